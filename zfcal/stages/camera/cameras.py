"""From camera files to cameras and back: the one place that knows both."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.cameras import CameraFile, read_camera_file, write_camera_file
from zfcal.artifacts.frame_files import Calibration
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.cameras.camera import FISHEYE, Camera, Homography
from zfcal.cameras.lens import Lens
from zfcal.errors import DamagedError, InputError

_HOMOGRAPHY = "homography"
_PLUMB_BOB, _RATIONAL = 5, 8

SIDE_KEY = "seen_from"
"""Option in the lineage of a camera that looks from another side than its name says."""


def read_camera(path: Path) -> Camera | Homography:
    """Read a calibrated camera.

    Parameters
    ----------
    path
        A TOML file of schema ``zfcal.camera/1``, made by ``zfcal camera``.

    Raises
    ------
    InputError
        The file is missing or wrong, or holds a lens alone.
    SchemaError
        It has another schema.
    DamagedError
        It is empty or not TOML.
    """
    found = read_camera_file(path)
    if found.model != _HOMOGRAPHY and found.rotation_rad is None:
        raise InputError(
            f"{path}: holds a lens alone, it does not say where the camera stands.",
            hint=f"Add the pose with: zfcal camera points POINTS.csv --lens {path} -o CAMERA.toml",
        )
    with _named(path):
        return _camera_of(found)


def read_lens(path: Path) -> Lens:
    """Read the lens of a camera file, with or without a pose.

    Raises
    ------
    InputError, SchemaError, DamagedError
        As `read_camera`; or it is a homography, which has no lens.
    """
    found = read_camera_file(path)
    if found.model == _HOMOGRAPHY:
        raise InputError(
            f"{path}: is a homography, which has no lens.",
            hint="Calibrate the lens with: zfcal camera board IMAGE... -o LENS.toml",
        )
    with _named(path):
        return _lens_of(found)


def stated_side(path: Path) -> str | None:
    """Return from where a person said that a camera looks, when its file was made.

    None where nothing was said, and for a file that was written by hand.
    """
    try:
        said = read_lineage(path).options.get(SIDE_KEY)
    except (DamagedError, InputError):
        return None
    return said if isinstance(said, str) else None


def write_camera(
    path: Path,
    camera: Camera | Homography | Lens,
    lineage: Lineage,
    *,
    result: Mapping[str, JSON] | None = None,
    points: tuple[Floats, Floats] | None = None,
) -> None:
    """Write a camera, or a lens alone, whole or not at all.

    Parameters
    ----------
    path
        Where it goes.
    camera
        What was calibrated.
    lineage
        Where it comes from.
    result
        How the calibration went.
    points : pair of ndarray, shape (n, 2)
        Pixels and metres of the points that it was made from.

    Raises
    ------
    StorageError
        The file cannot be written.
    """
    write_camera_file(path, _file_of(camera, result=result or {}, points=points), lineage)


def _camera_of(found: CameraFile) -> Camera | Homography:
    """Return the camera of a file that has a pose, or its homography.

    Raises
    ------
    InputError
        The numbers make no camera.
    """
    if found.model == _HOMOGRAPHY:
        return Homography(size_px=found.size_px, matrix=found.matrix)
    if found.rotation_rad is None or found.translation_m is None:
        raise InputError("A lens alone does not say where the camera stands.")
    return Camera.of(_lens_of(found), np.array(found.rotation_rad), np.array(found.translation_m))


def _file_of(
    camera: Camera | Homography | Lens,
    *,
    result: Mapping[str, JSON],
    points: tuple[Floats, Floats] | None = None,
) -> CameraFile:
    """Return what the file of a camera holds."""
    px, m = points if points is not None else ((), ())
    values: dict[str, Any] = {
        "size_px": _whole(camera.size_px),
        "matrix": tuple(_plain(row) for row in camera.matrix),
        "result": result,
        "points_px": tuple(_plain(point) for point in px),
        "points_m": tuple(_plain(point) for point in m),
    }
    if isinstance(camera, Homography):
        return CameraFile(model=_HOMOGRAPHY, **values)
    values |= {"model": camera.model, "distortion": _plain(camera.distortion)}
    if isinstance(camera, Camera):
        values["rotation_rad"] = _plain(camera.rotation_rad)
        values["translation_m"] = _plain(camera.translation_m)
    return CameraFile(**values)


def _lens_of(found: CameraFile) -> Lens:
    return Lens(
        size_px=found.size_px,
        model=found.model,
        matrix=found.matrix,
        distortion=found.distortion,
    )


def _plain(values: Iterable[float]) -> tuple[float, ...]:
    """Return Python's numbers for NumPy's."""
    return tuple(float(value) for value in values)


def _whole(size_px: tuple[int, int]) -> tuple[int, int]:
    return int(size_px[0]), int(size_px[1])


@contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}: {error}", hint=error.hint) from error


def calibration_of(camera: Camera | Homography | None) -> Calibration | None:
    """Return a camera's calibration in the viewers' words.

    Returns
    -------
    Calibration or None
        None for a camera that they have no word for: a homography, or a lens of
        12 or 14 coefficients of which the last ones are not zero.
    """
    if not isinstance(camera, Camera):
        return None
    matrix = tuple(float(value) for value in itertools.chain.from_iterable(camera.matrix))
    said = list(camera.distortion)
    if camera.model == FISHEYE:
        model = "kannala_brandt"
    elif len(said) <= _PLUMB_BOB:
        model, said = "plumb_bob", said + [0.0] * (_PLUMB_BOB - len(said))
    elif not any(said[_RATIONAL:]):
        model, said = "rational_polynomial", said[:_RATIONAL]
    else:
        return None
    return Calibration(
        size_px=camera.size_px,
        distortion_model=model,
        distortion=tuple(map(float, said)),
        matrix=matrix,
    )
