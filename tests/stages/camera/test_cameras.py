"""From camera files to cameras."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from zfcal.artifacts.cameras import SCHEMA
from zfcal.artifacts.lineage import Lineage
from zfcal.cameras.camera import Camera, Homography
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import calibration_of, read_camera, read_lens, write_camera

CAMERA = Camera(
    size_px=(640, 480),
    model="fisheye",
    matrix=((200.0, 0, 320.0), (0, 200.0, 240.0), (0, 0, 1)),
    distortion=(0.01, 0, 0, 0),
    rotation_rad=(0.1, 0, 0),
    translation_m=(-0.5, -0.5, 0.6),
)
FLAT = Homography(size_px=(500, 500), matrix=((0.002, 0, 0), (0, -0.002, 1), (0, 0, 1)))
PINHOLE = Camera(
    size_px=(500, 400),
    model="pinhole",
    matrix=((600.0, 0, 250.0), (0, 610.0, 200.0), (0, 0, 1)),
    distortion=(),
    rotation_rad=(3.0, 0, 0),
    translation_m=(0.0, 0.0, 1.0),
)
ORIGIN = Lineage(schema=SCHEMA, command="camera points")


@pytest.mark.parametrize("camera", [CAMERA, FLAT])
def test_a_camera_comes_back(tmp_path, camera):
    """Equal, hence with the same pixels."""
    path = tmp_path / "camera.toml"
    write_camera(path, camera, ORIGIN, points=(np.zeros((1, 2)), np.ones((1, 2))))
    assert read_camera(path) == camera


def test_a_lens_alone_is_no_camera(tmp_path):
    """It says so, and how to add the pose."""
    path = tmp_path / "lens.toml"
    write_camera(path, CAMERA.lens, ORIGIN)
    assert read_lens(path) == CAMERA.lens
    with pytest.raises(InputError, match="holds a lens alone") as caught:
        read_camera(path)
    assert "zfcal camera points" in caught.value.hint


def test_a_homography_has_no_lens(tmp_path):
    """Nor can it serve as one."""
    path = tmp_path / "flat.toml"
    write_camera(path, FLAT, ORIGIN)
    with pytest.raises(InputError, match="has no lens"):
        read_lens(path)


def test_numbers_that_make_no_camera_are_refused_with_the_file(tmp_path):
    """A focal length of zero passes the schema, not the camera."""
    path = tmp_path / "camera.toml"
    write_camera(path, CAMERA, ORIGIN)
    path.write_text(path.read_text().replace("[200.0, 0.0, 320.0]", "[0.0, 0.0, 320.0]"))
    with pytest.raises(InputError, match=r"camera.toml: Focal lengths must be positive"):
        read_camera(path)


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
