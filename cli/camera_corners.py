"""`zfcal camera corners`: a camera from the four corners of the arena."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .camera_options import aim_of, box, image_options, numbers, place_options
from .options import NAME, makes_artifacts, speaks
from .output import Output

_NAMES = ("LL", "LR", "UR", "UL")


def _pixel(name: str, text: str) -> tuple[float, ...]:
    return numbers(text, 2, of=name)


@click.command("corners")
@click.argument("corners", nargs=4, metavar=" ".join(_NAMES))
@click.option(
    "--arena", type=NAME, metavar="NAME|FILE", help="Whose corners; default: the trial's arena."
)
@click.option("--bounds-m", callback=box, metavar="X0,Y0,X1,Y1", help="Instead of an arena.")
@image_options
@place_options
@makes_artifacts
@speaks
def corners(
    out: Output,
    corners: tuple[str, ...],
    *,
    arena: str | None,
    bounds_m: tuple[float, float, float, float] | None,
    size: tuple[int, int] | None,
    image: Path | None,
    **where: Any,
) -> None:
    r"""Take the pixels of the arena's four corners, X,Y each.

    In the order lower left, lower right, upper right, upper left as the arena
    has them (y up), however the camera is turned. The corners are those of
    the rectangle round the arena. A lens that bends lines needs more: points.
    A camera below sees them in the opposite sense, through the floor.

    \b
    Example:
        zfcal camera corners 52,448 447,450 449,51 50,53 --size 500x500 \
            --trial trial --camera overhead
        zfcal camera corners 148,62 503,68 496,424 140,416 --size 640x480 \
            --trial trial --camera below
    """
    from zfcal.stages.camera.corners import Corners, make_from_corners

    given = Corners(
        px=tuple((x, y) for x, y in map(_pixel, _NAMES, corners)),
        size_px=size,
        image=image,
        arena=arena,
        bounds_m=bounds_m,
    )
    place, task = aim_of(where, image)
    out.attempt(lambda: make_from_corners(place, given, out.tell, task=task))
