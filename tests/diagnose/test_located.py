"""Residuals of single steps, and where they are large."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.diagnose.battery import UNITS, heading_statistics, speed_statistics
from zfcal.diagnose.kernels import (
    BEARING,
    DISTANCE,
    POLARISATION,
    QUANTITIES,
    TURN,
    heading_moments,
    landing_chances,
    surroundings_of,
)
from zfcal.diagnose.located import Residuals, centre_and_spread, located, residuals
from zfcal.diagnose.standing import standing_of
from zfcal.diagnose.surroundings import probabilities
from zfcal.model.kernels.state import HX, HY, SPEED, STATES, ZONE, X, Y

CELLS = 64


def state_of(*agents):
    """Return a state, shape (1, STATES, agent), of agents (x, y, heading)."""
    state = np.zeros((1, STATES, len(agents)))
    for i, (x, y, heading) in enumerate(agents):
        state[0, [X, Y, HX, HY, SPEED, ZONE], i] = (
            x, y, math.cos(heading), math.sin(heading), 0.1, 3.0,
        )  # fmt: skip
    return state


def moments_of(probability, *, about, reach_m=0.02, heading=(1.0, 0.0), taken=(0.0, 1.0)):
    """Return waves and quantities of one step."""
    waves, quantities = np.empty((1, 4)), np.empty((1, QUANTITIES, 3))
    heading_moments(
        np.asarray(probability)[None], np.array([heading]), np.array([taken]), about,
        np.array([reach_m]), waves, quantities,
    )  # fmt: skip
    return waves[0], quantities[0]


def test_the_quantities_of_a_left_turn_by_hand():
    """A neighbour 5 cm to the left that swims along x; a step of 2 cm to the left leads to
    3 cm from it, which then is straight ahead, with headings at a right angle.
    """
    state = state_of((0.2, 0.7, 0.0), (0.2, 0.75, 0.0))
    about = surroundings_of(state, np.array([0]), np.array([0]), 0.1)
    uniform = np.full(CELLS, 1 / CELLS)

    waves, quantities = moments_of(uniform, about=about)

    assert quantities[TURN, 0] == pytest.approx(math.pi / 2)
    assert quantities[DISTANCE, 0] == pytest.approx(0.03)
    assert quantities[BEARING, 0] == pytest.approx(0.0, abs=1e-6)
    assert quantities[POLARISATION, 0] == pytest.approx(math.sqrt(2) / 2)
    assert waves == pytest.approx(np.zeros(4), abs=1e-12)
    # A uniform turn in cells: only the half turn has no opposite one.
    assert abs(quantities[TURN, 1]) == pytest.approx(math.pi / CELLS)
    assert quantities[TURN, 2] == pytest.approx(math.pi**2 / 3, rel=0.01)


def test_a_certain_heading_has_no_variance():
    """With all probability in the cell of the heading taken, mean is value and variance 0."""
    state = state_of((0.2, 0.7, 0.0), (0.2, 0.75, 0.0))
    about = surroundings_of(state, np.array([0]), np.array([0]), 0.1)
    certain = np.zeros(CELLS)
    certain[CELLS // 4] = 1.0

    _, quantities = moments_of(certain, about=about)

    assert quantities[:, 1] == pytest.approx(quantities[:, 0])
    assert quantities[:, 2] == pytest.approx(np.zeros(QUANTITIES), abs=1e-12)


def test_surroundings_leave_out_who_is_not_there():
    """The nearest other one is the nearest that is in the tank; the robot is found by kind."""
    state = state_of((0.2, 0.7, 0.0), (0.21, 0.7, 0.0), (0.2, 0.78, math.pi))
    state[0, ZONE, 1] = 0.0

    about = surroundings_of(state, np.array([0]), np.array([0]), 0.1)[0]

    assert about[:5] == pytest.approx([2, 0.08, 0.0, 1.0, 1.0])
    assert about[6:8] == pytest.approx([-1.0, 0.0])


def test_every_statistic_of_the_base_model_is_a_standard_normal_number(base):
    """Over ten minutes of the base model no sum of all steps is beyond 4 standard errors, and
    the variance of z over time blocks and zones is 1 to within a fifth.

    With about 900 parts the test notices a wrong variance of a fifth with probability 0.9.
    """
    scene, fitted = base

    table = residuals(standing_of(scene, fitted))

    assert np.abs(table.z).max() < 4.5
    blocks = table.block >= 0
    assert blocks.sum() > 400
    assert table.z[blocks].std() == pytest.approx(1.0, abs=0.1)


def locate(scene, fitted):
    """Return where a scene differs from a model, by the model's own spread."""
    return located(residuals(standing_of(scene, fitted)))


def test_nothing_is_located_where_the_model_is_right(base):
    """Ten minutes of the base model, fitted: no place is named."""
    assert locate(*base) == ()


def test_a_drift_is_located_as_a_heading_along_its_axis(base, worlds):
    """Headings drawn with weight exp(0.3 sin theta): along y they exceed what is expected.

    At 12,000 steps the drift is worth about 15 standard errors.
    """
    scene, fitted = base
    rng = np.random.default_rng(3)
    wrong = worlds.redrawn(scene, fitted, rng, lambda angle: np.exp(0.3 * np.sin(angle))[None])

    found = locate(wrong, fitted)

    assert found[0].statistic == "heading along y"
    assert found[0].z > 8
    assert found[0].observed > found[0].expected
    assert found[0].q < 1e-6


def test_a_wrong_half_is_located_in_time(base, worlds):
    """Turns to the left in the second half alone: what is named begins there."""
    scene, fitted = base
    late = scene.time_s(scene.turns) > 300
    heading = np.arctan2(scene.turns.heading[:, 1], scene.turns.heading[:, 0])

    def to_the_left(angle):
        return np.exp(0.5 * late[:, None] * np.sin(angle[None] - heading[:, None]))

    wrong = worlds.redrawn(scene, fitted, np.random.default_rng(4), to_the_left)

    found = locate(wrong, fitted)

    (turning,) = (each for each in found if each.statistic == "turning")
    assert turning.time_s == pytest.approx((300.0, 600.0), abs=61)
    assert turning.observed > turning.expected
    assert UNITS[turning.statistic] == "rad"


def test_slow_fish_are_located_by_their_ids(base):
    """One fish at 0.8 times its speed: its id is named, and it is slower than expected."""
    scene, fitted = base
    moves = scene.moves
    speed = np.where(moves.track == 3, 0.8 * moves.speed_m_s, moves.speed_m_s)
    wrong = dataclasses.replace(scene, moves=dataclasses.replace(moves, speed_m_s=speed))

    found = locate(wrong, fitted)

    assert (3,) in [each.agents for each in found if each.statistic == "speed"]
    slow = next(each for each in found if each.agents == (3,))
    assert slow.observed < slow.expected


def test_a_half_lit_tank_is_located_by_its_quarter(base):
    """Fish swim faster by 8 % in the upper left: that quarter's speed is named."""
    scene, fitted = base
    moves = scene.moves
    upper_left = scene.states[moves.at, Y, moves.who] > 0.5
    speed = moves.speed_m_s * np.where(upper_left, 1.08, 1.0)
    wrong = dataclasses.replace(scene, moves=dataclasses.replace(moves, speed_m_s=speed))

    names = [each.statistic for each in locate(wrong, fitted)]

    assert "speed in the upper left quarter" in names


def table_of(z, *, block=None, variance=None):
    """Return residuals of one statistic with given z, one part each."""
    z = np.asarray(z, dtype=float)
    n = len(z)
    variance = np.ones(n) if variance is None else np.asarray(variance, dtype=float)
    return Residuals(
        names=("turning",),
        zones=("corridor", "walls", "centre"),
        ids=(1, 2),
        statistic=np.zeros(n, dtype=np.int64),
        zone=np.full(n, -1),
        block=np.arange(n) if block is None else np.asarray(block),
        agent=np.full(n, -1),
        count=np.full(n, 100),
        observed=z * np.sqrt(variance),
        expected=np.zeros(n),
        variance=variance,
        edges_s=60.0 * np.arange(n + 1),
    )


def test_neighbouring_time_blocks_are_taken_together():
    """Residuals 6 and 8 of variance 1 and 1 sum to 14 of variance 2; the 0 between two runs
    keeps them apart.
    """
    found = located(table_of([6.0, 8.0, 0.0, 7.0]))

    assert [each.time_s for each in found] == [(0.0, 120.0), (180.0, 240.0)]
    assert found[0].z == pytest.approx(14 / math.sqrt(2))
    assert found[0].observed == pytest.approx(14 / 200)


def test_opposite_neighbours_are_kept_apart():
    """Blocks of 6 and -6 do not cancel each other."""
    found = located(table_of([6.0, -6.5]))

    assert [each.z for each in found] == pytest.approx([-6.5, 6.0])


def test_what_holds_a_clearer_part_is_not_named_again():
    """The whole recording at 5 and one block of it at 9: the block alone is named."""
    found = located(table_of([5.0, 9.0, 0.1], block=[-1, 1, 2]))

    assert [each.time_s for each in found] == [(60.0, 120.0)]


def test_the_share_of_false_discoveries_by_hand():
    """Of p = 0.001, 0.02, 0.5 (z = 3.2905, 2.3263, 0.6745) the first two stay at q <= 0.05:
    3 * 0.001 and 3 * 0.02 / 2.
    """
    found = located(table_of([3.290527, 0.6744898, 2.326348]))

    assert [each.q for each in found] == pytest.approx([0.003, 0.03], rel=1e-4)


def test_centre_and_spread_of_the_null_are_taken_off():
    """What noise makes of a statistic in every replicate is no disagreement."""
    rng = np.random.default_rng(5)
    nulls = [table_of(rng.normal(6.0, 2.0, 4)) for _ in range(39)]
    table = table_of([6.0, 7.0, 5.0, 20.0])

    centre, spread = centre_and_spread(table, nulls)

    assert centre == pytest.approx(np.full(4, 6.0), abs=0.7)
    assert spread == pytest.approx(np.full(4, 1.95), abs=0.35)
    assert [each.time_s for each in located(table, centre, spread)] == [(180.0, 240.0)]


def test_a_part_that_no_replicate_has_keeps_the_models_own_law():
    """Without replicates centre is 0 and spread 1."""
    centre, spread = centre_and_spread(table_of([1.0, 2.0]), [])

    assert centre.tolist() == [0.0, 0.0]
    assert spread.tolist() == [1.0, 1.0]


def test_an_empty_table_names_nothing():
    """No parts, no places."""
    assert located(table_of([])) == ()


def test_a_mirrored_tank_has_the_same_sizes_and_opposite_turns(worlds):
    """Mirroring positions turns the sign of turning and leaves turn size as it is."""
    xy = worlds.base_walk(21, minutes=2)
    one, model = worlds.fitted_scene(xy)
    # The diagonal from lower left to upper right mirrors the two rooms onto each other.
    other, mirrored = worlds.fitted_scene(np.ascontiguousarray(xy[..., ::-1]))
    seen = {s.statistic: s for s in heading_statistics(standing_of(one, model))}
    back = {s.statistic: s for s in heading_statistics(standing_of(other, mirrored))}

    for name, sign in (("turning", -1), ("turn size", 1), ("persistence", 1)):
        assert back[name].observed.sum() == pytest.approx(sign * seen[name].observed.sum())
        assert back[name].expected.sum() == pytest.approx(
            sign * seen[name].expected.sum(), abs=0.02 * len(one.turns)
        )


def test_speeds_are_expected_as_their_zone_has_them(base):
    """The residuals of speed sum to zero in every zone, whatever the speeds."""
    scene, fitted = base
    speed = next(s for s in speed_statistics(standing_of(scene, fitted)) if s.statistic == "speed")

    left = np.bincount(scene.moves.zone, speed.observed - speed.expected)

    assert left == pytest.approx(np.zeros(4), abs=1e-9)


def test_landing_chances_are_those_of_the_written_out_sum(base):
    """Of each cell its parts by zone, weighted by preferences and made to sum to one."""
    scene, fitted = base
    turns, probability = scene.turns, probabilities(fitted)
    weight = np.exp(np.random.default_rng(4).normal(size=(len(turns), turns.share.shape[2])))

    found = landing_chances(probability, turns.share, weight)

    parts = turns.share * weight[:, None, :]
    parts /= np.maximum(parts.sum(axis=2, keepdims=True), 1e-300)
    np.testing.assert_allclose(found, np.einsum("sg,sgz->sz", probability, parts), atol=1e-12)


@pytest.mark.parametrize(("timed", "owned"), [(True, False), (False, True)])
def test_parts_of_a_statistic_add_up_to_the_whole_recording(base, timed, owned):
    """Over blocks of time, and over agents, where no part is too small."""
    table = residuals(standing_of(*base))
    whole = table.keys.index(("turning", -1, False, False))
    rows = [key == ("turning", -1, timed, owned) for key in table.keys]

    for of in (table.count, table.observed, table.expected, table.variance):
        assert of[rows].sum() == pytest.approx(of[whole])
