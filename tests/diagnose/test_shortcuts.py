"""What is worked out from few points is what all points give."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.model.effects import all_effects, find_effect, generic_effects
from zfcal.model.extended import with_effect
from zfcal.model.kernels.geometry import zone_of
from zfcal.model.kernels.scores import factor_score, mixture_score
from zfcal.model.kernels.state import TRAIT, X, Y
from zfcal.model.packing import pack
from zfcal.model.scene import thin
from zfcal.model.simulate import tank_of
from zfcal.model.views import factors_of, harmonics, polynomial_of, smooth_factors_of, view_of

SMOOTH = [e for e in (*all_effects(), *generic_effects()) if e.harmonics is not None]


@pytest.fixture(scope="module")
def few(screen):
    """Return a screen of fish and a robot, and some of its turns."""
    own = screen(41, minutes=3.0, n_fish=3, n_robots=1)
    rows = np.arange(len(own.scene.turns)) % 8 == 0
    own.scene.states[:, TRAIT] = 1.0
    return own, thin(own.scene, rows, np.zeros(len(own.scene.moves), dtype=bool))


def packed_with(own, effect, arena, **given):
    """Return an effect as a model has it, each of its parameters well away from zero."""
    middling = {p.name: p.default or min(0.7, p.high) for p in effect.parameters}
    here = own.scene.states[own.scene.turns.at[0], :, own.scene.turns.who[0]]
    # Leaning, where some headings may be drawn or turned instead: that is no factor.
    place = {"x_m": here[X] + 0.05, "y_m": here[Y], "drawn": 0.0}
    place |= {"turning": 0.0} if effect.name in {"turning-memory", "turning-bias"} else {}
    place |= {"into_zone": 0.0, "sizes": 0.0, "last": 0.0, effect.not_harmonic: 0.0}
    middling |= {name: at for name, at in place.items() if name in middling} | given
    model = with_effect(own.fitted.parameters, effect.name, middling)
    return pack([model], arena)


@pytest.mark.parametrize(
    ("effect", "given"),
    [
        *(pytest.param(effect, {}, id=effect.name) for effect in SMOOTH),
        pytest.param(find_effect("turning-memory"), {"sizes": 1.0}, id="sizes"),
        pytest.param(find_effect("speed-turn-coupling"), {"last": 1.0}, id="last"),
    ],
)
def test_harmonics_give_the_factor_at_every_heading_that_lands(effect, given, few, tank):
    """An effect that says it is a polynomial of some degree is one, up to a common factor."""
    own, scene = few
    packed = packed_with(own, effect, tank, **given)
    angle_sr = view_of(scene, own.fitted.parameters).angle_sr
    whole, at_taken = factors_of(scene, packed, angle_sr)
    form = polynomial_of({effect.name: {}})
    few_points, at_taken_again = smooth_factors_of(scene, packed, angle_sr, form)
    lands = scene.turns.share.any(axis=2)
    np.testing.assert_allclose(few_points[lands], whole[lands], rtol=1e-5)
    np.testing.assert_allclose(at_taken_again, at_taken, rtol=1e-9)


def test_a_form_that_is_no_polynomial_says_so():
    """Nor is a product with one; else its degree is that of the highest."""
    local = {"local": 1.0}
    assert polynomial_of({"speed-turn-coupling": {}}).degree == 1
    assert polynomial_of({"speed-turn-coupling": local}) is None
    assert polynomial_of({"turning-bias": {}, "speed-turn-coupling": local}) is None
    assert polynomial_of({"turning-bias": {}, "speed-turn-coupling": {}}).degree == 2


def test_a_factor_of_the_landing_zone_is_given_for_each(few, tank):
    """Steps out of a room and within it differ, for all headings alike: by 1.4 in their logs."""
    own, scene = few
    effect = find_effect("boldness")
    packed = packed_with(own, effect, tank, heading_share=0.0)
    angle_sr = view_of(scene, own.fitted.parameters).angle_sr
    form = polynomial_of({effect.name: {}})
    waves, zones, log_taken = harmonics(scene, packed, angle_sr, form)
    _, at_taken = factors_of(scene, packed, angle_sr)
    np.testing.assert_allclose(waves[:, 1:], 0.0, atol=1e-12)
    assert np.ptp(zones, axis=1).max() == pytest.approx(2 * 0.7)
    np.testing.assert_allclose(np.exp(log_taken), at_taken, rtol=1e-9)


def test_a_factor_of_one_zone_is_given_for_it(few, tank):
    """Of landing in the third, against all others: by 1.4 in its log, wherever a step begins."""
    own, scene = few
    effect = find_effect("boldness")
    packed = packed_with(own, effect, tank, heading_share=0.0, into_zone=3.0)
    angle_sr = view_of(scene, own.fitted.parameters).angle_sr
    _, zones, _ = harmonics(scene, packed, angle_sr, polynomial_of({effect.name: {}}))
    np.testing.assert_allclose(zones[:, 2:] - zones[:, :2], 1.4)


def test_the_factors_differ_between_headings(few, tank):
    """The test above would be idle if factors were one."""
    own, scene = few
    angle_sr = view_of(scene, own.fitted.parameters).angle_sr
    flat = {
        effect.name
        for effect in SMOOTH
        for whole, _ in [factors_of(scene, packed_with(own, effect, tank), angle_sr)]
        if np.ptp(whole, axis=1).max() < 0.01
    }
    assert flat <= {"collective-departure"}


@pytest.mark.parametrize("whole", [1.0, 0.0])
def test_the_score_of_a_late_response_is_that_of_the_late_mixture(few, candidate, whole):
    """Only what is seen elsewhere is summed anew; the whole mixture says the same."""
    own, _ = few
    asked = candidate("reaction-delay", delay_s=0.4, felt_m=0.05, whole=whole)
    late = with_effect(own.fitted.parameters, asked.name, asked.values(0.3))
    fitted = own.fitted
    other = dataclasses.replace(fitted, view=view_of(own.scene, late, fitted.view))
    table, _, taken = other.tables()
    expected = np.empty(len(own.scene.turns))
    mixture_score(table, taken, *own._tables.mixtures(), expected)
    found = own.heading_scores(own.scene, asked)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(found, expected / 0.3, atol=1e-6)


def test_landing_zones_are_those_of_every_place_on_the_circle(few, tank):
    """Places that are passed over, being as far from a border as they are, land alike."""
    _, scene = few
    turns, made = scene.turns, tank_of(tank)
    own = scene.states[turns.at, :, turns.who]
    cells, n_zones = turns.share.shape[1:]
    per = int(turns.share.sum(axis=2).max())
    for s in range(0, len(turns), 3):
        reach, share = turns.speed_m_s[s] * scene.dt_s, np.zeros((cells, n_zones))
        for p in range(cells * per):
            theta = 2 * math.pi * ((p + 0.5) / (cells * per) - 0.5 / cells)
            x, y = own[s, 0] + reach * math.cos(theta), own[s, 1] + reach * math.sin(theta)
            zone = zone_of(x, y, made)
            share[p // per, zone - 1] += zone > 0
        np.testing.assert_array_equal(turns.share[s], share)


def test_the_score_of_a_factor_has_no_bias_of_the_size_of_its_probe():
    """At a probe of a hundredth: the slope at zero, not that of a step whose variance counts."""
    rng = np.random.default_rng(4)
    probability = rng.dirichlet(np.ones(16), size=50)
    slope, taken = rng.standard_normal((50, 16)), rng.standard_normal(50)
    score, probe = np.empty(50), 0.01
    factor_score(np.exp(probe * slope), np.exp(probe * taken), probability, score)
    exact = taken - (probability * slope).sum(axis=1)
    np.testing.assert_allclose(score / probe, exact, atol=0.001)
    # What a difference of logarithms would be off by.
    assert 0.5 * probe * np.var(slope) > 0.004
