"""`zfcal camera board` and `sheet`: a lens from images of a board, and the board to print."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import click

from .camera_options import aim_of, numbers, place_options
from .options import EXISTING, PLACE, POSITIVE, adds, makes_artifacts, speaks
from .output import Output


def _corners(_: click.Context, __: click.Parameter, text: str) -> tuple[int, int]:
    """Return columns and rows from ``9x6``."""
    match = re.fullmatch(r"(\d+)x(\d+)", text.strip())
    if match is None:
        raise click.BadParameter(f"expected COLUMNSxROWS of inner corners, got {text!r}.")
    return int(match[1]), int(match[2])


def _place_in_tank(
    _: click.Context, __: click.Parameter, text: str | None
) -> tuple[float, ...] | None:
    """Return metres and radians from ``X,Y,DEGREES``."""
    if text is None:
        return None
    x_m, y_m, degrees = numbers(text, 3)
    return x_m, y_m, math.radians(degrees)


_board_options = adds(
    click.option(
        "--board",
        callback=_corners,
        required=True,
        metavar="CxR",
        help="Inner corners, such as 9x6 for 10 by 7 squares.",
    ),
    click.option(
        "--square-mm", type=POSITIVE, required=True, help="Side of a square, in millimetres."
    ),
    click.option("--charuco", is_flag=True, help="The white squares hold markers."),
)


@click.command("board")
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=EXISTING)
@_board_options
@click.option(
    "--model",
    type=click.Choice(["pinhole", "fisheye"]),
    help="Of the lens; default: the one that predicts left-out images best.",
)
@click.option("--lies", type=EXISTING, metavar="IMAGE", help="The board lying in the tank.")
@click.option(
    "--at",
    callback=_place_in_tank,
    metavar="X,Y,DEGREES",
    help="Its first inner corner in metres of the arena, and which way its rows run.",
)
@click.option("--face-down", is_flag=True, help="It lies on its face; so below sees it.")
@place_options
@makes_artifacts
@speaks
def board(
    out: Output,
    images: tuple[Path, ...],
    *,
    board: tuple[int, int],
    square_mm: float,
    charuco: bool,
    model: str | None,
    lies: Path | None,
    at: tuple[float, float, float] | None,
    face_down: bool,
    **where: Any,
) -> None:
    r"""Find the lens from images of a board held before the camera.

    Eight to twenty images (or a folder of them): tipped, near and far, in all
    corners of the image, the whole board in each (a ChArUco board may be
    seen in part). With --lies and --at one more image gives the pose as well.

    \b
    Example:
        zfcal camera board shots/ --board 9x6 --square-mm 25 -o overhead-lens.toml
        zfcal camera board shots/ --board 9x6 --square-mm 25 --charuco --model fisheye \\
            --lies floor.png --at 0.2,0.3,90 --trial trial --camera below
    """
    from zfcal.cameras.boards import Board
    from zfcal.stages.camera.boards import BoardAt, BoardImages, make_from_boards

    if (lies is None) != (at is None):
        raise click.UsageError("--lies and --at go together.")
    if lies is None and where["side"] is not None:
        raise click.UsageError("--seen-from is for a board that --lies in the tank.")
    known = None
    if lies is not None and at is not None:
        down = face_down or (where["side"] or where["name"]) == "below"
        known = BoardAt(image=lies, x_m=at[0], y_m=at[1], angle_rad=at[2], face_down=down)

    def make() -> None:
        what = Board(columns=board[0], rows=board[1], square_m=square_mm / 1000, charuco=charuco)
        given = BoardImages(paths=images, board=what, model=model, lies=known)
        place, task = aim_of(where, lies)
        make_from_boards(place, given, out.tell, task=task)

    out.attempt(make)


@click.command("sheet")
@_board_options
@click.option("-o", "--out", "path", type=PLACE, required=True, help="The PNG file to write.")
@speaks
def sheet(
    out: Output,
    *,
    board: tuple[int, int],
    square_mm: float,
    charuco: bool,
    path: Path,
) -> None:
    r"""Draw a board to print: at 10 pixels a millimetre, which is 254 dpi.

    Print it at its own size, glue it on something flat, and measure a square.

    \b
    Example:
        zfcal camera sheet --board 9x6 --square-mm 25 --charuco -o board.png
    """
    from zfcal.cameras.boards import Board
    from zfcal.stages.camera.boards import write_sheet

    def make() -> None:
        what = Board(columns=board[0], rows=board[1], square_m=square_mm / 1000, charuco=charuco)
        write_sheet(path, what, out.tell)

    out.attempt(make)
