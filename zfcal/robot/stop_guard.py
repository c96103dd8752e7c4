"""Stops the robot when its driver cannot: a process beside it, and how both write to the line.

It is run as a file, by itself, and therefore imports nothing but the standard library: it has
to be there within a moment, and to last when the driver is killed, stopped or hangs. The
driver imports the same functions, so that both agree on what is on the line.

An Aseba receiver cannot find the beginning of a frame by itself. So a frame is written in one
piece, or what is missing of it is remembered; where nobody can know how much of it arrived,
`RESYNC` brings any receiver to the beginning of a frame.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import mmap
import os
import select
import signal
import struct
import sys
import termios
import time
import weakref
from collections.abc import Callable
from typing import Protocol

STOP = bytes.fromhex("00 00 00 00 01 00")
"""The frame that `zfcal.robot.events.stop` makes; a test compares them."""

MOST_UNSENT = 32
"""Bytes that may wait in the port's driver: at 115200 baud they are gone in 2.8 ms."""

MOST_FRAME = 15
"""Bytes of the longest frame that can be remembered; the longest that is sent has 12."""

AGAIN_S = 0.1
"""While nothing fresh is known STOP is said so often: a command that was late lasts a tick."""

RESYNC_S = 1.0
"""And so often together with `RESYNC`: a receiver may have lost a byte on the air."""

STUCK_S = 0.5
"""Bytes that wait for longer than this will not go: a radio says a byte again for less long."""

LAST_S = 1.0
"""For so long the helper says STOP when the driver has gone: one alone may be lost."""

LOOK_S = 0.02
NICENESS = -10

DRIVER, HELPER = 0, 1
STATE, FRAMES, DONE, CROWD = range(4)
"""A writer's numbers: its state, how often it wrote, how many bytes of its last frame were taken,
and how many bytes since nothing waited."""

WHOLE, WRITING, CUT, UNKNOWN = range(4)
"""States: no frame is cut, one is being written, one is cut at a known byte, nobody knows."""


def _resync() -> bytes:
    """Return bytes after which any receiver is at the beginning of a frame, and has heard STOP.

    Zeros end the frame that was cut; from then on each six zeros are an empty frame, and only
    where these begin is unknown. A one that is read as the first byte of a length makes that
    frame a byte longer: of three ones, each at another place, every receiver that stood at
    an odd place meets such a one and stands at an even one. Last come lengths that fall by
    two with each word: whichever word is read as a length, the frame ends at the same byte.
    """
    longest = 6 + 516
    # The same one may be read as the high byte of a length, 256: that frame ends before the next.
    ones = 3 * (b"\x01" + bytes(265))
    # No event has these numbers, wherever they are read as one.
    words = struct.pack("<3H", 100, 98, 96)
    return bytes(longest) + ones + bytes(1) + words + bytes(100) + STOP


RESYNC = _resync()


class Port(Protocol):
    """Where bytes go to the robot."""

    def write(self, data: bytes) -> int:
        """Hand over bytes; return how many were taken, 0 where there is no room."""

    def unsent(self) -> int:
        """Return how many bytes wait here, as the port's driver says; 0 where it says nothing."""

    def flush(self) -> int:
        """Drop what waits here; return how many bytes that were, as the port's driver says."""

    def resume(self) -> None:
        """Let bytes leave again, if somebody was killed while he held them up."""


class Descriptor:
    """A terminal that is open.

    Parameters
    ----------
    number
        Its file descriptor, not blocking.
    """

    def __init__(self, number: int) -> None:
        self._number = number

    def write(self, data: bytes) -> int:
        """Hand over bytes; return how many were taken."""
        with contextlib.suppress(BlockingIOError):
            return os.write(self._number, data)
        return 0

    def unsent(self) -> int:
        """Return how many bytes wait in the port's driver."""
        try:
            found = fcntl.ioctl(self._number, termios.TIOCOUTQ, bytes(4))
        except OSError as error:
            if error.errno in {errno.ENOTTY, errno.EINVAL}:
                return 0
            raise
        return int(struct.unpack("i", found)[0])

    def flush(self) -> int:
        """Drop what waits; held meanwhile, so that the count stays right where that is possible."""
        with contextlib.suppress(termios.error):
            termios.tcflow(self._number, termios.TCOOFF)
        before = self.unsent()
        with contextlib.suppress(termios.error):
            termios.tcflush(self._number, termios.TCOFLUSH)
        after = self.unsent()
        self.resume()
        return max(0, before - after)

    def resume(self) -> None:
        """Let bytes leave."""
        with contextlib.suppress(termios.error):
            termios.tcflow(self._number, termios.TCOON)


class Slate:
    """What driver and helper tell each other, in memory that both have.

    Each number is written by one of them alone, and whole: eight bytes at a multiple of
    eight. So it can be read at any time, whatever has become of the other.

    Parameters
    ----------
    room
        `SIZE` bytes, zero at first: a shared map, or any buffer where there is one process.
    descriptor
        Of the file that is mapped.
    """

    SIZE = 256
    _SLOTS, _FIRST = 8, 128

    def __init__(self, room: mmap.mmap | bytearray, descriptor: int = -1) -> None:
        self.descriptor = descriptor
        self._bytes = memoryview(room)
        self._times = self._bytes[:16].cast("d")
        self._numbers = self._bytes[16:80].cast("q")

    @classmethod
    def shared(cls) -> Slate:
        """Make one whose descriptor can be handed to another process; it is closed with it."""
        descriptor = os.memfd_create("zfcal-robot", os.MFD_CLOEXEC)
        os.ftruncate(descriptor, cls.SIZE)
        made = cls(mmap.mmap(descriptor, cls.SIZE), descriptor)
        weakref.finalize(made, os.close, descriptor)
        return made

    @property
    def until_s(self) -> float:
        """Until when the robot may move, by the monotonic clock; 0 before anything is known."""
        return self._times[0]

    @until_s.setter
    def until_s(self, value: float) -> None:
        self._times[0] = value

    @property
    def alive_s(self) -> float:
        """When the helper last looked."""
        return self._times[1]

    @alive_s.setter
    def alive_s(self, value: float) -> None:
        self._times[1] = value

    def number(self, who: int, what: int) -> int:
        """Return one of a writer's numbers: `STATE`, `FRAMES`, `DONE` or `CROWD`."""
        return self._numbers[4 * who + what]

    def put(self, who: int, what: int, value: int) -> None:
        """Set one of a writer's numbers."""
        self._numbers[4 * who + what] = value

    def remember(self, frame: bytes, taken: int) -> None:
        """Keep the driver's newest frame, of which so many bytes were taken, beside seven older."""
        count = self.number(DRIVER, FRAMES)
        at = self._FIRST + 16 * (count % self._SLOTS)
        self._bytes[at : at + 16] = bytes([len(frame)]) + frame.ljust(MOST_FRAME, b"\0")
        self.put(DRIVER, DONE, taken)
        self.put(DRIVER, FRAMES, count + 1)

    def frame(self, age: int) -> bytes:
        """Return one of the driver's last frames, 0 for the newest; empty where it is forgotten."""
        number = self.number(DRIVER, FRAMES) - 1 - age
        if age >= self._SLOTS or number < 0:
            return b""
        at = self._FIRST + 16 * (number % self._SLOTS)
        return bytes(self._bytes[at + 1 : at + 1 + self._bytes[at]])

    def missing(self, dropped: int) -> bytes:
        """Return what a receiver lacks of the frame that it is in, if so many bytes were dropped.

        Nothing where they are more than is remembered.
        """
        lacks = dropped + len(self.frame(0)) - self.number(DRIVER, DONE)
        for age in range(self._SLOTS):
            frame = self.frame(age)
            if 0 < lacks < len(frame):
                return frame[-lacks:]
            lacks -= len(frame)
        return b""


class Output:
    """One of two writers to a port: it writes whole frames, and knows where one was cut.

    Both may write at any time, since what is taken in one piece stays together.

    Parameters
    ----------
    port
        Where bytes go.
    slate
        What it shares with the other writer.
    who
        `DRIVER` or `HELPER`.
    is_lossless
        Whether what was written is always heard: then `RESYNC` is said where a frame was cut, and
        not beside that.
    clock
        In seconds, never set back.
    """

    def __init__(
        self,
        port: Port,
        slate: Slate,
        who: int,
        *,
        is_lossless: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._port = port
        self._slate = slate
        self._who = who
        self._is_lossless = is_lossless
        self._clock = clock
        self._mended = (-1, -1)
        self._stopped_at = -1
        self._others = 0
        self._resynced_s, self._waits_since_s = float("-inf"), float("inf")
        self.is_lost = False

    @property
    def is_cut(self) -> bool:
        """Whether this writer's last frame is not whole on the line."""
        return self._slate.number(self._who, STATE) != WHOLE

    def begin(self) -> bool:
        """Stop whoever hears at the port, wherever its receiver is; return whether that was taken.

        What somebody else has left waiting in the port's driver is dropped.
        """
        self._port.resume()
        if self._port.unsent() > 0:
            return self._force()
        self.doubt()
        return self._is_lossless or self.stop()

    def doubt(self) -> None:
        """Take the receiver for one that may be anywhere in a frame, where bytes can be lost."""
        self.is_lost = self.is_lost or not self._is_lossless

    def waiting(self) -> int:
        """Return how many bytes wait in the port's driver, at most.

        Some say a packet's length where a single byte waits (RFCOMM): what was written since
        nothing waited is a limit as well.
        """
        unsent = self._port.unsent()
        if unsent == 0:
            self._slate.put(self._who, CROWD, 0)
            return 0
        return min(unsent, sum(self._slate.number(who, CROWD) for who in (DRIVER, HELPER)))

    def has_room(self, frame: bytes) -> bool:
        """Return whether a frame and each writer's STOP after it keep within `MOST_UNSENT`."""
        return self.waiting() + len(frame) + 2 * len(STOP) <= MOST_UNSENT

    def send(self, frame: bytes) -> bool:
        """Write a frame of the driver's; return whether it went as a whole.

        If not, and `is_cut`, `finish` goes on with it. Where the line is not known to be at the
        beginning of a frame it is brought there, in place of this frame.
        """
        if self._is_doubtful():
            self.stop()
            return False
        self._others = self._slate.number(HELPER, FRAMES)
        self._slate.put(DRIVER, STATE, WRITING)
        taken = self._port.write(frame)
        if taken:
            self._slate.remember(frame, taken)
        self._settle(taken, WHOLE if taken in {0, len(frame)} else CUT)
        return taken == len(frame)

    def finish(self) -> bool:
        """Write what is missing of the driver's frame; return whether it is whole now."""
        done = self._slate.number(DRIVER, DONE)
        rest = self._slate.frame(0)[done:]
        if self._was_disturbed() or self._slate.number(DRIVER, STATE) != CUT:
            self.stop()
            return False
        self._slate.put(DRIVER, STATE, WRITING)
        taken = self._port.write(rest)
        self._slate.put(DRIVER, DONE, done + taken)
        self._settle(taken, WHOLE if taken == len(rest) else CUT)
        if self._was_disturbed():
            self._slate.put(DRIVER, STATE, UNKNOWN)
            self.stop()
            return False
        return taken == len(rest)

    def stop(self) -> bool:
        """Write STOP, behind what is missing of a frame; return whether it is on its way.

        Where the port takes no more, what waits is dropped first. The first STOP after a command,
        and one a second, is followed by `RESYNC`.
        """
        if self._is_doubtful():
            self._port.resume()
            data = self._slate.missing(0) + STOP + RESYNC
        elif self._ends_in_stop() and self.waiting():
            # One waits already, and nothing behind it.
            return not self._is_stuck() or self._force()
        else:
            data = STOP + RESYNC if self._is_resync_due() else STOP
        self._waits_since_s = float("inf")
        taken = self._say(data)
        return taken == len(data) or self._force(taken)

    def _was_disturbed(self) -> bool:
        """Return whether the helper has written since the driver's frame began."""
        return self._slate.number(HELPER, FRAMES) != self._others

    def _is_doubtful(self) -> bool:
        """Return whether the line may be in the middle of a frame."""
        if self.is_cut or self.is_lost:
            return True
        state, frames = self._other()
        # The helper is writing for a moment, fifty times a second at most, and lives; a driver
        # that is found writing may be no more.
        well = {WHOLE} if self._who == HELPER else {WHOLE, WRITING}
        return state not in well and (state, frames) != self._mended

    def _is_resync_due(self) -> bool:
        """Return whether a receiver that has lost a byte is to be brought back now."""
        if self._is_lossless:
            return False
        return not self._ends_in_stop() or self._clock() - self._resynced_s >= RESYNC_S

    def _is_stuck(self) -> bool:
        """Return whether a STOP that waits has waited for too long."""
        now_s = self._clock()
        self._waits_since_s = min(self._waits_since_s, now_s)
        return now_s - self._waits_since_s > STUCK_S

    def _other(self) -> tuple[int, int]:
        """Return the other writer's state, and how often it wrote."""
        other = DRIVER if self._who == HELPER else HELPER
        return self._slate.number(other, STATE), self._slate.number(other, FRAMES)

    def _ends_in_stop(self) -> bool:
        """Return whether STOP was the last that was written."""
        frames = self._slate.number(DRIVER, FRAMES)
        return self._slate.frame(0) == STOP or self._stopped_at == frames

    def _say(self, data: bytes, *, then: int = WHOLE) -> int:
        """Write what ends in STOP; return how many bytes were taken: if all, the state is then."""
        before, other = self._slate.number(self._who, STATE), self._other()
        driver = self._slate.number(DRIVER, FRAMES)
        self._slate.put(self._who, STATE, WRITING)
        if self._who == HELPER:
            # Before it is written: the driver looks for it after each piece of its own.
            self._slate.put(HELPER, FRAMES, self._slate.number(HELPER, FRAMES) + 1)
        taken = self._port.write(data)
        self._settle(taken, before if taken == 0 else UNKNOWN)
        if taken == len(data):
            if self._who == DRIVER:
                self._slate.remember(STOP, len(STOP))
            else:
                self._stopped_at = driver
            if data.endswith(RESYNC):
                self._resynced_s = self._clock()
        if taken == len(data) and then == WHOLE:
            self._slate.put(self._who, STATE, WHOLE)
            self._mended, self.is_lost = other, False
        return taken

    def _force(self, after: int = 0) -> bool:
        """Drop what waits, and stop; return whether that was taken.

        How much of what waited has left is known where the port's driver counts; as not all do,
        `RESYNC` follows in any case.

        Parameters
        ----------
        after
            So many bytes of a STOP wait behind the driver's frames.
        """
        self._slate.put(self._who, STATE, UNKNOWN)
        self._waits_since_s = float("inf")
        dropped = self._port.flush()
        data = self._slate.missing(max(0, dropped - after)) + STOP
        went = self._say(data, then=UNKNOWN) == len(data)
        if went:
            self._say(RESYNC)
        return went

    def _settle(self, taken: int, state: int) -> None:
        """Count what was taken, and note how far that got."""
        self._slate.put(self._who, CROWD, self._slate.number(self._who, CROWD) + taken)
        self._slate.put(self._who, STATE, state)


class Guard:
    """Says STOP when nothing fresh is known of the robot, and again and again until it is.

    Parameters
    ----------
    output
        The helper's.
    slate
        What it shares with the driver.
    """

    def __init__(self, output: Output, slate: Slate) -> None:
        self._output = output
        self._slate = slate
        self._said_s = -AGAIN_S

    def look(self, now_s: float) -> float:
        """Stop the robot if it is time; return how long to wait for the next look."""
        self._slate.alive_s = now_s
        until_s = self._slate.until_s
        if now_s < until_s:
            self._said_s = -AGAIN_S
            return min(LOOK_S, until_s - now_s)
        if now_s - self._said_s >= AGAIN_S - LOOK_S / 2 and self.say():
            self._said_s = now_s
        return LOOK_S

    def begin_last(self) -> bool:
        """Say STOP to a receiver of which nothing is known; return whether that is on its way."""
        self._output.doubt()
        return self.say()

    def say(self) -> bool:
        """Say STOP; return whether it is on its way."""
        # A port that has gone is the driver's to open again, with another helper.
        with contextlib.suppress(OSError):
            return self._output.stop()
        return False


def main() -> None:
    """Watch the driver whose port and slate are named, until standard input ends; then stop.

    A third word says that the line is lossless. A driver that ends by itself says so by a byte: it
    has said STOP, and once more is enough.
    """
    port, shared, is_lossless = (int(word) for word in sys.argv[1:4])
    # Whoever ends a session or a service ends all of its processes at once, and this one is last.
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)
    os.set_blocking(port, False)
    slate = Slate(mmap.mmap(shared, Slate.SIZE))
    output = Output(Descriptor(port), slate, HELPER, is_lossless=bool(is_lossless))
    guard = Guard(output, slate)
    rest_s = 0.0
    while not select.select([0], [], [], rest_s)[0]:
        rest_s = guard.look(time.monotonic())
    is_well = bool(os.read(0, 64))
    guard.begin_last()
    for _ in range(0 if is_well else round(LAST_S / AGAIN_S)):
        time.sleep(AGAIN_S)
        guard.say()


if __name__ == "__main__":
    main()
