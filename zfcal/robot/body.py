"""The FishBot's body: what it can do, and how wheel speeds become motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from zfcal.errors import InputError
from zfcal.units import wrap_angle

WHEEL_BASE_M = 0.018
WHEEL_LIMIT_M_S = 0.30
"""A wheel that is asked for more makes the robot set both to zero."""

ACCELERATION_M_S2 = 1.0
RADIUS_M = 0.015
"""About half the diagonal of the FishBot's 22 x 22 mm: so near a wall its centre may go."""

TICK_M = 0.00088
"""Way of one encoder tick, about."""

_SLACK_M_S = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """Where the robot is: metres, and radians counter-clockwise from x."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheels:
    """Wheel speeds in metres per second."""

    left_m_s: float = 0.0
    right_m_s: float = 0.0

    @property
    def speed_m_s(self) -> float:
        """Speed of the point between the wheels."""
        return (self.left_m_s + self.right_m_s) / 2

    @property
    def turn_rad_s(self) -> float:
        """Rate of turning, counter-clockwise."""
        return (self.right_m_s - self.left_m_s) / WHEEL_BASE_M


def wheels_for(speed_m_s: float, turn_rad_s: float) -> Wheels:
    """Return wheel speeds within the robot's limit; turning goes before speed.

    Parameters
    ----------
    speed_m_s
        Asked for; less is given where turning leaves no room for it.
    turn_rad_s
        Counter-clockwise; cut off at what a turn on the spot gives.
    """
    most = 2 * WHEEL_LIMIT_M_S / WHEEL_BASE_M
    turn = min(most, max(-most, turn_rad_s))
    side = turn * WHEEL_BASE_M / 2
    room = WHEEL_LIMIT_M_S - abs(side)
    speed = min(room, max(-room, speed_m_s))
    return Wheels(left_m_s=speed - side, right_m_s=speed + side)


def check_wheels(wheels: Wheels) -> None:
    """Raise an `InputError` for speeds at which the robot would stop both wheels."""
    for side, value in (("left", wheels.left_m_s), ("right", wheels.right_m_s)):
        if not abs(value) <= WHEEL_LIMIT_M_S + _SLACK_M_S:
            raise InputError(
                f"The speed of the {side} wheel is {value:.3f} m/s, the robot's limit is "
                f"{WHEEL_LIMIT_M_S:.2f} m/s; nothing was sent.",
                hint="Beyond it the robot sets both wheels to zero.",
            )


def roll(pose: Pose, wheels: Wheels, dt_s: float) -> Pose:
    """Return where wheel speeds lead in a moment, along the arc that they describe."""
    half = wheels.turn_rad_s * dt_s / 2
    # The chord of the arc: exact, also for a turn of next to nothing.
    way = wheels.speed_m_s * dt_s * (math.sin(half) / half if half else 1.0)
    return Pose(
        x_m=pose.x_m + way * math.cos(pose.heading_rad + half),
        y_m=pose.y_m + way * math.sin(pose.heading_rad + half),
        heading_rad=wrap_angle(pose.heading_rad + 2 * half),
    )
