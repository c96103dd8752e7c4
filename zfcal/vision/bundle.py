"""Fit a lens and poses to points of planes: one least-squares problem for every calibration.

A *view* is a plane seen once: a board somewhere before the camera, or the tank. With
one view this is the calibration from point pairs, with many that from board images
(Zhang 2000). The projection and its derivatives are OpenCV's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import cv2
import numpy as np
from scipy.optimize import least_squares

from zfcal.errors import InputError
from zfcal.vision.camera import Camera
from zfcal.vision.lens import FISHEYE, PINHOLE, Floats, Lens

NOISE_PX = 0.5
"""What a point is off in an image, by which the priors are weighed against the points."""

FOCAL_PRIOR_LOG = 1.0
CENTRE_PRIOR_SHARE = 0.1
COEFFICIENT_PRIOR = 1.0
"""Standard deviations of what is likely: log of the focal length about the image's width, the
principal point about the middle (share of the width), coefficients about zero. They decide
where the points leave it open, such as the focal length of a camera that looks straight down."""

_FOCAL_STARTS = {PINHOLE: (0.45, 0.7, 1.1, 1.8, 3.0), FISHEYE: (0.25, 0.32, 0.42, 0.6, 1.0)}
_N_EVALUATIONS = 200


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Freedom:
    """Which numbers of a lens are fitted; the focal length always is.

    Parameters
    ----------
    name
        What to call the fit, in a few words.
    model
        ``pinhole`` or ``fisheye``.
    coefficients
        Places of the distortion coefficients, in OpenCV's order.
    centre
        Whether the principal point is fitted; the middle of the image otherwise.
    square
        Whether pixels are square: one focal length for both sides.
    """

    name: str
    model: str
    coefficients: tuple[int, ...] = ()
    centre: bool = False
    square: bool = True

    @property
    def n_lens(self) -> int:
        """How many numbers of the lens are fitted."""
        return 2 - self.square + 2 * self.centre + len(self.coefficients)

    @property
    def n_coefficients(self) -> int:
        """How many coefficients the lens has, fitted or zero."""
        if self.model == FISHEYE:
            return 4
        return 8 if max(self.coefficients, default=0) > 4 else 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """A lens and a camera for each view.

    Parameters
    ----------
    lens
        The lens.
    cameras
        It in the pose of each view.
    focal_sd_px
        Standard deviation of the focal length, from the scatter of the points.
    """

    lens: Lens
    cameras: tuple[Camera, ...]
    focal_sd_px: float


Start: TypeAlias = tuple[Lens, Sequence[Camera]]
"""A lens and a camera for each view, from where a search may start."""


def fit_views(
    views: Sequence[View],
    size_px: tuple[int, int],
    free: Freedom,
    *,
    start: Start | None = None,
    robust: bool = False,
) -> Fitted:
    """Fit a lens, and a pose for each view.

    Parameters
    ----------
    views
        What was seen, at least four points each.
    size_px
        Width and height of the images.
    free
        What is fitted.
    start
        A lens and poses to start from; None to look for them.
    robust
        Whether a few points may be far off without drawing the fit toward them.

    Raises
    ------
    InputError
        There is no such camera.
    """
    lens, cameras = start if start is not None else find_start(views, size_px, free.model)
    problem = _Problem(views=tuple(views), size_px=size_px, free=free)
    found = least_squares(
        problem.residuals,
        problem.packed(lens, cameras),
        jac=problem.jacobian,
        x_scale="jac",
        max_nfev=_N_EVALUATIONS,
        **_method(robust=robust),
    )
    lens, cameras = problem.unpacked(found.x)
    for view, camera in zip(views, cameras, strict=True):
        if not np.isfinite(camera.to_pixels(view.m)).all():
            raise InputError(
                f"No {free.name} camera sees all the points.",
                hint="Check that pixels and metres belong together, line by line.",
            )
    return Fitted(
        lens=lens,
        cameras=tuple(cameras),
        focal_sd_px=problem.focal_sd_px(found),
    )


def find_start(views: Sequence[View], size_px: tuple[int, int], model: str) -> Start:
    """Return a lens without distortion and poses that roughly see the views.

    Raises
    ------
    InputError
        No focal length does.
    """
    best: tuple[float, Lens, list[Camera]] | None = None
    for share in _FOCAL_STARTS[model]:
        lens = plain_lens(size_px, model, focal_px=share * max(size_px))
        try:
            cameras = [pose_candidates(lens, view)[0] for view in views]
        except InputError:
            continue
        error = sum(error_px(camera, view) for camera, view in zip(cameras, views, strict=True))
        if best is None or error < best[0]:
            best = (error, lens, cameras)
    if best is None:
        raise InputError(
            f"No {model} camera sees the points as the image does.",
            hint="Check that pixels and metres belong together, line by line.",
        )
    return best[1], best[2]


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
        _refined_pose(lens, view, candidate, robust=robust)
        for candidate in pose_candidates(lens, view)
    ]
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


def _project(
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


def _refined_pose(lens: Lens, view: View, start: Camera, *, robust: bool) -> Camera:
    matrix, distortion = np.array(lens.matrix, np.float64), np.array(lens.distortion, np.float64)

    def residuals(pose: Floats) -> Floats:
        return (_project(lens.model, view, pose, matrix, distortion)[0] - view.px).ravel()

    def jacobian(pose: Floats) -> Floats:
        return _project(lens.model, view, pose, matrix, distortion)[1]

    found = least_squares(
        residuals,
        np.array([*start.rotation_rad, *start.translation_m]),
        jac=jacobian,
        x_scale="jac",
        **_method(robust=robust),
    )
    return Camera.of(lens, found.x[:3], found.x[3:])


def _method(*, robust: bool) -> dict[str, Any]:
    """Return how to minimise; robust, an error of a few pixels counts linearly."""
    if robust:
        return {"method": "trf", "loss": "soft_l1", "f_scale": 2 * NOISE_PX}
    return {"method": "lm"}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Problem:
    """The numbers of a fit as a vector: focal lengths (log), centre, coefficients, poses."""

    views: tuple[View, ...]
    size_px: tuple[int, int]
    free: Freedom

    def packed(self, lens: Lens, cameras: Sequence[Camera]) -> Floats:
        matrix = np.array(lens.matrix)
        focal = np.log([matrix[0, 0], matrix[1, 1]])
        known = np.zeros(14)
        known[: len(lens.distortion)] = lens.distortion
        parts = [
            [focal.mean()] if self.free.square else focal,
            matrix[:2, 2] if self.free.centre else [],
            known[list(self.free.coefficients)],
            *([*camera.rotation_rad, *camera.translation_m] for camera in cameras),
        ]
        return np.concatenate([np.asarray(part, np.float64) for part in parts])

    def unpacked(self, values: Floats) -> tuple[Lens, list[Camera]]:
        matrix, distortion, poses = self._split(values)
        rows = tuple(tuple(map(float, row)) for row in matrix)
        lens = Lens(
            size_px=self.size_px,
            model=self.free.model,
            matrix=rows,
            distortion=tuple(map(float, distortion)),
        )
        return lens, [Camera.of(lens, pose[:3], pose[3:]) for pose in poses]

    def residuals(self, values: Floats) -> Floats:
        matrix, distortion, poses = self._split(values)
        off = [
            (_project(self.free.model, view, pose, matrix, distortion)[0] - view.px).ravel()
            for view, pose in zip(self.views, poses, strict=True)
        ]
        return np.concatenate([*off, self._prior(values)])

    def jacobian(self, values: Floats) -> Floats:
        matrix, distortion, poses = self._split(values)
        n_lens = self.free.n_lens
        blocks = []
        for number, (view, pose) in enumerate(zip(self.views, poses, strict=True)):
            _, by_pose, by_focal, by_centre, by_coefficient = _project(
                self.free.model, view, pose, matrix, distortion
            )
            focal = by_focal * np.diag(matrix)[:2]
            block = np.zeros((2 * len(view.px), len(values)))
            block[:, :n_lens] = np.hstack(
                [
                    focal.sum(axis=1, keepdims=True) if self.free.square else focal,
                    by_centre[:, : 2 * self.free.centre],
                    by_coefficient[:, list(self.free.coefficients)],
                ]
            )
            block[:, n_lens + 6 * number : n_lens + 6 * number + 6] = by_pose
            blocks.append(block)
        prior = np.zeros((n_lens, len(values)))
        prior[:, :n_lens] = np.diag(NOISE_PX / self._prior_sd())
        return np.vstack([*blocks, prior])

    def focal_sd_px(self, found: Any) -> float:
        n_spare = 2 * sum(len(view.px) for view in self.views) - len(found.x)
        if n_spare < 1:
            return math.nan
        off = self.residuals(found.x)[: -self.free.n_lens]
        jacobian = self.jacobian(found.x)
        spread = np.linalg.pinv(jacobian.T @ jacobian)[0, 0] * (off @ off) / n_spare
        return float(np.sqrt(spread) * np.exp(found.x[0]))

    def _split(self, values: Floats) -> tuple[Floats, Floats, Floats]:
        free = self.free
        n_focal = 1 if free.square else 2
        focal = np.exp(values[:n_focal])
        centre = (np.array(self.size_px, np.float64) - 1) / 2
        if free.centre:
            centre = values[n_focal : n_focal + 2]
        matrix = np.array([[focal[0], 0, centre[0]], [0, focal[-1], centre[1]], [0, 0, 1]])
        distortion = np.zeros(free.n_coefficients)
        distortion[list(free.coefficients)] = values[free.n_lens - len(free.coefficients) :][
            : len(free.coefficients)
        ]
        return matrix, distortion, values[free.n_lens :].reshape(-1, 6)

    def _prior(self, values: Floats) -> Floats:
        """Return how far the lens is from a likely one, on the scale of the points' errors."""
        n_lens = self.free.n_lens
        return NOISE_PX * (values[:n_lens] - self._prior_mean()) / self._prior_sd()

    def _prior_mean(self) -> Floats:
        mean = np.zeros(self.free.n_lens)
        n_focal = 1 if self.free.square else 2
        mean[:n_focal] = math.log(max(self.size_px))
        if self.free.centre:
            mean[n_focal : n_focal + 2] = (np.array(self.size_px) - 1) / 2
        return mean

    def _prior_sd(self) -> Floats:
        sd = np.full(self.free.n_lens, COEFFICIENT_PRIOR)
        n_focal = 1 if self.free.square else 2
        sd[:n_focal] = FOCAL_PRIOR_LOG
        if self.free.centre:
            sd[n_focal : n_focal + 2] = CENTRE_PRIOR_SHARE * max(self.size_px)
        return sd
