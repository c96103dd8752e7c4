"""Who is the robot, and which ids agents keep."""

import math
from dataclasses import dataclass

import pytest

from zfcal.tracking.fusing import ALONE, GUESSED, Fuser
from zfcal.tracking.robot import RobotSeen
from zfcal.tracking.seen import Exchange
from zfcal.tracks import FISH, ROBOT


@dataclass(frozen=True)
class Blob:
    """What a tracker overhead says."""

    agent: int
    x_m: float
    y_m: float
    heading_rad: float = 0.5
    confidence: float = 0.9
    followed: int | None = None

    @property
    def track(self):
        """What was followed: as many tracks as ids, where nothing else is said."""
        return self.agent if self.followed is None else self.followed


def robot(x_m=math.nan, y_m=math.nan, heading_rad=1.0, *, time_s=0.0):
    """Return a robot seen there; without a place it is lost."""
    leds = () if math.isnan(x_m) else ((0.0, 0.0), (9.0, 0.0))
    return RobotSeen(time_s=time_s, x_m=x_m, y_m=y_m, heading_rad=heading_rad, leds_px=leds)


def kinds(agents):
    """Return the kind of each agent by its id."""
    return {agent.agent: agent.kind for agent in agents}


FOUR = [Blob(7, 0.1, 0.1), Blob(8, 0.5, 0.5), Blob(9, 0.9, 0.9)]


def test_without_a_camera_below_everybody_is_a_fish():
    """Ids count from nought, in the order in which the tracker names them."""
    agents = Fuser().step(FOUR, None, 0.0)
    assert kinds(agents) == {0: FISH, 1: FISH, 2: FISH}
    assert [agent.x_m for agent in agents] == [0.1, 0.5, 0.9]


def test_the_blob_nearest_to_the_leds_is_the_robot():
    """Its place is that of the blob, its heading that of the LEDs; the others are fish."""
    agents = Fuser().step(FOUR, robot(0.51, 0.49), 0.0)
    (found,) = [agent for agent in agents if agent.kind == ROBOT]
    assert (found.x_m, found.y_m, found.heading_rad, found.confidence) == (0.5, 0.5, 1.0, 0.9)
    assert sum(agent.kind == FISH for agent in agents) == 2


def test_an_id_has_one_kind_for_ever():
    """Though the tracker swaps a fish and the robot, back and forth."""
    fuser = Fuser()
    seen = {}
    for k in range(40):
        at = FOUR[k // 5 % 3]
        for agent in fuser.step(FOUR, robot(at.x_m, at.y_m), 0.0):
            assert seen.setdefault(agent.agent, agent.kind) == agent.kind
    assert sum(kind == ROBOT for kind in seen.values()) == 1


def test_a_track_that_was_the_robot_s_gets_a_new_name_as_a_fish():
    """Nobody is sure that it is the fish that it was before."""
    fuser = Fuser()
    before = {a.x_m: a.agent for a in fuser.step(FOUR, robot(0.9, 0.9), 0.0)}
    fuser.step(FOUR, robot(0.1, 0.1), 0.0)
    after = {a.x_m: a.agent for a in fuser.step(FOUR, robot(0.9, 0.9), 0.0)}
    assert after[0.5] == before[0.5]
    assert after[0.9] == before[0.9]
    assert after[0.1] != before[0.1]


def test_a_fish_that_crosses_over_the_robot_keeps_its_name():
    """A little nearer to the LEDs for a moment it is still the fish, and the robot the robot."""
    fuser = Fuser()
    fuser.step([Blob(1, 0.50, 0.5), Blob(2, 0.60, 0.5)], robot(0.5, 0.5), 0.0)
    before = kinds(fuser.step([Blob(1, 0.50, 0.5), Blob(2, 0.53, 0.5)], robot(0.5, 0.5), 0.0))

    crossing = fuser.step([Blob(1, 0.507, 0.5), Blob(2, 0.502, 0.5)], robot(0.5, 0.5), 0.0)

    assert kinds(crossing) == before
    assert {a.x_m for a in crossing if a.kind == ROBOT} == {0.507}


def test_a_fish_that_is_not_seen_for_a_while_keeps_its_name():
    """As long as the tracker keeps it."""
    fuser = Fuser()
    first = fuser.step(FOUR, None, 0.0)
    fuser.step(FOUR[:2], None, 0.1)
    assert fuser.step(FOUR, None, 0.9) == first


def test_names_that_are_long_gone_are_forgotten():
    """Memory does not grow with the hours."""
    fuser = Fuser()
    for k in range(100_000):
        fuser.step([Blob(k, 0.5, 0.5)], None, k / 15)
    assert len(fuser._fish) < 3000


def test_a_robot_that_is_seen_from_below_alone_is_there_all_the_same():
    """With its own place, and less sure."""
    agents = Fuser().step(FOUR, robot(0.3, 0.7), 0.0)
    (found,) = [agent for agent in agents if agent.kind == ROBOT]
    assert (found.x_m, found.y_m, found.confidence) == (0.3, 0.7, ALONE)
    assert len(agents) == 4


def test_a_robot_without_leds_stays_the_robot_as_a_guess():
    """By the track that it had, without a heading; not a fish more."""
    fuser = Fuser()
    fuser.step(FOUR, robot(0.5, 0.5), 0.0)
    agents = fuser.step(FOUR, robot(), 0.1)
    (found,) = [agent for agent in agents if agent.kind == ROBOT]
    assert (found.x_m, found.confidence) == (0.5, GUESSED)
    assert math.isnan(found.heading_rad)
    assert sum(agent.kind == FISH for agent in agents) == 2


def test_a_robot_that_was_never_seen_cannot_be_told():
    """Everybody is a fish, and there is no robot."""
    assert {agent.kind for agent in Fuser().step(FOUR, robot(), 0.0)} == {FISH}


@pytest.mark.parametrize("first", [0, 17])
def test_ids_begin_with_the_first_that_is_free(first):
    """A recording that goes on gives no id twice."""
    fuser = Fuser(first)
    assert [agent.agent for agent in fuser.step(FOUR, None, 0.0)] == [first, first + 1, first + 2]
    assert fuser.next_agent == first + 3


def test_where_ids_are_kept_no_name_is_made_for_a_fish_that_was_the_robot():
    """However often the tracker swaps the robot with a fish, two fish have two names."""
    fuser = Fuser(keeps=True)
    seen = {}
    for k in range(60):
        at = FOUR[k // 5 % 3]
        for agent in fuser.step(FOUR, robot(at.x_m, at.y_m, time_s=k / 15), k / 15):
            assert seen.setdefault(agent.agent, agent.kind) == agent.kind
    assert sorted(seen.values()) == [FISH, FISH, ROBOT]


def test_the_fish_s_name_goes_over_to_the_track_that_was_the_robot_s():
    """A tracker that mistook one for the other is mended beside them at once."""
    near = [Blob(7, 0.50, 0.5), Blob(8, 0.53, 0.5)]
    fuser = Fuser(keeps=True)
    (fish,) = (a.agent for a in fuser.step(near, robot(0.5, 0.5), 0.0) if a.kind == FISH)

    after = fuser.step(near, robot(0.54, 0.5), 0.05)

    assert {(a.agent, a.x_m) for a in after if a.kind == FISH} == {(fish, 0.50)}


STEP_S = 3 / 15 + 1 / 15


def told_x_m(fuser, frames, *, first=0):
    """Return where each fish is told in each frame, by id."""
    told = [
        fuser.step(blobs, robot(*at, time_s=k / 15) if at else None, k / 15)
        for k, (blobs, at) in enumerate(frames, first)
    ]
    return [{a.agent: a.x_m for a in agents if a.kind == FISH} for agents in told]


def test_a_name_that_goes_over_to_another_place_is_not_told_for_a_step_of_the_model():
    """Not a single step, three frames long, has it on both places: no fish jumps across."""
    two = FOUR[:2]
    told = told_x_m(
        Fuser(keeps=True, break_s=STEP_S), [(two, (0.1, 0.1))] + 5 * [(two, (0.5, 0.5))]
    )
    assert told == [{0: 0.5}, {}, {}, {}, {0: 0.1}, {0: 0.1}]


def test_ids_that_the_tracker_exchanges_late_do_not_jump():
    """Two far apart whose looks tell late who is who: nobody is told for a step."""
    before = [Blob(0, 0.1, 0.1, followed=5), Blob(1, 0.9, 0.9, followed=6)]
    after = [Blob(0, 0.9, 0.9, followed=6), Blob(1, 0.1, 0.1, followed=5)]
    told = told_x_m(Fuser(keeps=True, break_s=STEP_S), 2 * [(before, None)] + 5 * [(after, None)])
    assert told == [*2 * [{0: 0.1, 1: 0.9}], {}, {}, {}, *2 * [{0: 0.9, 1: 0.1}]]


def test_ids_exchanged_beside_each_other_are_told_at_once():
    """A fish may have swum so far."""
    before = [Blob(0, 0.50, 0.5, followed=5), Blob(1, 0.53, 0.5, followed=6)]
    after = [Blob(0, 0.53, 0.5, followed=6), Blob(1, 0.50, 0.5, followed=5)]
    told = told_x_m(Fuser(keeps=True, break_s=STEP_S), [(before, None), (after, None)])
    assert told == [{0: 0.50, 1: 0.53}, {0: 0.53, 1: 0.50}]


@pytest.mark.parametrize(("lost", "silent"), [(0, 3), (2, 1), (3, 0), (9, 0)])
def test_a_lost_id_that_is_found_elsewhere_waits_for_a_step_since_it_was_told(lost, silent):
    """The frames for which it was lost count."""
    fuser = Fuser(keeps=True, break_s=STEP_S)
    here, there = Blob(0, 0.1, 0.1, followed=5), Blob(0, 0.9, 0.9, followed=6)
    frames = [([here], None), *lost * [([], None)], *4 * [([there], None)]]
    told = told_x_m(fuser, frames)[1 + lost :]
    assert told == silent * [{}] + (4 - silent) * [{0: 0.9}]


def test_a_fish_that_darts_is_told():
    """Its track was followed all the while."""
    frames = [([Blob(0, x_m, 0.1, followed=5)], None) for x_m in (0.1, 0.2, 0.3)]
    told = told_x_m(Fuser(keeps=True, break_s=STEP_S), frames)
    assert told == [{0: 0.1}, {0: 0.2}, {0: 0.3}]


def test_a_track_that_comes_back_before_its_step_is_over_is_told():
    """An exchange that is taken back two frames later has told nobody elsewhere."""
    here, there = Blob(0, 0.1, 0.1, followed=5), Blob(0, 0.9, 0.9, followed=6)
    frames = [([here], None), ([there], None), ([there], None), ([here], None)]
    assert told_x_m(Fuser(keeps=True, break_s=STEP_S), frames) == [{0: 0.1}, {}, {}, {0: 0.1}]


def test_a_fish_s_name_is_free_where_the_robot_is_seen_late():
    """Three were told as fish before the LEDs shone: two stay, and the third name is not lost."""
    fuser = Fuser(keeps=True)
    fuser.step(FOUR, robot(), 0.0)

    after = kinds(fuser.step(FOUR, robot(0.5, 0.5), 0.05))
    later = kinds(fuser.step([*FOUR, Blob(10, 0.3, 0.9)], robot(0.5, 0.5, time_s=1.0), 1.0))

    assert after == {0: FISH, 2: FISH, 3: ROBOT}
    assert later == {0: FISH, 1: FISH, 2: FISH, 3: ROBOT}


def test_exchanges_are_told_in_the_names_of_fish():
    """Of the tracker's ids; one with the robot's is none: its LEDs have told who it is."""
    fuser = Fuser(keeps=True)
    fuser.step(FOUR, robot(0.5, 0.5), 0.0)
    asked = [Exchange(one=one, other=other, since_s=0.5) for one, other in ((7, 9), (7, 8), (9, 8))]
    assert fuser.named(asked) == [Exchange(one=0, other=1, since_s=0.5)]


def test_everybody_is_known_with_those_who_are_not_told():
    """By name and by track, and the robot; so that a minute's tracks may tell them later."""
    fuser = Fuser(keeps=True, break_s=STEP_S)
    fuser.step([Blob(0, 0.1, 0.1, followed=5), FOUR[1]], robot(0.5, 0.5), 0.0)
    after = [Blob(0, 0.9, 0.9, followed=6), FOUR[1]]
    told = fuser.step(after, robot(0.5, 0.5, time_s=1 / 15), 1 / 15)
    assert [agent.kind for agent in told] == [ROBOT]
    assert [(a.track, a.pose.kind) for a in fuser.agents] == [(6, FISH), (8, ROBOT)]
