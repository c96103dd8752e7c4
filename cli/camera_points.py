"""`zfcal camera points` and `import`: a camera from points of the tank."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .camera_options import aim_of, image_options, place_options
from .options import EXISTING, adds, makes_artifacts, speaks
from .output import Output

_fit_options = adds(
    click.option(
        "--model",
        type=click.Choice(["pinhole", "fisheye"]),
        help="Of the lens; default: the one that predicts left-out points best.",
    ),
    click.option("--robust", is_flag=True, help="Let points that are far off weigh less."),
)


@click.command("points")
@click.argument("file", metavar="POINTS.csv", type=EXISTING)
@click.option("--lens", type=EXISTING, help="A camera file with this camera's lens.")
@_fit_options
@image_options
@place_options
@makes_artifacts
@speaks
def points(
    out: Output,
    file: Path,
    *,
    lens: Path | None,
    model: str | None,
    robust: bool,
    size: tuple[int, int] | None,
    image: Path | None,
    **where: Any,
) -> None:
    r"""Take points of the tank whose place is known.

    The file has the columns x_px, y_px (pixels, y down) and x_m, y_m (metres
    of the arena; x_cm or x_mm will do). With --lens four points give the pose;
    without, the lens is fitted too, as rich a one as the points support.

    \b
    Example:
        zfcal camera points marks.csv --size 500x500 --trial trial --camera overhead
        zfcal camera points below-marks.csv --lens below-lens.toml \
            -o below.toml --seen-from below
    """
    from zfcal.stages.camera.points import Points, make_from_points

    if lens is not None and model is not None:
        raise click.UsageError("--lens has its model already: leave --model out.")
    given = Points(path=file, size_px=size, image=image, lens=lens, model=model, robust=robust)
    place, task = aim_of(where, image)
    out.attempt(lambda: make_from_points(place, given, out.tell, task=task))


@click.command("import")
@click.argument("file", metavar="OLD.xml", type=EXISTING)
@_fit_options
@place_options
@makes_artifacts
@speaks
def older(
    out: Output,
    file: Path,
    *,
    model: str | None,
    robust: bool,
    **where: Any,
) -> None:
    r"""Read a camera of the older rig: OpenCV's XML with calibrationPoints.

    The pose is found from the file's points. Files without a cameraMatrix
    hold points alone; then the lens is fitted too, as by camera points.

    \b
    Example:
        zfcal camera import cats2-below-camera.xml --trial trial --camera below
    """
    from zfcal.stages.camera.points import Points, make_from_older

    given = Points(path=file, model=model, robust=robust)
    place, task = aim_of(where)
    out.attempt(lambda: make_from_older(place, given, out.tell, task=task))
