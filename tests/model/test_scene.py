"""Measured tracks as states and steps: headings, gaps, ids, rooms, robots."""

import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.kernels.scene import perceive
from zfcal.model.kernels.state import (
    HX,
    HY,
    KIND,
    LATELY,
    LEFT_S,
    NEVER_S,
    PAST_HX,
    PAST_HY,
    ROOM,
    SPEED,
    TIME,
    WALL,
    ZONE,
    X,
    Y,
)
from zfcal.model.scene import cos_of, make_scene, thin
from zfcal.model.simulate import simulate_tracks
from zfcal.tracks import FISH, ROBOT, Samples

DT_S = 0.2
ROOM_A, ROOM_B, CORRIDOR, VOID = (0.22, 0.77), (0.75, 0.25), (0.50, 0.50), (0.75, 0.75)
AWAY = (math.nan, math.nan)


def samples_of(*paths, kind=None, ids=None, confidence=None, first=0):
    """Return samples of paths, each a list of (x, y) in metres."""
    xy_m = np.array(paths, dtype=np.float64).swapaxes(0, 1)
    n, agents = xy_m.shape[:2]
    sure = np.ones((n, agents)) if confidence is None else np.array(confidence).T
    return Samples(
        dt_s=DT_S,
        k=np.arange(first, first + n, dtype=np.int64),
        agent=np.array(range(1, agents + 1) if ids is None else ids, dtype=np.int32),
        kind=np.array([FISH] * agents if kind is None else kind, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.where(np.isnan(xy_m[..., 0]), np.nan, sure).astype(np.float32),
    )


def line(start, n, *, step_m=0.01):
    """Return n places, each a step further along x."""
    return [(start[0] + step_m * k, start[1]) for k in range(n)]


@pytest.fixture(scope="module")
def walk(two_rooms, model):
    """Return four minutes of five fish of the base model, as samples."""
    xy_m, _ = simulate_tracks(model, two_rooms, n_agents=5, n_steps=1200, seed=3)
    return samples_of(*xy_m.swapaxes(0, 1))


def test_headings_and_speeds_by_hand(two_rooms):
    """10 mm along x, then 20 mm along y, then 10 mm back: 0.05, 0.10 and 0.05 m/s."""
    path = [(0.20, 0.75), (0.21, 0.75), (0.21, 0.77), (0.20, 0.77)]
    scene = make_scene(samples_of(path, first=50), two_rooms)

    assert scene.states[:, [HX, HY], 0] == pytest.approx(
        np.array([(0, 0), (1, 0), (0, 1), (-1, 0)])
    )
    assert scene.states[3, [PAST_HX, PAST_HY], 0] == pytest.approx([0, 1])
    assert scene.states[1:, SPEED, 0] == pytest.approx([0.05, 0.10, 0.05])
    assert scene.states[:, TIME, 0] == pytest.approx([10.0, 10.2, 10.4, 10.6])
    assert scene.turns.at.tolist() == [1, 2]
    assert scene.turns.heading == pytest.approx(np.array([(1, 0), (0, 1)]))
    assert scene.turns.taken == pytest.approx(np.array([(0, 1), (-1, 0)]))
    assert scene.turns.speed_m_s == pytest.approx([0.10, 0.05])
    assert scene.time_s(scene.turns) == pytest.approx([10.2, 10.4])
    assert (scene.n_fish, scene.n_robots) == (1, 0)


def test_a_displacement_below_two_millimetres_has_no_heading(two_rooms):
    """The fish keeps its last heading; the step counts among moves, and not among turns."""
    path = [(0.20, 0.75), (0.21, 0.75), (0.21, 0.7519), (0.21, 0.7619), (0.21, 0.7719)]
    scene = make_scene(samples_of(path), two_rooms)

    assert scene.states[2, [HX, HY], 0] == pytest.approx([1, 0])
    assert scene.moves.at.tolist() == [1, 2, 3]
    assert scene.moves.speed_m_s[0] == pytest.approx(0.0019 / DT_S)
    assert scene.turns.at.tolist() == [3]


def test_exactly_two_millimetres_have_a_heading(two_rooms):
    """The limit itself counts, whatever the rounding."""
    scene = make_scene(samples_of(line((0.2, 0.75), 6, step_m=0.002)), two_rooms)
    assert scene.turns.at.tolist() == [1, 2, 3, 4]


def test_nothing_moves_across_a_missing_sample(two_rooms):
    """Sample 3 is missing: no speed at 3 and 4, and steps from 1 and from 5 alone."""
    path = line((0.2, 0.75), 8)
    path[3] = AWAY
    scene = make_scene(samples_of(path), two_rooms)

    assert scene.moves.at.tolist() == [1, 5, 6]
    assert scene.turns.at.tolist() == [1, 5, 6]
    assert scene.states[3, ZONE, 0] == 0
    assert scene.states[4, [HX, HY], 0] == pytest.approx([0, 0])
    assert scene.tracks[:, 0].tolist() == [1, 1, 1, -1, 1, 1, 1, 1]


def test_an_unknown_speed_is_a_middling_one(two_rooms):
    """So that nobody attends to a fish more or less for having been lost."""
    scene = make_scene(
        samples_of(line((0.2, 0.75), 5), line((0.2, 0.7), 5, step_m=0.02)), two_rooms
    )
    assert scene.states[0, SPEED] == pytest.approx([0.075, 0.075])


def test_fragments_that_do_not_overlap_share_a_column(two_rooms):
    """Ids 1 and 2 are one fish that was lost at sample 4; no step leads across."""
    path = line((0.2, 0.75), 9)
    one, two = path[:4] + [AWAY] * 5, [AWAY] * 5 + path[5:]
    scene = make_scene(samples_of(one, two), two_rooms)

    assert scene.tracks[:, 0].tolist() == [1, 1, 1, 1, -1, 2, 2, 2, 2]
    assert scene.states.shape[2] == 1
    assert scene.turns.at.tolist() == [1, 2, 6, 7]
    assert scene.turns.track.tolist() == [1, 1, 2, 2]
    assert scene.n_fish == 1


def test_a_change_of_id_without_a_gap_is_no_displacement(two_rooms):
    """Id 2 begins in the sample after id 1 has ended: it may be another fish."""
    path = line((0.2, 0.75), 8)
    one, two = path[:4] + [AWAY] * 4, [AWAY] * 4 + path[4:]
    scene = make_scene(samples_of(one, two), two_rooms)

    assert scene.states.shape[2] == 2
    assert scene.turns.at.tolist() == [1, 2, 5, 6]
    assert scene.states[4, [HX, HY], 1] == pytest.approx([0, 0])


def test_many_short_tracks_need_few_columns_and_lose_no_step(two_rooms, walk):
    """Cut into pieces of 10 s with gaps, five fish fill six columns at most, each step kept."""
    xy = walk.xy_m.copy()
    pieces, ids = [], []
    for fish in range(5):
        for number, first in enumerate(range(0, 1200, 50)):
            piece = np.full((1200, 2), np.nan)
            piece[first : first + 49] = xy[first : first + 49, fish]
            pieces.append(piece)
            ids.append(1000 * fish + number)
    order = np.argsort(ids)
    cut = samples_of(*np.array(pieces)[order], ids=np.array(ids)[order])
    scene, whole = make_scene(cut, two_rooms), make_scene(walk, two_rooms)

    assert scene.states.shape[2] <= 6
    assert scene.n_fish == 5
    # Of each piece the 49 samples have 47 steps with a speed before.
    assert len(scene.moves) == 5 * 24 * 47
    own = {(k, t // 1000) for k, t in zip(scene.turns.at, scene.turns.track, strict=True)}
    all_ = {(k, t - 1) for k, t in zip(whole.turns.at, whole.turns.track, strict=True)}
    assert own <= all_
    assert len(own) == len(scene.turns)


def test_no_step_begins_or_ends_in_a_guess(two_rooms):
    """Confidence 0.49 is one; 0.5 is not."""
    path = line((0.2, 0.75), 8)
    low, enough = [1, 1, 1, 0.49, 1, 1, 1, 1], [1, 1, 1, 0.5, 1, 1, 1, 1]
    assert make_scene(samples_of(path, confidence=[low]), two_rooms).turns.at.tolist() == [1, 5, 6]
    assert len(make_scene(samples_of(path, confidence=[enough]), two_rooms).turns) == 6
    for confidence, at in ((low, [1, 5, 6]), (enough, [1, 2, 3, 4, 5, 6])):
        samples = samples_of(path, confidence=[confidence])
        assert make_scene(samples, two_rooms).moves.at.tolist() == at


def test_a_guess_is_seen_by_the_others(two_rooms):
    """The second fish is a guess at sample 3: the first sees it then as at other times."""
    paths = line((0.2, 0.75), 8), line((0.25, 0.75), 8)
    guess = [[1] * 8, [1, 1, 1, 0.2, 1, 1, 1, 1]]
    scene = make_scene(samples_of(*paths, confidence=guess), two_rooms)

    assert (scene.states[:, ZONE, 1] > 0).all()
    assert scene.tracks[:, 1].tolist() == [2] * 8
    assert scene.turns.at[scene.turns.who == 1].tolist() == [1, 5, 6]
    first = scene.turns.take(scene.turns.who == 0)
    assert first.at.tolist() == [1, 2, 3, 4, 5, 6]
    _, angle = perceive(scene.states, first.at, first.who, 0.0, cos_of(2.0), False)
    assert (angle[:, 1] > 0).all()
    assert scene.n_fish == 2


def test_a_position_outside_is_not_there_and_one_at_the_wall_is(two_rooms):
    """Far outside is void; 6 mm beyond the wall counts as at the wall."""
    far, near = line((0.2, 0.75), 8), line((0.2, 0.75), 8)
    far[3], near[3] = VOID, (0.045, 0.75)
    scene = make_scene(samples_of(far), two_rooms)
    assert scene.states[3, ZONE, 0] == 0
    assert scene.moves.at.tolist() == [1, 5, 6]

    scene = make_scene(samples_of(near), two_rooms)
    assert scene.states[3, ZONE, 0] > 0
    assert scene.states[3, [X, Y], 0] == pytest.approx([0.051, 0.75], abs=1e-6)
    assert scene.states[3, WALL, 0] == pytest.approx(0.0, abs=1e-5)
    assert len(scene.moves) == 6


def test_a_departure_is_known_to_those_left_behind(two_rooms):
    """Who leaves the room at sample 2 left 0, 0.2, 0.4 s ago, until it is back at sample 5."""
    stays = [ROOM_A] * 7
    goes = [ROOM_A, ROOM_A, CORRIDOR, CORRIDOR, CORRIDOR, ROOM_A, ROOM_A]
    elsewhere = [ROOM_B] * 7
    scene = make_scene(samples_of(stays, goes, elsewhere), two_rooms)

    rooms = scene.states[:, ROOM]
    assert rooms[0, 0] == rooms[0, 1] != rooms[0, 2]
    assert rooms[2, 1] == 0
    assert scene.states[2:5, LEFT_S, 0] == pytest.approx([0.0, 0.2, 0.4])
    assert (scene.states[[0, 1, 5, 6], LEFT_S, 0] == NEVER_S).all()
    assert (scene.states[:, LEFT_S, 2] == NEVER_S).all()
    assert (scene.states[:, LEFT_S, 1] == NEVER_S).all()


def test_who_is_lost_has_not_left(two_rooms):
    """A fish that vanishes in a room and is found in the other one leaves no trace."""
    stays, lost = [ROOM_A] * 5, [ROOM_A, ROOM_A, AWAY, ROOM_B, ROOM_B]
    scene = make_scene(samples_of(stays, lost), two_rooms)
    assert (scene.states[:, LEFT_S, 0] == NEVER_S).all()


def test_robots_are_seen_and_make_no_steps(two_rooms):
    """A robot in front of a fish takes up room in its sight; it has a state and no step."""
    fish, robot = line((0.2, 0.75), 6), line((0.3, 0.75), 6)
    scene = make_scene(samples_of(fish, robot, kind=[FISH, ROBOT]), two_rooms)

    assert set(scene.turns.track) == set(scene.moves.track) == {1}
    assert (scene.n_fish, scene.n_robots) == (1, 1)
    (column,) = np.flatnonzero(scene.states[0, KIND] == ROBOT)
    toward, angle = perceive(scene.states, scene.turns.at, scene.turns.who, 0.0, cos_of(4.0), False)
    assert (angle[:, column] > 0).all()
    assert toward[:, column] == pytest.approx(np.array([[1.0, 0.0]] * 4))


def test_a_robots_column_is_no_fishs(two_rooms):
    """A fish that appears after a robot has gone has a column of its own."""
    gone = line((0.3, 0.75), 3) + [AWAY] * 5
    late = [AWAY] * 4 + line((0.2, 0.75), 4)
    scene = make_scene(samples_of(gone, late, kind=[ROBOT, FISH]), two_rooms)
    assert scene.states.shape[2] == 2
    assert set(scene.moves.track) == {2}


def test_the_turns_are_those_of_plain_arithmetic(two_rooms, walk):
    """Two displacements of 2 mm or more: their directions, the speed, and the zones at the ends."""
    turns, xy = make_scene(walk, two_rooms).turns, walk.xy_m
    moved = np.diff(xy, axis=0)
    length = np.hypot(moved[..., 0], moved[..., 1])
    at, who = np.nonzero((length[:-1] >= 0.002) & (length[1:] >= 0.002))

    assert turns.at.tolist() == (at + 1).tolist()
    assert turns.track.tolist() == (who + 1).tolist()
    assert turns.zone.tolist() == two_rooms.zone_of(xy[at + 1, who]).tolist()
    assert turns.landing.tolist() == two_rooms.zone_of(xy[at + 2, who]).tolist()
    assert turns.speed_m_s == pytest.approx(length[at + 1, who] / DT_S)
    for steps, unit in ((at, turns.heading), (at + 1, turns.taken)):
        assert unit == pytest.approx(moved[steps, who] / length[steps, who][:, None], abs=1e-9)


@pytest.mark.parametrize("lag", [2.0, 1.0, 0.5, 1.25])
def test_who_responds_late_sees_where_others_were(two_rooms, lag):
    """A neighbour that swims 1 cm a step is so far behind where it is now."""
    still, moves = [(0.2, 0.75)] * 6, line((0.25, 0.80), 6)
    scene = make_scene(samples_of(still, moves), two_rooms)
    at, who = np.array([4]), np.array([0])
    now, _ = perceive(scene.states, at, who, 0.0, -2.0, False)
    late, _ = perceive(scene.states, at, who, lag, -2.0, False)
    # What is seen is the neighbour's head, as far ahead of its centre in both.
    ahead = [0.05 * toward[0, 1, 0] / toward[0, 1, 1] for toward in (now, late)]
    assert ahead[0] - ahead[1] == pytest.approx(0.01 * lag)


@pytest.mark.parametrize("lag", [2.0, 0.5])
def test_what_was_seen_then_is_seen_from_where_the_fish_was(two_rooms, lag):
    """Two that swim side by side at 1 cm a step see each other straight aside, then as now."""
    one, other = line((0.20, 0.75), 6), line((0.20, 0.80), 6)
    scene = make_scene(samples_of(one, other), two_rooms)
    at, who = np.array([4]), np.array([0])
    now, now_sr = perceive(scene.states, at, who, 0.0, -2.0, False)
    then, then_sr = perceive(scene.states, at, who, lag, -2.0, True)
    from_here, _ = perceive(scene.states, at, who, lag, -2.0, False)
    np.testing.assert_allclose(then, now, atol=1e-9)
    np.testing.assert_allclose(then_sr, now_sr, atol=1e-9)
    assert not np.allclose(from_here, now, atol=1e-3)


def test_between_two_steps_a_fish_looks_half_way(two_rooms):
    """It turned by 120 degrees: half way it heads for 60, and 70 aside lies in a field of 75.5."""
    turned, half = math.radians(120), math.radians(60)
    own = line((0.18, 0.75), 5)
    own += [(own[-1][0] + 0.01 * math.cos(turned), own[-1][1] + 0.01 * math.sin(turned))]
    middle = np.mean([own[-2], own[-1]], axis=0)
    aside = half + math.radians(70)
    other = [tuple(middle + 0.08 * np.array([math.cos(aside), math.sin(aside)]))] * 6
    scene = make_scene(samples_of(own, other), two_rooms)
    at, who = np.array([5]), np.array([0])
    seen = [
        perceive(scene.states, at, who, 0.5, field, True)[1][0, 1] > 0
        for field in (math.cos(math.radians(60)), 0.25)
    ]
    assert seen == [False, True]


def test_the_order_of_tracks_does_not_matter(two_rooms, walk):
    """With ids dealt anew the same steps come out."""
    other = walk.take_agents(np.array([3, 1, 4, 0, 2]))
    one, two = make_scene(walk, two_rooms).turns, make_scene(other, two_rooms).turns
    order = [np.lexsort((turns.track, turns.at)) for turns in (one, two)]
    assert np.array_equal(one.track[order[0]], two.track[order[1]])
    assert np.array_equal(one.taken[order[0]], two.taken[order[1]])
    assert np.array_equal(one.share[order[0]], two.share[order[1]])


def test_the_mean_of_speeds_fades_and_begins_anew_after_a_gap(two_rooms):
    """Of each sample e^(-dt / 2 s) of it is kept; the first known speed is all of it."""
    far = np.cumsum([0, 0.01, 0.02, 0.005, 0.0, 0.01])
    path = [(ROOM_A[0] - 0.05 + x, ROOM_A[1]) for x in far]
    scene = make_scene(samples_of([*path[:4], AWAY, *path[4:]]), two_rooms)
    kept, mean = math.exp(-DT_S / 2), 0.01 / DT_S
    found = scene.states[:, LATELY, 0]
    assert found[0] == 0.0
    assert found[1] == pytest.approx(mean)
    for k, step_m in ((2, 0.02), (3, 0.005)):
        mean = kept * mean + (1 - kept) * step_m / DT_S
        assert found[k] == pytest.approx(mean)
    assert found[5] == 0.0
    assert found[6] == pytest.approx(0.01 / DT_S)


def test_thinning_leaves_states_alone(two_rooms, walk):
    """Half of the steps, all of the states."""
    scene = make_scene(walk, two_rooms)
    less = thin(scene, scene.turns.at % 2 == 0, scene.moves.at < 100)
    assert len(less.turns) == (scene.turns.at % 2 == 0).sum()
    assert less.moves.at.max() == 99
    assert np.array_equal(less.states, scene.states)
    assert less.duration_s == scene.duration_s == pytest.approx(240.0)


def test_all_is_seen_with_a_field_of_view_of_half_a_turn():
    """To each side, in radians; a right angle has the cosine zero."""
    assert cos_of(math.pi) < -1
    assert cos_of(math.pi / 2) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    "samples",
    [
        samples_of(line((0.2, 0.75), 9), kind=[ROBOT]),
        samples_of(line((0.2, 0.75), 2)),
    ],
    ids=["robots alone", "two samples"],
)
def test_without_fish_at_three_samples_there_is_no_scene(two_rooms, samples):
    """The message says how many there are."""
    with pytest.raises(InputError, match=f"got {len(samples.k)} samples of"):
        make_scene(samples, two_rooms)


def test_a_recording_in_which_all_are_lost_has_no_steps(two_rooms):
    """Fish that were never seen make a scene without columns."""
    scene = make_scene(samples_of([AWAY] * 9, [AWAY] * 9), two_rooms)
    assert len(scene.turns) == len(scene.moves) == scene.n_fish == 0


def test_a_jump_that_no_heading_explains_is_no_turn(two_rooms):
    """From one corner of the tank into the opposite one: all cells of headings miss it."""
    path = [(0.064, 0.936), (0.058, 0.942), (0.942, 0.058), (0.936, 0.064), (0.930, 0.070)]
    scene = make_scene(samples_of(path), two_rooms)
    assert scene.moves.at.tolist() == [1, 2, 3]
    assert 1 not in scene.turns.at
    assert scene.turns.share.any(axis=(1, 2)).all()
