"""Commands in forks of one process that has loaded what they need, so that none has a start.

What is killed is then at work, not still importing. As a process (``python forks.py``) this reads
a JSON object a line, ``{"words": [...], "cwd": FOLDER}``, and answers with the process that runs
them and with how that ended: ``{"process": N}``, ``{"code": C}``, as `subprocess.Popen` has it, and
``{"took_s": S}``.
`Forks` is who talks to it.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from importlib import import_module

STAGES = ("analyse", "calibrate", "drive", "import_", "track")


class Forks:
    """Runs one command at a time in such a fork; leaving its block ends it."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._running = None
        self.took_s = 0.0

    def start(self, folder, *words):
        """Start a command, standing in a folder."""
        order = {"words": [str(word) for word in words], "cwd": str(folder)}
        print(json.dumps(order), file=self._process.stdin, flush=True)
        self._running = self._answer("process")

    def kill(self):
        """Kill it, as kill -9 does; return whether it had ended by itself."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._running, signal.SIGKILL)
        return self.wait()

    def wait(self):
        """Wait for it; return whether it ended by itself, and fail where that was not well."""
        code, self.took_s = self._answer("code"), self._answer("took_s")
        assert code in {0, -signal.SIGKILL}, code
        return code == 0

    def run(self, folder, words, *, kill_after_s=None):
        """Run a command; with a time, kill it then. Return whether it had ended by itself."""
        self.start(folder, *words)
        if kill_after_s is None:
            return self.wait()
        time.sleep(kill_after_s)
        return self.kill()

    def _answer(self, key):
        return json.loads(self._process.stdout.readline())[key]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()


def load():
    """Import what commands import only when they run, and load the kernels."""
    from brief import LESS
    from warming import count, estimate, tracker

    for name in STAGES:
        import_module(f"zfcal.online.{name}")
    settings = import_module("zfcal.calibrate.task").Settings
    settings.__init__.__kwdefaults__.update(LESS)
    count(3)
    estimate()
    tracker()


def carry_out(words, cwd):
    """Run a command in this process, which is its own, and end it."""
    from zfcal_cli.main import run

    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)
    os.chdir(cwd)
    os._exit(run(words))


def answer(what):
    """Write a line."""
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


def main():
    """Serve until standard input ends."""
    load()
    for line in sys.stdin:
        order = json.loads(line)
        began_s = time.monotonic()
        process = os.fork()
        if process == 0:
            carry_out(order["words"], order["cwd"])
        answer({"process": process})
        _, status = os.waitpid(process, 0)
        answer({"code": os.waitstatus_to_exitcode(status)})
        answer({"took_s": time.monotonic() - began_s})


if __name__ == "__main__":
    main()
