"""Generic effects respond to their cue, in the direction that their sentences say."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from zfcal.model.onestep import heading_density

STRENGTH = {"strength": 0.5}


def log_odds(asked, toward, *, i=0):
    """Return the log of the factor on a heading over that on its opposite."""
    return math.log(asked.factor(toward, i=i) / asked.factor(toward + math.pi, i=i))


@pytest.mark.parametrize(
    ("cue", "given", "rows", "toward", "length"),
    [
        ("neighbour-bearing", {}, {"X": [0.0, 0.0, 0.3], "Y": [0.0, 0.1, 0.0]}, math.pi / 2, 1.0),
        ("neighbour-bearing", {"offset_rad": 1.0}, {"X": [0.0, 0.1]}, 1.0, 1.0),
        ("neighbour-distance", {"preferred_m": 0.1}, {"X": [0.0, 0.4]}, 0.0, 1.0),
        ("neighbour-distance", {"preferred_m": 0.1}, {"X": [0.0, 0.01]}, 0.0, math.tanh(-3.0)),
        ("neighbour-distance", {"preferred_m": 0.1}, {"X": [0.0, 0.1]}, 0.0, 0.0),
        ("neighbour-heading", {}, {"X": [0.0, 0.1], "HX": [1.0, 0.0], "HY": [0.0, 1.0]}, 1.5708, 1),
        ("neighbour-speed", {}, {"X": [0.0, 0.1], "SPEED": [0.0, 0.17]}, 0.0, 1.0),
        ("neighbour-speed", {}, {"X": [0.0, 0.1], "SPEED": [0.0, 0.02]}, 0.0, -0.5),
        ("wall", {"reach_m": 0.05}, {"WALL": 0.05}, 0.0, 0.5),
        ("wall", {"reach_m": 0.05}, {"WALL": 1.0}, 0.0, 0.0),
        ("place", {"x_m": 0.0, "y_m": -0.1}, {"X": 0.0}, -math.pi / 2, 0.8016),
        ("place-time", {"x_m": 0.1, "for_s": 9.0}, {"TIME": 5.0}, 0.0, 0.8333),
        ("place-time", {"x_m": 0.1, "for_s": 9.0}, {"TIME": 15.0}, 0.0, 0.0),
        ("time", {"direction_rad": 2.0, "for_s": 5.0, "every_s": 50.0}, {"TIME": 202.0}, 2.0, 1.0),
        ("time", {"direction_rad": 2.0, "for_s": 5.0, "every_s": 50.0}, {"TIME": 220.0}, 2.0, 0.0),
        ("own-turn", {"carried": 0.0}, {"PAST_HX": 0.0, "PAST_HY": -1.0}, 0.0, 1.0),
        ("own-turn", {"carried": 1.0}, {"PAST_HX": 0.0, "PAST_HY": -1.0}, math.pi / 2, 1.0),
        ("own-speed", {}, {"SPEED": 0.17}, 0.0, 1.0),
        ("own-speed", {}, {"SPEED": 0.02}, 0.0, -0.5),
    ],
)
def test_headings_are_weighed_along_the_cue(ask, cue, given, rows, toward, length):
    """Along against opposite e^(2 s l), l the cue's length; across it, both sides alike."""
    asked = ask(f"generic:heading:{cue}", STRENGTH | given, **rows)
    assert log_odds(asked, toward) == pytest.approx(length, abs=1e-3)
    assert log_odds(asked, toward + math.pi / 2) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.slow
def test_the_wall_is_left_to_the_inside(natural_model, two_rooms):
    """2 cm from the left wall headings to the right gain, whatever the wall's own direction."""
    state = {"xy_m": [(0.071, 0.8)], "heading_rad": [1.0], "speed_m_s": 0.0}
    away = dataclasses.replace(natural_model, effects={"generic:heading:wall": {"strength": 1.0}})
    theta, before = heading_density(natural_model, two_rooms, **state)
    _, after = heading_density(away, two_rooms, **state)
    assert np.cos(theta) @ after > np.cos(theta) @ before + 1.0


@pytest.mark.parametrize(("time_s", "sign"), [(100.0, 1.0), (150.0, 0.0), (200.0, -1.0)])
def test_wall_following_waxes_and_wanes(ask, time_s, sign):
    """Along the wall against across it: e^(2 s) at the crest, e^(-2 s) half a period later."""
    given = {"period_s": 200.0, "crest_s": 100.0, "on": 0.0}
    rows = {"FOLLOWS": 1.0, "TIME": time_s}
    asked = ask("generic:heading:wall-time", STRENGTH | given, **rows)
    ratio = asked.factor(-math.pi / 2) / asked.factor(0.0)
    assert math.log(ratio) == pytest.approx(sign, abs=1e-9)
    assert log_odds(asked, math.pi / 2) == pytest.approx(0.0, abs=1e-9)


def test_going_on_along_the_wall_waxes_and_wanes(ask):
    """On against back at the crest: e^(2 s); away from walls nothing."""
    given = {"period_s": 200.0, "crest_s": 0.0, "on": 1.0}
    rows = {"HX": 0.0, "HY": 1.0, "FOLLOWS": [1.0, 0.0]}
    asked = ask("generic:heading:wall-time", STRENGTH | given, **rows)
    assert log_odds(asked, math.pi / 2) == pytest.approx(1.0)
    assert log_odds(asked, math.pi / 2, i=1) == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("cue", "given", "rows", "value"),
    [
        ("neighbour-bearing", {}, {"X": [0.0, 0.1]}, 1.0),
        ("neighbour-bearing", {}, {"X": [0.0, -0.1]}, -1.0),
        ("neighbour-distance", {"preferred_m": 0.1}, {"X": [0.0, 0.1]}, 0.0),
        ("neighbour-distance", {"preferred_m": 0.1}, {"X": [0.0, 0.15]}, math.tanh(1.0)),
        ("neighbour-heading", {}, {"X": [0.0, 0.1], "HX": [1.0, -1.0]}, -1.0),
        ("neighbour-speed", {}, {"X": [0.0, 0.1], "SPEED": [0.0, 0.17]}, 1.0),
        ("wall", {"reach_m": 0.05}, {"WALL": 0.05}, 0.5),
        ("place", {"x_m": 0.1, "reach_m": 0.1}, {"X": 0.0}, 0.5),
        ("time", {"from_s": 60.0, "for_s": 10.0}, {"TIME": 65.0}, 1.0),
        ("time", {"from_s": 60.0, "for_s": 10.0}, {"TIME": 75.0}, 0.0),
        ("own-turn", {}, {"PAST_HX": -1.0}, 1.0),
        ("own-turn", {}, {"PAST_HX": 0.0, "PAST_HY": 1.0}, 0.5),
        ("own-speed", {}, {"SPEED": 0.02}, -0.5),
    ],
)
def test_speed_follows_the_cue(ask, cue, given, rows, value):
    """e^(s c) for a cue c, and the inverse for the opposite sign."""
    for sign in (1.0, -1.0):
        asked = ask(f"generic:speed:{cue}", {"strength": 0.5 * sign} | given, **rows)
        assert asked.speed() == pytest.approx(math.exp(0.5 * sign * value), abs=1e-6)


@pytest.mark.parametrize("name", ["heading:neighbour-distance", "heading:neighbour-heading"])
def test_who_sees_nobody_has_no_cue(ask, name):
    """Neighbours that are not seen do not count."""
    asked = ask(f"generic:{name}", STRENGTH, X=[0.0, 0.1])
    asked.sight[:] = 0.0
    assert asked.factor(0.0) == asked.factor(2.0) == 1.0


def test_attention_follows_the_side(ask):
    """A neighbour on the left gains e^0.5, one on the right loses as much, one ahead nothing."""
    asked = ask(
        "generic:attention:neighbour-side", {"strength": 0.5}, X=[0.0, 0.0, 0.0, 0.1],
        Y=[0.0, 0.1, -0.1, 0.0],
    )  # fmt: skip
    found = [asked.sight_of(j) for j in (1, 2, 3)]
    assert found == pytest.approx([math.exp(0.5), math.exp(-0.5), 1.0])


def test_attention_follows_the_distance(ask):
    """Far beyond the middle e^1, far within e^-1, at it 1."""
    asked = ask(
        "generic:attention:neighbour-distance", {"strength": 1.0, "middle_m": 0.1},
        X=[0.0, 0.5, 0.1, 0.001],
    )  # fmt: skip
    found = [asked.sight_of(j) for j in (1, 2, 3)]
    assert found == pytest.approx([math.e, 1.0, math.exp(-1.0)], rel=1e-2)
