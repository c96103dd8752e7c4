"""What viewers are told of a camera."""

import dataclasses

import pytest

from zfcal.cameras.camera import Camera, Homography
from zfcal.stages.camera.messages import calibration_of

PINHOLE = Camera(
    size_px=(500, 400),
    model="pinhole",
    matrix=((600.0, 0, 250.0), (0, 610.0, 200.0), (0, 0, 1)),
    distortion=(),
    rotation_rad=(3.0, 0, 0),
    translation_m=(0.0, 0.0, 1.0),
)


@pytest.mark.parametrize(
    ("model", "distortion", "name", "stated"),
    [
        ("pinhole", (), "plumb_bob", (0, 0, 0, 0, 0)),
        ("pinhole", (0.1, 0.2, 0.3, 0.4), "plumb_bob", (0.1, 0.2, 0.3, 0.4, 0)),
        ("pinhole", (0.1,) * 8, "rational_polynomial", (0.1,) * 8),
        ("pinhole", (0.1,) * 8 + (0.0,) * 6, "rational_polynomial", (0.1,) * 8),
        ("fisheye", (0.1, 0.0, 0.0, 0.0), "kannala_brandt", (0.1, 0, 0, 0)),
    ],
)
def test_lenses_have_foxglove_s_names(model, distortion, name, stated):
    """Each with as many coefficients as that model takes."""
    camera = dataclasses.replace(PINHOLE, model=model, distortion=distortion)
    found = calibration_of(camera)
    assert (found.distortion_model, found.distortion) == (name, stated)
    assert found.size_px == (500, 400)
    assert found.matrix == (600, 0, 250, 0, 610, 200, 0, 0, 1)


def test_what_has_no_name_is_not_told():
    """A thin prism, a homography, no camera at all."""
    prism = dataclasses.replace(PINHOLE, distortion=(0.1,) * 12)
    flat = Homography(size_px=(500, 500), matrix=((0.002, 0, 0), (0, -0.002, 1), (0, 0, 1)))
    assert [calibration_of(camera) for camera in (prism, flat, None)] == [None, None, None]
