"""Camera files."""

from __future__ import annotations

import dataclasses

import pytest

from zfcal.artifacts.cameras import SCHEMA, CameraFile, read_camera_file, write_camera_file
from zfcal.artifacts.inspecting import describe
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.errors import DamagedError, InputError, SchemaError

CAMERA = CameraFile(
    model="fisheye",
    size_px=(640, 480),
    matrix=((200.1, 0.0, 320.0), (0.0, 200.2, 240.0), (0.0, 0.0, 1.0)),
    distortion=(0.1 + 0.2, -1e-17, 3.0, 1 / 3),
    rotation_rad=(0.1, 0.2, 0.3),
    translation_m=(0.0, -0.5, 1.5),
    result={"method": "board", "error_mm": {"median": 0.5}, "notes": ["One.", "Two."]},
    points_px=((1.0, 2.0), (3.5, 4.0)),
    points_m=((0.0, 0.0), (0.1, 0.2)),
)
LENS = dataclasses.replace(CAMERA, rotation_rad=None, translation_m=None, points_px=(), points_m=())
FLAT = CameraFile(
    model="homography", size_px=(500, 500), matrix=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1))
)
ORIGIN = Lineage(schema=SCHEMA, command="camera corners", options={"size_px": [500, 500]})


@pytest.mark.parametrize("camera", [CAMERA, LENS, FLAT])
def test_what_is_written_is_read_again_to_the_last_bit(tmp_path, camera):
    """A camera, a lens alone, a homography."""
    path = tmp_path / "cameras" / "below.toml"
    write_camera_file(path, camera, ORIGIN)
    assert read_camera_file(path) == camera
    assert read_lineage(path) == ORIGIN


def test_the_same_camera_makes_the_same_bytes(tmp_path):
    """No time, no host."""
    for name in ("a.toml", "b.toml"):
        write_camera_file(tmp_path / name, CAMERA, ORIGIN)
    assert (tmp_path / "a.toml").read_bytes() == (tmp_path / "b.toml").read_bytes()


def test_inspect_knows_a_camera_file(tmp_path):
    """Its schema, its lineage and its numbers."""
    path = tmp_path / "below.toml"
    write_camera_file(path, CAMERA, ORIGIN)
    found = describe(path)
    assert found["schema"] == SCHEMA
    assert found["problem"] is None
    assert found["contents"]["pose"]["translation_m"] == [0.0, -0.5, 1.5]
    assert found["lineage"]["command"] == "camera corners"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('model = "fisheye"', 'model = "mirror"', "model must be one of"),
        ("[lens]", "[lense]", "unknown key 'lense'"),
        ("size_px = [640, 480]", "size_px = [640]", "size_px must be a list of at least 2"),
        ("size_px = [640, 480]", "size_px = [640, 0]", r"size_px\[1\] must be at least 1"),
        ("distortion = [", "distortion = [1.0, ", "must have 4 coefficients, got 5"),
        ("    [200.1, 0.0, 320.0],\n", "", "lens.matrix must be a list of at least 3"),
        ("rotation_rad = [0.1, ", "rotation_rad = [", "pose.rotation_rad must be a list"),
        ("    [1.0, 2.0],\n", "", "points.px has 1 points, points.m 2"),
        ("[pose]", "[homography]\nmatrix = [[1,0,0],[0,1,0],[0,0,1]]\n[pose]", "has no homography"),
        ("[lens]", "[result.lens]", "'lens' is missing"),
    ],
)
def test_a_wrong_file_is_refused_with_the_place(tmp_path, old, new, says):
    """What is wrong, where, what was expected and what was got."""
    path = tmp_path / "below.toml"
    write_camera_file(path, CAMERA, ORIGIN)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=says) as caught:
        read_camera_file(path)
    assert str(caught.value).startswith(str(path))


def test_the_file_of_another_version_is_refused(tmp_path):
    """By its schema, before anything else."""
    path = tmp_path / "below.toml"
    path.write_text('schema = "zfcal.camera/2"\n')
    with pytest.raises(SchemaError, match=r"zfcal.camera/2"):
        read_camera_file(path)


def test_a_cut_file_is_damaged(tmp_path):
    """Not TOML any more."""
    path = tmp_path / "below.toml"
    write_camera_file(path, CAMERA, ORIGIN)
    path.write_bytes(path.read_bytes()[:700])
    with pytest.raises(DamagedError, match="is not valid TOML"):
        read_camera_file(path)


def test_a_value_that_makes_no_camera_is_not_written(tmp_path):
    """Neither is half of it."""
    path = tmp_path / "below.toml"
    with pytest.raises(InputError, match="must have 4 coefficients"):
        write_camera_file(path, dataclasses.replace(CAMERA, distortion=(1.0,)), ORIGIN)
    with pytest.raises(InputError, match="lineage has schema"):
        write_camera_file(path, CAMERA, Lineage(schema="zfcal.model/1", command="camera"))
    assert list(tmp_path.iterdir()) == []
