"""One frame's agents out of what both cameras saw: who is the robot, and the ids that stay.

The tracker overhead follows everybody alike. Here the robot is told from the fish, and
gets an id of its own: an id belongs to one agent, of one kind.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol, final

import numpy as np

from zfcal.tracks import FISH, ROBOT, AgentPose
from zfcal.vision.robot import NEAR_M, RobotSeen, nearest_blob

ALONE = 0.6
"""Confidence of a robot that the camera below alone sees."""

GUESSED = 0.4
"""Confidence of a robot without LEDs, known by having been the robot before."""

_STAYS_M = 0.01
"""How much nearer to the LEDs than the robot's track another must be, to be the robot."""

_SLACK_S = 1e-6
"""What a difference of two times may be off by rounding."""

_FORGET_S = 60.0
"""Far longer than any tracker keeps the id of an animal that it does not see."""


class Blob(Protocol):
    """What the tracker overhead says of one agent."""

    @property
    def agent(self) -> int:
        """The tracker's id."""
        ...

    @property
    def track(self) -> int:
        """What the tracker followed from frame to frame."""
        ...

    @property
    def x_m(self) -> float:
        """Metres."""
        ...

    @property
    def y_m(self) -> float:
        """Metres."""
        ...

    @property
    def heading_rad(self) -> float:
        """Counter-clockwise from x; NaN where unknown."""
        ...

    @property
    def confidence(self) -> float:
        """In [0, 1]."""
        ...


@final
class Fuser:
    """Names the agents of one frame after the other.

    Parameters
    ----------
    first_agent
        The first id that is free.
    keeps
        Whether the tracker's ids are those of animals, for good. Then names are kept as well: where
        a track that was a fish's turns out to be the robot's, its name goes over to the one
        that was taken for the robot.
    break_s
        How long a fish is not told, in seconds, once its name has gone over to a track elsewhere:
        the longest step of the model (`Trial.longest_step_s`), so that none spans the jump.

    Attributes
    ----------
    next_agent
        The next id that is free.
    """

    def __init__(self, first_agent: int = 0, *, keeps: bool = False, break_s: float = 0.0) -> None:
        self.next_agent = first_agent
        self._keeps = keeps
        self._free: list[int] = []
        self._break_s = break_s - _SLACK_S
        self._told: dict[int, tuple[int, float, float, float]] = {}
        self._fish: dict[int, tuple[int, float]] = {}
        self._tidied_s = 0.0
        self._robot: int | None = None
        self._robot_blob: int | None = None

    def step(
        self, blobs: Sequence[Blob], robot: RobotSeen | None, time_s: float
    ) -> tuple[AgentPose, ...]:
        """Return who is where, by ascending id.

        Parameters
        ----------
        blobs
            From the camera overhead.
        robot
            From the camera below; None where there is none, or no image that belongs.
        time_s
            Of the overhead image.
        """
        which = None if robot is None else self._which(blobs, robot, time_s)
        self._take_robot(None if which is None else blobs[which].agent)
        self._forget(time_s)
        agents = [
            pose
            for k, blob in enumerate(blobs)
            if k != which and (pose := self._fish_pose(blob, time_s)) is not None
        ]
        if robot is not None:
            agents += self._robot_pose(None if which is None else blobs[which], robot)
        return tuple(sorted(agents, key=lambda agent: agent.agent))

    def _take_robot(self, blob: int | None) -> None:
        """Take a track for the robot's; the fish that it was taken for is another one."""
        before, self._robot_blob = self._robot_blob, blob
        if blob is None or blob not in self._fish:
            return
        # Should the track be told to be a fish again, nobody is sure that it is the same one.
        name = self._fish.pop(blob)
        if self._keeps and before is not None and before not in self._fish:
            self._fish[before] = name
        elif self._keeps:
            self._free.append(name[0])

    def _which(self, blobs: Sequence[Blob], robot: RobotSeen, time_s: float) -> int | None:
        xy_m = np.array([(blob.x_m, blob.y_m) for blob in blobs], np.float64).reshape(-1, 2)
        which = nearest_blob(robot, xy_m, time_s)
        before = next((k for k, blob in enumerate(blobs) if blob.agent == self._robot_blob), None)
        if which is None:
            return before if robot.is_lost else None
        if before is not None:
            # A fish that crosses over the robot may be a little nearer to its LEDs.
            away_m = np.hypot(*(xy_m - (robot.x_m, robot.y_m)).T)
            if away_m[before] <= away_m[which] + _STAYS_M:
                return before
        return which

    def _new(self) -> int:
        self.next_agent += 1
        return self.next_agent - 1

    def _forget(self, time_s: float) -> None:
        """Drop the names of tracks that the tracker has dropped long ago."""
        if not self._keeps and time_s >= self._tidied_s + _FORGET_S:
            self._fish = {
                old: (new, last_s)
                for old, (new, last_s) in self._fish.items()
                if last_s >= self._tidied_s
            }
            self._tidied_s = time_s

    def _fish_pose(self, blob: Blob, time_s: float) -> AgentPose | None:
        """Return a fish; None while its name has just come from elsewhere."""
        known = self._fish.get(blob.agent)
        agent = self._name() if known is None else known[0]
        self._fish[blob.agent] = (agent, time_s)
        if self._keeps:
            if self._is_jump(agent, blob, time_s):
                return None
            self._told[agent] = (blob.track, time_s, blob.x_m, blob.y_m)
        return AgentPose(
            agent=agent,
            kind=FISH,
            x_m=blob.x_m,
            y_m=blob.y_m,
            heading_rad=blob.heading_rad,
            confidence=blob.confidence,
        )

    def _name(self) -> int:
        return self._free.pop(0) if self._free else self._new()

    def _is_jump(self, agent: int, blob: Blob, time_s: float) -> bool:
        """Tell whether a name was told a moment ago of another track, elsewhere."""
        if agent not in self._told:
            return False
        track, last_s, x_m, y_m = self._told[agent]
        moved_m = math.hypot(blob.x_m - x_m, blob.y_m - y_m)
        return track != blob.track and time_s - last_s < self._break_s and moved_m > NEAR_M

    def _robot_pose(self, blob: Blob | None, robot: RobotSeen) -> list[AgentPose]:
        """Return the robot where it was seen: above if it can be, in the fish's own measure."""
        if blob is None and robot.is_lost:
            return []
        if self._robot is None:
            self._robot = self._new()
        if blob is None:
            x_m, y_m, confidence = robot.x_m, robot.y_m, ALONE
        else:
            confidence = min(blob.confidence, GUESSED) if robot.is_lost else blob.confidence
            x_m, y_m = blob.x_m, blob.y_m
        return [
            AgentPose(
                agent=self._robot,
                kind=ROBOT,
                x_m=x_m,
                y_m=y_m,
                heading_rad=math.nan if robot.is_lost else robot.heading_rad,
                confidence=confidence,
            )
        ]
