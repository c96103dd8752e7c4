"""zfcal for a shell, in forks of one process that has loaded it: no command has to load it first.

``python serving.py serve SOCKET`` serves until its standard input ends. ``python -I -S serving.py
ask SOCKET WORD...`` has a command run there with its own folder, environment and streams, and
leaves with its exit code. `Serving` starts the former and says how to call the latter.

An import that a command forgot is not noticed here: it was loaded for another one.
"""

import json
import os
import select
import signal
import socket
import sys

LOADED = (
    "zfcal_cli.main",
    "zfcal.api.calibrating",
    "zfcal.api.diagnosing",
    "zfcal.api.reporting",
    "zfcal.diagnose.diagnose",
    "zfcal.report.page",
    "zfcal.stages.analyse.analyse",
    "zfcal.stages.calibrate.calibrate",
    "zfcal.stages.extend.extend",
    "zfcal.stages.import_",
)
"""What commands import only when they run."""

MOST = 1 << 17
"""Bytes of an order: the words and the environment."""


class Serving:
    """Serves a shell; leaving its block ends it.

    Parameters
    ----------
    place
        A folder for the socket; its name has some 90 letters at most.
    environment
        Of the process. A command has that of who asks, and what only this one has.
    """

    def __init__(self, place, environment):
        import subprocess

        self._socket = place / "zfcal.socket"
        self._process = subprocess.Popen(
            [sys.executable, __file__, "serve", self._socket],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )
        assert self._process.stdout.readline() == b"loaded\n"

    @property
    def words(self):
        """What stands in a shell for ``zfcal``."""
        return [sys.executable, "-I", "-S", __file__, "ask", str(self._socket)]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()


def ask(path, words):
    """Have a command run; return its exit code."""
    order = json.dumps({"words": words, "environment": dict(os.environ)}).encode()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as line:
        line.connect(path)
        socket.send_fds(line, [order], [0, 1, 2, os.open(".", os.O_RDONLY)])
        return int(line.recv(16))


def mind(line):
    """Run the command that a line asks for, say how it ended, and end it where nobody listens.

    This process returns as the command; the one that minds it ends here.
    """
    said, streams, _, _ = socket.recv_fds(line, MOST, 4)
    command = os.fork()
    if command == 0:
        line.close()
        become(json.loads(said), streams)
        return
    for each in streams:
        os.close(each)
    ended = os.pidfd_open(command)
    if ended not in select.select([line, ended], [], [])[0]:
        os.kill(command, signal.SIGTERM)
    code = os.waitstatus_to_exitcode(os.waitpid(command, 0)[1])
    try:
        line.send(str(code if code >= 0 else 128 - code).encode())
    finally:
        os._exit(0)


def become(order, streams):
    """Let this process have the words, the environment, the streams and the folder of who asks."""
    *streams, folder = streams
    for stream, given in enumerate(streams):
        os.dup2(given, stream)
        os.close(given)
    os.fchdir(folder)
    os.close(folder)
    os.environ.update(order["environment"])
    sys.argv = ["zfcal", *order["words"]]


def serve(path):
    """Load zfcal and fork for each command, until standard input ends; return in a fork alone."""
    import gc
    from importlib import import_module

    for name in LOADED:
        import_module(name)
    gc.collect()
    gc.freeze()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as door:
        door.bind(path)
        door.listen()
        sys.stdout.write("loaded\n")
        sys.stdout.flush()
        running = set()
        while door in select.select([door, sys.stdin], [], [])[0]:
            line, _ = door.accept()
            process = os.fork()
            if process == 0:
                door.close()
                mind(line)
                return True
            line.close()
            running.add(process)
            running -= {each for each in running if os.waitpid(each, os.WNOHANG)[0]}
    return False


if __name__ == "__main__":
    what, where, *typed = sys.argv[1:]
    if what == "ask":
        sys.exit(ask(where, typed))
    if serve(where):
        from zfcal_cli.main import main

        main()
