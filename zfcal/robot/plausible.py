"""Which measured poses are none: what no animal and no robot can have done.

A tracker that loses its animal may go on with a guess, a reflection or a hand. Here stands
what is not taken for a pose; what is done without it is the driver's business.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import shapely

from zfcal.arena import Arena
from zfcal.robot.body import WHEEL_LIMIT_M_S
from zfcal.tracks import GUESS, AgentPose

TOLERANCE_M = 0.03
"""So far outside the water a position may be measured: a zebrafish's length, twice the robot's
radius. Cameras are off by millimetres; whoever is farther out is not in the tank with any part."""

CONSISTENT_FRAMES = 5
"""After so many frames at a place that it cannot have driven to the robot is there all the same."""

_LATEST_S = 1e9
"""Seconds since a trial began, some thirty years: no frame is later."""

_OFF_S, _OFF = 1.0, 0.02
"""So far a frame's number may be from its time: a second and 2 %, cameras are a little off."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubt:
    """Why a pose is none.

    Parameters
    ----------
    kind
        ``not-finite``, ``unsure``, ``outside`` or ``jump``.
    says
        The same for people, with the values.
    """

    kind: str
    says: str


def is_frame(time_s: float, frame: int, fps: float) -> bool:
    """Return whether a frame of poses has a time and a number that a trial can have.

    Parameters
    ----------
    time_s
        Seconds since the start of the trial.
    frame
        Number of the frame since then.
    fps
        Frames a second, in the trial.
    """
    if not (0.0 <= time_s <= _LATEST_S and frame >= 0):
        return False
    return abs(frame / fps - time_s) <= _OFF_S + _OFF * time_s


@final
class Plausibility:
    """Tells poses that nobody in the tank can have.

    Parameters
    ----------
    arena
        The tank. Where it allows more than `TOLERANCE_M` outside, that holds.
    """

    def __init__(self, arena: Arena) -> None:
        self._outline = arena.outline
        self._tolerance_m = max(TOLERANCE_M, arena.wall_tolerance_m)
        shapely.prepare(self._outline)

    def doubt(self, agent: AgentPose) -> Doubt | None:
        """Return why a pose is none; None where nothing speaks against it.

        A heading that is unknown (NaN) does not: the one before counts.
        """
        x, y = agent.x_m, agent.y_m
        if not (math.isfinite(x) and math.isfinite(y)):
            return Doubt(kind="not-finite", says=f"its position ({x}, {y}) is no number")
        if not agent.confidence >= GUESS:
            says = f"its confidence is {agent.confidence:g}, at least {GUESS:g} is wanted"
            return Doubt(kind="unsure", says=says)
        away = self._away(x, y)
        if not away <= self._tolerance_m:
            says = f"it is {away:.3g} m outside the tank, {self._tolerance_m:g} m are allowed"
            return Doubt(kind="outside", says=says)
        return None

    def _away(self, x_m: float, y_m: float) -> float:
        """Return how far outside the tank a place is, at least."""
        west, south, east, north = self._outline.bounds
        beside = math.hypot(max(west - x_m, x_m - east, 0.0), max(south - y_m, y_m - north, 0.0))
        if beside > self._tolerance_m:
            # No polygon is asked about places whose squares are no numbers.
            return beside
        return float(shapely.distance(self._outline, shapely.Point(x_m, y_m)))


@final
class Reach:
    """Tells jumps of the robot: where it cannot have driven to since it was last seen.

    A robot that was lifted and put down elsewhere is found after `CONSISTENT_FRAMES`.
    """

    def __init__(self) -> None:
        self._last: tuple[float, float, float] | None = None
        self._elsewhere: tuple[float, float, float] | None = None
        self._count = 0

    def doubt(self, time_s: float, x_m: float, y_m: float) -> Doubt | None:
        """Take the next place; return why the robot cannot be there, None where it can.

        Parameters
        ----------
        time_s
            Of the frame, in seconds of the trial.
        x_m, y_m
            Where it was seen, in metres, finite.
        """
        here = (time_s, x_m, y_m)
        if self._last is None or _reaches(self._last, here):
            self._last, self._elsewhere = here, None
            return None
        consistent = self._elsewhere is not None and _reaches(self._elsewhere, here)
        self._count = self._count + 1 if consistent else 1
        self._elsewhere = here
        if self._count >= CONSISTENT_FRAMES:
            self._last, self._elsewhere = here, None
            return None
        way, passed_s = math.dist(self._last[1:], here[1:]), time_s - self._last[0]
        says = (
            f"it is {way:.3g} m from where it was {passed_s:.2g} s before, too far to have driven"
        )
        return Doubt(kind="jump", says=says)


def _reaches(before: tuple[float, float, float], here: tuple[float, float, float]) -> bool:
    """Return whether the robot can have driven so far; each place may be wrong by a tolerance."""
    passed_s = max(0.0, here[0] - before[0])
    return math.dist(before[1:], here[1:]) <= WHEEL_LIMIT_M_S * passed_s + TOLERANCE_M
