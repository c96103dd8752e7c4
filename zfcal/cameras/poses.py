"""From where a lens that is known sees a plane.

A *view* is a plane seen once: a board somewhere before the camera, or the tank.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy.optimize import least_squares

from zfcal.arrays import Floats
from zfcal.cameras.camera import Camera
from zfcal.cameras.lens import FISHEYE, Lens
from zfcal.errors import InputError

NOISE_PX = 0.5
"""What a point is off in an image, by which the priors are weighed against the points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Points of a plane, and where an image shows them.

    Parameters
    ----------
    px : ndarray, shape (n, 2)
        In pixels.
    m : ndarray, shape (n, 2)
        In metres, on the plane.
    """

    px: Floats
    m: Floats


def plain_lens(size_px: tuple[int, int], model: str, *, focal_px: float) -> Lens:
    """Return a lens without distortion that looks through the middle of the image."""
    width, height = size_px
    return Lens(
        size_px=size_px,
        model=model,
        matrix=(
            (focal_px, 0.0, (width - 1) / 2),
            (0.0, focal_px, (height - 1) / 2),
            (0.0, 0.0, 1.0),
        ),
        distortion=(0.0,) * (4 if model == FISHEYE else 5),
    )


def pose_candidates(lens: Lens, view: View) -> list[Camera]:
    """Return the poses in which a lens may see a view, the likelier first.

    A plane that is seen from afar has two (Collins and Bartoli 2014).

    Raises
    ------
    InputError
        No ray of the lens reaches some pixel, or there is no pose.
    """
    rays = lens.to_rays(view.px)
    for number in np.flatnonzero(~np.isfinite(rays).all(axis=1)):
        raise InputError(
            f"Point {number + 1}: no ray of this lens reaches pixel "
            f"{view.px[number, 0]:g}, {view.px[number, 1]:g}.",
            hint="Is it the lens of that camera?",
        )
    poses = [*_two_poses(rays, view.m), *_pose_of_homography(rays, view.m)]
    cameras = [
        camera
        for rotation, translation in poses
        if (camera := _camera_or_none(lens, rotation, translation)) is not None
        and np.isfinite(camera.to_pixels(view.m)).any()
    ]
    if not cameras:
        raise InputError(
            "The points are seen from no place.",
            hint="Check that pixels and metres belong together, line by line.",
        )
    return sorted(cameras, key=lambda camera: error_px(camera, view))


def fit_pose(lens: Lens, view: View, *, robust: bool = False) -> Camera:
    """Return the camera with that lens that sees a view best.

    Raises
    ------
    InputError
        No ray of the lens reaches some pixel, or there is no pose.
    """
    refined = [
        camera
        for candidate in pose_candidates(lens, view)
        if (camera := _refined_pose(lens, view, candidate, robust=robust)) is not None
    ]
    if not refined:
        raise InputError(
            "The points are seen from no place that is not in their plane.",
            hint="Check that pixels and metres belong together, line by line.",
        )
    return min(refined, key=lambda camera: error_px(camera, view))


def error_px(camera: Camera, view: View) -> float:
    """Return the mean distance in pixels; a point that is not seen counts as the image's width."""
    lengths = np.hypot(*(camera.to_pixels(view.m) - view.px).T)
    return float(np.mean(np.where(np.isfinite(lengths), lengths, camera.size_px[0])))


def _two_poses(rays: Floats, m: Floats) -> list[tuple[Any, Any]]:
    """Return the two poses of a plane; none where it is seen exactly straight on."""
    solved = cv2.solvePnPGeneric(
        np.column_stack([m, np.zeros(len(m))])[:, None, :],
        rays[:, None, :],
        np.eye(3),
        np.zeros(4),
        flags=cv2.SOLVEPNP_IPPE,
    )
    found = zip(solved[1], solved[2], strict=True)
    # Near half a turn OpenCV may give rotation vectors of millions of radians.
    return [(turn, shift) for turn, shift in found if np.linalg.norm(turn) <= 2 * math.pi]


def _pose_of_homography(rays: Floats, m: Floats) -> list[tuple[Any, Any]]:
    """Return the pose that comes of a homography's columns: r1, r2 and t, up to scale."""
    found, _ = cv2.findHomography(m, rays)
    if found is None or not np.isfinite(found).all():
        return []
    # The scale that puts the points before the camera.
    depth = found[2] @ [*m.mean(axis=0), 1.0]
    scale = np.sign(depth) / np.sqrt(np.linalg.norm(found[:, 0]) * np.linalg.norm(found[:, 1]))
    first, second, translation = (scale * found).T
    left, _, right = np.linalg.svd(np.column_stack([first, second, np.cross(first, second)]))
    return [(cv2.Rodrigues(left @ right)[0], translation)]


def _camera_or_none(lens: Lens, rotation: Any, translation: Any) -> Camera | None:
    try:
        return Camera.of(lens, rotation, translation)
    except InputError:
        return None


def project(
    model: str, view: View, pose: Floats, matrix: Floats, distortion: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return pixels, and their derivatives by pose, focal lengths, centre and coefficients."""
    world = np.column_stack([view.m, np.zeros(len(view.m))])[:, None, :]
    turn, shift = pose[:3].copy(), pose[3:].copy()
    if model == FISHEYE:
        pixels, slopes = cv2.fisheye.projectPoints(world, turn, shift, matrix, distortion)
        places = (slice(8, 14), slice(0, 2), slice(2, 4), slice(4, 8))
    else:
        pixels, slopes = cv2.projectPoints(world, turn, shift, matrix, distortion)
        places = (slice(0, 6), slice(6, 8), slice(8, 10), slice(10, None))
    j = np.asarray(slopes, np.float64)
    pose_, focal, centre, coefficients = (j[:, place] for place in places)
    return np.asarray(pixels, np.float64).reshape(-1, 2), pose_, focal, centre, coefficients


def _refined_pose(lens: Lens, view: View, start: Camera, *, robust: bool) -> Camera | None:
    """Return the best pose near a first one; None where that ends in the plane itself."""
    matrix, distortion = np.array(lens.matrix, np.float64), np.array(lens.distortion, np.float64)

    def residuals(pose: Floats) -> Floats:
        return (project(lens.model, view, pose, matrix, distortion)[0] - view.px).ravel()

    def jacobian(pose: Floats) -> Floats:
        return project(lens.model, view, pose, matrix, distortion)[1]

    found = least_squares(
        residuals,
        np.array([*start.rotation_rad, *start.translation_m]),
        jac=jacobian,
        x_scale="jac",
        **method_of(robust=robust),
    )
    return _camera_or_none(lens, found.x[:3], found.x[3:])


def method_of(*, robust: bool) -> dict[str, Any]:
    """Return how to minimise; robust, an error of a few pixels counts linearly."""
    if robust:
        return {"method": "trf", "loss": "soft_l1", "f_scale": 2 * NOISE_PX}
    return {"method": "lm"}
