"""Says STOP to a port and leaves: for a hand that has no time. It imports next to nothing."""

from __future__ import annotations

import contextlib
import fcntl
import os
import termios
import time
import tty
from collections.abc import Callable, Iterator

from zfcal.errors import InputError
from zfcal.robot.stop_guard import DRIVER, Descriptor, Output, Slate

_PATIENCE_S = 0.7
"""After so long it is said that STOP has not gone yet: where the radio link is up it has."""

LONGEST_S = 15.0
"""For so long it is waited for: a Bluetooth link that nobody had takes seconds to come up."""

_PAUSE_S = 0.01
_SPEED, _CFLAG = (4, 5), 2
"""Places in what `termios.tcgetattr` returns."""


def stop_at(port: str, tell: Callable[[str], None], *, resync: bool = False) -> bool:
    """Say STOP to whatever robots hear at a port.

    A driver that has the port does not keep others out (its lock is advisory); a program that
    does (TIOCEXCL) keeps out all but root.

    Parameters
    ----------
    port
        A serial port, such as ``/dev/rfcomm5``; 115200 baud, 8N1.
    tell
        Hears after 0.7 s that STOP waits for the link, if it does.
    resync
        Whether bytes follow by which a receiver that has lost one finds its place again, and STOP.

    Returns
    -------
    bool
        Whether another process has the port as well.

    Raises
    ------
    InputError
        It cannot be opened, is no serial port, or has not sent STOP in `LONGEST_S`.
    """
    with _opened(port) as number:
        is_held = _is_held(number)
        if not is_held:
            _set_up(number)
        descriptor = Descriptor(number)
        # Whoever was killed while he held the port's output up would hold this up as well.
        descriptor.resume()
        problem = _send(descriptor, lambda says: tell(f"{port}: {says}"), resync=resync)
        if problem:
            if not is_held:
                # Or closing the port would wait for it. Of a driver's port nothing is dropped.
                descriptor.flush()
            raise InputError(
                f"{port}: STOP was not sent in {LONGEST_S:g} s ({problem}).",
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


def _send(descriptor: Descriptor, tell: Callable[[str], None], *, resync: bool) -> str:
    """Say STOP as soon as the port takes it, and wait until it has left; return why it did not."""
    output = Output(descriptor, Slate(bytearray(Slate.SIZE)), DRIVER, is_lossless=not resync)
    began_s, is_said, is_told = time.monotonic(), False, False
    while time.monotonic() - began_s < LONGEST_S:
        problem = "it takes nothing"
        with contextlib.suppress(OSError):
            is_said = is_said or output.stop()
            if is_said and not descriptor.unsent():
                return ""
            problem = "it does not leave the port" if is_said else "it is full"
        if time.monotonic() - began_s > _PATIENCE_S and not is_told:
            is_told = True
            tell(f"STOP waits for the link ({problem}); Ctrl-C gives up.")
        time.sleep(_PAUSE_S)
    return problem
