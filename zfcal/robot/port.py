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
import termios
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar, final

import serial

from zfcal.robot import stop_guard
from zfcal.robot.stop_guard import (
    DRIVER,
    HELPER,
    STATE,
    STOP,
    STUCK_S,
    WHOLE,
    Descriptor,
    Output,
    Slate,
)

T = TypeVar("T")

_BAUD = 115200
_RETRY_S = 0.25
_WRITE_S = 0.05
"""A line that takes no byte for longer has nobody at the other end."""

_PIECES = 5
"""In so many pieces a message goes at most; a line with room takes it in one."""

_SILENT_S = 0.5
"""A helper that has not looked for so long hangs; it looks fifty times a second."""

_STARTING_S = 5.0
_ENDING_S = 0.5
_LOOK_S = 0.005

_BREAKS = (OSError, serial.SerialException, termios.error)
"""What a port that has gone raises."""


class Line(Protocol):
    """A way to the robot."""

    @property
    def is_open(self) -> bool:
        """Whether there is somebody to write to, as far as is known."""

    @property
    def is_guarded(self) -> bool:
        """Whether somebody stops the robot if this process cannot."""

    @property
    def n_opened(self) -> int:
        """How often the line was opened: after each time everything is to be said anew."""

    def write(self, data: bytes) -> bool:
        """Send bytes; return whether they went."""

    def read(self) -> bytes:
        """Return what has come, maybe nothing; never wait."""

    def beat(self, until_s: float) -> None:
        """Say that the robot may move until then, by the monotonic clock."""

    def close(self) -> None:
        """Leave the line for good."""


@final
class SerialLine:
    """A serial port, 115200 baud, 8N1.

    Whoever hears there is stopped when it is opened. While it is open a helper, a small process,
    holds the port as well. It says STOP until the first `beat`, when the last one runs out, and
    when this process ends, in whatever way. One that ends itself, or hangs, is replaced.

    Parameters
    ----------
    port
        Such as ``/dev/rfcomm5``.
    is_lossless
        For a virtual robot that is led in steps: it hears every byte, and waits. Then nothing is
        said at the opening, and there is no expiry until a `beat` states one.
    """

    def __init__(self, port: str, *, is_lossless: bool = False) -> None:
        self.port = port
        self._is_lossless = is_lossless
        self.n_opened = 0
        self.problem = ""
        self._lock = threading.Lock()
        self._serial: serial.Serial | None = None
        self._output: Output | None = None
        self._helper: _Helper | None = None
        self._full_since_s = float("inf")
        self._until_s = float("inf") if is_lossless else 0.0
        self._closing = threading.Event()
        self._wanted = threading.Event()
        self._wanted.set()
        self._thread = threading.Thread(target=self._keep_open, daemon=True)
        self._thread.start()

    @property
    def is_open(self) -> bool:
        """Whether the port is open, as far as is known."""
        return self._serial is not None

    @property
    def is_guarded(self) -> bool:
        """Whether the helper is at work; one that is not is replaced from now on."""
        helper = self._helper
        if helper is not None and helper.is_at_work:
            return True
        self._wanted.set()
        return False

    def wait(self, patience_s: float) -> bool:
        """Wait until the port is open, or patience ends; return whether it is."""
        end = threading.Event()
        for _ in range(max(1, round(patience_s / 0.01))):
            if self.is_open:
                return True
            end.wait(0.01)
        return self.is_open

    def write(self, data: bytes) -> bool:
        """Send a frame; return whether it went, or for STOP, whether it is on its way."""
        with self._lock:
            return self._attempt(lambda port: self._write(port, data)) is True

    def read(self) -> bytes:
        """Return what has come, maybe nothing."""
        with self._lock:
            return self._attempt(lambda port: port.read(4096)) or b""

    def beat(self, until_s: float) -> None:
        """Tell the helper until when the robot may move."""
        # Kept as well: a port that is opened again has a helper that has heard nothing yet.
        self._until_s = until_s
        helper = self._helper
        if helper is not None:
            helper.slate.until_s = until_s

    def close(self) -> None:
        """Leave the port."""
        self._closing.set()
        self._wanted.set()
        with self._lock:
            self._leave()

    def _attempt(self, use: Callable[[serial.Serial], T]) -> T | None:
        if self._serial is None:
            return None
        try:
            return use(self._serial)
        except _BREAKS as error:
            self.problem = str(error)
            self._leave()
            self._wanted.set()
            return None

    def _leave(self) -> None:
        if self._serial is not None:
            with contextlib.suppress(*_BREAKS):
                self._serial.close()
            self._serial = None
        if self._helper is not None:
            # It has its last word.
            self._helper.end()
            self._helper = None

    def _keep_open(self) -> None:
        while not self._closing.is_set():
            self._wanted.wait()
            if self._closing.is_set():
                return
            self._wanted.clear()
            if not (self._replace_helper() if self.is_open else self._open()):
                self._closing.wait(_RETRY_S)
                self._wanted.set()

    def _open(self) -> bool:
        slate = Slate.shared()
        slate.until_s = self._until_s
        try:
            opened = serial.Serial(self.port, _BAUD, timeout=0, write_timeout=0, exclusive=True)
        except (*_BREAKS, ValueError) as error:
            self.problem = str(error)
            return False
        lossless = self._is_lossless
        output = Output(Descriptor(opened.fileno()), slate, DRIVER, is_lossless=lossless)
        try:
            # Before all else: what drove the robot before may have left its wheels turning.
            if not output.begin():
                raise serial.SerialTimeoutException("it takes no STOP")
            helper = _Helper(opened.fileno(), slate, is_lossless=lossless)
        except _BREAKS as error:
            self.problem = str(error)
            opened.close()
            return False
        is_there = helper.wait(_STARTING_S)
        with self._lock:
            if self._closing.is_set() or not is_there:
                self.problem = "the process that stops the robot does not start"
                opened.close()
                helper.kill()
                return False
            self._helper, self._output, self._serial = helper, output, opened
            slate.until_s = self._until_s
            self._full_since_s = float("inf")
            self.n_opened += 1
        return self.is_open

    def _replace_helper(self) -> bool:
        """Start another helper where the one that there was is not at work any more."""
        with self._lock:
            port, output, before = self._serial, self._output, self._helper
            if port is None or output is None or before is None or before.is_at_work:
                return True
            before.kill()
            output.is_lost = before.slate.number(HELPER, STATE) != WHOLE
            if not self._attempt(lambda _: output.stop()):
                return False
            before.slate.put(HELPER, STATE, WHOLE)
            try:
                made = _Helper(port.fileno(), before.slate, is_lossless=self._is_lossless)
            except OSError as error:
                self.problem = str(error)
                return False
        # Not held up meanwhile: whoever drives goes on saying STOP.
        is_there = made.wait(_STARTING_S)
        with self._lock:
            if self._helper is not before or not is_there:
                made.kill()
                return False
            self._helper = made
        return True

    def _write(self, port: serial.Serial, data: bytes) -> bool:
        """Write all of it, or nothing where too much waits; raise if the line takes nothing.

        The write timeout of pyserial is by the clock: it would lose the line of a driver that was
        itself held up, though every byte had gone.
        """
        output = self._output
        if output is None:
            return False
        if data == STOP:
            # That one waits already is believed for so long.
            self._count_silence(is_silent=output.waiting() > 0)
            if output.stop():
                return True
            raise serial.SerialTimeoutException("Write timeout")
        has_room = output.has_room(data)
        self._count_silence(is_silent=not has_room)
        if not has_room:
            return False
        for _ in range(_PIECES):
            # The second look is for a driver that was held up while it waited.
            if not (_takes(port, _WRITE_S) or _takes(port, 0.0)):
                break
            if output.finish() if output.is_cut else output.send(data):
                return True
        raise serial.SerialTimeoutException("Write timeout")

    def _count_silence(self, *, is_silent: bool) -> None:
        """Note whether bytes wait that were there before; raise once that has lasted."""
        now_s = time.monotonic()
        self._full_since_s = min(self._full_since_s, now_s) if is_silent else float("inf")
        if now_s - self._full_since_s > STUCK_S:
            self._full_since_s = float("inf")
            raise serial.SerialTimeoutException(f"no byte has gone for {STUCK_S} s")


@final
class _Helper:
    """The process that stops the robot when this one cannot.

    Parameters
    ----------
    port
        Descriptor of the port.
    slate
        What they share, such as `Slate.shared` makes.
    is_lossless
        Whether every byte is heard (see `Output`).
    """

    def __init__(self, port: int, slate: Slate, *, is_lossless: bool = False) -> None:
        self.slate = slate
        slate.alive_s = 0.0
        self._process = subprocess.Popen(  # noqa: S603 - this very Python, on a file of this package
            [
                *(sys.executable, "-I", "-S", str(Path(stop_guard.__file__))),
                *(str(port), str(slate.descriptor), str(int(is_lossless))),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[port, slate.descriptor],
            # Neither Ctrl-C nor Ctrl-Z is for it.
            start_new_session=True,
        )

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    @property
    def is_at_work(self) -> bool:
        """Whether it is there, and has looked a moment ago."""
        return self._process.poll() is None and (time.monotonic() - self.slate.alive_s < _SILENT_S)

    def wait(self, patience_s: float) -> bool:
        """Wait until it is at work, or patience ends; return whether it is."""
        end_s = time.monotonic() + patience_s
        pause = threading.Event()
        while not self.is_at_work:
            if self._process.poll() is not None or time.monotonic() > end_s:
                return False
            pause.wait(_LOOK_S)
        return True

    def end(self) -> None:
        """Let it have its last word."""
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                # That all is well: it need not say it again and again.
                self._process.stdin.write(b".")
                self._process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDING_S)
        self.kill()

    def kill(self) -> None:
        """End it without a last word; one that the system itself holds up is left behind."""
        self._process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDING_S)
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()


def _takes(port: serial.Serial, patience_s: float) -> bool:
    """Wait until the line takes bytes, or patience ends; return whether it does."""
    return bool(select.select([], [port.fileno()], [], patience_s)[1])


def is_pseudo_terminal(port: str) -> bool:
    """Return whether a port is the end of a pseudo-terminal, as a virtual robot's is."""
    return os.path.realpath(port).startswith("/dev/pts/")
