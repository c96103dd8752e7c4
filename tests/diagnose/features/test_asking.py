"""Fits beside effects are made once for each law, and the same as if they were made anew."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import chdtrc

from zfcal.artifacts.arenas import load_arena
from zfcal.diagnose.features.asking import _absorbed, _askable, _one, fits_beside, gains_of
from zfcal.diagnose.features.curves import redrawn
from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import best_by_name
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import LEVEL
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise
from zfcal.model.features import Leaving, Tilt
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks

BIAS, DRIFT, COHESION = map(find_effect, ("turning-bias", "directional-drift", "group-cohesion"))


@pytest.fixture
def law(base):
    """Return a law of its own of ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Law(scene=scene, fitted=fitted)


def test_who_asks_again_gets_the_same_fits(law):
    """Those of one effect are not those of two; those of none are kept beside any others."""
    none, one = fits_beside(law, ()), fits_beside(law, [BIAS])
    assert fits_beside(law, [BIAS]) is one
    assert fits_beside(law, [BIAS, DRIFT]) is not one
    assert fits_beside(law, ()) is none


def test_fits_that_were_forgotten_are_made_again_as_they_were(law):
    """A law keeps two of them."""
    before = fits_beside(law, ()), fits_beside(law, [BIAS])
    fits_beside(law, [COHESION])
    again = fits_beside(law, [BIAS])
    assert again is not before[1]
    np.testing.assert_array_equal(again.null_log_p, before[1].null_log_p)


def test_the_best_of_many_has_to_gain_more_to_be_taken_along(law):
    """A leaning by chance to one of many places: taken along as the only one, not as their best."""
    places = find_effect("place-preference").features(law.scene.arena)
    tilts = next(f.features for f in places if isinstance(getattr(f, "features", [0])[0], Tilt))
    fits = Fits(law=law)

    def chance(tilt):
        fit = fits.fit(dataclasses.replace(tilt, low=None))
        return chdtrc(len(fit.strengths), 2 * max(float(fit.log_p.sum()), 0.0))

    best = min(tilts, key=chance)
    assert 1e-4 < chance(best) < LEVEL
    assert _absorbed(law, best, 1) is not law
    assert _absorbed(law, best, math.ceil(1.01 * LEVEL / chance(best))) is law


def test_a_law_of_noisy_positions_keeps_no_fits(law):
    """Each would hold what all of its draws need."""
    noisy = dataclasses.replace(law, noise_m=5e-4, n_draws=2)
    assert fits_beside(noisy, [BIAS]) is not fits_beside(noisy, [BIAS])


def test_what_a_redrawn_law_takes_along_is_what_it_would_work_out(law, base):
    """Its weights, their waves and its cells do not know which headings were drawn."""
    scene, fitted = base
    screen = Screen(scene=scene, fitted=fitted)
    made = redrawn(law, screen, np.random.default_rng(1))
    anew = dataclasses.replace(made)
    assert (made.turns.taken != law.turns.taken).any()
    np.testing.assert_array_equal(made.cells, anew.cells)
    np.testing.assert_array_equal(made.weight, anew.weight)
    np.testing.assert_array_equal(made.base, anew.base)


@pytest.mark.parametrize("n_fish", [2, 3])
def test_few_fish_drawn_sharply_to_each_in_view_follow_no_leader(screen, n_fish):
    """The fastest in view is often the only one: that tells nothing of speeds."""
    effects = {"group-cohesion": {"weight": 0.6, "kappa": 10.0, "each": 1.0}}
    screened = screen(7200 + n_fish, effects, minutes=10.0, n_fish=n_fish)
    law = Law(scene=screened.scene, fitted=screened.fitted)
    led = find_effect("leader-following")
    nats = {each.name: each.nats for each in best_by_name(gains_of(law, [COHESION, led]))}
    assert nats["group-cohesion"] > 30
    assert nats["leader-following"] < 0.7 * nats["group-cohesion"]


def test_a_tank_without_rooms_has_nobody_leaving_them(law):
    """Neither by itself nor under circumstances; who swims into the open is another matter."""
    open_square = load_arena("open-square", Path())
    bare = dataclasses.replace(law, scene=dataclasses.replace(law.scene, arena=open_square))
    for name in ("boldness", "collective-departure"):
        effect = find_effect(name)
        asked = _askable(bare, effect)
        leaving = [each for each in asked if isinstance(_one(each), Leaving)]
        assert all(_one(each).into == "open" for each in leaving)
        in_rooms = [_one(each) for each in _askable(law, effect)]
        assert sum(isinstance(each, Leaving) for each in in_rooms) > len(leaving)


@pytest.mark.slow
def test_what_an_effect_has_to_gain_more_than_is_not_taken_along_with_it(base, worlds):
    """Attention to the fast may change with time; attention to all that wanes is no part of that.

    Fish that follow the fast and habituate, for 20 minutes: the second is there beside the first.
    """
    effects = {
        "leader-following": {"strength": 1.0},
        "habituation": {"per_hour": 6.0, "usual_at_s": 600.0},
    }
    fish = worlds.natural_fish(base[0].arena)
    xy_m, _ = simulate_tracks(
        dataclasses.replace(fish, effects=effects), base[0].arena, n_agents=5, n_steps=6000, seed=2
    )
    scene = make_scene(worlds.samples_of(xy_m), base[0].arena)
    both = Law(scene=scene, fitted=maximise(scene, fish))
    leading, waning = map(find_effect, effects)
    alone, beside = (
        max(each.nats for each in gains_of(both, [waning], beside=known))
        for known in ((), (leading,))
    )
    assert alone > 50
    assert beside > 0.3 * alone
    assert not any(
        "attention to the fast" in each.label for each in fits_beside(both, [leading]).also
    )
