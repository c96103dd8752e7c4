"""An effect's statistic, step by step and against what it responds to."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.naming import refit
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.tracing import _last_turn_deg, trace
from zfcal.model.extended import maximise
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY, STATES, X, Y
from zfcal.model.scene import make_scene


@pytest.fixture(scope="module")
def traced(screen, candidate):
    """Return what traces an effect in a recording that has it."""

    def of(name, values, **company):
        own = screen(23, {name: values}, **company)
        score = own.ask(candidate(name))
        return own, trace(score, own, refit(own, score))

    return of


@pytest.mark.slow
def test_scores_are_positive_without_the_effect_and_nothing_with_it(traced):
    """In units of their own spread; for an effect to the right as for one to the left."""
    for strength in (0.4, -0.4):
        own, found = traced("turning-bias", {"strength": strength})
        n = len(own.scene.turns)
        assert found.before.std() == pytest.approx(1.0)
        assert found.before.mean() * np.sqrt(n) > 10
        assert abs(found.after.mean()) * np.sqrt(n) < 1
        assert found.before.shape == found.after.shape == found.time_s.shape == (n,)


def test_places_and_times_are_those_of_the_steps(traced):
    """Where and when each step began, and whose it was."""
    own, found = traced("turning-bias", {"strength": 0.4})
    scene, turns = own.scene, own.scene.turns
    assert np.array_equal(found.x_m, scene.states[turns.at, X, turns.who])
    assert np.array_equal(found.y_m, scene.states[turns.at, Y, turns.who])
    assert np.array_equal(found.track, turns.track)
    assert found.time_s == pytest.approx(turns.at * 0.2)


def test_the_curve_has_twelve_points_and_its_mean_is_that_of_the_scores(traced):
    """Equally full bins, rising cues; what the model with the effect expects lies on it."""
    _, found = traced("turning-bias", {"strength": 0.4})
    assert found.cue.shape == found.observed.shape == found.expected_after.shape == (12,)
    assert (np.diff(found.cue) > 0).all()
    assert found.observed.mean() == pytest.approx(found.before.mean(), rel=0.01)
    assert (found.expected_before == 0).all()
    apart = np.abs(found.observed - found.expected_after)
    assert apart.mean() < 0.5 * np.abs(found.observed).mean()


@pytest.mark.parametrize(
    ("name", "values", "company", "cue"),
    [
        ("turning-bias", {"strength": 0.4}, {}, "distance to the wall (cm)"),
        ("alignment", {"weight": 20.0}, {}, "distance to the nearest neighbour (cm)"),
        ("place-preference", {"strength": 1.0}, {"n_fish": 1}, "distance to the wall (cm)"),
        ("fatigue", {"per_hour": 3.0}, {}, "time (min)"),
        ("burst-and-coast", {"exponent": 0.3}, {}, "speed of the step before (cm/s)"),
        (
            "generic:heading:own-turn",
            {"strength": 2.0},
            {},
            "the last turn (degrees to the left)",
        ),
    ],
)
def test_the_cue_is_what_the_effect_responds_to(traced, name, values, company, cue):
    """In the units of its name."""
    own, found = traced(name, values, minutes=4.0, **company)
    assert found.cue_name == cue
    low = -180.0 if "turn" in cue else 0.0
    reach = {"time (min)": 4.0, "speed of the step before (cm/s)": 60.0}.get(cue, 180.0)
    assert low <= found.cue[0] < found.cue[-1] < reach
    moves = own.scene.moves if name in {"fatigue", "burst-and-coast"} else own.scene.turns
    assert len(found.time_s) == len(moves)


def test_neighbours_that_were_lost_are_not_near(record, candidate, tank, fish):
    """Where nobody else is seen a step has no distance, and is left out of the curve."""
    samples = record(23, {"alignment": {"weight": 20.0}}, minutes=4.0, n_fish=2)
    xy_m = samples.xy_m.copy()
    xy_m[600:, 1] = np.nan
    scene = make_scene(dataclasses.replace(samples, xy_m=xy_m), tank)
    own = Screen(scene=scene, fitted=maximise(scene, fish))
    score = own.ask(candidate("alignment"))
    found = trace(score, own, refit(own, score))
    together = scene.turns.at < 600
    assert found.observed.mean() == pytest.approx(found.before[together].mean(), rel=0.05, abs=0.01)
    assert np.isfinite(found.cue).all()


def test_the_last_turn_by_hand():
    """From east to north is 90 degrees to the left; who has not moved before has none."""
    states = np.zeros((3, STATES))
    states[:2, [PAST_HX, PAST_HY]] = [[1.0, 0.0], [0.0, 1.0]]
    states[:, [HX, HY]] = [[0.0, 1.0], [1.0, 0.0], [1.0, 0.0]]

    assert _last_turn_deg(states) == pytest.approx([90.0, -90.0, np.nan], nan_ok=True)
