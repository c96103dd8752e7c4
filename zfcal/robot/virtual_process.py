"""Starts a virtual FishBot as a process, and asks it things."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self, final

from zfcal.errors import InputError

_PATIENCE_S = 300.0
"""One that has ended is noticed at once; on a busy computer a slow one is waited for."""


@final
class Control:
    """A connection to the control socket of a virtual robot.

    Parameters
    ----------
    path
        The socket.
    """

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(_PATIENCE_S)
        self._socket.connect(str(path))
        self._file = self._socket.makefile("rb")

    def ask(self, do: str, **what: Any) -> dict[str, Any]:
        """Ask for something and return the answer.

        Raises
        ------
        InputError
            The robot does not understand, or has gone.
        """
        self._socket.sendall(json.dumps({"do": do, **what}).encode() + b"\n")
        answer = self.next()
        if "error" in answer:
            raise InputError(f"The virtual robot cannot {do}: {answer['error']}.")
        return answer

    def next(self) -> dict[str, Any]:
        """Return the next line, of those that `watch` asks for."""
        line = self._file.readline()
        if not line:
            raise InputError("The virtual robot has gone.")
        found: dict[str, Any] = json.loads(line)
        return found

    def close(self) -> None:
        """Leave it."""
        self._file.close()
        self._socket.close()


@final
class VirtualProcess:
    """A virtual FishBot in a process of its own, which ends with this one.

    Parameters
    ----------
    words
        Further options of ``python -m zfcal.robot.virtual``.

    Attributes
    ----------
    port
        Its serial port.
    control
        A connection to its socket.
    """

    def __init__(self, words: Sequence[str] = ()) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="zfcal-robot-")
        folder = Path(self._folder.name)
        self.port = folder / "port"
        self.socket = folder / "control"
        self._process = subprocess.Popen(  # noqa: S603 - this very Python, on a module of zfcal
            [
                *(sys.executable, "-m", "zfcal.robot.virtual", "--until-eof"),
                *("--link", str(self.port), "--control", str(self.socket), *words),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # Ctrl-C is for whoever drives: the robot has to hear the last STOP.
            start_new_session=True,
        )
        if not self._process.stdout or not self._process.stdout.readline():
            self.close()
            raise InputError("The virtual robot did not start; see its words above.")
        self.control = Control(self.socket)

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    def close(self) -> None:
        """End the process."""
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.control.close()
        self.close()
