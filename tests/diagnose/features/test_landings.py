"""Steps that end near something: a preference with an edge is seen, and has the strength it has."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose.features import asking, curves
from zfcal.diagnose.features.asking import fits_beside, gains_of
from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.landings import Landings, leaned
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import tell
from zfcal.diagnose.looks import in_the_model
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.extended import maximise
from zfcal.model.features import Landing, OneOf, Tilt
from zfcal.model.kernels.landing import ANGLES

WALL, BAND_M = np.array([0.95, 0.05, 0.95, 0.4]), 0.05


@pytest.fixture(scope="module")
def nothing(base):
    """Return fits to ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Fits(law=Law(scene=scene, fitted=fitted))


def ends_of(scene):
    """Return where the heading of each cell would lead, shape (turn, cell, 2)."""
    angle = 2 * math.pi * np.arange(ANGLES) / ANGLES
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turns = scene.turns
    xy = scene.states[turns.at, :2, turns.who]
    return xy[:, None] + (turns.speed_m_s * scene.dt_s)[:, None, None] * ways


def band(scene):
    """Return a factor on steps that end within 5 cm of one wall, shape (turn, cell)."""
    inside = WALL[0] - ends_of(scene)[..., 0] < BAND_M
    return np.where(inside & (ends_of(scene)[..., 1] < WALL[3]), math.exp(3.0), 1.0)


def off_walls(scene, factor=1e-9):
    """Return a factor on steps that end within 25 mm of any wall, shape (turn, cell)."""
    return np.where(scene.arena.wall_distance(ends_of(scene)) < 0.025, factor, 1.0)


@pytest.fixture(scope="module")
def bent(base, worlds):
    """Return what makes the law of fish whose steps have a factor."""
    scene, fitted = base

    def make(factor):
        drawn = worlds.redrawn(scene, fitted, np.random.default_rng(4), lambda _angle: factor)
        return Law(scene=drawn, fitted=maximise(drawn, fitted.parameters))

    return make


@pytest.fixture(scope="module")
def banded(base, bent):
    """Return a law of fish of which steps that end within 5 cm of one wall are likelier."""
    return bent(band(base[0]))


def at_wall(arena):
    """Return the feature of landing at that wall."""
    (kind,) = (
        each
        for each in find_effect("place-preference").features(arena)
        if isinstance(each, OneOf) and each.kind == "landing at a wall"
    )
    (found,) = (each for each in kind.features if each.label.endswith("at 0.95, 0.23"))
    return found


@pytest.mark.slow
def test_a_band_along_a_wall_is_a_place(banded):
    """A preference with an edge: no tilt toward the wall sees half as much."""
    gains = gains_of(banded, all_effects())
    told = tell(gains)
    assert told.gain.name == "place-preference"
    assert told.gain.label == "landing at the wall at 0.95, 0.23"
    tilts = [g.nats for g in gains if g.name == "place-preference" and "leaning" in g.label]
    assert told.gain.nats > 2 * max(tilts)


@pytest.mark.slow
def test_a_landing_that_is_asked_for_is_fitted_beside_walls_too(base, bent):
    """It promises nothing, and a clear one has all landings fitted anew."""
    law = bent(band(base[0]) * off_walls(base[0], 0.7))
    fits = Fits(law=law).beside_walls
    assert fits.landings.walls is not None
    coupling = find_effect("speed-turn-coupling")
    idle = next(
        each
        for each in coupling.features(law.scene.arena)
        if isinstance(each, Landing) and not fits.may_gain(each)
    )
    clear = ("place-preference", "landing at a wall")
    kinds = {clear, (coupling.name, idle.label)}
    found = gains_of(law, [find_effect(clear[0]), coupling], kinds=kinds)
    gains = {each.key: each for each in found}
    assert gains[clear].nats > 20
    made = gains[coupling.name, idle.label].log_p
    assert made.any()
    np.testing.assert_array_equal(made, fits.gain(coupling.name, idle).log_p)


@pytest.mark.slow
@pytest.mark.parametrize("middle", [(0.815, 0.145), (0.187, 0.599)])
def test_a_shelter_between_the_places_that_are_tried_goes_into_the_model(base, worlds, middle):
    """A disc of 6 cm in which steps are likelier to end: where it is, how wide and how strong."""
    scene, fitted = base
    reach_m, strength = 0.06, 2.5
    inside = np.linalg.norm(ends_of(scene) - middle, axis=-1) < reach_m
    factor = np.where(inside, math.exp(strength), 1.0)
    drawn = worlds.redrawn(scene, fitted, np.random.default_rng(5), lambda _angle: factor)
    screen = Screen(scene=drawn, fitted=maximise(drawn, fitted.parameters))

    gains = gains_of(
        Law(scene=drawn, fitted=screen.fitted), [find_effect("place-preference")], n_workers=2
    )
    best = max(gains, key=lambda gain: gain.nats)
    assert best.kind == "landing at a place"
    case = SimpleNamespace(
        listed=(), generic=(), scene=drawn, question=SimpleNamespace(n_workers=2)
    )
    values = in_the_model(case, screen, best)[0].values
    assert values["lands"] == 1.0
    assert math.hypot(values["x_m"] - middle[0], values["y_m"] - middle[1]) < 0.015
    assert values["reach_m"] == pytest.approx(reach_m, abs=0.012)
    assert values["strength"] == pytest.approx(strength, abs=1.0)


def test_its_strengths_are_those_of_the_band(banded):
    """About three nats up to 4 cm, next to nothing from 5 cm on."""
    fits = Fits(law=banded)
    fit = fits.fit(at_wall(banded.scene.arena))
    by_knot = dict(zip(at_wall(banded.scene.arena).knots_m, fit.factor, strict=False))
    assert 2.0 < np.mean([by_knot[k] for k in (0.02, 0.03, 0.04)]) < 4.0
    assert abs(by_knot[0.07]) < 0.8


def test_beside_itself_it_gains_nothing(banded):
    """What was named is taken in with its strengths, and asked no more."""
    fits = Fits(law=banded)
    feature = at_wall(banded.scene.arena)
    gained = fits.gain("place-preference", feature).log_p.sum()
    beside = fits_beside(banded, [find_effect("place-preference")])
    assert gained > 8
    assert beside.gain("place-preference", feature).log_p.sum() < 0.3 * gained


def test_every_landing_gains_nothing_where_nothing_is(nothing):
    """A few nats at most, by as many strengths; never less than nothing."""
    features = [
        each
        for effect in all_effects()
        for feature in effect.features(nothing.law.scene.arena)
        for each in (feature.features if isinstance(feature, OneOf) else [feature])
        if isinstance(each, Landing)
    ]
    assert len(features) > 20
    for feature in features:
        fit = nothing.fit(feature)
        assert -1e-2 < fit.log_p.sum() < 4 + 2 * len(fit.strengths)


def test_a_landing_that_no_step_can_reach_has_no_strength(nothing):
    """It stays at nothing, and nothing is gained."""
    far = Landing(
        label="far", away_m=lambda _seen, _rows, xy_m: xy_m[..., 0] + 9.0, knots_m=(0.0, 1.0)
    )
    fit = nothing.fit(far)
    assert fit.strengths == pytest.approx([0.0])
    assert fit.log_p.sum() == pytest.approx(0.0, abs=1e-9)


def test_where_nobody_lands_is_shunned(base, worlds):
    """A spot in which no step ends, though many could: its strength is at its bound."""
    scene, fitted = base
    spot = np.array([0.2, 0.8])

    def away_m(_seen, _rows, xy_m):
        return np.linalg.norm(xy_m - spot, axis=-1)

    inside = np.linalg.norm(ends_of(scene) - spot, axis=-1) < 0.06
    factor = np.where(inside, 1e-9, 1.0)
    drawn = worlds.redrawn(scene, fitted, np.random.default_rng(4), lambda _angle: factor)
    shunned = Fits(law=Law(scene=drawn, fitted=maximise(drawn, fitted.parameters)))
    fit = shunned.fit(Landing(label="spot", away_m=away_m, knots_m=(0.0, 0.05, 0.06)))
    assert (fit.strengths < -3).all()
    assert fit.log_p.sum() > 5


@pytest.fixture(scope="module")
def bodies(base, bent):
    """Return the law of fish whose middles keep 25 mm off every wall."""
    return bent(off_walls(base[0]))


@pytest.mark.slow
def test_what_all_walls_have_in_common_is_no_place(bodies):
    """Each wall is shunned by itself, and no more than the others."""
    walls = at_wall(bodies.scene.arena)
    alone = Fits(law=bodies).gain("place-preference", walls)
    beside = Fits(law=bodies).beside_walls.gain("place-preference", walls)
    assert alone.nats > 10
    assert beside.nats < 2


@pytest.mark.slow
def test_beside_walls_all_but_landings_is_kept(bodies):
    """What else was fitted is not fitted once more, and landings are as if they had been asked."""
    fits, anew = Fits(law=bodies), Landings(law=bodies).beyond_walls()
    beside = fits.beside_walls
    assert beside is not fits
    for kept in ("_null", "_own"):
        assert getattr(beside, kept) is getattr(fits, kept)
    assert beside.landings._ends is fits.landings._ends
    spot = find_effect("place-preference").features(bodies.scene.arena)[-1].features[0]
    np.testing.assert_array_equal(beside.gain("place-preference", spot).log_p, anew.fit(spot).log_p)
    assert fits.beside_walls is beside
    assert "_few" not in beside.__dict__
    choice = find_effect("place-preference").features(bodies.scene.arena)[-1]
    asking._off_walls(fits, [("place-preference", choice)], [], lambda *_: (), fit_all=True)
    assert "_few" in beside.__dict__  # Worked out before threads ask for it side by side.


@pytest.mark.slow
def test_the_curve_of_a_form_is_beside_walls_too(bodies, monkeypatch):
    """Both curves of one picture are."""
    walls, beside = at_wall(bodies.scene.arena), Fits(law=bodies).beside_walls
    monkeypatch.setattr(curves, "redrawn", lambda law, *_: law)
    found = curves._of_the_form(beside, walls, None)
    np.testing.assert_allclose(found, beside.fit(walls).strengths, rtol=1e-9)


def test_walls_that_gain_nothing_are_nothing_to_be_beside(nothing, monkeypatch):
    """Then no landing is fitted again."""
    assert nothing.beside_walls is nothing
    found = [("a feature", "its gain")]
    asked = [("place-preference", at_wall(nothing.law.scene.arena))]
    monkeypatch.setattr(asking, "_gains", None)
    assert asking._off_walls(nothing, asked, found, map, fit_all=True) == found


@pytest.mark.slow
def test_bodies_that_keep_off_walls_have_no_landing_named(bodies):
    """All landings are asked beside what all walls have in common, where one stands out."""
    told = tell(gains_of(bodies, all_effects()))
    assert told is None or "landing" not in told.gain.label


def test_a_band_along_one_wall_is_more_than_all_have(banded):
    """It is not taken for what they have in common."""
    walls = at_wall(banded.scene.arena)
    alone = Fits(law=banded).gain("place-preference", walls).log_p.sum()
    beside = Fits(law=banded).beside_walls.gain("place-preference", walls).log_p.sum()
    assert beside > 0.7 * alone


def test_a_tilt_and_a_landing_bend_the_law_alike(nothing):
    """A factor on cells, by its logs there and at the heading taken."""
    law = nothing.law
    east = Tilt(label="east", vectors=lambda seen: seen.x_axis[:, None])
    cells, taken = leaned(law, east, 0.3 * east.vectors(law.draws[0].seen)[:, 0])
    bent = law.absorbing(bent=(cells, taken))
    np.testing.assert_allclose(taken, 0.3 * law.turns.taken[:, 0], rtol=1e-6)
    whole = (law.cells * np.exp(cells)).sum(axis=1)
    np.testing.assert_allclose(bent.cells.sum(axis=1), whole, rtol=1e-9)


def test_a_preference_more_than_another_counts_its_own_strengths(nothing):
    """Where both have as many strengths none is free."""
    (aside,) = (
        each
        for each in find_effect("speed-turn-coupling").features(nothing.law.scene.arena)
        if isinstance(each, Landing) and each.label == "landing aside"
    )
    alone = nothing.gain("speed-turn-coupling", replace(aside, over=None))
    more = nothing.gain("speed-turn-coupling", aside)
    assert more.n_strengths == alone.n_strengths == len(aside.knots_m) - 1
    assert more.log_p.sum() < alone.log_p.sum() + 1e-6
