"""Calibrations of the older rig: OpenCV's XML as CATS2 keeps it.

``cameraMatrix`` and ``distortionCoefficients`` of OpenCV's pinhole (5 or 14; the
oldest files have neither), ``imageSize``, ``worldUnits``, and ``calibrationPoints`` of the tank.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.reading.contents import read_bytes
from zfcal.errors import DamagedError, InputError

_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_HINT = "Camera files of the older rig lie in its config/camera-calibration/."


@dataclass(frozen=True, slots=True, kw_only=True)
class OlderCamera:
    """What a calibration file of the older rig holds.

    Parameters
    ----------
    size_px
        Width and height of the images.
    matrix : tuple of 3 rows of 3, or None
        Of the lens; None where the file has points alone.
    distortion
        In OpenCV's order; empty where the file has none.
    px, m : ndarray, shape (n, 2)
        The calibration points, in pixels and in metres of the tank. ``invertX`` and
        ``invertY`` turn both of the rig's frames over and leave these alone.
    """

    size_px: tuple[int, int]
    matrix: tuple[tuple[float, ...], ...] | None
    distortion: tuple[float, ...]
    px: Floats
    m: Floats


def read_older_camera(path: Path) -> OlderCamera:
    """Read a camera file of the older rig.

    Raises
    ------
    InputError
        The file is missing, or lacks what a camera needs.
    DamagedError
        It is not XML of OpenCV.
    """
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DamagedError(f"{path}: is no text.", hint=_HINT) from error
    if "<opencv_storage>" not in text:
        raise DamagedError(f"{path}: is no XML of OpenCV (no <opencv_storage>).", hint=_HINT)
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except (cv2.error, SystemError) as error:
        raise DamagedError(
            f"{path}: is XML of OpenCV that is cut or wrong.", hint="Copy it again."
        ) from error
    try:
        return _camera(path, storage.root())
    finally:
        storage.release()


def _camera(path: Path, root: Any) -> OlderCamera:
    size = root.getNode("imageSize")
    units = root.getNode("worldUnits").string()
    if units not in _UNITS:
        raise InputError(
            f"{path}: worldUnits must be m, cm or mm, got {units!r}.", hint="See the file's head."
        )
    px, m = _points(path, root.getNode("calibrationPoints"))
    matrix = root.getNode("cameraMatrix")
    distortion = root.getNode("distortionCoefficients")
    found = None if matrix.empty() else np.asarray(matrix.mat(), np.float64)
    known = () if distortion.empty() else np.ravel(distortion.mat()).tolist()
    return OlderCamera(
        size_px=(_whole(path, size, "width"), _whole(path, size, "height")),
        matrix=None if found is None else tuple(tuple(row) for row in found.tolist()),
        distortion=tuple(map(float, known)),
        px=px,
        m=m * _UNITS[units],
    )


def _points(path: Path, node: Any) -> tuple[Floats, Floats]:
    count = node.getNode("numberOfPoints")
    if count.empty() or not count.isInt() or count.real() < 1:
        raise InputError(
            f"{path}: has no calibrationPoints.",
            hint="A lens alone does not say where the camera stands: give points of the tank.",
        )
    names = ("xImage", "yImage", "xWorld", "yWorld")
    rows = []
    for number in range(int(count.real())):
        point = node.getNode(f"point_{number}")
        for name in names:
            if point.empty() or not _is_number(point.getNode(name)):
                raise InputError(f"{path}: calibrationPoints.point_{number}.{name} is no number.")
        rows.append([point.getNode(name).real() for name in names])
    found = np.array(rows, np.float64)
    return found[:, :2], found[:, 2:]


def _whole(path: Path, node: Any, name: str) -> int:
    part = node.getNode(name)
    if node.empty() or part.empty() or not part.isInt():
        raise InputError(f"{path}: imageSize.{name} is no whole number.")
    return int(part.real())


def _is_number(node: Any) -> bool:
    return bool(not node.empty() and (node.isInt() or node.isReal()))
