"""One frame's agents out of what both cameras saw: who is the robot, and the ids that stay.

The tracker overhead follows everybody alike. Here the robot is told from the fish, and
gets an id of its own: an id belongs to one agent, of one kind.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, final

import numpy as np

from zfcal.tracking.breaks import Breaks
from zfcal.tracking.robot import RobotSeen, nearest_blob
from zfcal.tracking.seen import Exchange
from zfcal.tracks import FISH, ROBOT, AgentPose

ALONE = 0.6
"""Confidence of a robot that the camera below alone sees."""

GUESSED = 0.4
"""Confidence of a robot without LEDs, known by having been the robot before."""

_STAYS_M = 0.01
"""How much nearer to the LEDs than the robot's track another must be, to be the robot."""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """An agent in a frame, and what the tracker followed.

    Parameters
    ----------
    track
        The same from frame to frame, whatever the agent's id; None where the camera below
        alone saw it.
    pose
        The agent.
    """

    track: int | None
    pose: AgentPose


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
        As of `Breaks`; for names that are kept.

    Attributes
    ----------
    next_agent
        The next id that is free.
    agents
        Everybody in the last frame, with those who were not told.
    """

    def __init__(self, first_agent: int = 0, *, keeps: bool = False, break_s: float = 0.0) -> None:
        self.next_agent = first_agent
        self._keeps = keeps
        self._free: list[int] = []
        self._breaks = Breaks(break_s)
        self.agents: tuple[Named, ...] = ()
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
        agents = [self._fish_pose(blob, time_s) for k, blob in enumerate(blobs) if k != which]
        if robot is not None:
            agents += self._robot_pose(None if which is None else blobs[which], robot)
        self.agents = tuple(sorted(agents, key=lambda agent: agent.pose.agent))
        return tuple(agent.pose for agent in self.agents if self._may_tell(agent, time_s))

    def named(self, exchanges: Iterable[Exchange]) -> list[Exchange]:
        """Return exchanges of the tracker's ids as those of fish's names, as they were just now."""
        return [
            replace(told, one=self._fish[told.one][0], other=self._fish[told.other][0])
            for told in exchanges
            if told.one in self._fish and told.other in self._fish
        ]

    def _may_tell(self, agent: Named, time_s: float) -> bool:
        if not self._keeps or agent.track is None or agent.pose.kind != FISH:
            return True
        return self._breaks.may_tell(agent.pose, agent.track, time_s)

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

    def _fish_pose(self, blob: Blob, time_s: float) -> Named:
        known = self._fish.get(blob.agent)
        agent = self._name() if known is None else known[0]
        self._fish[blob.agent] = (agent, time_s)
        pose = AgentPose(
            agent=agent,
            kind=FISH,
            x_m=blob.x_m,
            y_m=blob.y_m,
            heading_rad=blob.heading_rad,
            confidence=blob.confidence,
        )
        return Named(track=blob.track, pose=pose)

    def _name(self) -> int:
        return self._free.pop(0) if self._free else self._new()

    def _robot_pose(self, blob: Blob | None, robot: RobotSeen) -> list[Named]:
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
        pose = AgentPose(
            agent=self._robot,
            kind=ROBOT,
            x_m=x_m,
            y_m=y_m,
            heading_rad=math.nan if robot.is_lost else robot.heading_rad,
            confidence=confidence,
        )
        return [Named(track=None if blob is None else blob.track, pose=pose)]
