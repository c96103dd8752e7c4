"""A camera from the four corners of the arena."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.images import read_image
from zfcal.artifacts.settings import read_trial
from zfcal.cameras.calibration import Calibration, calibrate_corners
from zfcal.cameras.handedness import check_corners
from zfcal.errors import InputError
from zfcal.stages.camera.making import CameraTask, Place, Recipe, make_camera
from zfcal.stages.events import Tell

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Corners:
    """Where the corners of the arena are seen.

    Parameters
    ----------
    px
        Lower left, lower right, upper right, upper left, as the arena has them.
    size_px
        Of the image; None to take that of `image`.
    image
        A picture of the tank; None if there is none.
    arena
        An arena by name, or its file; None for the trial's.
    bounds_m
        ``(x0, y0, x1, y1)`` instead of an arena.
    """

    px: tuple[tuple[float, float], ...]
    size_px: tuple[int, int] | None = None
    image: Path | None = None
    arena: str | None = None
    bounds_m: Box | None = None


def make_from_corners(place: Place, corners: Corners, tell: Tell, *, task: CameraTask) -> None:
    """Make a camera file from the four corners of the arena.

    Parameters
    ----------
    place
        Where it goes.
    corners
        What is known.
    tell
        Hears of the file.
    task
        Whether to write, and whether to do it again.

    Raises
    ------
    InputError
        The corners do not determine a camera or run the wrong way round, or neither arena nor
        size is known.
    """
    make_camera(place, lambda: _from_corners(place, corners), tell, task=task)


def _from_corners(place: Place, corners: Corners) -> Recipe:
    bounds_m = _bounds(place, corners)
    size_px = size_of_images(corners.size_px, corners.image)

    def work() -> Calibration:
        found = calibrate_corners(corners.px, bounds_m, size_px)
        check_corners(found.camera, corners.px, place.side)
        return found

    return Recipe(
        place=place,
        command="camera corners",
        work=work,
        options={
            "corners_px": [list(point) for point in corners.px],
            "bounds_m": list(bounds_m),
            "size_px": list(size_px),
        },
    )


def size_of_images(size_px: tuple[int, int] | None, image: Path | None) -> tuple[int, int]:
    """Return the size that was given, or that of an image.

    Raises
    ------
    InputError
        Neither is known, or the two differ.
    """
    if image is None:
        if size_px is None:
            raise InputError(
                "How large are the camera's images?",
                hint="Give --size WIDTHxHEIGHT, or --image with a picture of the tank.",
            )
        return size_px
    height, width = read_image(image).shape[:2]
    if size_px is not None and size_px != (width, height):
        raise InputError(
            f"{image}: is {width} x {height} px, --size says {size_px[0]} x {size_px[1]}.",
            hint="Take a picture with the camera set as for the recording.",
        )
    return width, height


def _bounds(place: Place, corners: Corners) -> Box:
    if corners.bounds_m is not None:
        return corners.bounds_m
    if corners.arena is not None:
        arena = load_arena(corners.arena, Path())
    elif place.root is not None:
        arena = load_arena(read_trial(place.root).arena, place.root)
    else:
        raise InputError(
            "Corners of which arena?",
            hint="Give --arena NAME|FILE, --bounds-m X0,Y0,X1,Y1, or --trial TRIAL.",
        )
    x0, y0, x1, y1 = arena.outline.bounds
    return x0, y0, x1, y1
