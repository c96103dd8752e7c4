"""What is wrong with the robot, from what it says and when."""

from __future__ import annotations

import math
from typing import final

from zfcal.robot.events import Said

_OBSTACLE_S = 0.5
"""An obstacle that is not met again has gone after so long."""

_STARVED_S = 3.0
"""PowerDown that comes again and again for so long means that the supply is lost."""

_PAUSE_S = 1.0
"""PowerDown that does not come for so long has ended."""


@final
class Complaints:
    """Remembers what a robot complained of.

    Parameters
    ----------
    letter
        Only this robot's complaints count.
    """

    def __init__(self, letter: str) -> None:
        self._letter = letter
        self._obstacle_s = -math.inf
        self._low_from_s = math.inf
        self._low_s = -math.inf

    def hear(self, said: Said, now_s: float) -> None:
        """Take what was said now."""
        if said.robot != self._letter:
            return
        if said.what == "obstacle":
            self._obstacle_s = now_s
        elif said.what == "power-down":
            if now_s - self._low_s > _PAUSE_S:
                self._low_from_s = now_s
            self._low_s = now_s

    def fault(self, now_s: float) -> str:
        """Return ``power-down``, ``obstacle`` or nothing."""
        if now_s - self._low_s <= _PAUSE_S and now_s - self._low_from_s >= _STARVED_S:
            return "power-down"
        return "obstacle" if now_s - self._obstacle_s < _OBSTACLE_S else ""
