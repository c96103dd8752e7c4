"""Alignment does what its sentence says."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.onestep import draw_headings, heading_density
from zfcal.model.simulate import simulate_tracks


def test_a_neighbour_that_swims_upward_turns_the_focal_fish_upward(two_rooms, make_natural, twin):
    """More density toward the neighbour's heading, less elsewhere; by the weight stated.

    A neighbour at 0.06 m ahead that swims across: with weight w and solid
    angle A the new component holds w A / (1 + alpha A + w A) of the density.
    """
    state = {"xy_m": [(0.2, 0.78), (0.26, 0.78)], "heading_rad": [0.0, math.pi / 2]}
    plain = make_natural(two_rooms)
    aligned = dataclasses.replace(plain, effects={"alignment": {"weight": 40.0, "kappa": 25.0}})

    theta, before = heading_density(plain, two_rooms, speed_m_s=0.0, **state)
    _, after = heading_density(aligned, two_rooms, speed_m_s=0.0, **state)

    assert theta[np.argmax(after - before)] == pytest.approx(math.pi / 2, abs=0.05)
    angle = twin.body_solid_angle(*state["xy_m"], math.pi / 2)
    share = 40 * angle / (1 + 49 * angle + 40 * angle)
    component = (after - (1 - share) * before) / share
    assert np.trapezoid(component, theta) == pytest.approx(1.0, abs=1e-6)
    assert component.min() > -1e-3


def test_neighbours_that_disagree_weigh_less(ask):
    """Two of 0.01 sr at right angles: root of two of one; opposite ones: nothing."""
    rows = {"HX": [1.0, 1.0, 0.0], "HY": [0.0, 0.0, 1.0]}
    weight, (x, y, kappa) = ask("alignment", {"weight": 10.0, "kappa": 7.0}, **rows).component()
    assert weight == pytest.approx(0.1 * math.sqrt(2))
    assert (x, y, kappa) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5), 7.0))
    assert ask("alignment", {"weight": 10.0}, HX=[1.0, 1.0, -1.0]).component()[0] == 0.0


def test_all_that_are_seen_can_count_alike(ask):
    """One of 0.04 sr and one of 0.0001 sr: with grading 0 their mean heading is the diagonal."""
    asked = ask("alignment", {"weight": 10.0, "grading": 0.0}, HX=[1.0, 1.0, 0.0], HY=[0, 0, 1])
    asked.sight[0] = (0.0, 0.04, 0.0001)
    weight, (x, y, _) = asked.component()
    assert (weight, x) == pytest.approx((0.1 * math.sqrt(2), y))


def test_all_headings_can_lean_toward_that_of_those_near(ask):
    """Along against opposite e^(2 x 20 x 0.03); who is 0.2 m away does not count."""
    given = {"weight": 20.0, "leaning": 1.0}
    rows = {"X": [0.0, 0.1, 0.2], "HX": [1.0, 0.0, 1.0], "HY": [0.0, 1.0, 0.0]}
    asked = ask("alignment", given, **rows)
    ratio = asked.factor(math.pi / 2) / asked.factor(-math.pi / 2)
    assert ratio == pytest.approx(math.exp(1.2))
    assert asked.component()[0] == 0.0


def test_all_can_turn_a_share_of_the_way(ask):
    """Weight 20: a fifth of the right angle to the heading of who is near, not of who is far."""
    given = {"weight": 20.0, "turning": 1.0}
    rows = {"X": [0.0, 0.1, 0.2], "HX": [1.0, 0.0, -1.0], "HY": [0.0, 1.0, 0.0]}
    asked = ask("alignment", given, **rows)
    assert asked.rotation() == pytest.approx(0.2 * math.pi / 2)
    assert asked.rotation(i=2) == pytest.approx(-0.2 * math.pi / 2)
    assert asked.component()[0] == 0.0
    assert asked.factor(1.0) == 1.0


def test_along_a_wall_the_nearer_sense_is_preferred_instead(ask):
    """Nothing is turned there; with the neighbour against it e^(2 x 20 / 100)."""
    rows = {"X": [0.0, 0.1], "HX": [1.0, 0.0], "HY": [0.0, 1.0], "FOLLOWS": [1.0, 1.0]}
    asked = ask("alignment", {"weight": 20.0, "turning": 1.0}, **rows)
    assert asked.rotation() == 0.0
    ratio = asked.factor(math.pi / 2) / asked.factor(-math.pi / 2)
    assert ratio == pytest.approx(math.exp(0.4))


def test_turned_fish_head_where_the_density_says(two_rooms, make_natural):
    """The neighbour is behind and not seen. Draws against the density: laws 2 % apart at most."""
    plain = make_natural(two_rooms)
    model = dataclasses.replace(plain, effects={"alignment": {"weight": 40.0, "turning": 1.0}})
    state = {"xy_m": [(0.22, 0.77), (0.14, 0.77)], "heading_rad": [0.0, 2.0], "speed_m_s": 0.05}
    theta, density = heading_density(model, two_rooms, **state)
    drawn = np.sort(draw_headings(model, two_rooms, n=20_000, seed=3, **state))
    below = np.interp(drawn, theta, np.cumsum(density) * (theta[1] - theta[0]))
    assert np.abs(below - (np.arange(len(drawn)) + 0.5) / len(drawn)).max() < 0.02
    _, straight = heading_density(plain, two_rooms, **state)
    assert abs(theta[density.argmax()] - theta[straight.argmax()] - 0.8) < 0.1


def test_aligned_fish_are_more_polarised(two_rooms, make_natural):
    """Mean polarisation of five fish over 4,000 s rises by more than 0.02 (0.37 to 0.42)."""
    plain = make_natural(two_rooms)
    aligned = dataclasses.replace(plain, effects={"alignment": {"weight": 20.0, "kappa": 10.0}})

    polarisation = []
    for model in (plain, aligned):
        _, heading = simulate_tracks(model, two_rooms, n_agents=5, n_steps=20_000, seed=6)
        polarisation.append(np.abs(np.exp(1j * heading).mean(axis=1)).mean())

    assert polarisation[1] - polarisation[0] > 0.02


def test_without_weight_it_changes_nothing(two_rooms, make_natural):
    """The density is the base model's."""
    state = {"xy_m": [(0.2, 0.78), (0.26, 0.78)], "heading_rad": [0.0, 1.0], "speed_m_s": 0.1}
    plain = make_natural(two_rooms)
    idle = dataclasses.replace(plain, effects={"alignment": {"weight": 0.0}})

    assert heading_density(idle, two_rooms, **state)[1] == pytest.approx(
        heading_density(plain, two_rooms, **state)[1]
    )


def test_every_effect_is_found_by_its_name():
    """The folder is the list; each effect says what it means and where it was described."""
    for effect in all_effects():
        assert find_effect(effect.name) is effect
        assert effect.says.endswith(".")
        assert effect.reference
        assert len(effect.values({})) == len(effect.parameters)


def test_an_unknown_effect_names_the_nearest(two_rooms):
    """A slip of the pen is answered with the right word."""
    with pytest.raises(InputError) as caught:
        find_effect("alignement")
    assert "alignment" in caught.value.hint


def test_a_parameter_out_of_bounds_is_refused():
    """Bounds, value and name are in the message; NaN is out of bounds."""
    effect = find_effect("alignment")
    for value in (-1.0, math.nan):
        with pytest.raises(InputError, match=r"weight must be in \[0, 50\]"):
            effect.values({"weight": value})
    with pytest.raises(InputError, match="no parameter 'strength'"):
        effect.values({"strength": 1.0})
