"""Places that fish are on one side of."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose.naming import Refit, refit
from zfcal.diagnose.sides import feigned, one_sided
from zfcal.model.kernels.state import STATES

DRIFT = {"directional-drift": {"strength": 0.4, "direction_rad": 1.2, "by_slowness": 1.0}}
PLACE = {"place-preference": {"strength": 1.5, "x_m": 0.25, "y_m": 0.75, "reach_m": 0.3}}

SHARES = np.linspace(0.5, 1.5, 100) / 100.0
"""Of what is gained each sample has so much."""


@pytest.fixture
def suspect(candidate):
    """Return what makes a suspect up that gains so many nats, of fish at these points."""

    def of(name, nats, points=(), **values):
        states = np.zeros((len(points), STATES, 1))
        states[:, :2, 0] = np.reshape(points, (-1, 2))
        at = np.arange(len(points))
        turns = SimpleNamespace(at=at, who=np.zeros_like(at))
        scene = SimpleNamespace(states=states, turns=turns)
        return Refit(
            candidate=candidate(name), screen=SimpleNamespace(scene=scene), values=values,
            interval={}, gain=(nats + 1.0) * SHARES, n_free=1,
        )  # fmt: skip

    return of


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([(0, 0), (0.1, 0)], 1.0),
        ([(0, 0), (2, 0)], 0.0),
        ([(0, 0), (1, 1)], np.sqrt(0.5)),
        ([(0, 0), (1, 101)], 1.0),
    ],
)
def test_sides_by_hand(suspect, points, expected):
    """A place at (1, 0): both west of it; west and east; west and north; one out of its reach."""
    place = suspect("place-preference", 1.0, points, x_m=1.0, y_m=0.0, reach_m=2.0)
    assert one_sided(place) == pytest.approx(expected, abs=0.06)


AT = {"x_m": 1.0, "y_m": 0.0, "reach_m": 2.0}
WITHOUT = SimpleNamespace(fitted=SimpleNamespace(parameters=SimpleNamespace(effects={})))


def test_a_place_on_one_side_must_gain_clearly_more_than_a_direction(suspect):
    """1.2 and 1.6 times what the direction gains; round it both count, and alone any."""
    drift, other = suspect("directional-drift", 100.0), suspect("alignment", 10.0)
    little, clear = (suspect("place-preference", n, [(0, 0)], **AT) for n in (120.0, 160.0))
    inside = suspect("place-preference", 120.0, [(0, 0), (2, 0)], **AT)
    assert feigned([little, drift, other], WITHOUT) == [little]
    for place in (clear, inside):
        assert feigned([place, drift, other], WITHOUT) == []
    assert feigned([little, other], WITHOUT) == []


@pytest.mark.slow
def test_beside_a_direction_in_the_model_a_place_must_gain_half_of_what_it_does(
    screen, candidate, suspect
):
    """What a current leaves over is no place, whether the current was found or came with it."""
    own = screen(31, DRIFT)
    drift = refit(own, own.ask(candidate("directional-drift")))
    for points in ([(0, 0)], [(0, 0), (2, 0)]):
        # Fish that are all on one side of it, and fish all round it.
        little, clear = (
            suspect("place-preference", share * drift.nats, points, **AT) for share in (0.4, 0.6)
        )
        assert feigned([little], drift.screen) == [little]
        assert feigned([clear], drift.screen) == []


@pytest.mark.slow
@pytest.mark.parametrize(("effects", "kept"), [(DRIFT, False), (PLACE, True)])
def test_a_current_is_no_place(screen, candidate, effects, kept):
    """A current pulls the same way everywhere, whatever place comes near it; a place does not."""
    own = screen(31, effects)
    asked = [candidate("directional-drift"), candidate("place-preference", x_m=0.25, y_m=0.75)]
    drift, place = (refit(own, own.ask(each)) for each in asked)
    assert (one_sided(place) < 0.8) is kept
    assert (place not in feigned([drift, place], own)) is kept
