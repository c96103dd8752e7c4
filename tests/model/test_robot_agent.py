"""One agent among others that are measured."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from zfcal.artifacts.arenas import load_arena
from zfcal.model.kernels.curves import BY_NEAREST
from zfcal.model.onestep import draw_headings
from zfcal.model.packing import pack
from zfcal.model.robot_agent import Among
from zfcal.parameters import Parameters, natural

ARENA = load_arena("two-rooms", Path())
MODEL = natural(tuple((zone.name, zone.follows_walls) for zone in ARENA.zones), dt_s=0.2)
OTHERS = np.array([[0.25, 0.75, 0.3], [0.20, 0.80, -1.0], [0.30, 0.72, 2.0], [0.75, 0.3, 0.0]])
OWN = (0.22, 0.74, 0.5)
NOWHERE = np.full(3, np.nan)


def among(others=OTHERS, own=OWN):
    """Return an agent among others."""
    made = Among(ARENA, np.zeros(len(others)), dt_s=0.2)
    made.measure(0.0, others)
    made.place(*own)
    return made


def with_effects(**effects):
    """Return the model, extended."""
    return Parameters(dt_s=0.2, zones=MODEL.zones, effects=effects)


def headings(made, parameters, n):
    """Return n draws of the next step's heading, of those that move."""
    packed = pack([parameters], ARENA)
    moves = [made.step(packed, seed) for seed in range(n)]
    return np.array([move.heading_rad for move in moves if move.speed_m_s > 0])


def test_it_draws_from_the_law_of_the_simulator():
    """Headings in a crowd in the room's centre, against the one-step sampler.

    Two-sample Kolmogorov and Smirnov with 3000 and 20 000 draws: it notices a distance of
    0.04 between the laws at p = 0.001.
    """
    xy = np.vstack([OTHERS[:, :2], OWN[:2]])
    heading = np.append(OTHERS[:, 2], OWN[2])
    wanted = draw_headings(
        MODEL, ARENA, xy_m=xy, heading_rad=heading, speed_m_s=0.05, n=20_000, seed=3, agent=4
    )
    found = headings(among(), MODEL, 3000)
    assert stats.ks_2samp(found, wanted).pvalue > 0.001


def test_a_lost_fish_is_absent():
    """Rows of NaN change nothing: the same steps as without those fish."""
    packed = pack([MODEL], ARENA)
    more = among(np.vstack([OTHERS[:2], NOWHERE, NOWHERE]))
    less = among(OTHERS[:2])
    assert [more.step(packed, s) for s in range(200)] == [less.step(packed, s) for s in range(200)]
    lost = among()
    lost.measure(0.2, np.vstack([OTHERS[:2], NOWHERE, NOWHERE]))
    assert [lost.step(packed, s) for s in range(200)] == [less.step(packed, s) for s in range(200)]


def test_the_same_seed_draws_the_same_step_and_moves_nobody():
    """Asked ten times in whatever order."""
    packed = pack([MODEL], ARENA)
    made = among()
    first = made.step(packed, 7)
    made.step(packed, 8)
    assert made.step(packed, 7) == first
    reach = math.hypot(first.x_m - OWN[0], first.y_m - OWN[1])
    assert reach == pytest.approx(first.speed_m_s * 0.2)
    assert first.heading_rad == pytest.approx(math.atan2(first.y_m - OWN[1], first.x_m - OWN[0]))


def test_it_is_nowhere_until_it_is_placed():
    """And outside the tank; a little outside counts as at the wall."""
    packed = pack([MODEL], ARENA)
    made = Among(ARENA, np.zeros(4), dt_s=0.2)
    made.measure(0.0, OTHERS)
    assert made.step(packed, 0) is None
    made.place(0.9, 0.9, 0.0)
    assert made.step(packed, 0) is None
    made.place(0.045, 0.75, 0.0)
    assert made.step(packed, 0) is not None


def test_effects_take_part():
    """With alignment the agent turns to where its neighbours are headed; without not."""
    others = OTHERS.copy()
    others[:, 2] = 2.5
    plain = headings(among(others), MODEL, 1500)
    aligned = headings(among(others), with_effects(alignment={"weight": 50.0, "kappa": 12.0}), 1500)
    near = [np.mean(np.cos(found - 2.5)) for found in (plain, aligned)]
    assert near[1] > near[0] + 0.2


def test_curves_take_part():
    """A robot among others that are near turns as one with the strength of its curve there."""
    knots = {"knot_1": 1.0, "knot_2": 2.0, "knot_3": 3.0}
    bent = {"weight": 0.0, "more_1": 50.0, "more_3": 0.0, "by": float(BY_NEAREST)} | knots
    others = OTHERS.copy()
    others[:, 2] = 2.5
    plain, flat, near = (
        headings(among(others), with_effects(alignment={"kappa": 12.0} | values), 300)
        for values in ({"weight": 50.0}, bent | {"more_1": 0.0}, bent)
    )
    np.testing.assert_array_equal(near, plain)
    assert np.mean(np.cos(near - 2.5)) > np.mean(np.cos(flat - 2.5)) + 0.2


def test_a_model_without_turns_forgets_those_of_the_one_before():
    """A model that leans against all that it draws, so that rare draws are of a grid."""
    back = OWN[2] + math.pi
    lean = with_effects(**{"directional-drift": {"strength": 4.0, "direction_rad": back}})
    turn = with_effects(
        **{"directional-drift": {"strength": 4.0, "direction_rad": 2.0, "turning": 1.0}}
    )
    packed, other = pack([lean], ARENA), pack([turn], ARENA)
    fresh, used = among(), among()
    for seed in range(600):
        used.step(other, seed)
        assert used.step(packed, seed) == fresh.step(packed, seed)


def test_a_response_that_lags_sees_where_the_others_were():
    """Fish that jump across the agent are approached where they were some steps ago."""
    model = with_effects(**{"reaction-delay": {}})
    before, after = OTHERS[:1].copy(), OTHERS[:1].copy()
    before[0, :2], after[0, :2] = (0.30, 0.74), (0.14, 0.74)
    packed = pack([model], ARENA)
    assert packed.lags[0] > 0
    shares = []
    for path in ([before] * 3 + [after], [after] * 4):
        turned = []
        for seed in range(400):
            made = Among(ARENA, np.zeros(1), dt_s=0.2)
            for k, others in enumerate(path):
                made.measure(0.2 * k, others)
                made.place(*OWN[:2], 1.57)
                move = made.step(packed, seed)
            turned.append(math.cos(move.heading_rad))
        shares.append(np.mean(turned))
    assert shares[0] > shares[1] + 0.1


@pytest.mark.parametrize("near", [0.0, 1.0])
@pytest.mark.parametrize("whole", [0.0, 1.0])
@pytest.mark.parametrize(("delay_s", "share"), [(0.2, 0.9), (0.1, 1.0), (0.3, 0.5)])
def test_a_fish_that_comes_back_is_seen_where_it_is(delay_s, share, whole, near):
    """Where it was nobody knows: every draw of the next step has a heading all the same."""
    effect = {"delay_s": delay_s, "share": share, "whole": whole, "near": near}
    packed = pack([with_effects(**{"reaction-delay": effect})], ARENA)
    for seed in range(40):
        made = Among(ARENA, np.zeros(1), dt_s=0.2)
        for k, others in enumerate((NOWHERE[None], OTHERS[:1])):
            made.measure(0.2 * k, others)
            made.place(*OWN)
            move = made.step(packed, seed)
        assert math.isfinite(move.heading_rad)


def test_unknown_headings_are_no_obstacle():
    """Fish that never moved, and an agent that never did: a step all the same, inside."""
    others = OTHERS.copy()
    others[:, 2] = np.nan
    made = among(others, (*OWN[:2], math.nan))
    packed = pack([MODEL], ARENA)
    ends = [made.step(packed, seed) for seed in range(100)]
    assert (ARENA.zone_of([(move.x_m, move.y_m) for move in ends]) > 0).all()
