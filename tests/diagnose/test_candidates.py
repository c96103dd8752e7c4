"""Which effects are asked for, and why others are not."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.candidates import (
    askable,
    candidates_of,
    company_of,
    curved,
    further_forms,
    in_model,
    not_forms_of,
)
from zfcal.model.effects import all_effects, find_effect, generic_effects
from zfcal.model.features import LAGS
from zfcal.model.kernels import curves
from zfcal.model.kernels.state import KIND, TIME
from zfcal.model.scene import make_scene


@pytest.fixture(scope="module")
def scene_of(record, tank):
    """Return what makes the scene of a recording, changed as asked."""

    def of(change=lambda samples: samples, **company):
        return make_scene(change(record(1, **{"minutes": 6.0, **company})), tank)

    return of


def test_a_candidate_has_its_shape_and_a_strength(candidate):
    """All parameters of the effect, the strength among them."""
    own = candidate("alignment", kappa=3.0)
    assert own.values(7.0) == {
        "weight": 7.0,
        "kappa": 3.0,
        "grading": 1.0,
        "leaning": 0.0,
        "turning": 0.0,
        "among": 0.0,
        "reach_m": 0.15,
    }
    assert own.name == "alignment"
    assert own.notable == 20.0


def test_a_model_has_its_effects_at_their_shapes(candidate, fish):
    """What the model file is silent about is as by default."""
    own = dataclasses.replace(
        fish,
        effects={"turning-bias": {"strength": 0.3}, "alignment": {"weight": 5.0, "kappa": 3.0}},
    )
    bias, alignment = in_model(own)
    assert bias == candidate("turning-bias")
    assert alignment == candidate("alignment", kappa=3.0)
    assert in_model(fish) == ()


def test_a_change_with_the_hour_is_slow(candidate):
    """What a recording tells of it grows faster than its length."""
    assert candidate("fatigue").is_slow
    assert not candidate("crowding").is_slow


def test_only_some_strengths_have_a_sign(candidate):
    """A bias is left or right; an alignment is there or not."""
    assert candidate("turning-bias").signed
    assert not candidate("alignment").signed


def test_every_shape_is_asked_for(tank):
    """One candidate for each, with defaults for what the shape does not name."""
    effect = find_effect("alignment")
    made = candidates_of((effect,), tank)
    assert len(made) == len(effect.shapes(tank))
    names = set(effect.names) - {"weight"}
    assert all(set(each.shape) == names for each in made)
    assert len({tuple(each.shape.values()) for each in made}) == len(made)


def test_what_the_model_has_is_not_asked_for(tank, fish, scene_of):
    """Neither by name nor by way of the model."""
    effects = all_effects()
    asked = candidates_of(effects, tank, without=("alignment", "freezing"))
    assert {each.name for each in asked} == {e.name for e in effects} - {"alignment", "freezing"}
    having = type(fish)(
        **{f: getattr(fish, f) for f in fish.__dataclass_fields__ if f != "effects"},
        effects={"freezing": {"rate_per_s": 0.1}},
    )
    found, lacks = askable(scene_of(), having)
    assert "freezing" not in {effect.name for effect in found} | set(lacks)


def test_five_fish_in_two_rooms_lack_a_robot(fish, scene_of):
    """All else is asked for, and every effect is either asked for or lacking something."""
    found, lacks = askable(scene_of(), fish)
    assert lacks == {"robot-avoidance": "a robot"}
    assert {effect.name for effect in found} | set(lacks) == {e.name for e in all_effects()}


def test_with_a_robot_nothing_is_lacking(fish, scene_of):
    """Four fish and a robot."""
    scene = scene_of(n_fish=4, n_robots=1)
    assert askable(scene, fish)[1] == {}
    assert (company_of(scene).n_fish, company_of(scene).n_robots) == (4, 1)


def test_one_fish_alone_lacks_neighbours(fish, scene_of):
    """Effects between fish are not asked for; those of walls and places are."""
    found, lacks = askable(scene_of(n_fish=1), fish)
    asked = {effect.name for effect in found}
    assert {"alignment", "group-cohesion", "rear-blind-zone", "boldness"} <= set(lacks)
    assert {"wall-persistence", "place-preference", "turning-bias", "freezing"} <= asked


def test_boldness_needs_long_tracks(fish, scene_of):
    """A new id every minute: 300 s under one id are never reached."""

    def cut(samples):
        xy, ids = [], []
        for minute in range(6):
            piece = np.full_like(samples.xy_m, np.nan)
            rows = slice(300 * minute, 300 * minute + 299)
            piece[rows] = samples.xy_m[rows]
            xy.append(piece)
            ids.append(samples.agent + 100 * minute)
        xy_m = np.concatenate(xy, axis=1)
        return type(samples)(
            dt_s=samples.dt_s,
            k=samples.k,
            agent=np.concatenate(ids),
            kind=np.zeros(xy_m.shape[1], dtype=np.int8),
            xy_m=xy_m,
            confidence=np.ones(xy_m.shape[:2], dtype=np.float32),
        )

    _, lacks = askable(scene_of(cut), fish)
    assert lacks["boldness"] == "tracks of 300 s under one id"


def test_other_forms_of_what_is_known_are_not_asked_for(tank):
    """Own speed is burst and coast by another form; places for the speed are another matter."""
    generic = candidates_of(generic_effects(), tank)
    left = {each.name for each in not_forms_of(generic, {"burst-and-coast", "place-preference"})}
    gone = {each.name for each in generic} - left
    assert gone == {"generic:speed:own-speed", "generic:heading:place"}
    assert not_forms_of(generic, ()) == generic
    assert not_forms_of(generic, {"turning-memory", "wall-persistence"}) == generic
    assert "generic:speed:wall" not in {
        each.name for each in not_forms_of(generic, {"generic:speed:wall"})
    }


def forms_of(scene, name, key):
    """Return the values of a shape at which features alone find an effect."""
    return {each.shape[key] for each in further_forms(find_effect(name), scene)}


def test_one_fish_is_asked_for_where_it_is_the_same_all_the_time(scene_of):
    """Five fish: each; without the one whose track breaks; none behind a robot."""
    scene = scene_of()
    assert forms_of(scene, "leader-following", "who") == {-1.0, 0.0, 1.0, 2.0, 3.0, 4.0}
    tracks = scene.tracks.copy()
    tracks[100:, 1] = tracks.max() + 1
    broken = dataclasses.replace(scene, tracks=tracks)
    assert forms_of(broken, "leader-following", "who") == {-1.0, 0.0, 2.0, 3.0, 4.0}
    states = scene.states.copy()
    states[:, KIND] = [1.0, 0.0, 0.0, 0.0, 0.0]
    first = dataclasses.replace(scene, states=states)
    assert forms_of(first, "leader-following", "who") == {-1.0}


def test_near_ones_may_be_felt_at_once_and_far_ones_late(scene_of):
    """By half a step of the recording and a whole one, beyond several distances."""
    scene = scene_of()
    found = {
        (each.shape["felt_m"], each.shape["delay_s"])
        for each in further_forms(find_effect("reaction-delay"), scene)
        if each.shape["whole"] == 0.0
    }
    late = {0.5 * scene.dt_s, scene.dt_s}
    assert {(felt_m, delay_s) for felt_m in (0.1, 0.14, 0.2) for delay_s in late} <= found


def test_no_response_is_later_than_it_can_be(scene_of):
    """By half a step of a recording to two, of those that are 2 s at most."""
    scene = scene_of()
    here = forms_of(scene, "reaction-delay", "delay_s")
    assert {0.5 * scene.dt_s, scene.dt_s, 1.5 * scene.dt_s, 2 * scene.dt_s} <= here
    then = [each.shape for each in further_forms(find_effect("reaction-delay"), scene)
            if each.shape["then"]]  # fmt: skip
    assert {(shape["delay_s"], shape["whole"]) for shape in then} == {
        (lag * scene.dt_s, whole) for lag in LAGS for whole in (0.0, 1.0)
    }
    assert len(then) == 2 * len(LAGS)
    slow = dataclasses.replace(scene, dt_s=1.25)
    assert max(forms_of(slow, "reaction-delay", "delay_s")) <= 2.0


@pytest.mark.parametrize(
    ("name", "label", "cue", "knots"),
    [
        ("turning-bias", "leaning to the left, by the nearest", "BY_NEAREST", (0.03, 0.1, 0.25)),
        ("habituation", "attention, steadily, by bearing", "BY_BEARING", (0.0, 1.2, 2.3)),
        ("turning-bias", "leaning to the left, by the zone", "BY_ZONE", (1.0, 2.0, 3.0)),
        ("interaction-range", "attention", "BY_DISTANCE", None),
        ("crowding", "company, by how many are near", "BY_NEAREST", (0.03, 0.1, 0.25)),
        ("group-cohesion", "drawn to each", "BY_NEAREST", None),
        ("fatigue", find_effect("fatigue").paces[0].label, "BY_TIME", None),
    ],
)
def test_a_curve_goes_by_what_a_feature_does(candidate, scene_of, name, label, cue, knots):
    """By its circumstances, or by what its own weights go by."""
    made = curved(candidate(name), label, scene_of())
    assert made.shape["by"] == getattr(curves, cue)
    own = tuple(made.shape[f"knot_{k}"] for k in (1, 2, 3))
    assert own == (knots or own)
    assert list(own) == sorted(set(own))
    assert made.shape["more_1"] == made.shape["more_3"] == 0.0
    assert candidate(name).shape.items() <= made.shape.items()


def test_a_curve_by_time_is_in_seconds_of_the_trial(candidate, scene_of):
    """A feature goes by shares of the recording."""
    scene = scene_of()
    made = curved(candidate("turning-bias"), "leaning to the left, by the time", scene)
    begin_s, end_s = scene.states[0, TIME, 0], scene.states[-1, TIME, 0]
    own = [made.shape[f"knot_{k}"] for k in (1, 2, 3)]
    assert own == pytest.approx([begin_s, (begin_s + end_s) / 2, end_s])


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("turning-bias", "leaning to the left, by who"),
        ("turning-bias", "leaning to the left"),
        ("reaction-delay", "attention, by the nearest"),
        ("freezing", "stops, by the time"),
        ("group-cohesion", "drawn to each, by bearing"),
    ],
)
def test_no_curve_goes_by_what_a_model_does_not_know(candidate, scene_of, name, label):
    """By who somebody is, or of what is no matter of one strength."""
    assert curved(candidate(name), label, scene_of()) is None
