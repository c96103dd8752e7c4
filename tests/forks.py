"""Commands in forks of one process that has loaded what they need, so that none has a start.

What is killed is then at work, not still importing. As a process (``python forks.py``) this reads
a JSON object a line, ``{"words": [...], "cwd": FOLDER}``, and answers with the process that runs
them and with how that ended: ``{"process": N}``, ``{"code": C}``, as `subprocess.Popen` has it, and
``{"took_s": S}``. Orders may name files for ``out`` and ``err``, to which output is added.
`Forks` is who talks to it.
"""

import contextlib
import gc
import json
import os
import select
import signal
import subprocess
import sys
import time
from importlib import import_module

STAGES = (
    "zfcal.drive.drive",
    "zfcal.stages.analyse.analyse",
    "zfcal.stages.calibrate.calibrate",
    "zfcal.stages.import_",
    "zfcal.stages.track.track",
)

POLL_S = 0.002


class Forks:
    """Runs one command at a time in such a fork; leaving its block ends it."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # What has come is then in the pipe, where `code` looks for it.
            bufsize=0,
        )
        self._running = None
        self.took_s = 0.0
        # Who is killed some time after its start must not find it loading still.
        self._answer("loaded")

    def start(self, folder, *words, out=os.devnull, err=os.devnull):
        """Start a command, standing in a folder."""
        order = {"words": [str(word) for word in words], "cwd": str(folder)}
        order |= {"out": str(out), "err": str(err)}
        self._process.stdin.write(f"{json.dumps(order)}\n".encode())
        self._running = self._answer("process")

    def send_signal(self, number):
        """Send it a signal, if it is still there."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._running, number)

    def kill(self):
        """Kill it, as kill -9 does; return whether it had ended by itself."""
        self.send_signal(signal.SIGKILL)
        return self.wait()

    def wait(self):
        """Wait for it; return whether it ended by itself, and fail where that was not well."""
        code = self.code()
        assert code in {0, -signal.SIGKILL}, code
        return code == 0

    def code(self, patience_s=600.0):
        """Wait for it; return how it ended."""
        assert select.select([self._process.stdout], [], [], patience_s)[0], "it goes on and on"
        code, self.took_s = self._answer("code"), self._answer("took_s")
        self._running = None
        return code

    @property
    def is_running(self):
        """Whether a command was started that nobody has waited for."""
        return self._running is not None

    def run(self, folder, words, *, kill_after_s=None, once=None):
        """Run a command; with a time, kill it then. Return whether it had ended by itself.

        The time begins at the start, or once something holds, unless it ends before.
        """
        self.start(folder, *words)
        if kill_after_s is None:
            return self.wait()
        while once and not once() and not select.select([self._process.stdout], [], [], 0.0)[0]:
            time.sleep(POLL_S)
        time.sleep(kill_after_s)
        return self.kill()

    def _answer(self, key):
        return json.loads(self._process.stdout.readline())[key]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.is_running:
            # A test that failed has left it.
            self.send_signal(signal.SIGKILL)
        self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()


def load():
    """Import what commands import only when they run, and load the kernels.

    All that there is by then is kept from the collector of garbage: a fork that looked through it
    would have each page of it copied.
    """
    from brief import LESS
    from warming import tracker

    from zfcal.virtual import compiling

    for name in STAGES:
        import_module(name)
    settings = import_module("zfcal.calibrate.task").Settings
    settings.__init__.__kwdefaults__.update(LESS)
    compiling.search()
    compiling.estimate()
    tracker()
    gc.collect()
    gc.freeze()


def carry_out(words, cwd, out, err):
    """Run a command in this process, which is its own, and end it."""
    from zfcal_cli.main import run

    for stream, name in enumerate((os.devnull, out, err)):
        os.dup2(os.open(name, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644), stream)
    os.chdir(cwd)
    code = run(words)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(code)


def answer(what):
    """Write a line."""
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


def main():
    """Serve until standard input ends."""
    load()
    answer({"loaded": True})
    for line in sys.stdin:
        order = json.loads(line)
        began_s = time.monotonic()
        process = os.fork()
        if process == 0:
            carry_out(**order)
        answer({"process": process})
        _, status = os.waitpid(process, 0)
        answer({"code": os.waitstatus_to_exitcode(status)})
        answer({"took_s": time.monotonic() - began_s})


if __name__ == "__main__":
    main()
