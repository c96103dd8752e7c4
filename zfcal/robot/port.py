"""The serial line to the robot: opened again by itself when it has gone.

Bluetooth can keep a port's opening waiting for seconds, so that is done in a thread of
its own; who writes meanwhile is told at once that there is no line.
"""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar, final

import serial

from zfcal.robot import lastword

T = TypeVar("T")

BAUD = 115200
RETRY_S = 0.25
_WRITE_S = 0.05
"""A line that takes no byte for longer has nobody at the other end."""

_PIECES = 5
"""In so many pieces a message goes at most; a line with room takes it in one."""


class Line(Protocol):
    """A way to the robot."""

    @property
    def is_open(self) -> bool:
        """Whether there is somebody to write to, as far as is known."""

    @property
    def n_opened(self) -> int:
        """How often the line was opened: after each time everything is to be said anew."""

    def write(self, data: bytes) -> bool:
        """Send bytes; return whether they went."""

    def read(self) -> bytes:
        """Return what has come, maybe nothing; never wait."""

    def close(self) -> None:
        """Leave the line for good."""


@final
class SerialLine:
    """A serial port, 115200 baud, 8N1.

    While it is open a small process holds the port as well, and says STOP when this one
    ends, in whatever way.

    Parameters
    ----------
    port
        Such as ``/dev/rfcomm5``.
    """

    def __init__(self, port: str) -> None:
        self.port = port
        self.n_opened = 0
        self.problem = ""
        self._lock = threading.Lock()
        self._serial: serial.Serial | None = None
        self._guardian: subprocess.Popen[bytes] | None = None
        self._closing = threading.Event()
        self._lost = threading.Event()
        self._lost.set()
        self._thread = threading.Thread(target=self._keep_open, daemon=True)
        self._thread.start()

    @property
    def is_open(self) -> bool:
        """Whether the port is open, as far as is known."""
        return self._serial is not None

    def wait(self, patience_s: float) -> bool:
        """Wait until the port is open, or patience ends; return whether it is."""
        end = threading.Event()
        for _ in range(max(1, round(patience_s / 0.01))):
            if self.is_open:
                return True
            end.wait(0.01)
        return self.is_open

    def write(self, data: bytes) -> bool:
        """Send bytes; return whether they went."""
        with self._lock:
            return self._attempt(lambda port: _write(port, data)) == len(data)

    def read(self) -> bytes:
        """Return what has come, maybe nothing."""
        with self._lock:
            return self._attempt(lambda port: port.read(4096)) or b""

    def close(self) -> None:
        """Leave the port."""
        self._closing.set()
        self._lost.set()
        with self._lock:
            self._leave()

    def _attempt(self, use: Callable[[serial.Serial], T]) -> T | None:
        if self._serial is None:
            return None
        try:
            return use(self._serial)
        except (OSError, serial.SerialException) as error:
            self.problem = str(error)
            self._leave()
            self._lost.set()
            return None

    def _leave(self) -> None:
        if self._serial is not None:
            with contextlib.suppress(OSError, serial.SerialException):
                self._serial.close()
            self._serial = None
        if self._guardian is not None:
            # It sees that nobody is left, and has its last word.
            if self._guardian.stdin is not None:
                with contextlib.suppress(OSError):
                    self._guardian.stdin.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._guardian.wait(0.5)
            self._guardian = None

    def _keep_open(self) -> None:
        while not self._closing.is_set():
            self._lost.wait()
            if self._closing.is_set():
                return
            if self._open():
                self._lost.clear()
            else:
                self._closing.wait(RETRY_S)

    def _open(self) -> bool:
        try:
            opened = serial.Serial(self.port, BAUD, timeout=0, write_timeout=0, exclusive=True)
        except (OSError, ValueError, serial.SerialException) as error:
            self.problem = str(error)
            return False
        with self._lock:
            if self._closing.is_set():
                opened.close()
                return False
            self._guardian = _guardian_of(opened.fileno())
            self._serial = opened
            self.n_opened += 1
        return True


def _write(port: serial.Serial, data: bytes) -> int:
    """Write all of it and return its length, or raise once the line has taken nothing for a while.

    The write timeout of pyserial is by the clock: it would lose the line of a driver that was
    itself held up, though every byte had gone.
    """
    rest = data
    for _ in range(_PIECES):
        # The second look is for a driver that was held up while it waited.
        if not (_takes(port, _WRITE_S) or _takes(port, 0.0)):
            break
        # Not by `port.write`, which tries for ever where a line that takes bytes takes none.
        with contextlib.suppress(BlockingIOError):
            rest = rest[os.write(port.fileno(), rest) :]
        if not rest:
            return len(data)
    raise serial.SerialTimeoutException("Write timeout")


def _takes(port: serial.Serial, patience_s: float) -> bool:
    """Wait until the line takes bytes, or patience ends; return whether it does."""
    return bool(select.select([], [port.fileno()], [], patience_s)[1])


def _guardian_of(descriptor: int) -> subprocess.Popen[bytes]:
    """Start the process that says STOP when this one has gone."""
    return subprocess.Popen(  # noqa: S603 - this very Python, on a file of this package
        [sys.executable, "-I", "-S", str(Path(lastword.__file__)), str(descriptor)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        pass_fds=[descriptor],
        start_new_session=True,
    )
