"""What was told of a minute, as it is known at its end.

Poses are told at once, by what was believed then. Looks tell seconds after a crossing that
two animals have changed places; until then each goes by the other's id. Tracks are written
when their minute has passed: there the ids are exchanged where the animals crossed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import final

from zfcal.tracking.breaks import Breaks
from zfcal.tracking.fusing import Named
from zfcal.tracking.seen import Exchange
from zfcal.tracks import FISH, FramePoses


@final
class IdentityRevision:
    """Keeps who was where until it is asked, and puts right what is learnt meanwhile.

    Parameters
    ----------
    break_s
        As of `Breaks`: ids that go elsewhere even so.
    """

    def __init__(self, break_s: float) -> None:
        self._breaks = Breaks(break_s)
        self._kept: dict[int, tuple[float, tuple[Named, ...]]] = {}
        self._learnt: list[tuple[Exchange, float]] = []

    def note(self, frame: int, time_s: float, agents: Sequence[Named]) -> None:
        """Keep a frame, with those of whom nothing was told since their id came from elsewhere."""
        self._kept[frame] = (time_s, tuple(agents))

    def exchange(self, exchanges: Iterable[Exchange], until_s: float) -> None:
        """Take in what `revise` is to put right: ids of fish, from then to now.

        Parameters
        ----------
        exchanges
            The earlier ones of one frame first.
        until_s
            Time of the first frame that has them right, in seconds.
        """
        self._learnt += [(told, until_s) for told in exchanges]

    def revise(self, frames: Sequence[FramePoses]) -> list[FramePoses]:
        """Return frames as they are known now, and forget them; others stay as they were told."""
        revised = [self._revised(poses) for poses in frames]
        if frames:
            self._learnt = [each for each in self._learnt if each[1] > frames[-1].time_s]
        return revised

    def _revised(self, poses: FramePoses) -> FramePoses:
        if poses.frame not in self._kept:
            return poses
        time_s, kept = self._kept.pop(poses.frame)
        wrong = [told for told, until_s in self._learnt if told.since_s <= time_s < until_s]
        agents = [_exchanged(agent, wrong) for agent in kept]
        told = [
            agent.pose
            for agent in agents
            if agent.track is None
            or agent.pose.kind != FISH
            or self._breaks.may_tell(agent.pose, agent.track, time_s)
        ]
        told.sort(key=lambda pose: pose.agent)
        return dataclasses.replace(poses, agents=tuple(told))


def _exchanged(agent: Named, exchanges: Sequence[Exchange]) -> Named:
    """Return somebody by the id that is right; the robot's is, whatever is exchanged."""
    if agent.pose.kind != FISH:
        return agent
    right = agent.pose.agent
    for told in exchanges:
        right = {told.one: told.other, told.other: told.one}.get(right, right)
    if right == agent.pose.agent:
        return agent
    return dataclasses.replace(agent, pose=dataclasses.replace(agent.pose, agent=right))
