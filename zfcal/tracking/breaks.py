"""No step of the model spans an id that goes elsewhere: it is not told for that long."""

from __future__ import annotations

import math
from typing import final

from zfcal.tracking.robot import NEAR_M
from zfcal.tracks import AgentPose

_SLACK_S = 1e-6
"""What a difference of two times may be off by rounding."""


@final
class Breaks:
    """Says of each fish of a frame whether it may be told.

    Parameters
    ----------
    break_s
        How long a fish is not told, in seconds, once its id has gone over to a track elsewhere:
        the longest step of the model (`Trial.longest_step_s`).
    """

    def __init__(self, break_s: float) -> None:
        self._break_s = break_s - _SLACK_S
        self._told: dict[int, tuple[int, float, AgentPose]] = {}

    def may_tell(self, pose: AgentPose, track: int, time_s: float) -> bool:
        """Return whether an id is where it may have been since it was last told; note it if so.

        Parameters
        ----------
        pose
            What is to be told.
        track
            What the tracker followed from frame to frame.
        time_s
            Of the frame; they come in order.
        """
        if pose.agent in self._told:
            before, last_s, last = self._told[pose.agent]
            moved_m = math.hypot(pose.x_m - last.x_m, pose.y_m - last.y_m)
            if before != track and time_s - last_s < self._break_s and moved_m > NEAR_M:
                return False
        self._told[pose.agent] = (track, time_s, pose)
        return True
