"""Whether a further effect is there, or is what an earlier one of another form leaves over."""

import numpy as np
import pytest

from zfcal.diagnose.leftover import outlasts
from zfcal.diagnose.naming import refit

COHESION = {"weight": 4.0, "full_m": 0.3, "leaning": 1.0}
FADED = {"full_m": 0.05, "leaning": 0.0}


@pytest.fixture(scope="module")
def with_cohesion(screen, candidate):
    """Return what puts cohesion of a shape into the model of fish that have it."""

    def of(seed, others=None, **shape):
        found = screen(seed, {"group-cohesion": COHESION, **(others or {})}, minutes=12.0)
        return refit(found, found.ask(candidate("group-cohesion", **shape)))

    return of


@pytest.mark.slow
def test_what_another_form_leaves_over_falls(with_cohesion, candidate):
    """Cohesion in the model reaches less far than that of the fish: far ones seem to count."""
    made = with_cohesion(71, **FADED)
    score = made.screen.ask(candidate("interaction-range", range_m=0.15))
    assert abs(score.z) > 8.0
    assert not outlasts(score, made.screen, [made.candidate])


@pytest.mark.slow
def test_the_right_form_leaves_nothing_over(with_cohesion, candidate):
    """The same recording, and the form that the fish have: nobody asks for a range."""
    made = with_cohesion(71, full_m=0.3, leaning=1.0)
    assert abs(made.screen.ask(candidate("interaction-range", range_m=0.15)).z) < 4.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [("turning-bias", {"strength": 0.3}), ("leader-following", {"strength": 1.5})],
)
def test_an_effect_that_is_there_stands(with_cohesion, candidate, name, values):
    """Beside cohesion, of whatever form: handedness, and an answer to the same neighbours."""
    made = with_cohesion(72, {name: values}, full_m=0.3, leaning=1.0)
    score = made.screen.ask(candidate(name))
    assert abs(score.z) > 5.0
    assert outlasts(score, made.screen, [made.candidate])


@pytest.mark.slow
def test_it_is_a_matter_of_how_much_stands_not_of_how_much_there_is(with_cohesion, candidate):
    """Twice the score or a tenth of it: the same answer, and never of the sign."""
    made = with_cohesion(71, **FADED)
    score = made.screen.ask(candidate("interaction-range", range_m=0.15))
    for factor in (2.0, 0.1, -1.0):
        other = type(score)(
            candidate=score.candidate, z=score.z, strength=score.strength,
            information=score.information, steps=factor * score.steps,
        )  # fmt: skip
        assert not outlasts(other, made.screen, [made.candidate])


def test_headings_leave_nothing_over_in_speeds(with_cohesion, candidate):
    """Nor what is no matter of single steps: these are not asked beside forms at all."""
    made = with_cohesion(71, **FADED)
    for name in ("crowding", "freezing", "boldness"):
        score = made.screen.ask(candidate(name))
        assert outlasts(score, made.screen, [made.candidate])


def test_without_an_earlier_effect_all_stand(with_cohesion, candidate):
    """What falls beside cohesion stands by itself: there is no form of nothing."""
    made = with_cohesion(71, **FADED)
    score = made.screen.ask(candidate("interaction-range", range_m=0.15))
    assert outlasts(score, made.screen, [])


def test_effects_on_speed_have_forms_as_well(screen, candidate):
    """Crowding at too small a radius leaves a distance over; fatigue is another thing."""
    effects = {
        "crowding": {"per_neighbour": 0.3, "radius_m": 0.2},
        "fatigue": {"per_hour": 5.0},
    }
    found = screen(73, effects, minutes=12.0)
    made = refit(found, found.ask(candidate("crowding", radius_m=0.05)))
    tired = made.screen.ask(candidate("fatigue"))
    near = made.screen.ask(candidate("generic:speed:neighbour-distance", preferred_m=0.12))
    assert abs(tired.z) > 5.0
    assert abs(near.z) > 5.0
    assert outlasts(tired, made.screen, [made.candidate])
    assert not outlasts(near, made.screen, [made.candidate])


def test_one_fish_alone_has_no_neighbours_to_depend_on(screen, candidate):
    """What it has about it is a number nevertheless, and a second effect stands as with others."""
    effects = {"turning-bias": {"strength": 0.4}, "wall-persistence": {"strength": 0.5}}
    found = screen(74, effects, minutes=12.0, n_fish=1)
    made = refit(found, found.ask(candidate("turning-bias")))
    score = made.screen.ask(candidate("wall-persistence"))
    assert score.z > 5.0
    with np.errstate(invalid="raise"):
        assert outlasts(score, made.screen, [made.candidate])
