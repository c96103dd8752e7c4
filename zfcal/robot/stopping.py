"""Says STOP to a port and leaves: for a hand that has no time. It imports next to nothing."""

from __future__ import annotations

import contextlib
import fcntl
import os
import termios
import time
import tty
from collections.abc import Iterator

from zfcal.errors import InputError
from zfcal.robot.lastword import DRIVER, Descriptor, Output, Slate

PATIENCE_S = 0.7
"""For so long a port is tried, opening and sending together."""

_PAUSE_S = 0.01
_SPEED, _CFLAG = (4, 5), 2
"""Places in what `termios.tcgetattr` returns."""


def stop_at(port: str) -> bool:
    """Say STOP to whatever robots hear at a port.

    A driver that has the port does not keep others out (its lock is advisory); a program that
    does (TIOCEXCL) keeps out all but root.

    Parameters
    ----------
    port
        A serial port, such as ``/dev/rfcomm5``; 115200 baud, 8N1.

    Returns
    -------
    bool
        Whether another process has the port as well.

    Raises
    ------
    InputError
        It cannot be opened, is no serial port, or has not sent STOP in `PATIENCE_S`.
    """
    end_s = time.monotonic() + PATIENCE_S
    with _opened(port) as number:
        is_held = _is_held(number)
        if not is_held:
            _set_up(number)
        descriptor = Descriptor(number)
        output = Output(descriptor, Slate(bytearray(Slate.SIZE)), DRIVER)
        problem = _say(output, end_s)
        while not problem and descriptor.unsent():
            if time.monotonic() > end_s:
                problem = "it does not leave the port"
            time.sleep(_PAUSE_S)
        if problem:
            # Or closing the port would wait for it.
            descriptor.flush()
            raise InputError(
                f"{port}: STOP was not sent in {PATIENCE_S} s ({problem}).",
                hint="Take the robot out, or use its switch; then look after the radio link.",
            )
    return is_held


@contextlib.contextmanager
def _opened(port: str) -> Iterator[int]:
    """Open a port that is not waited for, and set it up as the robot's."""
    hint = "Check that it exists (rfcomm bind), your rights (group dialout), and who has it."
    try:
        number = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except (OSError, ValueError) as error:
        says = getattr(error, "strerror", None) or error
        raise InputError(f"{port}: the port cannot be opened ({says}).", hint=hint) from error
    try:
        termios.tcgetattr(number)
        yield number
    except termios.error as error:
        raise InputError(
            f"{port}: is no serial port ({error.args[-1]}).",
            hint="A robot's port is a device such as /dev/rfcomm5.",
        ) from error
    finally:
        os.close(number)


def _set_up(number: int) -> None:
    """Set a port's speed and form; of one that somebody has, they are left alone."""
    tty.setraw(number, termios.TCSANOW)
    attributes = termios.tcgetattr(number)
    for place in _SPEED:
        attributes[place] = termios.B115200
    attributes[_CFLAG] |= termios.CLOCAL | termios.CREAD
    attributes[_CFLAG] &= ~termios.CRTSCTS
    termios.tcsetattr(number, termios.TCSANOW, attributes)


def _is_held(number: int) -> bool:
    """Return whether another process has locked the port, as drivers do."""
    try:
        fcntl.flock(number, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    fcntl.flock(number, fcntl.LOCK_UN)
    return False


def _say(output: Output, end_s: float) -> str:
    """Say STOP as soon as the port takes it; return why it did not."""
    while True:
        problem = "it takes nothing"
        with contextlib.suppress(OSError):
            if output.stop():
                return ""
            problem = "it is full"
        if time.monotonic() > end_s:
            return problem
        time.sleep(_PAUSE_S)
