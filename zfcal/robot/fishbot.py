"""The driver of one FishBot: what it is told, what it says, and that it stops.

Whoever drives must say again and again that what it knows is fresh. Where that fails for
half a second, a thread of its own stops the robot, and nothing else is sent until it is
fresh again.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Self, final

from zfcal.robot import events
from zfcal.robot.aseba import Decoder, Frame
from zfcal.robot.body import Wheels, check_wheels
from zfcal.robot.events import Said, understand
from zfcal.robot.port import Line
from zfcal.units import M_PER_CM

PATIENCE_S = 0.5
"""For so long the last pose may be driven by."""

_LOOK_S = 0.04


@final
class FishBot:
    """A robot at the end of a line.

    Parameters
    ----------
    letter
        Its name, A to J.
    line
        The way to it.
    clock
        In seconds, never set back; the monotonic one, by which its line's helper goes.

    Attributes
    ----------
    is_held
        Whether the robot was stopped by its watchdog, and is to stay so.
    n_sent
        Events that went over the line, without those of the watchdog.
    """

    def __init__(
        self, letter: str, line: Line, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        events.robot_index(letter)
        self.letter = letter
        self.line = line
        self._clock = clock
        self._until_s = math.inf
        self.is_held = False
        self.n_sent = 0
        self._lock = threading.Lock()
        self._decoder = Decoder()
        self._rest = [0.0, 0.0]
        self._opened = 0

    def frame_for(self, wheels: Wheels) -> Frame:
        """Return the event for wheel speeds, keeping what rounding cut off for the next one.

        Raises
        ------
        InputError
            A wheel is asked for more than the robot can do.
        """
        check_wheels(wheels)
        speeds = []
        for side, asked in enumerate((wheels.left_m_s, wheels.right_m_s)):
            exact = asked / M_PER_CM
            whole = round(exact + self._rest[side])
            # Rounding must not take it over the limit that the speeds asked for keep.
            whole = max(-30, min(30, whole))
            self._rest[side] = max(-0.5, min(0.5, self._rest[side] + exact - whole))
            speeds.append(whole)
        return events.motor_control(self.letter, *speeds)

    def stop_frame(self) -> Frame:
        """Return STOP, and forget what rounding cut off."""
        self._rest = [0.0, 0.0]
        return events.stop()

    def send(self, frame: Frame) -> bool:
        """Send wheel speeds or STOP; return whether they went.

        STOP alone goes to a robot that is held, or of which nothing fresh is known at that
        moment. Who was stopped between the look at the clock and the write looks again after it.
        """
        with self._lock:
            moves = frame.type != events.STOP
            if moves and (self.is_held or self._is_late()):
                return False
            went = self.line.write(frame.encode())
            self.n_sent += went
            if moves and self._is_late():
                self.is_held = True
                self.line.write(events.stop().encode())
            return went

    def hold(self) -> bool:
        """Stop, and send no wheel speeds from now on; return whether it was heard."""
        with self._lock:
            self.is_held = True
            return self.line.write(events.stop().encode())

    def release(self, until_s: float) -> None:
        """Let wheel speeds through again, until then; the line's helper hears of it."""
        with self._lock:
            self.is_held = False
            self._until_s = until_s
            self.line.beat(until_s)

    def listen(self) -> list[Said]:
        """Return what was said since; over a new connection the robot is asked who it is."""
        if self.line.n_opened != self._opened and self.line.is_open:
            self._opened = self.line.n_opened
            self._decoder.reset()
            self.line.write(events.list_nodes().encode())
        said = []
        for frame in self._decoder.feed(self.line.read()):
            heard = understand(frame)
            if heard.what == "present" and heard.robot == self.letter:
                node = events.node_of(self.letter)
                self.line.write(events.get_node_description(node).encode())
            said.append(heard)
        return said

    def _is_late(self) -> bool:
        return not self._clock() <= self._until_s

    def close(self) -> None:
        """Stop the robot and leave the line: STOP is the last thing sent."""
        self.hold()
        self.line.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@final
class Watchdog:
    """Stops a robot of which nothing fresh is known, from a thread of its own.

    Parameters
    ----------
    robot
        Whom to stop.
    patience_s
        After so much silence.
    clock
        In seconds, never set back.
    """

    def __init__(
        self,
        robot: FishBot,
        *,
        patience_s: float = PATIENCE_S,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._robot = robot
        self._patience_s = patience_s
        self._clock = clock
        self._fresh_s: float | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self.n_bites = 0

    def fresh(self, at_s: float | None = None) -> None:
        """Say that what is known was fresh at a time of the clock; by default now."""
        self._fresh_s = self._clock() if at_s is None else at_s
        self._robot.release(self._fresh_s + self._patience_s)

    @property
    def age_s(self) -> float:
        """Seconds since it was fresh; infinite before the first time."""
        return float("inf") if self._fresh_s is None else self._clock() - self._fresh_s

    def look(self) -> None:
        """Hold the robot if nothing fresh is known of it."""
        if self.age_s > self._patience_s and not self._robot.is_held:
            self.n_bites += 1
            self._robot.hold()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(_LOOK_S):
            self.look()
