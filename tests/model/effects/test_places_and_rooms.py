"""Effects of places and rooms on the heading do what their sentences say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from zfcal.model.simulate import individuals

ROOM = {"ROOM": 1.0, "EXIT": 1.0, "MOUTH_X": 1.0, "MOUTH_M": 0.2}


def departures(xy, arena):
    """Return whether each agent leaves a room for the corridor at each step."""
    zone = arena.zone_of(xy)
    return (zone[:-1] != 1) & (zone[1:] == 1)


def test_a_place_draws_from_all_sides(ask):
    """0.1 m away, toward against away: e^(2 s f), f = 5/6 of the fading by its reach."""
    fade = (0.1 / 0.12) / (1 + (0.1 / 0.3) ** 4)
    for angle in (0.0, 2.0, -1.0):
        place = {"x_m": 0.4 + 0.1 * math.cos(angle), "y_m": 0.5 + 0.1 * math.sin(angle)}
        asked = ask("place-preference", {"strength": 1.2, **place}, X=0.4, Y=0.5)
        ratio = asked.factor(angle) / asked.factor(angle + math.pi)
        assert ratio == pytest.approx(math.exp(2.4 * fade))


def test_a_place_is_not_felt_at_it_nor_far_from_it(ask):
    """On the spot headings are alike; at ten times its reach nearly so."""
    there = ask("place-preference", {"strength": 2.0, "x_m": 0.4, "y_m": 0.5}, X=0.4, Y=0.5)
    far = ask("place-preference", {"strength": 2.0, "x_m": 3.4, "y_m": 0.5}, X=0.4, Y=0.5)
    assert there.factor(1.0) == there.factor(-2.0) == 1.0
    assert far.factor(0.0) == pytest.approx(far.factor(math.pi), rel=1e-3)


def test_fish_gather_at_a_place_or_shun_it(swim):
    """Share of time within 0.1 m of a place: doubled, or halved."""

    def share(strength):
        place = {"x_m": 0.25, "y_m": 0.77}
        xy, _ = swim("place-preference", {"strength": strength, **place})
        return (np.linalg.norm(xy - (0.25, 0.77), axis=-1) < 0.1).mean()

    plain = share(0.0)
    assert share(1.5) > 2 * plain
    assert share(-1.5) < plain / 2


def test_some_headings_are_drawn_to_a_place_or_from_it(ask):
    """A component of the same weight about the bearing, or about the way from there."""
    place = {"x_m": 0.4, "y_m": 0.6, "drawn": 1.0, "kappa": 5.0}
    to, away = (
        ask("place-preference", {"strength": strength, **place}, X=0.4, Y=0.5).component()
        for strength in (0.7, -0.7)
    )
    assert to[0] == away[0] > 0
    np.testing.assert_allclose(to[1], (0.0, 1.0, 5.0), atol=1e-12)
    np.testing.assert_allclose(away[1], (0.0, -1.0, 5.0), atol=1e-12)


@pytest.mark.parametrize("strength", [0.9, -0.9])
def test_headings_may_be_likelier_that_end_at_a_place(ask, strength):
    """A step of 4 cm from 10 cm away ends inside 7 cm ahead alone: e^s against one."""
    place = {"x_m": 0.5, "y_m": 0.5, "reach_m": 0.08, "lands": 1.0}
    asked = ask("place-preference", {"strength": strength, **place}, X=0.4, Y=0.5, DT_S=0.5)
    ratio = asked.factor(0.0, speed=0.08) / asked.factor(math.pi, speed=0.08)
    assert ratio == pytest.approx(math.exp(strength / (1 + (0.06 / 0.08) ** 8)), rel=0.02)
    # Headings of a step that cannot reach it are alike, and none is rejected.
    far = ask("place-preference", {"strength": strength, **place}, X=0.0, Y=0.5, DT_S=0.5)
    assert far.factor(0.0, speed=0.08) == pytest.approx(1.0, abs=1e-4)
    assert asked.factor(0.0, speed=0.0) == asked.factor(2.0, speed=0.0) == 1.0


@pytest.mark.parametrize("turning", [0.0, 1.0, 2.0])
def test_where_headings_end_there_none_is_drawn_or_turned(ask, turning):
    """One strength does one thing."""
    place = {"x_m": 0.5, "y_m": 0.6, "strength": 1.0, "drawn": 1.0, "turning": turning}
    other, lands = (
        ask("place-preference", place | {"lands": on}, X=0.4, Y=0.5, HX=1.0) for on in (0.0, 1.0)
    )
    asked = [
        (each.component()[0], each.rotation(), each.whole_rotation()) for each in (other, lands)
    ]
    assert any(asked[0])
    assert not any(asked[1])


def test_fish_stay_where_headings_are_likelier_to_end(swim):
    """Of those within 8 cm of a place fewer leave it in a step, or more."""

    def leaving(strength):
        place = {"x_m": 0.25, "y_m": 0.77, "reach_m": 0.08, "lands": 1.0}
        xy, _ = swim("place-preference", {"strength": strength, **place}, seed=1)
        there = np.linalg.norm(xy - (0.25, 0.77), axis=-1) < 0.08
        assert there.sum() > 100
        return 1 - there[1:][there[:-1]].mean()

    assert leaving(3.0) < 0.7 * leaving(0.0)
    assert leaving(-3.0) > 1.3 * leaving(0.0)


def test_just_after_another_left_a_fish_heads_for_the_way_out(ask):
    """Toward the mouth against away from it: e^(2 s) at once, e^s after the memory's length."""
    asked = ask(
        "collective-departure", {"strength": 1.0, "memory_s": 5.0}, LEFT_S=[0.0, 5.0, 60.0], **ROOM
    )
    for i, power in ((0, 2.0), (1, 1.0), (2, 0.0)):
        ratio = asked.factor(0.0, i=i) / asked.factor(math.pi, i=i)
        assert ratio == pytest.approx(math.exp(power))


def test_between_rooms_nobody_follows(ask):
    """Nor in a tank without rooms: there is no way out."""
    asked = ask("collective-departure", {"strength": 3.0}, LEFT_S=0.1, ROOM=0.0, MOUTH_X=1.0)
    assert asked.factor(0.0) == asked.factor(2.0) == 1.0


@pytest.mark.parametrize("name", ["collective-departure", "boldness"])
def test_a_step_across_the_mouth_can_be_what_counts(ask, name):
    """Near the mouth: a step out against one that stays in, e^(2 s); far from it nothing."""
    given = {"strength" if name != "boldness" else "spread": 0.5, "heading_share": 0.0}
    rows = ROOM | {"MOUTH_M": [0.02, 0.3], "LEFT_S": [0.0, 0.0], "TRAIT": [1.0, 1.0]}
    asked = ask(name, given, **rows)
    assert asked.factor(1.0, landing=1) / asked.factor(1.0, landing=2) == pytest.approx(math.e)
    assert asked.factor(1.0, i=1, landing=2) == asked.factor(2.0, i=1, landing=3)


@pytest.mark.parametrize("heading_share", [0.0, 1.0])
def test_departures_come_in_series(swim, two_rooms, heading_share):
    """Rate of leaving within 4 s of another's leaving of the same room: by a sixth higher."""

    def rate(xy):
        leaves = departures(xy, two_rooms)
        room = xy[:-1, :, 0] < xy[:-1, :, 1]
        recent = np.zeros_like(leaves)
        for k, i in zip(*np.nonzero(leaves), strict=True):
            same = room[k + 1 : k + 21] == room[k, i]
            same[:, i] = False
            recent[k + 1 : k + 21] |= same
        return leaves[recent & (two_rooms.zone_of(xy[:-1]) != 1)].mean()

    given = {"strength": 2.0, "memory_s": 4.0, "heading_share": heading_share}
    assert rate(swim("collective-departure", given)[0]) > 7 / 6 * rate(swim()[0])


def test_the_bold_head_for_the_way_out_and_the_shy_away_from_it(ask):
    """One standard deviation to either side: e^(2 s) and e^(-2 s); the middling alike."""
    asked = ask("boldness", {"spread": 0.5}, TRAIT=[1.0, -1.0, 0.0], **ROOM)
    for i, power in ((0, 1.0), (1, -1.0), (2, 0.0)):
        ratio = asked.factor(0.0, i=i) / asked.factor(math.pi, i=i)
        assert ratio == pytest.approx(math.exp(power))


def test_without_rooms_the_bold_leave_their_zone(ask):
    """Where a border is within reach: e^(2 s) for a landing elsewhere; else nothing."""
    asked = ask("boldness", {"spread": 0.5}, TRAIT=[1.0, 1.0], CLEAR=[0.0, 0.1])
    assert asked.factor(0.0, landing=2) / asked.factor(0.0, landing=3) == pytest.approx(math.e)
    assert asked.factor(0.0, i=1, landing=3) == 1.0


def test_the_boldest_leave_most_often(swim, two_rooms):
    """Departures of four fish rank as their traits do; the boldest twice the shyest."""
    xy, _ = swim("boldness", {"spread": 0.8}, n_agents=4)
    counts = departures(xy, two_rooms).sum(axis=0)
    assert (np.diff(individuals(4, 0)[1]) > 0).all()
    assert counts[3] > 2 * counts[0]
    assert counts[3] > counts[1]
