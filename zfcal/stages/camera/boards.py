"""A lens from board images, and a camera where one of them lies in the tank."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.artifacts.images import read_image
from zfcal.cameras.boards import Board, draw_board, find_board
from zfcal.cameras.calibration import Calibration
from zfcal.cameras.calibration_boards import LensCalibration, calibrate_lens
from zfcal.cameras.calibration_points import calibrate_pose
from zfcal.cameras.handedness import BELOW
from zfcal.cameras.lens import shown_size
from zfcal.cameras.pairs import Pairs
from zfcal.cameras.poses import View
from zfcal.cameras.video import encoded
from zfcal.errors import DamagedError, InputError
from zfcal.stages.camera.making import CameraTask, Found, Place, Recipe, make_camera
from zfcal.stages.events import LeftOut, Made, Note, Progress, Tell

_PX_PER_M = 10_000.0
_SUFFIXES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm", ".webp"}


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardAt:
    """How a board lies in the tank, for one image of it.

    Parameters
    ----------
    image
        Shows it lying there.
    x_m, y_m
        Where its first inner corner is in the arena: the one beside the dark (or numbered
        zero) square at the head of the rows.
    angle_rad
        Which way its rows run from there, counter-clockwise from x.
    face_down
        Whether its face looks down, as a camera below sees it.
    """

    image: Path
    x_m: float
    y_m: float
    angle_rad: float
    face_down: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardImages:
    """Images of a board by one camera.

    Parameters
    ----------
    paths
        Images, and folders of them.
    board
        What they show.
    model
        ``pinhole`` or ``fisheye``; None to take what foretells images left out best.
    lies
        How it lies in the tank; None for the lens alone.
    """

    paths: tuple[Path, ...]
    board: Board
    model: str | None = None
    lies: BoardAt | None = None


def make_from_boards(place: Place, given: BoardImages, tell: Tell, *, task: CameraTask) -> None:
    """Make the file of a lens from board images, or of a camera where the board lies.

    Raises
    ------
    InputError
        There are too few images with the board in them, or they differ in size.
    """
    make_camera(place, lambda: _from_boards(place, given, tell), tell, task=task)


def _from_boards(place: Place, given: BoardImages, tell: Tell) -> Recipe:
    files = tuple(_files(given.paths))
    lies = given.lies
    if place.root is not None and lies is None:
        raise InputError(
            "Board images show the lens, not where the camera stands.",
            hint="Write the lens with -o LENS.toml, then: zfcal camera points MARKS.csv --lens "
            "LENS.toml --trial TRIAL --camera ... (or say how a board lies: --lies).",
        )
    if lies is not None and lies.face_down and place.stated_side is None and not place.name:
        # Who sees its face looks up at it.
        place = dataclasses.replace(place, stated_side=BELOW)
    board = given.board
    options: dict[str, Any] = {
        "board": [board.columns, board.rows],
        "square_m": board.square_m,
        "charuco": board.charuco or None,
        "model": given.model,
        "lies_m_rad": None if lies is None else [lies.x_m, lies.y_m, lies.angle_rad],
        "face_down": (lies is not None and lies.face_down) or None,
    }
    return Recipe(
        place=place,
        command="camera board",
        work=functools.partial(_work, files, given, tell),
        options=options,
        inputs=files if lies is None else (*files, lies.image),
    )


def write_sheet(path: Path, board: Board, tell: Tell) -> None:
    """Write a board as a PNG to print, ten pixels a millimetre.

    Raises
    ------
    StorageError
        It cannot be written.
    """
    image = draw_board(board, square_px=round(board.square_m * _PX_PER_M))
    write_bytes_whole(path, encoded(image, "png"))
    tell(Made(path=path, reason="requested"))


def _work(files: tuple[Path, ...], given: BoardImages, tell: Tell) -> Found:
    views, names, size_px = _views(files, given.board, tell)
    found = calibrate_lens(views, size_px, model=given.model, names=names)
    if given.lies is None:
        return found
    return _lying(found, given.board, given.lies)


def _views(
    files: tuple[Path, ...], board: Board, tell: Tell
) -> tuple[list[View], list[str], tuple[int, int]]:
    found: dict[str, View] = {}
    sizes: dict[tuple[int, int], Path] = {}
    missed: list[str] = []
    for number, path in enumerate(files):
        tell(Progress(stage="board images", done=number, total=len(files)))
        try:
            image = read_image(path)
        except DamagedError as error:
            tell(LeftOut(path=path, problem=str(error), hint=error.hint))
            continue
        sizes.setdefault((image.shape[1], image.shape[0]), path)
        _check_sizes(sizes)
        view = find_board(image, board)
        if view is None:
            missed.append(str(path))
        else:
            found[path.name] = view
    if missed:
        tell(Note(text=f"No {board.name} was found in {', '.join(missed)}.", warning=True))
    if len(found) < 3:
        raise InputError(
            f"The {board.name} was found in {len(found)} of {len(files)} images, 3 are needed.",
            hint="Does --board count the inner corners (10 by 7 squares are 9x6)? Is the whole "
            "board in the image, with its white margin, sharp and lit evenly?",
        )
    return list(found.values()), list(found), next(iter(sizes))


def _check_sizes(sizes: Mapping[tuple[int, int], Path]) -> None:
    if len(sizes) > 1:
        (first, one), (second, other) = list(sizes.items())[:2]
        raise InputError(
            f"The images differ in size: {one} is {shown_size(first)} px, {other} is "
            f"{shown_size(second)} px.",
            hint="Take all of them with the camera set as for the recording; do not crop them.",
        )


def _lying(found: LensCalibration, board: Board, lies: BoardAt) -> Calibration:
    view = find_board(read_image(lies.image), board)
    if view is None:
        raise InputError(f"{lies.image}: no {board.name} was found.")
    pairs = Pairs(px=view.px, m=_in_the_tank(view, lies), size_px=found.lens.size_px)
    posed = calibrate_pose(found.lens, pairs)
    return Calibration(
        camera=posed.camera,
        pairs=pairs,
        method=f"{found.result['method']}, board in the tank",
        n_parameters=posed.n_parameters,
        left_out_m=posed.left_out_m,
        notes=(*found.result["notes"], *posed.notes),
        details={**posed.details, "lens": {**found.result, "notes": None}},
    )


def _in_the_tank(view: View, lies: BoardAt) -> Floats:
    """Return the places of a board's corners in the arena.

    Seen on its face a board's rows follow each other clockwise from where they run; from
    above, that is so only while its face looks up.
    """
    cos, sin = math.cos(lies.angle_rad), math.sin(lies.angle_rad)
    upright = view.m * np.array([1.0, 1.0 if lies.face_down else -1.0])
    turned = upright @ np.array([[cos, sin], [-sin, cos]])
    return np.asarray(turned + np.array([lies.x_m, lies.y_m]), np.float64)


def _files(paths: tuple[Path, ...]) -> Iterator[Path]:
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() in _SUFFIXES)
            if not inside:
                raise InputError(f"{path}: holds no images.", hint="PNG, JPEG, TIFF, BMP are read.")
            yield from inside
        else:
            yield path
