"""Camera files: what a calibration found, as TOML; `zfcal.cameras` says what the numbers mean.

A file may hold a lens alone, a lens with a pose, or a homography. The older rig's XML
is read in `older_cameras`; from file to camera goes `zfcal.stages.camera.cameras`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit

from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.validation import check, descriptions_of, read_toml
from zfcal.errors import InputError

SCHEMA = "zfcal.camera/1"

Matrix = tuple[tuple[float, ...], ...]
Points = tuple[tuple[float, ...], ...]

_N_COEFFICIENTS = {"pinhole": (0, 4, 5, 8, 12, 14), "fisheye": (4,)}


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraFile:
    """What a camera file holds.

    Parameters
    ----------
    model
        ``pinhole``, ``fisheye`` or ``homography``.
    size_px
        Width and height of its images.
    matrix : tuple of 3 rows of 3
        Of the lens, in pixels; of a homography, from pixels to metres.
    distortion
        Of the lens, in OpenCV's order.
    rotation_rad, translation_m
        Its pose; None for a lens alone and for a homography.
    result
        How the calibration went, for people and programs.
    points_px, points_m : tuple of pairs
        The points of the plane that it was made from; empty if there are none.
    """

    model: str
    size_px: tuple[int, int]
    matrix: Matrix
    distortion: tuple[float, ...] = ()
    rotation_rad: tuple[float, ...] | None = None
    translation_m: tuple[float, ...] | None = None
    result: Mapping[str, JSON] = field(default_factory=dict)
    points_px: Points = ()
    points_m: Points = ()


def read_camera_file(path: Path) -> CameraFile:
    """Read a camera file.

    Parameters
    ----------
    path
        A TOML file of schema ``zfcal.camera/1``.

    Raises
    ------
    InputError
        The file is missing, or a key is unknown, missing or wrong.
    SchemaError
        It has another schema.
    DamagedError
        It is empty or not TOML.
    """
    document = read_toml(path)
    _check(document, path)
    part = document["homography" if document["model"] == "homography" else "lens"]
    pose = document.get("pose", {})
    points = document.get("points", {})
    width, height = document["size_px"]
    return CameraFile(
        model=document["model"],
        size_px=(width, height),
        matrix=_rows(part["matrix"]),
        distortion=tuple(map(float, part.get("distortion", ()))),
        rotation_rad=_vector(pose.get("rotation_rad")),
        translation_m=_vector(pose.get("translation_m")),
        result=document.get("result", {}),
        points_px=_rows(points.get("px", ())),
        points_m=_rows(points.get("m", ())),
    )


def write_camera_file(path: Path, camera: CameraFile, lineage: Lineage) -> None:
    """Write a camera file whole, or not at all.

    Parameters
    ----------
    path
        Where it goes.
    camera
        What it holds.
    lineage
        Where that comes from.

    Raises
    ------
    InputError
        The values do not make a camera file, or the lineage is of something else.
    StorageError
        The file cannot be written.
    """
    document = _document(camera)
    _check(document.unwrap(), path)
    if lineage.schema != SCHEMA:
        raise InputError(f"{path}: a camera's lineage has schema {SCHEMA}, not {lineage.schema!r}.")
    origin = lineage.as_dict()
    # The file's own schema stands at its head, once.
    del origin["schema"]
    document.add("lineage", _table(origin))
    write_text_whole(path, tomlkit.dumps(document))


def _check(document: dict[str, Any], path: Path) -> None:
    check(document, "camera", path)
    model = document["model"]
    for part in ("lens", "pose") if model == "homography" else ("homography",):
        if part in document:
            raise InputError(f"{path}: a camera of model {model} has no {part}.")
    allowed = _N_COEFFICIENTS.get(model)
    if allowed is not None and len(document["lens"]["distortion"]) not in allowed:
        raise InputError(
            f"{path}: lens.distortion of a {model} camera must have "
            f"{' or '.join(map(str, allowed))} coefficients, "
            f"got {len(document['lens']['distortion'])}."
        )
    points = document.get("points", {"px": [], "m": []})
    if len(points["px"]) != len(points["m"]):
        raise InputError(
            f"{path}: points.px has {len(points['px'])} points, points.m {len(points['m'])}."
        )


def _document(camera: CameraFile) -> tomlkit.TOMLDocument:
    document = tomlkit.document()
    document.add(tomlkit.comment("A camera: where its pixels lie on the plane of the tank."))
    document.add(tomlkit.comment("Metres, pixels, radians; pixels count from the middle of the"))
    document.add(tomlkit.comment("top left one, y down; metres are the arena's, y up."))
    says = descriptions_of("camera")
    head = {"schema": SCHEMA, "model": camera.model, "size_px": list(camera.size_px)}
    for key, value in head.items():
        document.add(key, tomlkit.item(value).comment(says[key]))
    if camera.model == "homography":
        document.add("homography", _commented({"matrix": camera.matrix}, "homography"))
    else:
        lens = {"matrix": camera.matrix, "distortion": camera.distortion}
        document.add("lens", _commented(lens, "lens"))
    if camera.rotation_rad is not None and camera.translation_m is not None:
        pose = {"rotation_rad": camera.rotation_rad, "translation_m": camera.translation_m}
        document.add("pose", _commented(pose, "pose"))
    if camera.result:
        document.add("result", _table(camera.result))
    if camera.points_px or camera.points_m:
        points = {"px": camera.points_px, "m": camera.points_m}
        document.add("points", _commented(points, "points"))
    return document


def _commented(values: Mapping[str, Any], part: str) -> tomlkit.items.Table:
    table = tomlkit.table()
    for key, value in values.items():
        table.add(tomlkit.comment(descriptions_of("camera", part)[key]))
        table.add(key, _item(value))
    return table


def _table(values: Mapping[str, Any]) -> tomlkit.items.Table:
    """Return a TOML table; None is left out, since TOML has no word for it."""
    table = tomlkit.table()
    for key, value in values.items():
        if value is not None:
            table.add(key, _table(value) if isinstance(value, Mapping) else _item(value))
    return table


def _item(value: Any) -> Any:
    """Return a value for TOML: rows of numbers stand on a line each."""
    if not isinstance(value, list | tuple):
        return value
    items = tomlkit.array()
    items.extend([list(item) if isinstance(item, tuple) else item for item in value])
    return items.multiline(any(isinstance(item, list | tuple) for item in value))


def _rows(rows: Any) -> Matrix:
    return tuple(tuple(map(float, row)) for row in rows)


def _vector(values: Any) -> tuple[float, ...] | None:
    return None if values is None else tuple(map(float, values))
