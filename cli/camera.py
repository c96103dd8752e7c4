"""`zfcal camera`: calibrate a camera, and say how well."""

from __future__ import annotations

import click

from .camera_align import align
from .camera_board import board, sheet
from .camera_corners import corners
from .camera_points import older, points
from .options import laid_out


@click.group("camera")
@laid_out
def command() -> None:
    r"""Calibrate a camera: find out where in the tank a pixel lies.

    A camera file (TOML) comes from images of a board, from points of the tank
    whose place is known, from the arena's four corners, or from the older
    rig's XML. It states its error in millimetres.

    \b
    Example:
        zfcal camera corners 52,448 447,450 449,51 50,53 --size 500x500 \
            --trial trial --camera overhead
        zfcal inspect trial/cameras/overhead.toml
    """


for part in (sheet, board, points, corners, older, align):
    command.add_command(part)
