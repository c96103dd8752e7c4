"""Features of effects: hat functions, and what each name asks of a step."""

import dataclasses
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from zfcal.artifacts.arenas import load_arena
from zfcal.model.directions import left_of, turned_by
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.effects.weights import each_fish
from zfcal.model.features import (
    AWAY_M,
    LAGS,
    Component,
    Landing,
    Leaving,
    OneOf,
    Sharper,
    Tilt,
    Turned,
)
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.rooms import find_rooms

N, OTHERS = 6, 3
"""Steps and others of the fixture `seen`."""

_OF_OTHERS = (
    "here",
    "speed_m_s",
    "lately_m_s",
    "distance_m",
    "off_axis_rad",
    "is_robot",
    "in_open",
)


@pytest.fixture(scope="module")
def arena():
    """Return the default arena."""
    return load_arena("two-rooms", Path())


def features_of(name, arena):
    """Return an effect's features; the first of those of which a few are chosen."""
    found = find_effect(name).features(arena)
    return [each.features[0] if isinstance(each, OneOf) else each for each in found]


def test_hat_functions_by_hand():
    """A quarter of the way from 1 to 3; at a knot; beyond both ends."""
    found = hats([1.5, 1.0, -2.0, 9.0], (0.0, 1.0, 3.0))
    np.testing.assert_allclose(found, [[0, 0.75, 0.25], [0, 1, 0], [1, 0, 0], [0, 0, 1]])


def test_hat_functions_of_what_is_not_known_are_not_known():
    """And have the shape of the values, with one more axis."""
    found = hats(np.array([[np.nan, 0.5], [1.0, 2.0]]), (0.0, 1.0, 3.0))
    assert found.shape == (2, 2, 3)
    assert np.isnan(found[0, 0]).any()
    np.testing.assert_array_equal(found[0, 1], [0.5, 0.5, 0.0])
    np.testing.assert_array_equal(found[1], [[0.0, 1.0, 0.0], [0.0, 0.5, 0.5]])


def test_hat_functions_add_up_to_one():
    """Whatever the values, infinite ones too."""
    values = np.append(np.random.default_rng(1).normal(0, 3, 100), [np.inf, -np.inf])
    np.testing.assert_allclose(hats(values, (-2.0, -1.0, 0.5, 2.0)).sum(axis=-1), 1.0)


def test_every_effect_on_headings_has_features_and_none_on_speed(arena):
    """A name without features could not be told from the others."""
    for effect in all_effects():
        assert bool(effect.features(arena)) == (not effect.on_speed), effect.name


@pytest.mark.parametrize("name", [e.name for e in all_effects() if not e.on_speed])
def test_features_have_a_number_for_each_step_and_weight(name, arena, seen):
    """And all of them are finite; labels of a name differ."""
    found = features_of(name, arena)
    labels = [each.label for each in found]
    assert len(set(labels)) == len(labels)
    for each in found:
        if isinstance(each, Component):
            named = isinstance(each.toward, str)
            toward = getattr(seen, each.toward) if named else each.toward(seen)
            weights = each.weights(seen)
            assert weights.shape[:2] == toward.shape[:2]
            values = (toward, weights)
        elif isinstance(each, Tilt):
            values = (each.vectors(seen),)
            assert values[0].shape[::2] == (N, 2)
        elif isinstance(each, Turned | Sharper):
            values = (each.by(seen),)
            assert values[0].shape[0] == N
        elif isinstance(each, Landing):
            away_m = each.away_m(seen, np.arange(N), np.stack([seen.xy_m, seen.xy_m + 0.1], axis=1))
            assert away_m.shape == (N, 2)
            assert (away_m >= 0).all()
            values = (away_m, hats(away_m, each.knots_m)[..., :-1])
        else:
            assert isinstance(each, Leaving)
            values = (each.weights(seen),)
            assert values[0].shape[0] == N
        assert all(np.isfinite(value).all() for value in values)
        along = getattr(each, "along", None)
        if along is not None:
            # A curve has a weight for each of its knots.
            n = values[-1].shape[1 if isinstance(each, Tilt) else -1]
            assert n == len(along.knots) + len(along.besides)
            assert list(along.knots) == sorted(along.knots)
            assert along.none_at is None or along.none_at < along.knots[0]


def test_who_is_not_there_has_no_weight(arena, seen):
    """Nobody is there: nothing about neighbours is left, near or far."""
    none = np.zeros((N, OTHERS))
    alone = dataclasses.replace(
        seen,
        here=none.astype(bool),
        is_robot=none.astype(bool),
        attention=none,
        attention_ago=lambda _steps: none,
        distance_m=none + AWAY_M,
    )
    for name in ("alignment", "interaction-range", "reaction-delay", "robot-avoidance"):
        for each in features_of(name, arena):
            if isinstance(each, Component):
                assert not each.weights(alone).any(), (name, each.label)


def test_attention_that_can_but_be_lost_and_leanings_of_one_sign(arena):
    """Fish that flee each other show no cohesion, and who attends to the far no range."""
    for name in ("alignment", "group-cohesion"):
        for each in features_of(name, arena):
            assert each.low == 0.0, (name, each.label)
    for name in ("interaction-range", "rear-blind-zone"):
        for each in features_of(name, arena):
            assert each.high == 0.0


def test_who_is_who_is_asked_of_a_few_tracks(arena, seen):
    """Nobody to follow: no strength. Of short pieces of tracks none has one of its own."""
    who = {
        name: next(each for each in features_of(name, arena) if each.label == "who")
        for name in ("leader-following", "boldness")
    }
    alone = dataclasses.replace(seen, is_robot=np.ones((N, OTHERS), dtype=bool))
    assert who["leader-following"].weights(alone).shape == (N, OTHERS, 0)
    many = dataclasses.replace(
        seen,
        other=np.arange(N * OTHERS, dtype=np.int32).reshape(N, OTHERS),
        track=np.arange(N, dtype=np.int32),
    )
    assert who["boldness"].weights(many).shape[1] <= 11
    assert who["leader-following"].weights(many).shape[2] in (0, N * OTHERS - N - 1)


def test_no_turn_is_remembered_along_walls_or_where_none_is_known(arena, seen):
    """There the base forgets the heading, and a heading before is but the present one."""
    unknown = dataclasses.replace(seen, last_turn_rad=np.array([0.0, 0.2] * (N // 2)))
    drawn = labelled("turning-memory", "drawn to the heading before", arena)
    leaning = labelled("turning-memory", "leaning to the heading before", arena)
    expected = (~seen.follows_walls) & (unknown.last_turn_rad != 0)
    np.testing.assert_array_equal(drawn.weights(unknown)[:, 0, 0], expected)
    np.testing.assert_array_equal(leaning.vectors(unknown)[:, 0].any(axis=1), expected)


def labelled(name, label, arena):
    """Return the feature of an effect that has a label, of several ones as well."""
    found = find_effect(name).features(arena)
    flat = [one for each in found for one in (each.features if isinstance(each, OneOf) else [each])]
    return next(each for each in flat if each.label == label)


def test_earlier_headings_are_remembered_by_what_they_have_aside(arena, seen):
    """Along the present heading there is nothing; along walls only what runs along them counts."""
    memory = labelled("turning-memory", "leaning to earlier headings", arena).vectors(seen)
    assert memory.shape == (N, len(LAGS), 2)
    np.testing.assert_allclose((memory * seen.own_heading[:, None]).sum(axis=-1), 0, atol=1e-12)
    whole = labelled("turning-memory", "leaning to earlier headings, along walls too", arena)
    np.testing.assert_array_equal(whole.vectors(seen)[:, 0], seen.ago_heading[1])
    along = labelled("wall-persistence", "leaning, by earlier headings", arena).vectors(seen)
    assert not along[~seen.follows_walls].any()
    across = left_of(seen.along_wall)
    np.testing.assert_allclose((along * across[:, None]).sum(axis=-1), 0, atol=1e-12)
    assert np.abs(along[seen.follows_walls]).min() > 0


def test_headings_are_drawn_to_an_angle_of_the_own_one(arena, seen):
    """To the left or the right, everywhere or off the walls."""
    left = labelled("turning-bias", "drawn to 30 degrees, everywhere", arena)
    right = labelled("turning-bias", "drawn to -60 degrees, off the walls", arena)
    cosine = (left.toward(seen)[:, 0] * seen.own_heading).sum(axis=-1)
    np.testing.assert_allclose(cosine, np.cos(np.pi / 6))
    sine = (right.toward(seen)[:, 0] * left_of(seen.own_heading)).sum(axis=-1)
    np.testing.assert_allclose(sine, -np.sin(np.pi / 3))
    np.testing.assert_array_equal(left.weights(seen), 1)
    np.testing.assert_array_equal(right.weights(seen)[:, 0, 0], ~seen.follows_walls)


def test_a_drift_may_be_there_off_the_walls_alone(arena, seen):
    """In a direction, and as a leaning."""
    north = labelled("directional-drift", "drawn to 90 degrees, off the walls", arena)
    np.testing.assert_allclose(north.toward(seen)[:, 0], [[0.0, 1.0]] * N, atol=1e-12)
    np.testing.assert_array_equal(north.weights(seen)[:, 0, 0], ~seen.follows_walls)
    leaning = labelled("directional-drift", "leaning, off the walls", arena)
    assert not leaning.vectors(seen)[seen.follows_walls].any()


def test_each_fish_is_drawn_to_the_way_out_near_to_it(arena, seen):
    """Between the rooms, and far from there, no fish is."""
    drawn = labelled("boldness", "drawn to the way out, by who", arena)
    (between,) = (zone.polygon for zone in arena.zones if zone.polygon is not None)
    near = np.array(between.centroid.coords[0]) + np.linspace(0, 0.4, N)[:, None] * [0.0, 1.0]
    seen = dataclasses.replace(seen, xy_m=near)
    away_m = shapely.distance(between, shapely.points(seen.xy_m))
    assert away_m[0] == 0 < away_m[-1]
    weights = drawn.weights(seen)[:, 0]
    assert weights.shape == (N, len(np.unique(seen.track)))
    np.testing.assert_allclose(weights.sum(axis=1), np.clip(1 - away_m / 0.2, 0, 1))
    inside = dataclasses.replace(seen, way_out=np.zeros((N, 2)))
    assert not drawn.weights(inside).any()


def test_each_fish_is_drawn_to_the_way_out_from_anywhere_in_its_room(arena, seen):
    """However far it is from there; between the rooms it has no way out."""
    for label in ("drawn to the way out from anywhere", "turning to the way out from anywhere"):
        feature = labelled("boldness", f"{label}, by who", arena)
        far = dataclasses.replace(seen, xy_m=np.tile((0.06, 0.94), (N, 1)))
        between = dataclasses.replace(far, way_out=np.zeros((N, 2)))
        weights = feature.by if isinstance(feature, Turned) else feature.weights
        assert weights(far).any(axis=0).all()
        assert not weights(between).any()
    drawn = labelled("boldness", "drawn to the way out from anywhere, by who", arena)
    np.testing.assert_allclose(drawn.weights(far).sum(axis=-1), 1.0)


def test_turns_of_the_whole_law_count_along_walls_too(arena, seen):
    """Where those of the base's direction alone have none."""
    for name, label in (
        ("group-cohesion", "turning"), ("robot-avoidance", "turning"),
        ("directional-drift", "turning"),
    ):  # fmt: skip
        part, whole = (labelled(name, f"{label}{end}", arena) for end in ("", " as a whole"))
        assert (part.neighbours, whole.neighbours) == (False, True)
        off = ~seen.follows_walls
        assert not part.by(seen)[~off].any()
        assert whole.by(seen)[~off].any()
        np.testing.assert_array_equal(part.by(seen)[off], whole.by(seen)[off])


def test_each_fish_turns_to_the_way_out_in_a_measure_of_its_own(arena, seen):
    """To the left where the way out is there."""
    turning = labelled("boldness", "turning to the way out, by who", arena)
    (between,) = (zone.polygon for zone in arena.zones if zone.polygon is not None)
    seen = dataclasses.replace(seen, xy_m=np.tile(between.centroid.coords[0], (N, 1)))
    sine = (seen.way_out * left_of(seen.own_heading)).sum(axis=1)
    by = turning.by(seen).sum(axis=1)
    assert by.any()
    assert (by * sine >= 0).all()


def test_what_all_do_alike_is_gained_over(arena, seen):
    """Features of how fish differ, and of how much the fast draw, count from that."""
    for name, label in (
        ("boldness", "drawn to the way out, by who"),
        ("boldness", "turning to the way out, by who"),
        ("boldness", "drawn to the way out from anywhere, by who"),
        ("boldness", "turning to the way out from anywhere, by who"),
        ("boldness", "going on between the rooms, by who"),
        ("boldness", "leaning to the way out, by who"),
        ("leader-following", "leaning to the fast"),
    ):  # fmt: skip
        own = labelled(name, label, arena)
        assert type(own.over) is type(own)
        assert getattr(own, "counts_whole", False) == ("the way out" in label)
    (between,) = (zone.polygon for zone in arena.zones if zone.polygon is not None)
    near = dataclasses.replace(seen, xy_m=np.tile(between.centroid.coords[0], (N, 1)))
    leaning = labelled("boldness", "leaning to the way out, by who", arena)
    both = leaning.vectors(near).reshape(N, -1, 2, 2)
    np.testing.assert_allclose(both.sum(axis=1), leaning.over.vectors(near))
    np.testing.assert_allclose(leaning.over.vectors(near)[:, 0], near.way_out)
    far = dataclasses.replace(seen, xy_m=np.tile((0.06, 0.94), (N, 1)))
    np.testing.assert_allclose(leaning.over.vectors(far)[:, 1], far.way_out)
    drawn = labelled("boldness", "drawn to the way out, by who", arena)
    np.testing.assert_allclose(
        drawn.weights(near).sum(axis=-1, keepdims=True), drawn.over.weights(near)
    )
    fast = labelled("leader-following", "leaning to the fast", arena)
    alike = dataclasses.replace(seen, speed_m_s=np.full((N, OTHERS), 0.1))
    np.testing.assert_allclose(
        fast.vectors(alike).sum(axis=1), fast.over.vectors(alike)[:, 0], atol=1e-12
    )


def test_a_drift_may_begin(arena, seen):
    """Before it there is nothing."""
    later = labelled("directional-drift", "leaning, from 50% of the time on", arena)
    vectors = later.vectors(seen)
    assert not vectors[seen.time <= 0.5].any()
    np.testing.assert_array_equal(vectors[seen.time > 0.5], [np.eye(2)] * (seen.time > 0.5).sum())


def test_the_fast_draw_by_their_speeds(arena, seen):
    """Those within 20 cm, and none that stands still."""
    fast = labelled("leader-following", "leaning to the fast", arena)
    assert fast.vectors(seen).any()
    for changed in (
        {"speed_m_s": np.zeros((N, OTHERS))}, {"distance_m": np.full((N, OTHERS), 0.3)}
    ):  # fmt: skip
        assert not fast.vectors(dataclasses.replace(seen, **changed)).any()


def test_steps_are_sharper_by_their_speed(arena, seen):
    """In the mean as sharp as they are."""
    sharper = labelled("speed-turn-coupling", "sharper by speed", arena)
    np.testing.assert_allclose(sharper.by(seen).mean(axis=0), 0, atol=1e-12)
    assert sharper.by(seen).shape == (N, 4)


def test_responses_are_late_by_a_share_of_their_own_at_each_distance(arena, seen):
    """As much is taken from the present response as is put to where the other was."""
    late = labelled("reaction-delay", "3 steps, by distance", arena)
    np.testing.assert_array_equal(late.toward(seen), seen.ago_toward(3))
    weights = late.weights(seen)
    np.testing.assert_allclose(weights.sum(axis=-1), seen.attention)
    np.testing.assert_array_equal(late.instead(seen), weights)


def test_a_late_response_takes_from_the_present_one(arena, seen):
    """At a strength of one all attention goes to where the others were, or the fish itself too."""
    late = features_of("reaction-delay", arena)
    for each in late:
        if each.instead is not True:
            is_far = "far ones" in each.label
            beyond_m = re.search(r"beyond ([\d.]+) m", each.label)
            least_m = float(beyond_m[1]) if beyond_m else 0.06 if is_far else 0.0
            counts = seen.distance_m > least_m
            np.testing.assert_allclose(
                each.instead(seen).sum(axis=-1), seen.attention * counts, err_msg=each.label
            )
        assert each.low == 0.0
        # Three tenths of a step are three times one.
        tenths = each.label.startswith("a tenth of a step") and "sight" not in each.label
        assert each.high == (3.0 if tenths else 1.0)
    by_label = {each.label: each for each in late}
    for lag in LAGS:
        here, there = by_label[f"{lag} steps"], by_label[f"{lag} steps, from there"]
        np.testing.assert_array_equal(here.toward(seen), seen.ago_toward(lag))
        np.testing.assert_array_equal(there.toward(seen), seen.then_toward(lag))
        np.testing.assert_array_equal(there.weights(seen)[..., 0], seen.attention)


def test_near_ones_are_felt_at_once_or_late_as_well(arena, seen):
    """The base law draws away from them: from where they are, or from where they were."""
    near = np.zeros((N, OTHERS), dtype=bool)
    near[:, 1] = True
    seen = dataclasses.replace(seen, too_near=near)
    felt, late = (
        labelled("reaction-delay", label, arena).toward(seen)
        for label in ("2 steps", "2 steps, near ones too")
    )
    np.testing.assert_array_equal(felt[:, 1], seen.toward[:, 1])
    np.testing.assert_array_equal(felt[:, ::2], late[:, ::2])
    np.testing.assert_array_equal(late, seen.ago_toward(2))
    assert (felt[:, 1] != late[:, 1]).any()
    for steps in (1, 2, 3):
        then = labelled("reaction-delay", f"{steps} steps, by where they were", arena)
        np.testing.assert_array_equal(then.toward(seen), seen.shortly_ago_toward(steps))
        assert then.instead is True
    soon = labelled("reaction-delay", "a tenth of a step, near ones too", arena)
    np.testing.assert_array_equal(getattr(seen, soon.toward), seen.ago_toward(0.1))
    by_bearing = labelled("reaction-delay", "a tenth of a step, near ones too, by bearing", arena)
    np.testing.assert_allclose(by_bearing.weights(seen).sum(axis=-1), seen.attention)
    np.testing.assert_allclose(by_bearing.instead(seen), by_bearing.weights(seen))


def test_wide_turns_go_by_the_last_one_and_by_how_long_there_was_none(arena, seen):
    """Weights have a mean of 0 where they lean; each side gets what the time says."""
    for label, cue in (
        ("going straight, by the last turn", np.abs(seen.last_turn_rad)),
        ("going straight, by how long it did", seen.straight_s),
    ):
        vectors = labelled("turning-memory", label, arena).vectors(seen)
        weights = (vectors * seen.own_heading[:, None]).sum(axis=-1)
        np.testing.assert_allclose(vectors, weights[..., None] * seen.own_heading[:, None])
        np.testing.assert_allclose(weights.mean(axis=0), 0, atol=1e-12)
        # The last knot has its most where the cue has.
        assert weights[cue.argmax(), -1] == weights[:, -1].max() > 0
    everywhere, off_walls = (
        labelled("turning-memory", f"going straight, by the last turn{where}", arena).vectors(seen)
        for where in ("", ", off the walls")
    )
    assert not off_walls[seen.follows_walls].any()
    np.testing.assert_array_equal(off_walls[~seen.follows_walls], everywhere[~seen.follows_walls])
    aside = labelled("turning-memory", "turned by 70 degrees, by how long it swam straight", arena)
    ways = aside.toward(seen)
    turns = (ways * seen.own_heading[:, None]).sum(axis=-1)
    np.testing.assert_allclose(turns, math.cos(math.radians(70)))
    left = seen.own_heading[:, 0] * ways[:, 1, 1] - seen.own_heading[:, 1] * ways[:, 1, 0]
    assert (left > 0).all()
    np.testing.assert_allclose(ways.sum(axis=1), 2 * turns[:, :1] * seen.own_heading)
    long = dataclasses.replace(seen, straight_s=np.full(N, 9.0))
    np.testing.assert_array_equal(aside.weights(long), np.tile([0.0, 0, 0, 1], (N, 2, 1)))
    np.testing.assert_array_equal(aside.over.weights(seen), np.ones((N, 2, 1)))


def test_headings_go_by_the_speed_of_the_step_before(arena, seen):
    """As by that of the step."""
    known = dataclasses.replace(seen, last_speed_m_s=np.linspace(0.02, 0.2, N))
    vectors = labelled("speed-turn-coupling", "by the last speed", arena).vectors(known)
    weights = (vectors * seen.own_heading[:, None]).sum(axis=-1)
    np.testing.assert_allclose(weights.sum(axis=0), 0, atol=1e-12)
    assert weights[-1, -1] == pytest.approx(weights[:, -1].max())
    assert weights[-1, -1] > 0


def test_fish_may_leave_by_how_near_the_robot_is(arena, seen):
    """Or because one is in their room; other fish do not count."""
    leaving = labelled("robot-avoidance", "leaving its room while a robot is near", arena)
    near = dataclasses.replace(seen, distance_m=np.full((N, OTHERS), 0.1))
    np.testing.assert_allclose(leaving.weights(near)[:, 0], seen.is_robot.sum(axis=1))
    assert not leaving.weights(near)[:, 1].any()
    far = dataclasses.replace(seen, distance_m=np.full((N, OTHERS), 0.6))
    assert not leaving.weights(far).any()
    shared = labelled("robot-avoidance", "leaving a room with a robot in it", arena)
    one, other = (np.array(room.centroid.coords[0]) for room in find_rooms(arena)[1])
    for own, robot, with_it in ((one, one + 0.02, 1), (other, one, 0), (one, other, 0)):
        to_robot = robot - own
        far_m = np.linalg.norm(to_robot)
        placed = dataclasses.replace(
            seen, xy_m=np.tile(own, (N, 1)), distance_m=np.tile([0.01, 0.01, far_m], (N, 1)),
            bearing=np.tile(to_robot / far_m, (N, OTHERS, 1)),
        )  # fmt: skip
        np.testing.assert_array_equal(shared.weights(placed), np.full((N, 1), with_it))


def test_who_heeds_nobody_has_as_much_of_its_own_way_as_of_all(arena, seen):
    """A share of all headings goes the own way: half each way along walls, else ahead."""
    nobody = labelled("habituation", "heeding nobody, by the time", arena)
    assert nobody.kappa == "own"
    toward, weights = nobody.toward(seen), nobody.weights(seen)
    whole = 1 + seen.attention.sum(axis=1)
    np.testing.assert_allclose(weights.sum(axis=(1, 2)), whole)
    np.testing.assert_allclose(weights.sum(axis=2), nobody.over.weights(seen)[..., 0])
    for column, time in enumerate((0.0, 0.5, 1.0)):
        then = nobody.weights(dataclasses.replace(seen, time=np.full(N, time)))
        np.testing.assert_allclose(then[..., column].sum(axis=1), whole)
    along = seen.follows_walls
    assert along.any()
    assert not along.all()
    np.testing.assert_array_equal(toward[along, 0], seen.along_wall[along])
    np.testing.assert_array_equal(toward[along, 1], -seen.along_wall[along])
    np.testing.assert_array_equal(toward[~along, 0], seen.own_heading[~along])
    np.testing.assert_allclose(weights[along, 0], weights[along, 1])
    assert not weights[~along, 1].any()


def test_robots_are_heeded_by_their_speed(arena, seen):
    """Fish are not, and all robots count at one speed or another."""
    robots = labelled("robot-avoidance", "attention to robots, by their speed", arena)
    weights = robots.weights(seen)
    assert not weights[~seen.is_robot].any()
    np.testing.assert_allclose(weights.sum(axis=2), seen.attention * seen.is_robot)
    for column, speed_m_s in enumerate((0.03, 0.07, 0.12)):
        own = np.full((N, OTHERS), speed_m_s)
        weights = robots.weights(dataclasses.replace(seen, speed_m_s=own))
        np.testing.assert_allclose(weights[..., column], seen.attention * seen.is_robot)


def test_who_is_in_front_is_the_nearest_ahead(arena, seen):
    """Within 60 degrees of the heading; nobody there is far away."""
    ahead = np.array([[0.2, 1.0, 3.0]] * N)
    far = np.array([[0.3, 0.1, 0.05]] * N)
    here = np.ones((N, OTHERS), dtype=bool)
    here[0, :2] = False
    seen = dataclasses.replace(seen, off_axis_rad=ahead, distance_m=far, here=here)
    np.testing.assert_array_equal(seen.in_front_m, [AWAY_M] + [0.1] * (N - 1))
    own = labelled("rear-blind-zone", "attention to those behind, by who is in front", arena)
    weights = own.weights(seen)
    # Those behind, and all, each while somebody is near in front and while nobody is.
    assert weights.shape == (N, OTHERS, 4)
    np.testing.assert_allclose(weights[0, :, 0], 0.0)
    np.testing.assert_allclose(weights[0, 2, 1], seen.attention[0, 2])
    np.testing.assert_allclose(weights[1:, 2, 0], seen.attention[1:, 2])
    np.testing.assert_allclose(weights[1:, :, 2], seen.attention[1:])
    assert not weights[1:, :, [1, 3]].any()


def test_each_that_left_counts_though_it_is_back(arena, seen):
    """Two that left draw out twice as much as one, and who left long ago does not count."""
    freshly, drawn = (
        next(each for each in features_of("collective-departure", arena) if each.label == label)
        for label in ("time, though it came back", "drawn out by each")
    )
    since = np.full((N, OTHERS), np.inf)
    one, two = since.copy(), since.copy()
    one[:, 0] = two[:, :2] = 2.0
    weights = [
        freshly.weights(dataclasses.replace(seen, each_left_s=each)) for each in (since, one, two)
    ]
    assert not weights[0].any()
    np.testing.assert_allclose(weights[2], 2 * weights[1])
    assert weights[1].sum(axis=1) == pytest.approx(1.0)
    found = drawn.weights(dataclasses.replace(seen, each_left_s=two))
    np.testing.assert_array_equal(found[:, 0], weights[2])
    long_ago = dataclasses.replace(seen, each_left_s=np.full((N, OTHERS), 60.0))
    assert not freshly.weights(long_ago).any()


def test_the_nearest_alone_is_a_range_by_rank(arena, seen):
    """Who is farther than the nearest, and than the two nearest, may lose attention."""
    by_rank = features_of("interaction-range", arena)[1]
    ranks = np.argsort(np.argsort(seen.distance_m, axis=1), axis=1)
    expected = np.stack([ranks > 0, ranks > 1], axis=-1) * seen.attention[..., None]
    np.testing.assert_array_equal(by_rank.weights(seen), expected)


def test_habituation_to_robots_leaves_fish_as_they_are(arena, seen):
    """Attention to fish does not change with the time."""
    to_robots = labelled("habituation", "attention to robots", arena).weights(seen)
    assert not to_robots[~seen.is_robot].any()
    assert to_robots[seen.is_robot].any()


def test_habituation_is_a_change_and_may_be_each_fishs_own(arena, seen):
    """Who is avoided all the time that it is there is not habituated to: in the mean nothing is."""
    late = np.arange(N) >= N // 2
    for here in (np.ones(N, dtype=bool), late):
        robot = np.zeros((N, OTHERS), dtype=bool)
        robot[here, 1] = True
        to_robots = labelled("habituation", "attention to robots", arena)
        weights = to_robots.weights(dataclasses.replace(seen, is_robot=robot))
        assert not weights[~robot].any()
        np.testing.assert_allclose(weights.sum(axis=(0, 1)), 0.0, atol=1e-12)
    assert np.ptp(weights[robot], axis=0).max() > 0.1

    each = labelled("habituation", "attention, each fish", arena).weights(seen)
    tracks = each_fish(seen)
    each = each.reshape(N, OTHERS, tracks.shape[1], -1)
    for k in range(tracks.shape[1]):
        assert not each[tracks[:, k] == 0, :, k].any()
        np.testing.assert_allclose(each[:, :, k].sum(axis=(0, 1)), 0.0, atol=1e-12)


def test_a_sense_of_travel_is_counted_along_walls_alone(arena, seen):
    """Half of the mixture one way more, half of it the other way less."""
    share = features_of("wall-persistence", arena)[0]
    ahead = share.toward(seen)[:, 0]
    assert ((ahead * seen.own_heading).sum(axis=1) >= 0).all()
    np.testing.assert_array_equal(
        share.weights(seen)[:, 0, 0], np.where(seen.follows_walls, 0.5, 0)
    )


def test_places_of_a_room_pull_those_in_it_alone(arena, seen):
    """Each spot is asked from everywhere, and from its own room."""
    first = find_effect("place-preference").features(arena)[0]
    far = dataclasses.replace(seen, xy_m=np.full((N, 2), 0.9) * [1.0, 0.15])
    sums = [each.weights(far).sum() for each in first.features]
    assert 0 < sum(total == 0 for total in sums) < len(sums)


def test_places_between_are_looked_at_as_well(arena):
    """Up to nine about each: the place itself, and those a third of the way to the next ones."""
    drawn, *_ = find_effect("place-preference").features(arena)
    near = [drawn.near(k) for k in range(len(drawn.features))]
    assert max(map(len, near)) == 9
    assert drawn.n_tried == sum(map(len, near))
    for each, some in zip(drawn.features, near, strict=True):
        labels = [one.label for one in some]
        assert each.label in labels
        assert len(set(labels)) == len(labels)
        for label in labels:
            spot = [float(part) for part in label.removeprefix("drawn to ").split(", ")]
            assert arena.outline.distance(shapely.Point(spot)) < 0.01


def test_the_fastest_in_view_is_one_fish(arena, seen):
    """Of those that are seen: one that is fast and not seen is none."""
    weights = find_effect("leader-following").features(arena)[1].weights(
        dataclasses.replace(seen, speed_m_s=np.tile([0.1, 0.2, 0.3], (N, 1)),
                            attention=np.tile([1.0, 2.0, 0.0], (N, 1)))
    )  # fmt: skip
    np.testing.assert_array_equal(weights[..., 0], np.tile([0.0, 2.0, 0.0], (N, 1)))


def test_the_fastest_over_two_seconds_is_one_fish(arena, seen):
    """Whatever its last step was."""
    feature = labelled("leader-following", "the fastest in view, over two seconds", arena)
    weights = feature.weights(
        dataclasses.replace(seen, lately_m_s=np.tile([0.3, 0.1, 0.2], (N, 1)),
                            speed_m_s=np.tile([0.1, 0.2, 0.3], (N, 1)),
                            attention=np.tile([2.0, 1.0, 1.0], (N, 1)))
    )  # fmt: skip
    np.testing.assert_array_equal(weights[..., 0], np.tile([2.0, 0.0, 0.0], (N, 1)))


def test_the_fastest_over_some_time_is_in_view_and_near(seen):
    """By the mean of that time; not who is hidden or far, nor a slower one where that is asked."""
    some = dataclasses.replace(
        seen,
        mean_speeds_m_s={
            0.6: (np.tile([0.1, 0.2, 0.3], (N, 1)), np.linspace(0.02, 0.12, N)),
            2.0: (np.tile([0.3, 0.2, 0.1], (N, 1)), np.zeros(N)),
        }.__getitem__,
        in_sight=np.tile([True, True, False], (N, 1)),
        distance_m=np.tile([0.05, 0.2, 0.05], (N, 1)),
    )
    for over_s, within_m, expected in ((0.6, 0.3, 1), (0.6, 0.1, 0), (2.0, 0.3, 0)):
        chosen = some.fastest(over_s, within_m, if_faster=False)[..., 0]
        np.testing.assert_array_equal(chosen, np.tile(np.arange(OTHERS) == expected, (N, 1)))
    faster = some.fastest(0.6, 0.1, if_faster=True)[..., 0]
    np.testing.assert_array_equal(faster[:, 0], np.linspace(0.02, 0.12, N) < 0.1)
    assert not faster[:, 1:].any()
    # Who rests has a speed: the others are faster.
    np.testing.assert_array_equal(some.fastest(2.0, 0.3, if_faster=True)[:, 0, 0], 1)


def test_a_current_may_lean_more_across_walls_than_along(arena, seen):
    """The axes of the tank, and what of each is across the wall; off the walls nothing more."""
    feature = labelled("directional-drift", "leaning, more across walls", arena)
    vectors = feature.vectors(seen)
    axes, across = vectors[:, :2], vectors[:, 2:]
    np.testing.assert_array_equal(
        axes, labelled("directional-drift", "leaning", arena).vectors(seen)
    )
    wall = seen.follows_walls
    assert not across[~wall].any()
    np.testing.assert_allclose(
        (across[wall] * seen.along_wall[wall, None]).sum(axis=2), 0, atol=1e-9
    )
    aside = np.stack([-seen.along_wall[:, 1], seen.along_wall[:, 0]], axis=1)
    expected = (axes * aside[:, None]).sum(axis=2)[wall]
    np.testing.assert_allclose((across * aside[:, None]).sum(axis=2)[wall], expected)


def test_where_there_is_never_more_than_one_other_none_is_the_fastest(arena, seen):
    """But it may be fast, or faster than the fish itself; and of two one may not be seen."""
    pair = dataclasses.replace(
        seen, here=np.tile([True, False, False], (N, 1)), distance_m=np.full((N, OTHERS), 0.05),
        in_sight=np.tile([True, False, False], (N, 1)), speed_m_s=np.full((N, OTHERS), 0.12),
    )  # fmt: skip
    kinds = {"drawn to the fastest", "drawn to the fastest in view"}
    asked = [
        each
        for feature in find_effect("leader-following").features(arena)
        if isinstance(feature, OneOf) and (feature.kind in kinds or "over some" in feature.kind)
        for each in feature.features
    ]
    conditional = [feature.label for feature in asked if feature.weights(pair).any()]
    expected = [
        feature.label
        for feature in asked
        if any(part in feature.label for part in ("faster", "from 0.07", "from 0.09", "from 0.11"))
    ]
    assert conditional == expected
    often = np.tile([True, False, False], (N, 1))
    often[0] = True
    assert all(
        feature.weights(dataclasses.replace(pair, here=often))[1:].any() for feature in asked
    )


def test_some_are_drawn_sharply_to_each_in_view(arena, seen):
    """Within some distance."""
    (sort,) = (
        each
        for each in find_effect("group-cohesion").features(arena)
        if isinstance(each, OneOf) and each.kind == "drawn to each in view, sharply"
    )
    for feature, reach_m in zip(sort.features, (0.1, 0.25, 9.0), strict=True):
        near = seen.in_sight & (seen.distance_m < reach_m)
        np.testing.assert_array_equal(feature.weights(seen)[..., 0], near)
        assert feature.kappa == 8.0


def test_each_sort_of_the_fastest_is_asked_over_each_time(arena, seen):
    """And what is asked is the one of its label."""
    sorts = [
        each
        for each in find_effect("leader-following").features(arena)
        if isinstance(each, OneOf) and each.kind.endswith("over some time")
    ]
    assert sorted(len(each.features) for each in sorts) == [8, 24]
    for feature in sorts[0].features + sorts[1].features:
        over_s, within_m = (
            float(part)
            for part in feature.label.split(" of ")[1].split(" m")[0].split(" s within ")
        )
        chosen = seen.fastest(over_s, within_m, if_faster="if it was" in feature.label)
        own = seen.attention[..., None] if feature.label.startswith("heeding") else 1.0
        np.testing.assert_array_equal(feature.weights(seen), own * chosen)


def test_steps_end_nearer_by_how_long_they_are(arena, seen):
    """A tenth of a metre a second counts as one; by how far others are: near or not."""
    near, far = ({"distance_m": np.full((N, OTHERS), away)} for away in (0.01, 0.4))
    fast = {"own_speed_m_s": np.full(N, 0.2)}
    asked = labelled("group-cohesion", "ending nearer to each", arena)
    for some, weight in ((near, 0), (far, 1)):
        vectors = asked.vectors(dataclasses.replace(seen, **some, **fast))
        np.testing.assert_allclose(vectors[:, weight], 2 * seen.bearing.sum(axis=1))
        assert not vectors[:, 1 - weight].any()
    one = labelled("group-cohesion", "ending nearer to the nearest", arena)
    vectors = one.vectors(dataclasses.replace(seen, **fast)).sum(axis=1)
    nearest = seen.distance_m.argmin(axis=1)
    np.testing.assert_allclose(vectors, 2 * seen.bearing[np.arange(N), nearest])
    middle = labelled("group-cohesion", "ending nearer to the middle", arena)
    vectors = middle.vectors(dataclasses.replace(seen, **fast)).sum(axis=1)
    mean = (seen.distance_m[..., None] * seen.bearing).mean(axis=1)
    np.testing.assert_allclose(vectors, 2 * mean / np.linalg.norm(mean, axis=1, keepdims=True))


def test_slow_steps_may_turn_back_and_fast_ones_aside(arena, seen):
    """A component about the way back by speed, and an axis by what speed has beside its mean."""
    back = labelled("speed-turn-coupling", "turning back, by speed", arena)
    np.testing.assert_array_equal(back.toward(seen)[:, 0], -seen.own_heading)
    slow = dataclasses.replace(seen, own_speed_m_s=np.zeros(N))
    np.testing.assert_array_equal(back.weights(slow)[:, 0, 0], np.ones(N))
    assert back.over is not None
    aside = labelled("speed-turn-coupling", "straight or aside, by speed", arena)
    assert aside.axial
    assert not aside.vectors(slow).any()
    x, y = seen.own_heading.T
    doubled = np.stack([x * x - y * y, 2 * x * y], axis=1)
    by = hats(seen.own_speed_m_s, (0.0, 0.05, 0.1, 0.15, 0.2))
    expected = (by - by.mean(axis=0))[:, 1:, None] * doubled[:, None]
    np.testing.assert_allclose(aside.vectors(seen), expected)


def test_the_foremost_is_the_one_most_straight_ahead(arena, seen):
    """Nobody beside or behind is; its heading counts by its distance."""
    some = dataclasses.replace(
        seen,
        off_axis_rad=np.array([[0.2, 0.5, 3.0], [1.7, 2.0, 3.0]] * (N // 2)),
        distance_m=np.full((N, OTHERS), 0.05),
    )
    chosen = some.foremost[..., 0]
    np.testing.assert_array_equal(chosen, [[1, 0, 0], [0, 0, 0]] * (N // 2))
    vectors = labelled("alignment", "leaning, the foremost", arena).vectors(some)
    np.testing.assert_allclose(vectors.sum(axis=1)[::2], some.heading[::2, 0])
    assert not vectors[1::2].any()


def test_headings_count_by_bearing_and_distance(arena, seen):
    """Within 0.4 m the weights of each other one add up to one."""
    near = dataclasses.replace(seen, distance_m=np.full((N, OTHERS), 0.05))
    vectors = labelled("alignment", "leaning, by bearing", arena).vectors(near)
    assert vectors.shape == (N, 12, 2)
    np.testing.assert_allclose(vectors.sum(axis=1), near.heading.sum(axis=1))


def test_a_course_is_the_mean_of_some_headings(arena, seen):
    """A fish that went straight on is drawn straight on."""
    ahead = np.broadcast_to(seen.own_heading, seen.ago_heading.shape)
    straight = dataclasses.replace(seen, ago_heading=ahead)
    for steps in (3, 5, 9):
        feature = labelled("turning-memory", f"drawn to the course of {steps} steps", arena)
        np.testing.assert_allclose(feature.toward(straight)[:, 0], seen.own_heading)


def test_steps_are_sharper_by_the_last_turn_along_walls_or_not(arena, seen):
    """Everywhere, or off the walls alone."""
    turned = dataclasses.replace(seen, last_turn_rad=np.linspace(-2, 2, N))
    along = labelled("turning-memory", "sharper by the last turn", arena).by(turned)
    off = labelled("turning-memory", "sharper by the last turn, off the walls", arena).by(turned)
    np.testing.assert_allclose(along.sum(axis=0), 0.0, atol=1e-12)
    assert not off[turned.follows_walls].any()
    np.testing.assert_array_equal(off[~turned.follows_walls], along[~turned.follows_walls])


def test_an_axis_has_two_ways(arena, seen):
    """Headings are drawn to one as much as to the other."""
    feature = labelled("directional-drift", "drawn along 60 degrees", arena)
    ways = feature.toward(seen)
    np.testing.assert_allclose(ways[:, 0], np.tile([0.5, np.sqrt(0.75)], (N, 1)))
    np.testing.assert_allclose(ways[:, 0], -ways[:, 1])
    assert (feature.weights(seen) == 1).all()


def test_who_leaves_when_is_none_of_what_all_do(arena, seen):
    """Over all fish the weights of a moment add up to nothing, beside those of all."""
    three = dataclasses.replace(
        seen, track=np.array([3, 4, 5] * 2, dtype=np.int32), time=np.full(N, 0.25)
    )
    feature = labelled("boldness", "who, by the time", arena)
    weights, common = feature.weights(three), feature.over.weights(three)
    assert weights.shape == (N, 8)
    np.testing.assert_array_equal(weights[:, :2], common)
    each = weights[:3, 2:]
    np.testing.assert_allclose(each[1:].sum(axis=0), -each[0])
    assert np.abs(each).sum(axis=1).min() > 0


def test_a_course_is_as_long_as_the_others_were_fast(arena, seen):
    """Of who is not seen it counts by distance alone."""
    far = dataclasses.replace(
        seen, distance_m=np.full((N, OTHERS), 0.6), in_sight=np.zeros((N, OTHERS), dtype=bool)
    )
    vectors = labelled("alignment", "leaning, their course", arena).vectors(far)
    assert not vectors.any()
    near = dataclasses.replace(far, distance_m=np.zeros((N, OTHERS)))
    vectors = labelled("alignment", "leaning, their course", arena).vectors(near)
    np.testing.assert_allclose(vectors[:, 0], near.course.sum(axis=1) / 0.05)


def test_landings_by_hand(arena, seen):
    """Distances to a wall, a place, the robot, and how long an arc is."""
    rows = np.array([0, 3])
    xy = np.array([[[0.9, 0.2], [0.94, 0.3]], [[0.9, 0.1], [0.95, 0.5]]])
    wall = labelled("place-preference", "landing at the wall at 0.95, 0.23", arena)
    far = wall.away_m(seen, rows, xy)
    np.testing.assert_allclose(far, [[0.05, 0.01], [0.05, 0.1]], atol=2e-3)
    robot = labelled("robot-avoidance", "landing near it", arena)
    at = seen.xy_m + (seen.bearing * seen.distance_m[..., None])[:, -1]
    found = robot.away_m(seen, rows, at[rows][:, None] + [[[0.03, 0.04]]])
    np.testing.assert_allclose(found, 0.05)
    nobody = dataclasses.replace(seen, is_robot=np.zeros((N, OTHERS), dtype=bool))
    assert (robot.away_m(nobody, rows, xy) == AWAY_M).all()
    aside = labelled("speed-turn-coupling", "landing aside", arena)
    ends = seen.xy_m[rows, None] + 0.02 * left_of(seen.own_heading[rows])[:, None]
    np.testing.assert_allclose(aside.away_m(seen, rows, ends), 0.02 * np.pi / 2)
    np.testing.assert_allclose(aside.over.away_m(seen, rows, ends), np.pi / 2)


def test_who_goes_on_between_the_rooms_counts_there_alone(arena, seen):
    """Each fish by its own heading; in a room nothing."""
    feature = labelled("boldness", "going on between the rooms, by who", arena)
    middle = arena.zones[[z.name for z in arena.zones].index("corridor")].polygon.centroid
    inside = dataclasses.replace(seen, xy_m=np.tile([middle.x, middle.y], (N, 1)))
    np.testing.assert_allclose(feature.vectors(inside).sum(axis=1), seen.own_heading)
    outside = dataclasses.replace(seen, xy_m=np.tile([0.1, 0.8], (N, 1)))
    assert not feature.vectors(outside).any()


def test_a_pull_to_one_fish_is_asked_of_each(arena, seen):
    """Of two fish and a robot: the robot is nobody's leader, and there is no third fish."""
    found = find_effect("leader-following").features(arena)
    (drawn,) = [each for each in found if getattr(each, "kind", "") == "drawn to one"]
    other = np.tile(np.array([4, 7, 9], dtype=np.int32), (N, 1))
    robot = np.tile([False, False, True], (N, 1))
    some = dataclasses.replace(seen, other=other, is_robot=robot)
    sums = [each.weights(some).sum(axis=(0, 2)).tolist() for each in drawn.features]
    assert sums[:2] == [[N, 0, 0], [0, N, 0]]
    assert not np.any(sums[2:])


def test_who_is_alone_has_no_features_of_others(arena, seen):
    """No others at all: weights of no source, and no failure."""
    shapes = {name: getattr(seen, name) for name in _OF_OTHERS}
    none = dataclasses.replace(
        seen,
        **{name: values[:, :0] for name, values in shapes.items()},
        attention=seen.attention[:, :0],
        bearing=seen.bearing[:, :0],
        heading=seen.heading[:, :0],
        in_sight=seen.in_sight[:, :0],
        other=seen.other[:, :0],
        mean_speeds_m_s=lambda _over_s: (np.zeros((N, 0)), np.zeros(N)),
    )
    assert none.nearest.shape == (N, 0, 1)
    for each in find_effect("leader-following").features(arena):
        for some in each.features if isinstance(each, OneOf) else (each,):
            made = some.vectors(none) if isinstance(some, Tilt) else some.weights(none)
            assert not made.any()


def test_all_that_are_no_long_track_are_one_fish(seen):
    """Each step is of one fish, and the longest tracks have one each."""
    many = dataclasses.replace(seen, track=np.array([7, 7, 7, 2, 2, 1], dtype=np.int32))
    np.testing.assert_array_equal(
        each_fish(many), [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0]]
    )
    found = each_fish(SimpleNamespace(track=np.arange(40, dtype=np.int32)))
    assert found.shape == (40, 12)
    np.testing.assert_array_equal(found.sum(axis=1), 1.0)
    np.testing.assert_array_equal(found.sum(axis=0), [1.0] * 11 + [29.0])


def test_a_bias_may_be_each_ones_own(arena, seen):
    """Some lean to the left, others to the right: no strength is shared."""
    leaning = labelled("turning-bias", "leaning, by who", arena).vectors(seen)
    for step, track in enumerate(seen.track):
        own = np.flatnonzero(leaning[step].any(axis=1))
        assert len(own) == 1
        np.testing.assert_allclose(leaning[step, own[0]], left_of(seen.own_heading)[step])
        others = leaning[seen.track != track]
        assert not others[:, own[0]].any()


def test_what_draws_may_wander_or_be_an_axis(arena, seen):
    """Hat functions of the time with a direction each; twice the angle of an axis."""
    wandering = labelled("directional-drift", "leaning, by the time", arena).vectors(seen)
    assert wandering.shape == (N, 6, 2)
    np.testing.assert_allclose(wandering[0], [[1, 0], [0, 1], *4 * [[0, 0]]])
    np.testing.assert_allclose(wandering[-1], [*4 * [[0, 0]], [1, 0], [0, 1]])
    axis = labelled("directional-drift", "leaning along an axis", arena)
    assert axis.axial
    by = 0.4
    turned = dataclasses.replace(seen, x_axis=turned_by(seen.x_axis, by))
    np.testing.assert_allclose(axis.vectors(turned), turned_by(axis.vectors(seen), 2 * by))


def test_what_draws_may_swing(arena, seen):
    """Three times to and fro: back after a third of the time, the other way after a sixth."""
    swing = labelled("directional-drift", "leaning, 3 times to and fro", arena)

    def vectors(time):
        return swing.vectors(dataclasses.replace(seen, time=np.full(N, time)))

    np.testing.assert_allclose(vectors(0.1 + 1 / 3), vectors(0.1), atol=1e-9)
    np.testing.assert_allclose(vectors(0.1 + 1 / 6), -vectors(0.1), atol=1e-9)
    turned = dataclasses.replace(seen, x_axis=turned_by(seen.x_axis, 0.7))
    np.testing.assert_allclose(swing.vectors(turned), turned_by(swing.vectors(seen), 0.7))


def test_half_way_is_between_the_own_heading_and_anothers(arena, seen):
    """The same angle from both; nothing where nobody is."""
    drawn = labelled("alignment", "drawn half-way", arena)
    between = drawn.toward(seen)
    by_own = np.einsum("sjd,sd->sj", between, seen.own_heading)
    by_other = np.einsum("sjd,sjd->sj", between, seen.heading)
    np.testing.assert_allclose(by_own, by_other)
    np.testing.assert_allclose(np.linalg.norm(between, axis=-1), 1.0)
    nobody = dataclasses.replace(seen, heading=np.zeros_like(seen.heading))
    assert not drawn.toward(nobody).any()


def test_along_a_wall_fish_may_go_as_others_do(arena, seen):
    """By the mean of those in view; off the walls nothing, and what one sense gains one loses."""
    feature = labelled("alignment", "along the wall as others within 9 m do", arena)
    with_wall = np.repeat(seen.along_wall[:, None], OTHERS, axis=1)
    same = dataclasses.replace(seen, heading=with_wall, in_sight=np.ones((N, OTHERS), dtype=bool))
    weights = feature.weights(same)
    np.testing.assert_allclose(weights[:, 0, 0], np.where(seen.follows_walls, 0.5, 0.0))
    np.testing.assert_array_equal(weights[:, 0], -weights[:, 1])
    unseen = dataclasses.replace(same, in_sight=np.zeros((N, OTHERS), dtype=bool))
    assert not feature.weights(unseen).any()


def test_who_swims_the_way_of_the_fish_leads_it(arena, seen):
    """Straight ahead with its heading all of it; behind, or against it, nothing."""
    feature = labelled("leader-following", "who is ahead and swims its way", arena)
    own = np.repeat(seen.own_heading[:, None], OTHERS, axis=1)
    ahead = dataclasses.replace(seen, heading=own, off_axis_rad=np.zeros((N, OTHERS)))
    np.testing.assert_allclose(feature.weights(ahead)[..., 0], seen.attention)
    behind = dataclasses.replace(ahead, off_axis_rad=np.full((N, OTHERS), 2.0))
    assert not feature.weights(behind).any()
    assert not feature.weights(dataclasses.replace(ahead, heading=-own)).any()


def test_the_fastest_in_view_draws_from_a_speed_on(arena, seen):
    """One of those in view, and none where all are slow."""
    feature = labelled("leader-following", "drawn to the fastest in view, from 0.09 m/s on", arena)
    every = np.ones((N, OTHERS), dtype=bool)
    quick = dataclasses.replace(
        seen, speed_m_s=np.tile([0.1, 0.15, 0.12], (N, 1)), in_sight=every
    )  # fmt: skip
    np.testing.assert_array_equal(feature.weights(quick)[..., 0], np.tile([0.0, 1, 0], (N, 1)))
    hidden = dataclasses.replace(quick, in_sight=np.tile([True, False, True], (N, 1)))
    np.testing.assert_array_equal(feature.weights(hidden)[..., 0], np.tile([0.0, 0, 1], (N, 1)))
    slow = dataclasses.replace(seen, speed_m_s=np.full((N, OTHERS), 0.08))
    assert not feature.weights(slow).any()


def test_old_headings_and_turns_to_one_side_draw(arena, seen):
    """To where the fish was heading; on from where it heads, to the side of its last turn."""
    old = labelled("turning-memory", "drawn to the heading 3 steps before, everywhere", arena)
    np.testing.assert_array_equal(old.toward(seen)[:, 0], seen.ago_heading[2])
    assert (old.weights(seen) == 1).all()
    on = labelled("turning-memory", "drawn 50 degrees on, after two turns to one side", arena)
    for turn, turn_before, weight in (
        (0.3, 0.2, 1.0), (0.3, -0.2, 0.0), (0.3, 0.01, 0.0), (1.2, 0.01, 0.0),
    ):  # fmt: skip
        before = turned_by(seen.own_heading, -turn)
        ago = seen.ago_heading.copy()
        ago[0], ago[1] = before, turned_by(before, -turn_before)
        known = dataclasses.replace(seen, ago_heading=ago, last_turn_rad=np.full(N, turn))
        assert (on.weights(known) == weight).all()
        np.testing.assert_allclose(
            on.toward(known)[:, 0], turned_by(seen.own_heading, np.radians(50))
        )


def test_tenths_of_a_step_count_for_those_that_are_not_next_to_the_fish(arena, seen):
    """Those are felt at once, under all circumstances; of the others all of the attention."""
    near = dataclasses.replace(seen, distance_m=np.full((N, OTHERS), 0.05))
    far = dataclasses.replace(seen, distance_m=np.full((N, OTHERS), 0.1))
    for label in ("", ", by who", ", by the zone", ", by the time", ", by the last turn"):
        sight = labelled("reaction-delay", f"a tenth of a step, sight, far ones{label}", arena)
        assert not sight.weights(near).any()
        np.testing.assert_allclose(sight.weights(far).sum(axis=-1), seen.attention_ago(0.1))
        np.testing.assert_allclose(sight.instead(far).sum(axis=-1), seen.attention)
    by_zone = labelled("reaction-delay", "a tenth of a step, far ones, by the zone", arena)
    np.testing.assert_allclose(
        by_zone.weights(far)[..., 0], seen.attention * (seen.zone == 1)[:, None]
    )
    assert by_zone.instead is by_zone.weights
    by_distance = labelled("reaction-delay", "a tenth of a step, by distance", arena)
    near = dataclasses.replace(seen, distance_m=np.full((N, OTHERS), 0.03))
    np.testing.assert_allclose(by_distance.weights(near)[..., 0], seen.attention)


def test_others_in_another_room_are_a_share(arena, seen):
    """Two of three are in the other room; between the rooms nobody is elsewhere."""
    feature = labelled("collective-departure", "others elsewhere", arena)
    one, other = (room.representative_point() for room in find_rooms(arena)[1])
    there = np.array([(one.x, one.y), (other.x, other.y), (other.x, other.y)])

    def weights(x, y):
        apart = there - (x, y)
        far = np.linalg.norm(apart, axis=1)
        moved = dataclasses.replace(
            seen, xy_m=np.tile((x, y), (N, 1)), distance_m=np.tile(far, (N, 1)),
            bearing=np.tile(apart / np.maximum(far, 1e-9)[:, None], (N, 1, 1)),
        )  # fmt: skip
        turned = dataclasses.replace(
            moved, bearing=turned_by(moved.bearing, 0.7), x_axis=turned_by(moved.x_axis, 0.7)
        )
        np.testing.assert_allclose(feature.weights(turned), feature.weights(moved))
        np.testing.assert_array_equal(feature.weights(moved)[:, :-1], feature.over.weights(moved))
        return feature.weights(moved)[:, -1]

    np.testing.assert_allclose(weights(one.x, one.y), 2 / 3)
    (between,) = (zone.polygon for zone in arena.zones if zone.polygon is not None)
    assert not weights(*between.centroid.coords[0]).any()


def test_fish_lean_to_the_mean_heading_within_reach_or_off_the_walls(arena, seen):
    """The unit vector of the sum; nobody within reach, no leaning."""
    near = seen.distance_m < 0.25
    total = (seen.heading * near[..., None]).sum(axis=1)
    mean = labelled("alignment", "leaning, the mean within 0.25 m", arena).vectors(seen)[:, 0]
    some = near.any(axis=1)
    assert some.any()
    expected = total[some] / np.linalg.norm(total[some], axis=1)[:, None]
    np.testing.assert_allclose(mean[some], expected)
    assert not mean[~some].any()
    off = labelled("alignment", "leaning, the mean within 0.25 m, off the walls", arena)
    expected = np.where(seen.follows_walls[:, None], 0.0, mean)
    np.testing.assert_array_equal(off.vectors(seen)[:, 0], expected)


def test_fish_lean_to_those_in_sight_who_agree(arena, seen):
    """Two at least, by the length of their mean heading: 0.7, 0.85 and 1; who is unseen is none."""
    angle = np.array([[0.0, 0.0, 2.0], [0.0, math.acos(0.7) * 2, 3.0], [0.0, 3.0, 0.0]] * 2)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    see = np.tile([True, True, False], (len(angle), 1))
    see[3:, 1] = False
    now = dataclasses.replace(
        seen, heading=heading, in_sight=see, distance_m=np.full(angle.shape, 0.1)
    )
    vectors = labelled("alignment", "leaning, those seen within 0.25 m who agree", arena).vectors
    found, half = vectors(now), math.acos(0.7)
    np.testing.assert_allclose(found[0], [[0, 0], [0, 0], [1, 0]], atol=1e-12)
    np.testing.assert_allclose(
        found[1], [[math.cos(half), math.sin(half)], [0, 0], [0, 0]], atol=1e-9
    )
    assert not found[2:].any()
    assert not vectors(dataclasses.replace(now, distance_m=np.full(angle.shape, 0.26))).any()
    mean = labelled("alignment", "leaning, the mean within 0.25 m, in sight", arena).vectors(now)
    np.testing.assert_allclose(mean[3:, 0], [[1.0, 0.0]] * 3, atol=1e-12)
    every = labelled("alignment", "leaning, the mean within 0.25 m", arena).vectors(now)
    assert (np.abs(every[3:, 0] - [1.0, 0.0]).max(axis=1) > 0.1).all()


def test_slow_steps_may_be_scattered(arena, seen):
    """About the own heading, by the speed, and beyond what is so at all speeds."""
    feature = labelled("speed-turn-coupling", "scattered, by speed", arena)
    np.testing.assert_array_equal(feature.toward(seen)[:, 0], seen.own_heading)
    np.testing.assert_allclose(
        feature.weights(seen).sum(axis=-1), feature.over.weights(seen)[..., 0]
    )
    slow = dataclasses.replace(seen, own_speed_m_s=np.zeros(N))
    np.testing.assert_allclose(feature.weights(slow)[:, 0], np.tile([1.0, 0, 0, 0, 0], (N, 1)))
