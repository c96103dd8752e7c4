"""A camera from points of the tank whose place is known: its pose, or all of it.

With a known lens, four points determine the pose. Without one, the lens is fitted as well:
as simple a one as the points support, which cross-validation decides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.bundle import Fitted, Freedom, Start, find_start, fit_views
from zfcal.cameras.calibration import (
    Calibration,
    calibrate_homography,
    fit_homography,
    left_out,
    outlier_notes,
)
from zfcal.cameras.camera import Camera, Homography
from zfcal.cameras.lens import FISHEYE, PINHOLE, Lens, shown_size
from zfcal.cameras.pairs import Pairs
from zfcal.cameras.poses import View, fit_pose
from zfcal.errors import InputError

LADDERS = {
    PINHOLE: (
        Freedom(name="pinhole, no distortion", model=PINHOLE),
        Freedom(name="pinhole, k1", model=PINHOLE, coefficients=(0,)),
        Freedom(name="pinhole, k1 k2", model=PINHOLE, coefficients=(0, 1)),
        Freedom(
            name="pinhole, k1 k2, principal point", model=PINHOLE, coefficients=(0, 1), centre=True
        ),
        Freedom(
            name="pinhole, k1 k2 p1 p2 k3, principal point",
            model=PINHOLE,
            coefficients=(0, 1, 2, 3, 4),
            centre=True,
        ),
    ),
    FISHEYE: (
        Freedom(name="fish-eye, equidistant", model=FISHEYE),
        Freedom(name="fish-eye, k1", model=FISHEYE, coefficients=(0,)),
        Freedom(name="fish-eye, k1 k2", model=FISHEYE, coefficients=(0, 1)),
        Freedom(
            name="fish-eye, k1 k2, principal point",
            model=FISHEYE,
            coefficients=(0, 1),
            centre=True,
        ),
    ),
}
"""Lenses from the simplest on; a rung is tried where it leaves `_SPARE` numbers to judge it by."""

_SPARE = 4
_N_POSE = 6
_N_FOLDS = 12
_CLIP = 6.0
_MM = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tried:
    """One camera model that was tried.

    Parameters
    ----------
    name
        In a few words.
    n_parameters
        How many numbers it fits.
    errors_m : ndarray, shape (n,)
        Distance at each point by a fit that had not seen it.
    free
        What it fits of a lens; None for a homography.
    """

    name: str
    n_parameters: int
    errors_m: Floats
    free: Freedom | None


def calibrate_pose(lens: Lens, pairs: Pairs, *, robust: bool = False) -> Calibration:
    """Find where a camera with a known lens stands.

    Parameters
    ----------
    lens
        The lens.
    pairs
        Four points or more of the tank's plane.
    robust
        Whether points that are far off are to draw the pose less.

    Raises
    ------
    InputError
        The points do not determine it, or the lens is that of another camera.
    """
    pairs.check_spread(4, what="A pose")
    if tuple(lens.size_px) != tuple(pairs.size_px):
        raise InputError(
            f"The lens was calibrated for {shown_size(lens.size_px)} images, the points are of "
            f"{shown_size(pairs.size_px)}.",
            hint="It is of another camera, or the camera's resolution was changed.",
        )

    def fit(some: Pairs) -> Camera:
        some.check_spread(4, what="A pose")
        return fit_pose(lens, View(px=some.px, m=some.m), robust=robust)

    camera = fit(pairs)
    errors_m = left_out(pairs, fit)
    return Calibration(
        camera=camera,
        pairs=pairs,
        method=f"{lens.model} pose",
        n_parameters=_N_POSE,
        left_out_m=errors_m,
        notes=outlier_notes(errors_m),
        details=_standing(camera),
    )


def calibrate_points(
    pairs: Pairs, *, model: str | None = None, robust: bool = False
) -> Calibration:
    """Fit a camera of which nothing is known to points of one plane.

    Parameters
    ----------
    pairs
        Points of the tank's plane.
    model
        ``pinhole`` or ``fisheye``; None to take what foretells points best.
    robust
        Whether points that are far off are to draw the fit less.

    Raises
    ------
    InputError
        The points determine no camera.
    """
    pairs.check_spread(4, what="A camera")
    tried = list(_try_all(pairs, model, robust=robust))
    if not tried:
        return _homography_alone(pairs)
    chosen = _simplest_of_the_best(tried)
    if chosen.free is None:
        found = calibrate_homography(pairs)
        fitted = None
    else:
        fitted = _fit(pairs, chosen.free, robust=robust)
        found = _calibration_of(pairs, chosen.free, fitted, robust=robust)
    return replace(
        found,
        notes=(*found.notes, *_notes(pairs, chosen, tried, fitted)),
        details={**found.details, "tried": {item.name: _rms_mm(item) for item in tried}},
    )


def _standing(camera: Camera) -> dict[str, Any]:
    """Return where a camera stands: its place over the arena, and how far it is tipped.

    ``camera_m`` is negative in z below the plane; ``tilt_deg`` is between the axis and the
    plane's normal.
    """
    rotation, _ = cv2.Rodrigues(np.array(camera.rotation_rad, np.float64))
    place = -rotation.T @ np.array(camera.translation_m)
    tilt_deg = math.degrees(math.acos(min(1.0, abs(float(rotation[2, 2])))))
    return {"camera_m": [float(value) for value in place], "tilt_deg": tilt_deg}


def _try_all(pairs: Pairs, model: str | None, *, robust: bool) -> Sequence[_Tried]:
    tried = []
    if model is None and 2 * len(pairs) >= 8 + _SPARE:
        errors = _cross_validated(pairs, None, robust=robust)
        tried.append(_Tried(name="homography", n_parameters=8, errors_m=errors, free=None))
    for name in (PINHOLE, FISHEYE) if model is None else (model,):
        start = _start(pairs, name)
        for free in LADDERS[name]:
            n_parameters = _N_POSE + free.n_lens
            if 2 * len(pairs) < n_parameters + _SPARE or start is None:
                continue
            errors = _cross_validated(pairs, free, start=start, robust=robust)
            if np.isfinite(errors).sum() > len(pairs) / 2:
                tried.append(
                    _Tried(name=free.name, n_parameters=n_parameters, errors_m=errors, free=free)
                )
    return tried


def _start(pairs: Pairs, model: str) -> Start | None:
    try:
        return find_start([View(px=pairs.px, m=pairs.m)], pairs.size_px, model)
    except InputError:
        return None


def _cross_validated(
    pairs: Pairs, free: Freedom | None, *, start: Start | None = None, robust: bool
) -> Floats:
    """Return each point's distance in metres by a fit that has not seen it.

    The search for it starts from where all points roughly fit: that saves most of the time.
    """
    errors = np.full(len(pairs), np.nan)
    folds = np.arange(len(pairs)) % min(_N_FOLDS, len(pairs))
    for fold in range(folds.max() + 1):
        seen = folds != fold
        some = Pairs(px=pairs.px[seen], m=pairs.m[seen], size_px=pairs.size_px)
        try:
            some.check_spread(4, what="A camera")
            camera: Camera | Homography
            if free is None:
                camera = fit_homography(some)
            else:
                camera = _fit(some, free, start=start, robust=robust).cameras[0]
        except InputError:
            continue
        off = camera.to_metres(pairs.px[~seen]) - pairs.m[~seen]
        errors[~seen] = np.hypot(*off.T)
    return errors


def _fit(pairs: Pairs, free: Freedom, *, start: Start | None = None, robust: bool) -> Fitted:
    view = View(px=pairs.px, m=pairs.m)
    return fit_views([view], pairs.size_px, free, start=start, robust=robust)


def _simplest_of_the_best(tried: Sequence[_Tried]) -> _Tried:
    """Return the simplest model that is within a standard error of the best (Hastie et al. 2009).

    A point that no model foretells counts little: it is mistyped, and says nothing of models.
    """
    floor = min(float(np.nanmedian(item.errors_m)) for item in tried)
    scores = np.array([np.minimum(_known(item), _CLIP * floor) ** 2 for item in tried])
    best = int(scores.mean(axis=1).argmin())
    excess = scores - scores[best]
    allowed = excess.std(axis=1) / math.sqrt(excess.shape[1])
    good = [
        item
        for item, mean, error in zip(tried, excess.mean(axis=1), allowed, strict=True)
        if mean <= error
    ]
    return min(good, key=lambda item: item.n_parameters)


def _known(item: _Tried) -> Floats:
    return np.where(np.isfinite(item.errors_m), item.errors_m, np.inf)


def _calibration_of(pairs: Pairs, free: Freedom, fitted: Fitted, *, robust: bool) -> Calibration:
    camera = fitted.cameras[0]

    def refit(some: Pairs) -> Camera:
        some.check_spread(4, what="A camera")
        start = (fitted.lens, [camera])
        view = View(px=some.px, m=some.m)
        return fit_views([view], some.size_px, free, start=start, robust=robust).cameras[0]

    errors_m = left_out(pairs, refit)
    return Calibration(
        camera=camera,
        pairs=pairs,
        method=free.name,
        n_parameters=_N_POSE + free.n_lens,
        left_out_m=errors_m,
        notes=outlier_notes(errors_m),
        details={
            "focal_px": fitted.lens.matrix[0][0],
            "focal_sd_px": fitted.focal_sd_px,
            **_standing(camera),
        },
    )


def _homography_alone(pairs: Pairs) -> Calibration:
    found = calibrate_homography(pairs)
    note = (
        f"{len(pairs)} points support no lens, only a homography: straight walls stay bent. "
        "With 6 points a lens can be tried, 12 to 20 judge it."
    )
    return replace(found, notes=(*found.notes, note))


def _notes(
    pairs: Pairs, chosen: _Tried, tried: Sequence[_Tried], fitted: Fitted | None
) -> tuple[str, ...]:
    notes = []
    richer = [item for item in tried if item.n_parameters > chosen.n_parameters]
    if not richer:
        notes.append(
            f"{chosen.name} is the richest lens that {len(pairs)} points support: more points, "
            "or board images, may show more."
        )
    if fitted is not None and not fitted.focal_sd_px < 0.1 * fitted.lens.matrix[0][0]:
        notes.append(
            f"The focal length is known to {fitted.focal_sd_px:.0f} px of "
            f"{fitted.lens.matrix[0][0]:.0f} only: a plane seen straight on does not separate "
            "it from the distance. Positions on the plane do not suffer."
        )
    return tuple(notes)


def _rms_mm(item: _Tried) -> float | None:
    known = item.errors_m[np.isfinite(item.errors_m)]
    return float(np.sqrt(np.mean(known**2)) * _MM) if len(known) else None
