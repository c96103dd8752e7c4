"""How the robot gets to its target: the published controller, and swimming like a fish."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Protocol, final

from zfcal.errors import InputError
from zfcal.robot.body import WHEEL_LIMIT_M_S, Pose, Wheels, wheels_for
from zfcal.units import wrap_angle

TICK_S = 0.1
"""Time between two commands."""

_THERE_M = 0.001
"""Nearer than this the target has no bearing: the robot is there."""

_FACING_PER_S = 5.0
"""Rate of turning on the spot per angle: faster, the wheels' inertia would carry it past."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gains:
    """The published controller's constants.

    Parameters
    ----------
    turn_p, turn_i, turn_d
        Rate of turning in rad/s per radian of error, of the sum of the last errors, and of
        the error's change in rad/s.
    window
        How many errors are summed.
    distance_p
        Speed per distance, in m/s per metre.
    cap_m_s
        The largest speed.
    """

    turn_p: float = 3.5
    turn_i: float = 0.05
    turn_d: float = 0.0
    window: int = 20
    distance_p: float = 2.5
    cap_m_s: float = 0.16


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """Where the robot is to go.

    Parameters
    ----------
    x_m, y_m
        In metres.
    speed_m_s
        Speed that the model drew for the way there.
    """

    x_m: float
    y_m: float
    speed_m_s: float = 0.0


class Pattern(Protocol):
    """A way of swimming."""

    def command(self, pose: Pose, goal: Goal, now_s: float) -> Wheels:
        """Return the wheel speeds from now to the next command."""

    def reset(self) -> None:
        """Forget what was under way: the robot has stopped."""


@final
class Steering:
    """Rate of turning from the angle to the target: proportional, integral, differential."""

    def __init__(self, gains: Gains) -> None:
        self._gains = gains
        self._errors: deque[float] = deque(maxlen=gains.window)

    def turn(self, error_rad: float) -> float:
        """Return the rate of turning in rad/s, once every `TICK_S`."""
        before = self._errors[-1] if self._errors else error_rad
        self._errors.append(error_rad)
        gains = self._gains
        change = wrap_angle(error_rad - before) / TICK_S
        whole = math.fsum(self._errors)
        return gains.turn_p * error_rad + gains.turn_i * whole + gains.turn_d * change

    def reset(self) -> None:
        """Forget the errors."""
        self._errors.clear()


def bearing(pose: Pose, goal: Goal) -> tuple[float, float]:
    """Return distance and angle from the robot's heading to the target."""
    dx, dy = goal.x_m - pose.x_m, goal.y_m - pose.y_m
    distance = math.hypot(dx, dy)
    if distance < _THERE_M:
        return 0.0, 0.0
    return distance, wrap_angle(math.atan2(dy, dx) - pose.heading_rad)


@final
class PidPattern:
    """The authors' controller: speed from the distance, turning from the angle."""

    def __init__(self, gains: Gains | None = None) -> None:
        self._gains = gains or Gains()
        self._steering = Steering(self._gains)

    def command(self, pose: Pose, goal: Goal, now_s: float) -> Wheels:  # noqa: ARG002 - a pattern's
        """Return the wheel speeds."""
        distance, error = bearing(pose, goal)
        speed = min(self._gains.cap_m_s, self._gains.distance_p * distance)
        return wheels_for(speed, self._steering.turn(error))

    def reset(self) -> None:
        """Forget the errors."""
        self._steering.reset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Kicks:
    """How a fish-like robot kicks.

    Parameters
    ----------
    peak_m_s
        Speed of the slowest and of the fastest kick.
    fastest_m_s
        Model speed that asks for the fastest kick.
    glide_s
        Time in which the speed falls to a third (to 1/e) of what it was.
    shortest_s, longest_s
        Between two kicks.
    face_rad
        A target farther off the heading, that is behind the robot, is faced first, on the
        spot; others are turned to on the way. A model of fish asks for 70 degrees a step,
        and who stood still for that would be half as slow as the fish.
    """

    peak_m_s: tuple[float, float] = (0.14, 0.19)
    fastest_m_s: float = 0.20
    glide_s: float = 0.6
    shortest_s: float = 0.5
    longest_s: float = 1.5
    face_rad: float = 2.0


@final
class FishPattern:
    """Burst and coast: turn, accelerate, relax; again about once a second.

    A kick is renewed when the mean speed since the last one has come down to what the
    model asks for, so fast targets are followed by more kicks, not by steady driving. That is
    the speed at which the robot was seen to go: wheels take their time, and turning on the
    spot gains no way. While it glides, the robot steers as the published controller does.
    """

    def __init__(self, gains: Gains | None = None, kicks: Kicks | None = None) -> None:
        self._gains = gains or Gains()
        self._kicks = kicks or Kicks()
        self._steering = Steering(self._gains)
        self._since_s: float | None = None
        self._glides_s = 0.0
        self._peak = 0.0
        self._way = 0.0
        self._asked = 0.0
        self._facing = False
        self._seen: Pose | None = None

    def command(self, pose: Pose, goal: Goal, now_s: float) -> Wheels:
        """Return the wheel speeds."""
        distance, error = bearing(pose, goal)
        self._way += self._gone(pose)
        # What the model asks, or what it takes to catch up with a target that has gone ahead.
        catching = min(self._gains.cap_m_s, self._gains.distance_p * distance)
        wanted = max(goal.speed_m_s, catching) if distance > 0 else 0.0
        # The mean over about a second: single steps are far more uneven than a fish's kicks.
        self._asked += 0.2 * (wanted - self._asked)
        if self._is_due(now_s) and distance > 0:
            self._begin(wanted, now_s, error)
        turn = self._steering.turn(error)
        if self._facing:
            # The kick itself begins when the robot faces its target.
            self._facing, self._glides_s = abs(error) > self._kicks.face_rad, now_s
            if self._facing:
                return wheels_for(0.0, _FACING_PER_S * error)
        return wheels_for(self._speed(now_s), turn)

    def reset(self) -> None:
        """Forget the kick that was under way."""
        self._steering.reset()
        self._since_s, self._peak, self._way, self._facing = None, 0.0, 0.0, False
        self._seen = None

    def _gone(self, pose: Pose) -> float:
        """Return how far the robot has come since the last command."""
        before, self._seen = self._seen, pose
        if before is None:
            return 0.0
        # A leap is the tracker's, not the robot's.
        gone = math.hypot(pose.x_m - before.x_m, pose.y_m - before.y_m)
        return min(gone, WHEEL_LIMIT_M_S * TICK_S)

    def _is_due(self, now_s: float) -> bool:
        if self._since_s is None:
            return True
        passed = now_s - self._since_s
        if passed < self._kicks.shortest_s - 1e-6:
            return False
        return passed >= self._kicks.longest_s - 1e-6 or self._way / passed <= self._asked

    def _begin(self, wanted: float, now_s: float, error: float) -> None:
        low, high = self._kicks.peak_m_s
        self._peak = low + (high - low) * min(1.0, wanted / self._kicks.fastest_m_s)
        self._since_s, self._glides_s, self._way = now_s, now_s, 0.0
        self._facing = abs(error) > self._kicks.face_rad

    def _speed(self, now_s: float) -> float:
        if self._since_s is None:
            return 0.0
        return self._peak * math.exp(-(now_s - self._glides_s) / self._kicks.glide_s)


def pattern_of(name: str, gains: Gains | None = None) -> Pattern:
    """Return a way of swimming by its name, ``fish`` or ``pid``."""
    patterns: dict[str, type[FishPattern | PidPattern]] = {
        "fish": FishPattern,
        "pid": PidPattern,
    }
    if name not in patterns:
        raise InputError(f"Pattern must be 'fish' or 'pid', got {name!r}.")
    return patterns[name](gains)
