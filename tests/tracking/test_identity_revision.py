"""Ids in a minute's tracks are put right where animals crossed, as far back as the minute goes."""

import math

import pytest

from zfcal.tracking.fusing import Named
from zfcal.tracking.identity_revision import IdentityRevision
from zfcal.tracking.seen import Exchange
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

FPS = 15.0
STEP_S = 3 / FPS + 1 / FPS


def named(agent, track, x_m, kind=FISH):
    """Return somebody at a place."""
    return Named(
        track=track,
        pose=AgentPose(
            agent=agent, kind=kind, x_m=x_m, y_m=0.5, heading_rad=math.nan, confidence=1.0
        ),
    )


class Minute:
    """Frames that are told one by one, and what is made of them at the end."""

    def __init__(self, break_s=STEP_S):
        self.revision = IdentityRevision(break_s)
        self.frames = []
        self.n = 0

    def tell(self, *agents, times=1):
        """Tell a frame."""
        for _ in range(times):
            time_s = self.n / FPS
            self.revision.note(self.n, time_s, agents)
            told = tuple(agent.pose for agent in agents)
            self.frames.append(FramePoses(time_s=time_s, frame=self.n, agents=told))
            self.n += 1

    def exchange(self, one, other, frames_ago):
        """Exchange two ids since so many frames before the next one."""
        since_s = (self.n - frames_ago) / FPS
        told = Exchange(one=one, other=other, since_s=since_s)
        self.revision.exchange([told], self.n / FPS)

    def end(self):
        """Return where everybody is in each frame, by id, and begin anew."""
        revised, self.frames = self.revision.revise(self.frames), []
        return [{pose.agent: pose.x_m for pose in poses.agents} for poses in revised]


def test_ids_are_exchanged_from_the_crossing_on():
    """Ten frames later looks tell: those ten are put right, and none before."""
    minute = Minute()
    minute.tell(named(0, 5, 0.1), named(1, 6, 0.9), times=4)
    minute.tell(named(0, 5, 0.2), named(1, 6, 0.8), times=10)
    minute.exchange(0, 1, 10)
    minute.tell(named(0, 6, 0.8), named(1, 5, 0.2), times=2)

    told = minute.end()

    # They really crossed elsewhere than in this test: so the break of a step is seen as well.
    assert told[:4] == 4 * [{0: 0.1, 1: 0.9}]
    assert told[4:7] == 3 * [{}]
    assert told[7:] == 9 * [{0: 0.8, 1: 0.2}]


def test_where_they_crossed_nothing_is_lost():
    """The tracks were a centimetre apart: not a row is left out."""
    minute = Minute()
    minute.tell(named(0, 5, 0.50), named(1, 6, 0.51))
    minute.tell(named(0, 5, 0.49), named(1, 6, 0.52))
    minute.tell(named(0, 5, 0.40), named(1, 6, 0.60))
    minute.exchange(0, 1, 2)
    minute.tell(named(0, 6, 0.65), named(1, 5, 0.35))

    assert minute.end() == [
        {0: 0.50, 1: 0.51},
        {0: 0.52, 1: 0.49},
        {0: 0.60, 1: 0.40},
        {0: 0.65, 1: 0.35},
    ]


def test_two_exchanges_are_applied_one_after_the_other():
    """First with second, then second with third."""
    minute = Minute(break_s=0.0)
    for _ in range(3):
        minute.tell(named(0, 5, 0.1), named(1, 6, 0.2), named(2, 7, 0.3))
    minute.revision.exchange(
        [
            Exchange(one=0, other=1, since_s=1 / FPS),
            Exchange(one=1, other=2, since_s=2 / FPS),
        ],
        3 / FPS,
    )
    assert minute.end() == [
        {0: 0.1, 1: 0.2, 2: 0.3},
        {0: 0.2, 1: 0.1, 2: 0.3},
        {0: 0.2, 1: 0.3, 2: 0.1},
    ]


def test_an_exchange_and_its_taking_back_leave_what_was_told_in_between_right():
    """The first was a mistake: what both cover is as it was told, and so is what follows."""
    minute = Minute(break_s=0.0)
    minute.tell(named(0, 5, 0.1), named(1, 6, 0.2), times=2)
    minute.exchange(0, 1, 1)
    minute.tell(named(1, 5, 0.1), named(0, 6, 0.2))
    minute.exchange(0, 1, 2)
    minute.tell(named(0, 5, 0.1), named(1, 6, 0.2))
    assert minute.end() == 4 * [{0: 0.1, 1: 0.2}]


def test_a_minute_that_is_closed_stays_as_it_is():
    """An exchange since before its end reaches back to its end; there the id is not told."""
    minute = Minute()
    minute.tell(named(0, 5, 0.1), named(1, 6, 0.9), times=3)
    assert minute.end() == 3 * [{0: 0.1, 1: 0.9}]
    minute.tell(named(0, 5, 0.1), named(1, 6, 0.9), times=5)
    minute.exchange(0, 1, 7)
    minute.tell(named(0, 6, 0.9), named(1, 5, 0.1))
    assert minute.end() == [*3 * [{}], *3 * [{0: 0.9, 1: 0.1}]]


def test_the_robot_is_told_wherever_it_is():
    """The LEDs tell who it is, on whichever track, or on none."""
    minute = Minute()
    for track, x_m in ((7, 0.9), (8, 0.2), (None, 0.7)):
        minute.tell(named(0, 5, 0.1), named(2, track, x_m, ROBOT))
    assert minute.end() == [{0: 0.1, 2: 0.9}, {0: 0.1, 2: 0.2}, {0: 0.1, 2: 0.7}]


def test_one_that_was_not_seen_in_between_is_put_right_where_it_was():
    """An exchange is of ids, whether both were seen or one."""
    minute = Minute(break_s=0.0)
    minute.tell(named(0, 5, 0.1), named(1, 6, 0.2))
    minute.tell(named(1, 6, 0.3))
    minute.exchange(0, 1, 1)
    minute.tell(named(0, 6, 0.4))
    assert minute.end() == [{0: 0.1, 1: 0.2}, {0: 0.3}, {0: 0.4}]


def test_frames_of_which_nothing_was_noted_stay():
    """Those of a run before, whose tracker is gone."""
    minute = Minute()
    minute.tell(named(0, 5, 0.1))
    before = FramePoses(time_s=-1.0, frame=-15, agents=(named(3, 1, 0.7).pose,))
    minute.frames.insert(0, before)
    assert minute.end() == [{3: 0.7}, {0: 0.1}]


@pytest.mark.parametrize("minutes", [1, 30])
def test_what_was_revised_is_forgotten(minutes):
    """Memory is that of a minute, however long the recording, and however much was exchanged."""
    minute = Minute()
    for _ in range(minutes):
        minute.tell(named(0, 5, 0.1), times=20)
        minute.exchange(0, 1, 10)
        minute.tell(named(1, 5, 0.1))
        minute.end()
    assert len(minute.revision._kept) == len(minute.revision._learnt) == 0
