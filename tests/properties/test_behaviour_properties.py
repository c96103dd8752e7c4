"""What holds for all statistics and scores, whatever the fish do."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from zfcal.arena import Zone, make_arena
from zfcal.behaviour.ceilings import robot_ceiling
from zfcal.behaviour.histograms import bin_of, similarity
from zfcal.behaviour.legacy import compare_legacy, measure_legacy
from zfcal.behaviour.located import join, locate
from zfcal.behaviour.rows import statistics_from_rows, statistics_to_rows
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import measure, measure_robot
from zfcal.sampling import sample, sample_range
from zfcal.tracks import Samples, Tracks

COUNTS = ("distance", "wall", "occupation", "transition", "speed")
DT_S = 0.25

TANK = make_arena(
    name="tank",
    outline=shapely.box(0.0, 0.0, 0.5, 0.5),
    zones=(Zone(name="west", follows_walls=True, polygon=shapely.box(0.0, 0.0, 0.125, 0.5)),),
)
"""A square of 0.5 m with three zones: west, walls, centre."""


@st.composite
def coordinates(draw, shape, *, on_grid):
    """Coordinates on a grid, or half of them anywhere, a few of the odder numbers among them.

    All but these are one draw of bytes: a draw for each coordinate takes ten times as long.
    """
    n = math.prod(shape)
    codes = np.frombuffer(draw(st.binary(min_size=2 * n, max_size=2 * n)), np.uint16)
    # Sixty-fourths are exact numbers: distances between them have no rounding error.
    metres = (codes // 2 % 35 - 1.0) / 64
    if not on_grid:
        metres = np.where(codes % 2, -0.02 + 0.54 * (codes / 65535), metres)
        odd = draw(st.lists(st.floats(-0.02, 0.52), max_size=min(n, 6), unique=True))
        metres[: len(odd)] = odd
        metres = metres[np.random.default_rng(draw(st.integers(0, 2**32 - 1))).permutation(n)]
    return metres.reshape(shape)


@st.composite
def groups(draw, *, min_samples=1, on_grid=False):
    """Agents that are here, there, lost, a little outside or far outside."""
    n_samples = draw(st.integers(min_samples, 24))
    n_agents = draw(st.integers(0, 6))
    xy_m = draw(coordinates((n_samples, n_agents, 2), on_grid=on_grid))
    lost = draw(hnp.arrays(np.bool_, (n_samples, n_agents)))
    xy_m[lost] = np.nan
    kind = draw(hnp.arrays(np.int8, n_agents, elements=st.integers(0, 1)))
    return samples_of(xy_m, kind=kind)


def samples_of(xy_m, *, kind, agent=None, first_k=0):
    """Return samples of positions, NaN where an agent is missing."""
    return Samples(
        dt_s=DT_S,
        k=np.arange(first_k, first_k + len(xy_m), dtype=np.int64),
        agent=np.arange(xy_m.shape[1], dtype=np.int32) if agent is None else agent,
        kind=kind,
        xy_m=xy_m,
        confidence=np.ones(xy_m.shape[:2], dtype=np.float32),
    )


def same(a, b, *, but=()):
    """Whether all counts are equal."""
    names = [name for name in (*COUNTS, "n_void", "n_settled") if name not in but]
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


@given(a=groups(), b=groups())
def test_scores_are_symmetric_and_within_bounds(a, b):
    """Each is in [0, 1] or null, and the two sides may be exchanged."""
    p, q = measure(a, TANK), measure(b, TANK)

    there, back = compare(p, q), compare(q, p)

    assert there.values == pytest.approx(back.values, abs=0, nan_ok=True)
    known = [value for value in there.values if not np.isnan(value)]
    assert all(0.0 <= value <= 1.0 for value in known)
    features = [there.I_D, there.I_W, there.I_O, there.I_T]
    assert there.n_features == 4 - sum(np.isnan(features))
    assert np.isnan(there.S) == (there.n_features == 0)


@given(group=groups())
def test_a_group_is_like_itself_and_like_itself_twice(group):
    """1 in every feature that has a count, also when all counts are doubled."""
    once = measure(group, TANK)

    assert {value for value in compare(once, once).values if not np.isnan(value)} <= {1.0}
    twice = [value for value in compare(once, once + once).values if not np.isnan(value)]
    assert twice == pytest.approx([1.0] * len(twice), abs=1e-7)


@pytest.mark.slow
@given(group=groups(), seed=st.integers(0, 2**32 - 1))
def test_the_order_of_the_agents_does_not_matter(group, seed):
    """Agents exchange their columns, or their ids, or both."""
    order = np.random.default_rng(seed).permutation(len(group.agent))
    moved = samples_of(group.xy_m[:, order], kind=group.kind[order])
    renamed = samples_of(
        group.xy_m[:, order], kind=group.kind[order], agent=np.asarray(order * 7, dtype=np.int32)
    )

    for kind_of_count in (measure, measure_robot):
        whole = kind_of_count(group, TANK)
        assert same(whole, kind_of_count(moved, TANK))
        assert same(whole, kind_of_count(renamed, TANK))


@given(group=groups())
def test_exchanging_two_fish_at_one_instant_changes_only_their_steps(group):
    """D, W and O do not ask who is who."""
    swapped = group.xy_m.copy()
    swapped[-1] = swapped[-1, ::-1]

    a, b = measure(group, TANK), measure(samples_of(swapped, kind=group.kind), TANK)

    assert same(a, b, but=("transition", "speed"))


@given(group=groups(min_samples=2), data=st.data())
def test_two_parts_of_a_window_make_the_whole_but_for_the_steps_across_the_cut(group, data):
    """Pooled, D, W and O are the whole's; T and V lack the steps of those seen on both sides."""
    cut = data.draw(st.integers(1, len(group.k) - 1))
    located = locate(group, TANK)
    first, second = located.between(0, cut * DT_S), located.between(cut * DT_S, 1e6)

    whole, pooled = measure(located, TANK), measure(first, TANK) + measure(second, TANK)

    zone = TANK.zone_of(TANK.settle(group.xy_m)[0])
    across = np.zeros((3, 3), dtype=int)
    for start, end in zip(zone[cut - 1], zone[cut], strict=True):
        if start and end:
            across[start - 1, end - 1] += 1
    assert same(whole, pooled, but=("transition", "speed"))
    assert np.array_equal(whole.transition - pooled.transition, across)
    assert np.array_equal((whole.speed - pooled.speed).sum(axis=1), across.sum(axis=1))
    assert same(measure(join([first, second]), TANK), whole)


@given(group=groups(), first_k=st.integers(0, 10_000))
def test_what_happened_later_is_what_happened(group, first_k):
    """Moving a window in time changes nothing."""
    later = samples_of(group.xy_m, kind=group.kind, first_k=first_k)

    assert same(measure(group, TANK), measure(later, TANK))


@given(group=groups(on_grid=True))
def test_a_mirrored_tank_counts_the_same(group):
    """North and south are exchanged; the zones are symmetric under it."""
    mirrored = group.xy_m * [1, -1] + [0, 0.5]

    assert same(measure(group, TANK), measure(samples_of(mirrored, kind=group.kind), TANK))


@given(group=groups())
def test_fish_and_robots_share_what_everybody_does(group):
    """W, O, T and V of all are those of the fish and those of the robots."""
    located = locate(group, TANK)

    everybody = measure(located, TANK)
    fish, robot = measure(located.of_kind(0), TANK), measure_robot(located, TANK)

    assert same(everybody, fish + robot, but=("distance",))
    assert (everybody.distance >= (fish + robot).distance).all()


@given(group=groups())
def test_statistics_survive_their_table(group):
    """To rows and back, every count is as it was."""
    counts = measure(group, TANK)

    back = statistics_from_rows(statistics_to_rows(counts, window_end_s=120, case="robot"))

    assert same(counts, back[120, "robot"], but=("n_void", "n_settled"))


@given(group=groups())
def test_a_ceiling_stays_within_bounds(group):
    """At most one score per fish, each in [0, 1], or null where all are in the void."""
    scores = robot_ceiling(group, TANK)

    assert len(scores) <= int((group.kind == 0).sum())
    assert all(0.0 <= one.S <= 1.0 or one.n_features == 0 for one in scores)


@pytest.mark.slow
@given(a=groups(), b=groups())
def test_legacy_scores_are_symmetric_and_within_bounds(a, b):
    """Each is in [0, 1] or null."""
    p, q = measure_legacy(a, TANK), measure_legacy(b, TANK)

    there, back = compare_legacy(p, q), compare_legacy(q, p)

    assert there.values == pytest.approx(back.values, abs=0, nan_ok=True)
    assert all(0.0 <= value <= 1.0 for value in there.values if not np.isnan(value))


histograms = hnp.arrays(np.int64, 10, elements=st.integers(0, 1000))


@given(p=histograms, q=histograms, r=histograms)
def test_one_minus_similarity_is_a_metric(p, q, r):
    """Never longer by a detour, for histograms that have a count."""
    p[0] += 1
    q[0] += 1
    r[0] += 1
    detour = (1 - similarity(p, r)) + (1 - similarity(r, q))

    assert 1 - similarity(p, q) <= detour + 1e-12
    assert 0.0 <= similarity(p, q) <= 1.0


@given(
    values=hnp.arrays(np.float64, 5, elements=st.floats(0, 10, allow_nan=False)),
    low=st.floats(0, 1),
    width=st.floats(0.01, 5),
)
def test_greater_values_are_in_no_lower_bin(values, low, width):
    """Bins 0 to 9, ascending."""
    bins = bin_of(np.sort(values), (low, low + width))

    assert (np.diff(bins) >= 0).all()
    assert bins.min() >= 0
    assert bins.max() <= 9


@given(
    frames_a_step=st.integers(1, 5),
    fps=st.floats(3, 60),
    seconds=st.integers(1, 3000),
    more=st.integers(0, 120),
)
def test_samples_of_a_window_are_those_between_its_ends(frames_a_step, fps, seconds, more):
    """By definition: start <= k dt < end, to within a millionth of a step."""
    dt_s = frames_a_step / fps

    first, stop = sample_range(seconds, seconds + more, dt_s=dt_s)

    slack_s = 1.1e-6 * dt_s
    assert first * dt_s >= seconds - slack_s
    assert (first - 1) * dt_s < seconds
    assert (stop - 1) * dt_s < seconds + more
    assert stop * dt_s >= seconds + more - slack_s


@given(
    seen=hnp.arrays(np.bool_, (40, 3)),
    late=hnp.arrays(np.float64, 40, elements=st.floats(-0.49, 0.49)),
)
def test_no_frame_is_sampled_twice_and_none_from_afar(seen, late):
    """With a clock that trembles by up to half a frame, at one sample a frame."""
    frame, agent = (axis.astype(np.int64) for axis in np.nonzero(seen))
    time_s = np.sort((np.arange(40) + late) / 15)[frame]
    tracks = Tracks(
        time_s=time_s,
        frame=frame,
        agent=agent.astype(np.int32),
        kind=np.zeros(len(frame), dtype=np.int8),
        x_m=frame.astype(float),
        y_m=time_s,
        heading_rad=np.zeros(len(frame), dtype=np.float32),
        confidence=np.ones(len(frame), dtype=np.float32),
    )

    samples = sample(tracks, fps=15, dt_s=1 / 15, start_s=0, end_s=3)

    for column in range(len(samples.agent)):
        x = samples.xy_m[:, column, 0]
        taken = x[~np.isnan(x)]
        assert len(set(taken)) == len(taken)
    away_s = np.abs(samples.xy_m[..., 1] - (samples.k * samples.dt_s)[:, None])
    assert not (away_s > 0.5 / 15 + 1e-6).any()
