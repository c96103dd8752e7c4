"""zfcal for a shell, in forks of one process that has loaded it, so that no command has a start.

``python serving.py SOCKET`` serves until its standard input ends. ``python -ISs serving.py SOCKET
WORD...`` has a command run there with its own folder, environment and streams, and leaves with the
exit code. `Serving` is who starts the former and says how to call the latter; who asks imports
little.
"""

import contextlib
import json
import os
import signal
import socket
import subprocess
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
MOST = 1 << 20
"""Bytes of an order: words, folder and environment."""


class Serving:
    """Serves a shell in a folder; leaving its block ends it.

    Parameters
    ----------
    place
        A folder for the socket.
    environment
        Of the process, and of what its commands start.
    """

    def __init__(self, place, environment):
        self._socket = place / "zfcal.socket"
        self._process = subprocess.Popen(
            [sys.executable, __file__, self._socket],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )
        assert self._process.stdout.readline() == b"loaded\n"

    @property
    def words(self):
        """What stands in a shell for ``zfcal``."""
        return [sys.executable, "-ISs", __file__, str(self._socket)]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()


def ask(path, words):
    """Have a command run; return its exit code."""
    order = json.dumps({"words": words, "env": dict(os.environ)})
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST)
        line.connect(path)
        socket.send_fds(line, [order.encode()], [0, 1, 2, os.open(".", os.O_RDONLY)])
        said = line.recv(16)
    # Nothing is said where the command was killed.
    return int(said) if said else 128 + signal.SIGKILL


def carry_out(line):
    """Run the command that a line asks for in this process, which is its own, and end it."""
    from zfcal_cli.main import main

    said, (*streams, folder), _, _ = socket.recv_fds(line, MOST, 4)
    order = json.loads(said)
    for stream, given in enumerate(streams):
        os.dup2(given, stream)
        os.close(given)
    os.fchdir(folder)
    os.close(folder)
    os.environ.clear()
    os.environ.update(order["env"])
    sys.argv = ["zfcal", *order["words"]]
    code = 1
    try:
        main()
    except SystemExit as end:
        code = end.code or 0
    finally:
        # A reader may have gone.
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        # What was begun beside the command ends with it, as at the end of a process.
        from multiprocessing.util import _exit_function

        _exit_function()
        line.send(str(code).encode())
        os._exit(code)


def serve(path):
    """Fork for each command, until standard input ends."""
    import gc
    import select
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
                carry_out(line)
            line.close()
            running.add(process)
            running -= {each for each in running if os.waitpid(each, os.WNOHANG)[0]}


if __name__ == "__main__":
    if sys.argv[2:]:
        sys.exit(ask(sys.argv[1], sys.argv[2:]))
    serve(sys.argv[1])
