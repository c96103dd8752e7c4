"""Camera files of the older rig, in the form that it publishes them."""

from __future__ import annotations

import numpy as np
import pytest

from zfcal.artifacts.older_cameras import read_older_camera
from zfcal.errors import DamagedError, InputError

HEAD = """<?xml version="1.0"?>
<opencv_storage>
    <!-- wide angle -->
    <cameraType>c930e</cameraType>
    <worldUnits>cm</worldUnits>
    <cameraHeight>45</cameraHeight>
    <agentHeight>0.</agentHeight>
    <imageSize>
        <width>640</width>
        <height>480</height>
    </imageSize>
"""
LENS = """    <cameraMatrix type_id="opencv-matrix">
    <rows>3</rows>
    <cols>3</cols>
    <dt>d</dt>
    <data>
        2.2e+02 0. 3.2e+02 0. 2.21e+02 2.4e+02 0. 0. 1.
    </data>
    </cameraMatrix>
    <distortionCoefficients type_id="opencv-matrix">
    <rows>1</rows>
    <cols>14</cols>
    <dt>d</dt>
    <data>
        2.2e-01 -4.3e-02 -6.8e-04 3.2e-04 -1.4e-03 5.6e-01 -3.4e-02 -9.4e-03 0. 0. 0. 0. 0. 0.
    </data>
    </distortionCoefficients>
    <invertX>0</invertX>
    <invertY>1</invertY>
"""
POINTS = """    <calibrationPoints>
        <numberOfPoints>2</numberOfPoints>
        <point_0>
            <xWorld>-13.6</xWorld>
            <yWorld>0</yWorld>
            <xImage>184.4</xImage>
            <yImage>120</yImage>
        </point_0>
        <point_1>
            <xWorld>20</xWorld>
            <yWorld>0.5</yWorld>
            <xImage>258.6</xImage>
            <yImage>107.2</yImage>
        </point_1>
    </calibrationPoints>
</opencv_storage>
"""


@pytest.fixture
def read(tmp_path):
    """Return what reads a text as such a file."""

    def call(text):
        path = tmp_path / "old.xml"
        path.write_text(text)
        return read_older_camera(path)

    return call


def test_lens_and_points_are_read(read):
    """Centimetres become metres; all fourteen coefficients stay in their order."""
    found = read(HEAD + LENS + POINTS)
    assert found.size_px == (640, 480)
    assert found.matrix == ((220.0, 0.0, 320.0), (0.0, 221.0, 240.0), (0.0, 0.0, 1.0))
    assert found.distortion[:3] == (0.22, -0.043, -6.8e-4)
    assert len(found.distortion) == 14
    np.testing.assert_allclose(found.m, [[-0.136, 0], [0.2, 0.005]])
    np.testing.assert_allclose(found.px, [[184.4, 120], [258.6, 107.2]])


def test_the_oldest_files_hold_points_alone(read):
    """Then there is no lens."""
    found = read(HEAD + POINTS)
    assert found.matrix is None
    assert found.distortion == ()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("<worldUnits>cm", "<worldUnits>ell", "worldUnits must be m, cm or mm, got 'ell'"),
        ("<width>640</width>", "", "imageSize.width is no whole number"),
        ("<numberOfPoints>2", "<numberOfPoints>0", "has no calibrationPoints"),
        ("<numberOfPoints>2", "<numberOfPoints>3", "point_2.xImage is no number"),
        ("<xWorld>20</xWorld>", "", "point_1.xWorld is no number"),
        ("<yImage>107.2", "<yImage>far", "point_1.yImage is no number"),
    ],
)
def test_what_is_missing_is_named(read, old, new, says):
    """With the file and the key."""
    with pytest.raises(InputError, match=says) as caught:
        read((HEAD + LENS + POINTS).replace(old, new))
    assert "old.xml" in str(caught.value)


@pytest.mark.parametrize("text", ["", "<html></html>", HEAD + LENS[:150], HEAD + LENS])
def test_what_is_cut_or_foreign_is_damaged(read, text):
    """Never a traceback of OpenCV's."""
    with pytest.raises(DamagedError, match=r"old\.xml: is"):
        read(text)


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    """And a picture is no text."""
    with pytest.raises(InputError, match="no such file"):
        read_older_camera(tmp_path / "none.xml")
    (tmp_path / "old.xml").write_bytes(b"\xff\xd8\xff\xe0")
    with pytest.raises(DamagedError, match="is no text"):
        read_older_camera(tmp_path / "old.xml")
