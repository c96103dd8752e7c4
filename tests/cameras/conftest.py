"""Known cameras over a tank of a metre, and what they see of points with known noise."""

from __future__ import annotations

import math
from functools import cache
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from zfcal.cameras.boards import draw_board
from zfcal.cameras.camera import FISHEYE, PINHOLE, Camera
from zfcal.cameras.pairs import Pairs

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


@cache
def rays_of_pixels(lens):
    """Return the ray of each pixel of a lens, shape (row, column, xyz)."""
    width, height = lens.size_px
    down, across = np.mgrid[0:height, 0:width]
    rays = lens.to_rays(np.stack([across, down], axis=-1))
    return np.concatenate([rays, np.ones((height, width, 1))], axis=-1)


def places_of_pixels(camera):
    """Return where each pixel's ray meets the plane z = 0, NaN behind the camera."""
    rotation, _ = cv2.Rodrigues(np.array(camera.rotation_rad))
    plane = np.column_stack([rotation[:, :2], camera.translation_m])
    *places, inverse_depth = np.moveaxis(
        rays_of_pixels(camera.lens) @ np.linalg.inv(plane).T, -1, 0
    )
    return np.where(inverse_depth > 0, places / inverse_depth, np.nan).transpose(1, 2, 0)


def board_image(board, camera, *, square_px=40, noise=2.0, seed=0):
    """Return what a camera sees of a board that lies in the plane z = 0."""
    places = places_of_pixels(camera)
    # A margin and the outer squares lie before the first inner corner.
    face = np.nan_to_num((places / board.square_m + 2) * square_px - 0.5, nan=-1e4)
    drawn = draw_board(board, square_px=square_px)
    x, y = np.moveaxis(face.astype(np.float32), -1, 0)
    seen = cv2.remap(drawn, x, y, cv2.INTER_LINEAR, borderValue=120)
    noisy = cv2.GaussianBlur(seen, (0, 0), 0.8) + np.random.default_rng(seed).normal(
        0, noise, seen.shape
    )
    return np.clip(noisy, 0, 255).astype(np.uint8)


def held(lens, board, n, *, far_m, seed=0):
    """Return cameras before which a board is held in n ways, all of it in the image."""
    rng = np.random.default_rng(seed)
    size = np.array(lens.size_px)
    middle = np.array([*(board.corners_m.max(axis=0) / 2), 0.0])
    cameras = []
    while len(cameras) < n:
        ray = np.array([*lens.to_rays(rng.uniform(0.2 * size, 0.8 * size)), 1.0])
        rotation = cv2.Rodrigues(rng.uniform(-0.6, 0.6, 3))[0]
        place = rng.uniform(*far_m) * ray / np.linalg.norm(ray) - rotation @ middle
        camera = Camera.of(lens, cv2.Rodrigues(rotation)[0], place)
        px = camera.to_pixels(board.corners_m)
        if np.isfinite(px).all() and (px > 12).all() and (px < size - 12).all():
            cameras.append(camera)
    return cameras


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
        board_image=board_image,
        held=held,
    )
