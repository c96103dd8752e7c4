"""By what the driver's ticks are timed: this computer's clock, or the poses themselves.

`DriveClock` is all that the driver knows of time. With `PoseClock` a drive takes as long as
its poses take to come: recorded ones are driven through as fast as can be, and a simulated
tank that waits for the driver's log keeps step with it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Protocol, final

from zfcal.robot.motion import TICK_S

_SLACK_S = 1e-6

_DRIFT = 0.01
"""By so much at most a camera's rate differs from that by which its frames are timed."""

_SET_BACK_S = 1.0


class DriveClock(Protocol):
    """When to tick.

    Attributes
    ----------
    is_live
        Whether time passes by itself. If not, silence means nothing, and it lasts as long
        as it lasts.
    n_skipped
        Ticks that fell out because the one before took too long.
    """

    is_live: bool
    n_skipped: int

    def take_frame(self, time_s: float) -> None:
        """Hear that a frame of poses has come that is of this second of the trial."""

    def now_s(self) -> float:
        """Return the second of the trial."""

    def due(self) -> list[float]:
        """Return the ticks that are due now, in seconds of the trial; each is told once."""

    def rest_s(self) -> float:
        """Return how long to wait for the next tick; infinite where frames bring it."""

    def steady_s(self) -> float:
        """Return the time by which silence is measured."""


@final
class WallClock:
    """The computer's clock, from the first frame on; it is never set back.

    Parameters
    ----------
    clock
        In seconds; the monotonic one, but where time is made.
    """

    is_live = True

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.steady_s = clock
        self.n_skipped = 0
        self._zero_s: float | None = None
        self._next_s = math.inf

    def take_frame(self, time_s: float) -> None:
        """Take the first frame's time as now."""
        if self._zero_s is None:
            self._zero_s = self.steady_s() - time_s
            self._next_s = math.ceil(time_s / TICK_S - _SLACK_S) * TICK_S

    def now_s(self) -> float:
        """Return the second of the trial."""
        return 0.0 if self._zero_s is None else self.steady_s() - self._zero_s

    def due(self) -> list[float]:
        """Return the tick that is due, the last one of several."""
        behind = self.now_s() - self._next_s
        if behind < 0 or math.isinf(behind):
            return []
        skipped = int(behind / TICK_S)
        self.n_skipped += skipped
        tick = self._next_s + skipped * TICK_S
        self._next_s = _on_grid(tick) + TICK_S
        return [_on_grid(tick)]

    def rest_s(self) -> float:
        """Return how long to wait for the next tick."""
        return max(0.0, self._next_s - self.now_s())


@final
class PoseClock:
    """The poses' own time: a frame brings the ticks from its time to the next frame's.

    Parameters
    ----------
    fps
        Frame rate of the trial.
    """

    is_live = False

    def __init__(self, fps: float) -> None:
        self.n_skipped = 0
        self._frame_s = 1.0 / fps
        self._time_s = 0.0
        self._next: int | None = None

    def take_frame(self, time_s: float) -> None:
        """Move on to a frame."""
        self._time_s = time_s
        if self._next is None:
            self._next = math.ceil(time_s / TICK_S - _SLACK_S)

    def now_s(self) -> float:
        """Return the time of the last frame."""
        return self._time_s

    def due(self) -> list[float]:
        """Return the ticks before the next frame."""
        if self._next is None:
            return []
        end = math.ceil((self._time_s + self._frame_s) / TICK_S - _SLACK_S)
        # After a gap in the poses the ticks that fell into it are not made up for.
        first = max(self._next, math.ceil(self._time_s / TICK_S - _SLACK_S))
        self._next = max(end, self._next)
        return [k * TICK_S for k in range(first, end)]

    def rest_s(self) -> float:
        """Return infinity: frames bring the ticks."""
        return math.inf

    def steady_s(self) -> float:
        """Return the time of the last frame: silence of nobody means nothing."""
        return self._time_s


@final
class Lag:
    """How old frames are at least, by how much sooner others came that were taken when they were.

    A tracker that falls behind writes poses now of images that are old. What all frames are late
    by, it cannot tell.
    """

    def __init__(self) -> None:
        self._lead_s, self._at_s, self._time_s = -math.inf, 0.0, -math.inf

    def of(self, time_s: float, now_s: float) -> float:
        """Return by how many seconds a frame of this time that comes now is behind.

        Parameters
        ----------
        time_s
            Of the frame, in seconds of the trial.
        now_s
            By a clock that is never set back.
        """
        lead_s = time_s - now_s
        expected_s = self._lead_s - _DRIFT * (now_s - self._at_s)
        # Whoever sets the frames' clock back begins anew.
        is_new = time_s < self._time_s - _SET_BACK_S
        self._time_s = time_s
        if lead_s >= expected_s or is_new:
            self._lead_s, self._at_s = lead_s, now_s
            return 0.0
        return expected_s - lead_s


def _on_grid(time_s: float) -> float:
    """Return a whole multiple of the tick, to the last bit."""
    return round(time_s / TICK_S) * TICK_S
