"""A camera from points of the tank: a CSV file of them, or a file of the older rig."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.older_cameras import read_older_camera
from zfcal.artifacts.point_files import read_points
from zfcal.cameras.calibration import Calibration
from zfcal.cameras.calibration_points import calibrate_points, calibrate_pose
from zfcal.cameras.lens import PINHOLE, Lens
from zfcal.cameras.pairs import Pairs
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import read_lens
from zfcal.stages.camera.corners import size_of_images
from zfcal.stages.camera.making import CameraTask, Place, Recipe, make_camera
from zfcal.stages.events import Tell


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Points of the tank, and what is known of the camera.

    Parameters
    ----------
    path
        The CSV file of points, or the older rig's XML.
    size_px
        Of the image that they were read off; None to take that of the lens or the image.
    image
        A picture of the tank; None if there is none.
    lens
        A camera file with the lens; None to fit it too.
    model
        ``pinhole`` or ``fisheye``; None to take what foretells points best.
    robust
        Whether points that are far off are to draw the fit less.
    """

    path: Path
    size_px: tuple[int, int] | None = None
    image: Path | None = None
    lens: Path | None = None
    model: str | None = None
    robust: bool = False


def make_from_points(place: Place, points: Points, tell: Tell, *, task: CameraTask) -> None:
    """Make a camera file from a CSV file of points.

    Raises
    ------
    InputError
        The points do not determine a camera, or are not of this one.
    """
    make_camera(place, lambda: _from_points(place, points), tell, task=task)


def _from_points(place: Place, points: Points) -> Recipe:
    lens = None if points.lens is None else read_lens(points.lens)
    if lens is not None and points.size_px is None and points.image is None:
        size_px = lens.size_px
    else:
        size_px = size_of_images(points.size_px, points.image)
    found = read_points(points.path)

    def work() -> Calibration:
        try:
            pairs = Pairs(px=found.px, m=found.m, size_px=size_px)
            return _calibrate(pairs, lens, points)
        except InputError as error:
            raise InputError(f"{points.path}: {error}", hint=error.hint) from error

    inputs = (points.path,) if points.lens is None else (points.path, points.lens)
    options = {"size_px": list(size_px), "model": points.model, "robust": points.robust or None}
    return Recipe(place=place, command="camera points", work=work, options=options, inputs=inputs)


def make_from_older(place: Place, points: Points, tell: Tell, *, task: CameraTask) -> None:
    """Make a camera file from one of the older rig.

    Raises
    ------
    InputError
        The file lacks what a camera needs.
    DamagedError
        It is not XML of OpenCV.
    """
    make_camera(place, lambda: _from_older(place, points), tell, task=task)


def _from_older(place: Place, points: Points) -> Recipe:
    found = read_older_camera(points.path)
    lens = None
    if found.matrix is not None:
        lens = Lens(
            size_px=found.size_px,
            model=PINHOLE,
            matrix=found.matrix,
            distortion=found.distortion,
        )

    def work() -> Calibration:
        try:
            pairs = Pairs(px=found.px, m=found.m, size_px=found.size_px)
            return _calibrate(pairs, lens, points)
        except InputError as error:
            raise InputError(f"{points.path}: {error}", hint=error.hint) from error

    options = {"model": points.model, "robust": points.robust or None}
    return Recipe(
        place=place, command="camera import", work=work, options=options, inputs=(points.path,)
    )


def _calibrate(pairs: Pairs, lens: Lens | None, points: Points) -> Calibration:
    """Return the pose of a lens that is known, or all of the camera."""
    if lens is not None:
        return calibrate_pose(lens, pairs, robust=points.robust)
    return calibrate_points(pairs, model=points.model, robust=points.robust)
