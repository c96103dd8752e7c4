"""Options that the commands of `zfcal camera` share."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import EXISTING, PLACE, adds

if TYPE_CHECKING:
    from zfcal.stages.camera.making import CameraTask, Found, Place

SIDES = ("above", "below")

figure_option = click.option(
    "--figure", type=PLACE, metavar="PNG", help="Draw the errors into this file."
)


def numbers(text: str, count: int, *, of: str | None = None) -> tuple[float, ...]:
    """Return as many finite numbers as asked for from ``1,2.5``; ``of`` is what they belong to."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        message = f"expected {count} numbers with commas between, got {text!r}."
        raise click.BadParameter(message, param_hint=of)
    if not all(map(math.isfinite, values)):
        raise click.BadParameter(f"expected finite numbers, got {text!r}.", param_hint=of)
    return values


def _size(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Return width and height from ``640x480``."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d+)\s*[x×]\s*(\d+)", text.strip())
    if match is None:
        raise click.BadParameter(f"expected WIDTHxHEIGHT such as 640x480, got {text!r}.")
    return int(match[1]), int(match[2])


def box(_: click.Context, __: click.Parameter, text: str | None) -> tuple[float, ...] | None:
    """Return four numbers from ``X0,Y0,X1,Y1``."""
    return None if text is None else numbers(text, 4)


image_options = adds(
    click.option(
        "--size", callback=_size, metavar="WxH", help="Of the camera's images, such as 640x480."
    ),
    click.option("--image", type=EXISTING, help="A picture of the tank by that camera."),
)

place_options = adds(
    click.option("-o", "--out", "place", type=PLACE, help="The camera file to write."),
    click.option("--trial", type=PLACE, help="A trial that is to use the camera."),
    click.option(
        "--camera",
        "name",
        type=click.Choice(["overhead", "below"]),
        help="Which one of the trial it is.",
    ),
    click.option(
        "--seen-from",
        "side",
        type=click.Choice(SIDES),
        help="Where it looks from; default: below for --camera below, else above.",
    ),
    figure_option,
)
"""What `aim_of` takes."""


def aim_of(where: Mapping[str, Any], image: Path | None = None) -> tuple[Place, CameraTask]:
    """Return where a camera goes and how it is to be made, by the options of a command."""
    from zfcal.stages.camera.making import place_for

    out, trial, name = where["place"], where["trial"], where["name"]
    if (out is None) == (trial is None):
        raise click.UsageError("Give -o FILE, or --trial TRIAL with --camera.")
    if (trial is None) != (name is None):
        raise click.UsageError("--trial and --camera go together.")
    place = place_for(out=out, trial=trial, name=name, stated_side=where["side"])
    return place, task_of(where, image)


def task_of(where: Mapping[str, Any], image: Path | None = None) -> CameraTask:
    """Return how a camera is to be made: --dry-run, --force and --figure."""
    from zfcal.stages.camera.making import CameraTask

    figure: Path | None = where["figure"]
    draw = None if figure is None else functools.partial(_draw, figure=figure, image=image)
    return CameraTask(dry_run=where["dry_run"], force=where["force"], draw=draw)


def _draw(found: Found, *, figure: Path, image: Path | None) -> Path:
    from zfcal.artifacts.atomic import write_whole
    from zfcal.artifacts.images import read_image
    from zfcal.report.figures.camera import draw_residuals, residuals_of

    backdrop = None if image is None else read_image(image)
    residuals = residuals_of(found)
    write_whole(figure, lambda part: draw_residuals(residuals, part, image=backdrop))
    return figure
