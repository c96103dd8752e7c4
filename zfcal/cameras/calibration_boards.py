"""A lens from images of a board that is held before the camera in many ways (Zhang 2000)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras.bundle import Fitted, Freedom, Start, find_start, fit_views
from zfcal.cameras.calibration import summary
from zfcal.cameras.lens import FISHEYE, PINHOLE, Lens
from zfcal.cameras.poses import View, fit_pose
from zfcal.errors import InputError

_LEAST_VIEWS = 3
_GOOD_VIEWS = 8
_N_FOLDS = 4
_GAIN = 0.97
"""A richer lens must foretell views left out better than this times a simpler one."""

_OUTLIER = 4.0
_CLIP = 10.0
_SPARED = 16
_COVERED = 0.6
_GRID = 5
_MM = 1000.0

_LADDERS = {
    PINHOLE: (
        Freedom(
            name="pinhole, k1 k2",
            model=PINHOLE,
            coefficients=(0, 1),
            centre=True,
            square=False,
        ),
        Freedom(
            name="pinhole, k1 k2 p1 p2 k3",
            model=PINHOLE,
            coefficients=(0, 1, 2, 3, 4),
            centre=True,
            square=False,
        ),
        Freedom(
            name="pinhole, rational",
            model=PINHOLE,
            coefficients=(0, 1, 2, 3, 4, 5, 6, 7),
            centre=True,
            square=False,
        ),
    ),
    FISHEYE: (
        Freedom(
            name="fish-eye, k1 k2",
            model=FISHEYE,
            coefficients=(0, 1),
            centre=True,
            square=False,
        ),
        Freedom(
            name="fish-eye, k1 k2 k3 k4",
            model=FISHEYE,
            coefficients=(0, 1, 2, 3),
            centre=True,
            square=False,
        ),
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LensCalibration:
    """A lens that was fitted to views of a board, and how well.

    Parameters
    ----------
    lens
        It.
    result
        Errors on the board in millimetres and in pixels, by the fit and of views left out,
        and what a person should know.
    views
        What it was made from.
    residual_px : tuple of ndarray, shape (n, 2)
        Of each view: where the fit sees the corners, less where they are.
    """

    lens: Lens
    result: dict[str, Any]
    views: tuple[View, ...]
    residual_px: tuple[Floats, ...]


def calibrate_lens(
    views: Sequence[View],
    size_px: tuple[int, int],
    *,
    model: str | None = None,
    names: Sequence[str] | None = None,
) -> LensCalibration:
    """Fit a lens to views of a board.

    Parameters
    ----------
    views
        Three at least; eight to twenty, tipped, in all parts of the image.
    size_px
        Width and height of the images.
    model
        ``pinhole`` or ``fisheye``; None to take what foretells views left out best.
    names
        Of the images, for messages.

    Raises
    ------
    InputError
        There are too few views, or no lens sees them so.
    """
    if len(views) < _LEAST_VIEWS:
        raise InputError(
            f"A lens needs {_LEAST_VIEWS} views of the board or more, got {len(views)}.",
            hint="Hold it in 8 to 20 ways: tipped, near and far, in all corners of the image.",
        )
    unseen = [
        (errors, free)
        for name in ((PINHOLE, FISHEYE) if model is None else (model,))
        if (start := _start(views, size_px, name)) is not None
        for free in _LADDERS[name]
        if np.isfinite(errors := _cross_validated(views, size_px, free, start)).all()
    ]
    tried = _judged(unseen)
    if not tried:
        raise InputError(
            "No lens sees the board so in all the images.",
            hint="Are all of them of one camera, not cropped, and is the board flat?",
        )
    chosen = _chosen(tried)
    fitted = fit_views(views, size_px, chosen)
    labels = list(names) if names is not None else [f"view {i + 1}" for i in range(len(views))]
    return _calibration(views, fitted, chosen, tried, labels)


def _start(views: Sequence[View], size_px: tuple[int, int], model: str) -> Start | None:
    try:
        return find_start(views, size_px, model)
    except InputError:
        return None


def _cross_validated(
    views: Sequence[View], size_px: tuple[int, int], free: Freedom, start: Start
) -> Floats:
    """Return the distances in pixels of corners whose view the lens has not seen.

    The pose of such a view is found from every other corner and judged by the rest.
    """
    errors: list[Floats] = []
    folds = np.arange(len(views)) % min(_N_FOLDS, len(views))
    for fold in range(folds.max() + 1):
        kept = [view for view, at in zip(views, folds, strict=True) if at != fold]
        cameras = [camera for camera, at in zip(start[1], folds, strict=True) if at != fold]
        try:
            lens = fit_views(kept, size_px, free, start=(start[0], cameras)).lens
        except InputError:
            return np.array([np.nan])
        for view, at in zip(views, folds, strict=True):
            if at == fold:
                errors.append(_unseen(lens, view))
    return np.concatenate(errors)


def _unseen(lens: Lens, view: View) -> Floats:
    # Of few corners none can be spared for the judgement.
    judge = (np.arange(len(view.px)) % 2 == 1) | (len(view.px) < _SPARED)
    held = view if judge.all() else View(px=view.px[~judge], m=view.m[~judge])
    try:
        camera = fit_pose(lens, held)
    except InputError:
        # The lens has no rays there: as wrong as can be.
        return np.full(int(judge.sum()), float(max(lens.size_px)))
    lengths = np.hypot(*(camera.to_pixels(view.m[judge]) - view.px[judge]).T)
    return np.where(np.isfinite(lengths), lengths, float(max(lens.size_px)))


def _judged(unseen: Sequence[tuple[Floats, Freedom]]) -> list[tuple[float, Freedom]]:
    """Return the root mean square of each; a view that nothing foretells counts little."""
    if not unseen:
        return []
    usual = min(float(np.median(errors)) for errors, _ in unseen)
    limit = max(_CLIP * usual, 1.0)
    return [
        (float(np.sqrt(np.mean(np.minimum(errors, limit) ** 2))), free) for errors, free in unseen
    ]


def _chosen(tried: Sequence[tuple[float, Freedom]]) -> Freedom:
    best_error, best = tried[0]
    for error, free in tried[1:]:
        if error < _GAIN * best_error:
            best_error, best = error, free
    return best


def _calibration(
    views: Sequence[View],
    fitted: Fitted,
    free: Freedom,
    tried: Sequence[tuple[float, Freedom]],
    names: Sequence[str],
) -> LensCalibration:
    pairs = list(zip(views, fitted.cameras, strict=True))
    off_px = tuple(camera.to_pixels(view.m) - view.px for view, camera in pairs)
    off_m = np.concatenate([camera.to_metres(view.px) - view.m for view, camera in pairs])
    covered = coverage(np.concatenate([view.px for view in views]), fitted.lens.size_px)
    matrix = fitted.lens.matrix
    result = {
        "method": free.name,
        "n_views": len(views),
        "n_points": len(off_m),
        "error_mm": summary(off_m * _MM),
        "error_px": summary(np.concatenate(off_px)),
        "left_out_px": next(error for error, item in tried if item is free),
        "focal_px": [matrix[0][0], matrix[1][1]],
        "focal_sd_px": fitted.focal_sd_px,
        "coverage": covered,
        "tried": {item.name: error for error, item in tried},
        "notes": [*_view_notes(off_px, names), *_notes(len(views), covered, fitted)],
    }
    return LensCalibration(lens=fitted.lens, result=result, views=tuple(views), residual_px=off_px)


def coverage(px: Floats, size_px: tuple[int, int]) -> float:
    """Return the share of a 5 by 5 grid over the image that holds corners of the board."""
    cells = np.floor(px / np.array(size_px) * _GRID).astype(int).clip(0, _GRID - 1)
    return len({tuple(cell) for cell in cells.tolist()}) / _GRID**2


def _view_notes(off_px: Sequence[Floats], names: Sequence[str]) -> list[str]:
    sizes = np.array([np.sqrt(np.mean(np.sum(off**2, axis=1))) for off in off_px])
    usual = float(np.median(sizes))
    return [
        f"{names[i]}: its corners are off by {sizes[i]:.2f} px, those of most images by "
        f"{usual:.2f} px: leave it out if it is blurred or the board was bent."
        for i in np.flatnonzero(sizes > max(_OUTLIER * usual, 0.3)).tolist()
    ]


def _notes(n_views: int, covered: float, fitted: Fitted) -> list[str]:
    notes = []
    if n_views < _GOOD_VIEWS:
        notes.append(f"{n_views} views are few: {_GOOD_VIEWS} to 20 make the lens sure.")
    if covered < _COVERED:
        notes.append(
            f"Corners of the board cover {covered:.0%} of the image: where there were none the "
            "lens is guessed. Hold the board into the corners too."
        )
    focal_px = fitted.lens.matrix[0][0]
    if not fitted.focal_sd_px < 0.02 * focal_px:
        notes.append(
            f"The focal length is known to {fitted.focal_sd_px:.0f} px of {focal_px:.0f} only: "
            "tip the board more."
        )
    return notes
