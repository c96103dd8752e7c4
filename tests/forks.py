"""Commands in forks of one process that has loaded what they need, so that none has a start.

``python forks.py`` reads a JSON object a line, ``{"words": [...], "cwd": FOLDER}``; it answers
with the process that runs them, and how that ended: ``{"process": N}``, ``{"code": C}``, as of
`subprocess.Popen.returncode`.
"""

import json
import os
import sys
from importlib import import_module

from brief import LESS

from zfcal.calibrate import task


def load():
    """Import what commands import only when they run, and load the kernels."""
    from warming import count

    for name in ("analyse", "calibrate", "import_"):
        import_module(f"zfcal.online.{name}")
    count(3)


def carry_out(words, cwd):
    """Run a command in this process, which is its own, and end it."""
    from zfcal_cli.main import run

    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)
    os.chdir(cwd)
    code = run(words)
    os._exit(code)


def answer(what):
    """Write a line."""
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


def main():
    """Serve until standard input ends."""
    task.Settings.__init__.__kwdefaults__.update(LESS)
    load()
    for line in sys.stdin:
        order = json.loads(line)
        process = os.fork()
        if process == 0:
            carry_out(order["words"], order["cwd"])
        answer({"process": process})
        _, status = os.waitpid(process, 0)
        answer({"code": os.waitstatus_to_exitcode(status)})


if __name__ == "__main__":
    main()
