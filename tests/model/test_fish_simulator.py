"""Fish that swim step by step beside robots: the same law, the same numbers."""

import dataclasses

import numpy as np
import pytest
import shapely

from zfcal.errors import InputError
from zfcal.model.fish_simulator import Shoal
from zfcal.model.kernels.state import LATELY, SPEED
from zfcal.model.simulate import simulate_tracks

NOBODY = np.empty((0, 3))


def swum(shoal, steps, robots=NOBODY):
    """Return where the fish are now and after each step, shape (step + 1, fish, 2)."""
    places = [shoal.fish_xy_m]
    for _ in range(steps):
        shoal.step(robots)
        places.append(shoal.fish_xy_m)
    return np.array(places)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"turning-bias": {"strength": 0.5}},
        {"reaction-delay": {"delay_s": 0.4}},
        {"reaction-delay": {"delay_s": 0.3}},
    ],
    ids=["base", "factor", "lag", "lag between steps"],
)
def test_alone_they_swim_as_a_simulation_of_that_seed(model, two_rooms, effects):
    """Step by step or in one call: the same places, but for the rounding of a sum."""
    model = dataclasses.replace(model, effects=effects)
    told, headings = simulate_tracks(model, two_rooms, n_agents=4, n_steps=40, seed=5)
    shoal = Shoal(model, two_rooms, n_fish=4, n_robots=0, seed=5)
    np.testing.assert_allclose(swum(shoal, 39), told, rtol=0, atol=1e-6)
    np.testing.assert_allclose(shoal.fish_heading_rad, headings[-1], rtol=0, atol=1e-4)


def test_parameters_can_change_on_the_way(model, two_rooms):
    """Fish that no more prefer the corridor's direction swim otherwise from then on."""
    first = Shoal(model, two_rooms, n_fish=4, n_robots=0, seed=5)
    second = Shoal(model, two_rooms, n_fish=4, n_robots=0, seed=5)
    np.testing.assert_array_equal(swum(first, 10), swum(second, 10))
    zones = tuple(dataclasses.replace(zone, kappa_0=0.0, alpha=0.0) for zone in model.zones)
    second.change(dataclasses.replace(model, zones=zones))
    assert not np.array_equal(swum(first, 10), swum(second, 10))


def test_a_change_to_other_effects_or_another_step_is_refused(model, two_rooms):
    """The arrays of a model hold so many effects and one step."""
    shoal = Shoal(model, two_rooms, n_fish=2, n_robots=0, seed=1)
    with pytest.raises(InputError, match="cannot change"):
        shoal.change(dataclasses.replace(model, effects={"turning-bias": {"strength": 0.5}}))
    with pytest.raises(InputError, match="cannot change"):
        shoal.change(dataclasses.replace(model, dt_s=2 * model.dt_s))


def test_fish_keep_near_a_robot_that_they_attend_to(model, two_rooms):
    """A robot that stands still holds a fish that takes it for one of its own.

    Twenty minutes of one fish, six times: within 5 cm of it for 9 to 18 % of the time; for
    less than 1 % where the robot has lost all but e^-5 of the attention.
    """
    place = np.array([[0.225, 0.775, 0.0]])
    near = {}
    for wariness in (0.0, 5.0):
        effects = {"robot-avoidance": {"strength": wariness, "flight": 0.0}}
        wary = dataclasses.replace(model, effects=effects)
        shoal = Shoal(wary, two_rooms, n_fish=1, n_robots=1, seed=3)
        places = swum(shoal, 6000, place)[:, 0]
        near[wariness] = np.mean(np.hypot(*(places - place[0, :2]).T) < 0.05)
    assert near[0.0] > 0.05, near
    assert near[5.0] < 0.02, near


def test_a_robot_that_is_not_there_is_not_seen(model, two_rooms):
    """NaN for a place: the fish swim as without a robot."""
    alone = Shoal(model, two_rooms, n_fish=2, n_robots=1, seed=8)
    beside = Shoal(model, two_rooms, n_fish=2, n_robots=1, seed=8)
    far = np.array([[50.0, 50.0, 0.0]])
    nobody = np.full((1, 3), np.nan)
    # Somebody 50 m off has a solid angle of 1e-7 sr: next to never does that decide a step.
    np.testing.assert_array_equal(swum(alone, 50, nobody), swum(beside, 50, far))
    near = np.array([[0.225, 0.775, 0.0]])
    assert not np.array_equal(swum(alone, 300, nobody), swum(beside, 300, near))


def test_a_robot_that_appears_has_no_speed_yet(model, two_rooms):
    """Neither at its first step nor after a gap: then it has that of the steps it has taken."""
    lasting = dataclasses.replace(model, effects={"turning-bias": {"strength": 0.1}})
    shoal = Shoal(lasting, two_rooms, n_fish=2, n_robots=1, seed=8)
    path = np.array([[[0.225, 0.775 - 0.01 * k, 0.0]] for k in range(4)])
    nobody = np.full((1, 3), np.nan)
    for _ in range(2):
        shoal.step(path[0])
        assert np.isnan(shoal._state[SPEED, -1])
        assert shoal._state[LATELY, -1] == 0.0
        for robot in path[1:]:
            shoal.step(robot)
        assert shoal._state[[SPEED, LATELY], -1] == pytest.approx(0.01 / model.dt_s)
        shoal.step(nobody)


def test_a_robot_that_brushes_a_wall_keeps_its_speed(model, two_rooms):
    """Its middle is outside for a step: it is seen there, and was not away."""
    shoal = Shoal(model, two_rooms, n_fish=2, n_robots=1, seed=8)
    for x_m in (0.94, 0.945, 0.955, 0.945):
        shoal.step(np.array([[x_m, 0.2, 0.0]]))
    assert shoal._state[SPEED, -1] == pytest.approx(0.01 / model.dt_s)


def test_fish_stay_in_the_tank(model, two_rooms):
    """Also where a robot stands in the wall."""
    shoal = Shoal(model, two_rooms, n_fish=3, n_robots=1, seed=2)
    places = swum(shoal, 2000, np.array([[0.051, 0.949, 1.0]]))
    assert shapely.covers(two_rooms.outline, shapely.points(places)).all()


@pytest.mark.parametrize(("n_fish", "seed"), [(0, 1), (2, -1)])
def test_a_shoal_needs_fish_and_a_seed(model, two_rooms, n_fish, seed):
    """Anything else is told in one line."""
    with pytest.raises(InputError, match="A shoal needs"):
        Shoal(model, two_rooms, n_fish=n_fish, n_robots=0, seed=seed)
