"""Known cameras over a tank of a metre, and what they see of points with known noise."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.vision.calibration import Pairs
from zfcal.vision.camera import FISHEYE, PINHOLE, Camera

OVERHEAD = Camera(
    size_px=(500, 500),
    model=PINHOLE,
    matrix=((570.0, 0, 255.0), (0, 570.0, 244.0), (0, 0, 1)),
    distortion=(-0.25, 0.08, 0, 0, 0),
    rotation_rad=(math.pi - 0.05, 0.03, 0.02),
    translation_m=(-0.5, 0.5, 1.3),
)
BELOW = Camera(
    size_px=(640, 480),
    model=FISHEYE,
    matrix=((230.0, 0, 325.0), (0, 230.0, 236.0), (0, 0, 1)),
    distortion=(-0.03, 0.004, -0.002, 0.0003),
    rotation_rad=(0.1, -0.1, 0.3),
    translation_m=(-0.4, -0.5, 0.6),
)


def square(n, low=0.05, high=0.95):
    """Return n by n points, shape (n * n, 2), in metres."""
    across, up = np.meshgrid(np.linspace(low, high, n), np.linspace(low, high, n))
    return np.stack([across.ravel(), up.ravel()], axis=-1)


def pairs_of(camera, n, *, noise_px=0.0, seed=0):
    """Return what a camera sees of n by n points, with noise."""
    m = square(n)
    noise = np.random.default_rng(seed).normal(0, noise_px, m.shape)
    return Pairs(px=camera.to_pixels(m) + noise, m=m, size_px=camera.size_px)


def true_errors_mm(found, camera, *, n=21, low=0.0, high=1.0):
    """Return how far off a camera is all over the tank, by the one that is known."""
    m = square(n, low, high)
    return 1000 * np.hypot(*(found.to_metres(camera.to_pixels(m)) - m).T)


@pytest.fixture(scope="session")
def rig():
    """Return the known cameras, and what makes points of them."""
    return SimpleNamespace(
        overhead=OVERHEAD,
        below=BELOW,
        cameras={"overhead": OVERHEAD, "below": BELOW},
        square=square,
        pairs_of=pairs_of,
        true_errors_mm=true_errors_mm,
    )
