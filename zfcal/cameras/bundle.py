"""Fit a lens and poses to points of planes: one least-squares problem for every calibration.

With one view this is the calibration from point pairs, with many that from board images
(Zhang 2000). The projection and its derivatives are OpenCV's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from scipy.optimize import least_squares

from zfcal.arrays import Floats
from zfcal.cameras.camera import Camera
from zfcal.cameras.lens import FISHEYE, PINHOLE, Lens
from zfcal.cameras.poses import (
    NOISE_PX,
    View,
    error_px,
    method_of,
    plain_lens,
    pose_candidates,
    project,
)
from zfcal.errors import InputError

_FOCAL_PRIOR_LOG = 1.0
_CENTRE_PRIOR_SHARE = 0.1
_COEFFICIENT_PRIOR = 1.0
"""Standard deviations of what is likely: log of the focal length about the image's width, the
principal point about the middle (share of the width), coefficients about zero. They decide
where the points leave it open, such as the focal length of a camera that looks straight down."""

_FOCAL_STARTS = {PINHOLE: (0.45, 0.7, 1.1, 1.8, 3.0), FISHEYE: (0.25, 0.32, 0.42, 0.6, 1.0)}
_N_EVALUATIONS = 200


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
        **method_of(robust=robust),
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
            (project(self.free.model, view, pose, matrix, distortion)[0] - view.px).ravel()
            for view, pose in zip(self.views, poses, strict=True)
        ]
        return np.concatenate([*off, self._prior(values)])

    def jacobian(self, values: Floats) -> Floats:
        matrix, distortion, poses = self._split(values)
        n_lens = self.free.n_lens
        blocks = []
        for number, (view, pose) in enumerate(zip(self.views, poses, strict=True)):
            _, by_pose, by_focal, by_centre, by_coefficient = project(
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
        sd = np.full(self.free.n_lens, _COEFFICIENT_PRIOR)
        n_focal = 1 if self.free.square else 2
        sd[:n_focal] = _FOCAL_PRIOR_LOG
        if self.free.centre:
            sd[n_focal : n_focal + 2] = _CENTRE_PRIOR_SHARE * max(self.size_px)
        return sd
