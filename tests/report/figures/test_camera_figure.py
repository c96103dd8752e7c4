"""The picture of a camera's errors."""

from __future__ import annotations

import numpy as np
import pytest

from zfcal.report.figures.camera import Residuals, _times, draw_residuals, residuals_picture

PX = np.array([[10.0, 20.0], [400.0, 300.0], [250.0, 480.0]])
OFF = np.array([[0.1, 0.0], [0.0, -0.2], [0.05, 0.05]])


def residuals(**changes):
    """Return the errors of three points."""
    known = {
        "title": "Camera: pose",
        "size_px": (500, 500),
        "px": PX,
        "off_px": OFF,
        "m": PX / 500,
        "off_m": OFF / 500,
        "left_out_m": OFF / 400,
    }
    return Residuals(**{**known, **changes})


def test_a_camera_has_three_panels_and_a_lens_two():
    """Image, tank, counts; a lens alone knows no tank."""
    assert len(residuals_picture(residuals()).panels) == 3
    lens = residuals(m=None, off_m=None, left_out_m=None)
    titles = [panel.title for panel in residuals_picture(lens).panels]
    assert titles[-1] == "Median 0.10 px"
    assert len(titles) == 2


@pytest.mark.parametrize("image", [None, np.zeros((500, 500), np.uint8)])
@pytest.mark.parametrize("off", [OFF, 0 * OFF, np.full((3, 2), np.nan)])
def test_it_can_be_drawn_whatever_the_errors(tmp_path, image, off):
    """None, or not known; with a backdrop or without."""
    path = tmp_path / "errors.png"
    draw_residuals(residuals(off_px=off, off_m=off, left_out_m=off), path, image=image)
    assert path.stat().st_size > 10_000


def test_arrows_are_drawn_longer_by_a_round_number():
    """A fifth of a pixel in 500: a hundred times as long is 20 px, or 4 %."""
    assert _times(np.full((5, 2), 0.2 / np.sqrt(2)), 500.0) == 100
    assert _times(np.zeros((5, 2)), 500.0) == 1
