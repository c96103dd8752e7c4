"""Metres read off a grid are those of the camera."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.cameras.plane import Plane
from zfcal.cameras.rig import below_camera, overhead_camera


@pytest.mark.parametrize(("camera", "within_m"), [(overhead_camera, 2e-6), (below_camera, 1e-12)])
def test_metres_are_those_of_the_camera(camera, within_m):
    """At two hundred places: to two micrometres above; a fish-eye, too bent for it, is exact."""
    projection = camera(load_arena("two-rooms", Path()))
    wide, high = projection.size_px
    places = np.random.default_rng(0).uniform((0, 0), (wide - 1, high - 1), (200, 2))
    exact = projection.to_metres(places)

    found = Plane(projection, projection.size_px).to_metres(places)

    known = np.isfinite(exact).all(axis=1) & (np.abs(exact) < 2).all(axis=1)
    assert known.sum() > 100
    assert found[known] == pytest.approx(exact[known], abs=within_m)


def test_places_beyond_the_image_are_asked_of_the_camera():
    """A head may be a pixel outside."""
    projection = overhead_camera(load_arena("two-rooms", Path()))
    places = np.array([[-3.0, 250.0], [520.0, 100.0], [250.0, 511.0]])

    found = Plane(projection, projection.size_px).to_metres(places)

    assert found == pytest.approx(projection.to_metres(places), abs=1e-6)
