"""What holds for every effect, listed or generic."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.effects import (
    MAX_PARAMETERS,
    Company,
    all_effects,
    find_effect,
    generic_effects,
    less_attention_to_robots,
)
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY, STATES
from zfcal.model.packing import pack
from zfcal.model.places import places
from zfcal.model.simulate import simulate_tracks

LISTED = {
    "alignment",
    "wall-persistence",
    "group-cohesion",
    "interaction-range",
    "rear-blind-zone",
    "leader-following",
    "reaction-delay",
    "collective-departure",
    "place-preference",
    "directional-drift",
    "turning-bias",
    "turning-memory",
    "speed-matching",
    "crowding",
    "burst-and-coast",
    "speed-turn-coupling",
    "freezing",
    "fatigue",
    "habituation",
    "boldness",
    "robot-avoidance",
}

EVERY = pytest.mark.parametrize(
    "effect", [*all_effects(), *generic_effects()], ids=lambda effect: effect.name
)

FULL = Company(n_fish=4, n_robots=1, has_rooms=True, follows_walls=True)


def strength_of(effect):
    """Return the parameter that is the strength."""
    (found,) = (each for each in effect.parameters if each.name == effect.strength)
    return found


def draws(effect, rng):
    """Return parameters at the ends of their ranges and in between, at random."""
    low = np.array([each.low for each in effect.parameters])
    high = np.array([each.high for each in effect.parameters])
    share = rng.choice([0.0, 0.5, 1.0, rng.uniform()], size=low.size)
    return dict(zip(effect.names, (low + share * (high - low)).tolist(), strict=True))


def random_rows(rng, n=4):
    """Return rows of a state with everybody somewhere."""
    heading, past, tau, mouth = rng.uniform(-math.pi, math.pi, (4, n))
    return {
        "X": rng.uniform(0, 1, n), "Y": rng.uniform(0, 1, n),
        "HX": np.cos(heading), "HY": np.sin(heading),
        "PAST_HX": np.cos(past), "PAST_HY": np.sin(past),
        "TAU_X": np.cos(tau), "TAU_Y": np.sin(tau),
        "MOUTH_X": np.cos(mouth), "MOUTH_Y": np.sin(mouth), "MOUTH_M": rng.uniform(0, 0.3, n),
        "SPEED": rng.choice([0.0, 0.03, 0.2], n), "WALL": rng.uniform(0, 0.2, n),
        "TIME": np.full(n, rng.uniform(-60, 7200)), "TRAIT": rng.normal(size=n),
        "KIND": np.array([0.0, 0.0, 0.0, 1.0]), "FOLLOWS": rng.choice([0.0, 1.0], n),
        "ROOM": rng.choice([0.0, 1.0, 2.0], n), "EXIT": np.full(n, rng.choice([0.0, 1.0])),
        "LEFT_S": rng.choice([0.2, 3.0, 1e9], n), "ZONE": rng.choice([1.0, 2.0, 3.0], n),
    }  # fmt: skip


def test_the_list_is_whole():
    """The names are those that findings use."""
    assert [effect.name for effect in all_effects()] == sorted(LISTED)


def test_the_generic_family_says_target_and_cue():
    """As in generic:heading:wall; each is found by its name, and none is on the list."""
    for effect in generic_effects():
        family, target, cue = effect.name.split(":")
        assert family == "generic"
        if effect.sight is not None:
            assert target == "attention"
        else:
            assert target == ("speed" if effect.on_speed else "heading")
        assert cue
        assert effect.generic
        assert find_effect(effect.name) is effect
        assert effect not in all_effects()
    assert not any(effect.generic for effect in all_effects())


def test_a_generic_effect_that_is_none_is_refused():
    """With the nearest names."""
    with pytest.raises(InputError, match="no effect 'generic:heading:walls'") as caught:
        find_effect("generic:heading:walls")
    assert "generic:heading:wall" in caught.value.hint


@pytest.mark.parametrize("name", ["robot_avoidance", "base", "forms", "generic", "..base", ""])
def test_what_is_no_effects_name_is_refused(name):
    """Names of files are not names of effects."""
    with pytest.raises(InputError, match="There is no effect"):
        find_effect(name)


@EVERY
def test_it_says_what_it_means(effect):
    """Sentences, sources, bounds that hold the default, a strength that can be nothing."""
    assert effect.says.endswith(".")
    assert effect.reference.count(",") >= 1
    assert 1 <= len(effect.parameters) <= MAX_PARAMETERS
    for parameter in effect.parameters:
        assert parameter.low <= parameter.default <= parameter.high
        assert parameter.says.endswith(".")
    own = strength_of(effect)
    assert own.low <= 0.0 < own.high
    assert bool(effect.opposite) == (own.low < 0.0)
    assert own.default > 0.0
    assert 0.0 < effect.probe <= own.high
    # A delay is tried at some lengths: its slope has jumps at whole steps.
    may_be_fixed = set(effect.names) if effect.lag else set(effect.names) - {effect.strength}
    assert set(effect.fixed) <= may_be_fixed


@EVERY
def test_an_idle_parameter_does_nothing_in_its_form(effect, natural_model, two_rooms):
    """All swim alike whatever its value, and a fit leaves it."""
    for shape in (*effect.shapes(two_rooms), *effect.further_shapes(two_rooms)):
        given = {**shape, effect.strength: strength_of(effect).default}
        for name in effect.idle(dict(zip(effect.names, effect.values(given), strict=True))):
            assert name not in {*effect.free(shape), *effect.fixed, effect.strength}
            (own,) = (each for each in effect.parameters if each.name == name)
            low, high = (
                simulate_tracks(
                    dataclasses.replace(natural_model, effects={effect.name: given | {name: end}}),
                    two_rooms, n_agents=4, n_robots=1, n_steps=60, seed=3,
                )[0]
                for end in (own.low, own.high)
            )  # fmt: skip
            assert np.array_equal(low, high)


def test_forms_of_the_list_have_the_parameters_that_they_use():
    """Where all lean or turn nothing is drawn, so a concentration is idle; else it is not."""
    cohesion, robot = find_effect("group-cohesion"), find_effect("robot-avoidance")
    assert cohesion.free({}) == ("weight", "kappa")
    assert cohesion.free({"leaning": 1.0}) == cohesion.free({"turning": 1.0}) == ("weight",)
    assert robot.free({"drawn": 1.0}) == ("strength", "reach_m", "kappa")
    assert robot.free({}) == robot.free({"flight": 1.0}) == ("strength",)
    drift = find_effect("directional-drift")
    assert "by_slowness" in drift.free({})
    assert "by_slowness" not in drift.free({"drawn": 1.0})


@EVERY
def test_what_else_it_says_holds_together(effect):
    """Times of rest are parameters of effects on speed; individuals differ in headings alone."""
    assert not effect.rests or (effect.on_speed and effect.rests in effect.names)
    assert not (effect.by_trait and effect.on_speed)
    assert effect.multiplies == (effect.on_speed and not effect.rests)
    assert effect.in_any_steps == (not effect.rests and not effect.by_trait)
    assert effect.may_be_placebo <= effect.in_any_steps <= effect.has_steps


def test_every_other_form_is_a_generic_effect_of_a_listed_one():
    """By names that there are, of one effect each; with the same response, headings or speed."""
    pairs = [(form, effect) for effect in all_effects() for form in effect.other_forms]
    assert len({form for form, _ in pairs}) == len(pairs) == 7
    for form, listed in pairs:
        own = find_effect(form)
        assert own.generic
        assert not listed.generic
        assert own.on_speed == listed.on_speed or listed.name == "speed-turn-coupling"


def test_what_an_effect_looks_like_is_another_one():
    """Of the list, and like it to a share where fish were: all of it from one side."""
    found = [effect for effect in all_effects() if effect.looks_like]
    assert [(effect.name, effect.looks_like.name) for effect in found] == [
        ("place-preference", "directional-drift")
    ]
    values = {"x_m": 0.0, "y_m": 0.0, "reach_m": 1.0}
    share = found[0].looks_like.share
    assert share(np.array([[0.1, 0.0], [0.2, 0.0]]), values) == pytest.approx(1.0)
    assert share(np.array([[0.1, 0.0], [-0.1, 0.0]]), values) == pytest.approx(0.0)


def test_a_control_leaves_the_states_that_it_is_given():
    """It makes others of the same shape, and those that an effect does not ask stay as they are."""
    states = np.random.default_rng(4).normal(size=(100, STATES, 3))
    before = states.copy()
    controls = [effect.control for effect in all_effects() if effect.control]
    assert [each.name for each in controls] == ["neighbours' heading 12 s ago", "a shuffled turn"]
    for control, rows in zip(controls, ([HX, HY], [PAST_HX, PAST_HY]), strict=True):
        other = control.states(states, 0.2, np.random.default_rng(1))
        changed = np.flatnonzero((other != states).any(axis=(0, 2)))
        assert changed.tolist() == rows
        assert np.array_equal(states, before)


def test_one_effect_takes_attention_from_robots():
    """Its log is the strength, and fish do not flee."""
    assert less_attention_to_robots(0.3) == {"robot-avoidance": {"strength": 0.3, "flight": 0.0}}


@EVERY
def test_its_shapes_are_within_bounds(effect, two_rooms):
    """In the default arena; the strength is not among them, but for a delay."""
    shapes = effect.shapes(two_rooms)
    assert 1 <= len(shapes) <= 16
    assert len({tuple(sorted(shape.items())) for shape in shapes}) == len(shapes)
    for shape in shapes:
        effect.values(shape)
        assert effect.lag == effect.strength or effect.strength not in shape


@EVERY
def test_at_strength_zero_it_changes_nothing(effect, ask):
    """Whatever the shape and the state: each function returns what leaves a step as it is."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        asked = ask(effect.name, draws(effect, rng) | {effect.strength: 0.0}, **random_rows(rng))
        for i in range(4):
            if effect.factor:
                assert asked.factor(rng.uniform(-math.pi, math.pi), i=i) == 1.0
            if effect.speed:
                assert asked.speed(i=i, chance=0.0) == 1.0
            if effect.component:
                assert asked.component(i=i)[0] == 0.0
            if effect.sight:
                assert asked.sight_of((i + 1) % 4, i=i) == 1.0


@EVERY
def test_its_functions_stay_within_bounds(effect, ask):
    """Factors in [0, 1], speeds in [0, 3], attention and weights finite and not negative."""
    rng = np.random.default_rng(7)
    for _ in range(60):
        asked = ask(effect.name, draws(effect, rng), **random_rows(rng))
        i, theta = int(rng.integers(4)), rng.uniform(-math.pi, math.pi)
        if effect.factor:
            assert 0.0 <= asked.factor(theta, i=i, landing=int(rng.integers(1, 4))) <= 1 + 1e-12
        if effect.speed:
            assert 0.0 <= asked.speed(i=i, chance=rng.uniform()) <= 3.0
        if effect.component:
            weight, (x, y, kappa) = asked.component(i=i)
            assert 0.0 <= weight < 1e3
            assert weight == 0.0 or math.hypot(x, y) == pytest.approx(1.0)
            assert 0.0 <= kappa <= 30.0
        if effect.sight:
            assert 0.0 <= asked.sight_of((i + 1) % 4, i=i) < 1e3


@EVERY
def test_a_simulation_with_it_runs(effect, natural_model, two_rooms):
    """2,000 steps of four fish and a robot at its middle strength: all inside, and not as
    without it.
    """
    shape = effect.shapes(two_rooms)[0]
    given = {effect.strength: strength_of(effect).default} | shape
    size = {"n_agents": 5, "n_steps": 2000, "seed": 2, "n_robots": 1}

    changed = dataclasses.replace(natural_model, effects={effect.name: given})
    xy, heading = simulate_tracks(changed, two_rooms, **size)
    before, _ = simulate_tracks(natural_model, two_rooms, **size)

    assert np.isfinite(heading).all()
    assert (two_rooms.zone_of(xy) > 0).all()
    assert not np.array_equal(xy, before)


@EVERY
def test_it_says_what_a_recording_lacks(effect):
    """Nothing where there is everything; words or nothing where there is not."""
    assert effect.lacks(FULL) is None
    for n_fish, n_robots, rooms, walls in itertools.product((0, 1, 4), (0, 1), (0, 1), (0, 1)):
        company = Company(
            n_fish=n_fish, n_robots=n_robots, has_rooms=bool(rooms), follows_walls=bool(walls)
        )
        lacks = effect.lacks(company)
        assert lacks is None or lacks


@pytest.mark.parametrize(
    ("name", "company", "lacks"),
    [
        ("alignment", {"n_fish": 1, "n_robots": 0}, "a neighbour"),
        ("alignment", {"n_fish": 1, "n_robots": 1}, None),
        ("boldness", {"n_fish": 1}, "a second fish"),
        ("robot-avoidance", {"n_robots": 0}, "a robot"),
        ("robot-avoidance", {"n_fish": 0}, "a fish"),
        ("collective-departure", {"has_rooms": False}, "rooms"),
        ("wall-persistence", {"follows_walls": False}, "a zone that follows walls"),
        ("turning-bias", {"n_fish": 1, "n_robots": 0}, None),
    ],
)
def test_what_is_lacking_has_a_name(name, company, lacks):
    """As the report says it."""
    assert find_effect(name).lacks(dataclasses.replace(FULL, **company)) == lacks


def test_places_cover_the_tank(two_rooms):
    """Twelve, inside, apart, and no point of the tank farther from one than 0.13 m."""
    found = np.array(places(two_rooms))
    assert found.shape == (12, 2)
    assert (two_rooms.zone_of(found) > 0).all()
    between = np.linalg.norm(found[:, None] - found[None], axis=-1) + np.eye(12)
    assert between.min() > 0.05
    rng = np.random.default_rng(3)
    points = rng.uniform(0.05, 0.95, (4000, 2))
    points = points[two_rooms.zone_of(points) > 0]
    nearest = np.linalg.norm(points[:, None] - found[None], axis=-1).min(axis=1)
    assert nearest.max() < 0.13


@EVERY
def test_what_is_not_called_would_have_done_nothing(effect, ask, two_rooms):
    """At each shape that leaves a function out: a factor of one, an angle of zero."""
    rng = np.random.default_rng(8)
    for shape in effect.shapes(two_rooms):
        given = shape | {effect.strength: 0.5 * strength_of(effect).default}
        for _ in range(5):
            asked = ask(effect.name, given, **random_rows(rng))
            if effect.factor is not None and not effect.calls("factor", given):
                assert asked.factor(rng.uniform(-3, 3)) == 1.0
            if effect.rotation is not None and not effect.calls("rotation", given):
                assert asked.rotation() == 0.0


def test_functions_that_do_nothing_are_not_packed(two_rooms, make_natural):
    """Alignment that leans has a factor and turns nothing; that which is drawn anew has neither."""

    def packed(**shape):
        given = {"alignment": {"weight": 5.0, **shape}}
        return pack([dataclasses.replace(make_natural(two_rooms), effects=given)], two_rooms)

    counts = [
        (len(own.components), len(own.factors), len(own.rotations))
        for own in (packed(), packed(leaning=1.0), packed(turning=1.0))
    ]
    assert counts == [(1, 0, 0), (1, 1, 0), (1, 1, 1)]
