"""Places that fish are on one side of."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose.naming import Refit, refit
from zfcal.diagnose.sides import one_sided, without_feigned
from zfcal.model.kernels.world import STATES

DRIFT = {"directional-drift": {"strength": 0.4, "direction_rad": 1.2, "by_slowness": 1.0}}
PLACE = {"place-preference": {"strength": 1.5, "x_m": 0.25, "y_m": 0.75, "reach_m": 0.3}}


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
            interval={}, gain=np.array([nats + 1.0]), n_free=1,
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


def test_a_place_on_one_side_must_gain_clearly_more_than_a_direction(suspect):
    """1.2 and 1.6 times what the direction gains; round it both count, and alone any."""
    drift, other = suspect("directional-drift", 100.0), suspect("alignment", 10.0)
    at = {"x_m": 1.0, "y_m": 0.0, "reach_m": 2.0}
    feigned, clear = (suspect("place-preference", n, [(0, 0)], **at) for n in (120.0, 160.0))
    inside = suspect("place-preference", 120.0, [(0, 0), (2, 0)], **at)
    assert without_feigned([feigned, drift, other]) == [drift, other]
    for place in (clear, inside):
        assert without_feigned([place, drift, other]) == [place, drift, other]
    assert without_feigned([feigned, other]) == [feigned, other]


@pytest.mark.parametrize(("effects", "kept"), [(DRIFT, False), (PLACE, True)])
def test_a_current_is_no_place(screen, candidate, effects, kept):
    """A current pulls the same way everywhere, whatever place comes near it; a place does not."""
    own = screen(31, effects)
    asked = [candidate("directional-drift"), candidate("place-preference", x_m=0.25, y_m=0.75)]
    drift, place = (refit(own, own.ask(each)) for each in asked)
    assert (one_sided(place) < 0.8) is kept
    assert (place in without_feigned([drift, place])) is kept
