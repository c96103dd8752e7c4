"""Options that the commands of `zfcal camera` share."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import EXISTING, PLACE

if TYPE_CHECKING:
    from zfcal.online.camera_making import Place

Command = Callable[..., None]


def numbers(text: str, count: int) -> tuple[float, ...]:
    """Return as many numbers as asked for from ``1,2.5``."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise click.BadParameter(f"expected {count} numbers with commas between, got {text!r}.")
    return values


def size(_: click.Context, __: click.Parameter, text: str | None) -> tuple[int, int] | None:
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


def image_options(command: Command) -> Command:
    """Add --size and --image."""
    command = click.option("--image", type=EXISTING, help="A picture of the tank by that camera.")(
        command
    )
    return click.option(
        "--size", callback=size, metavar="WxH", help="Of the camera's images, such as 640x480."
    )(command)


def place_options(command: Command) -> Command:
    """Add -o, --trial and --camera, handed over as ``place``."""
    for option in reversed(
        (
            click.option("-o", "--out", "place", type=PLACE, help="The camera file to write."),
            click.option("--trial", type=PLACE, help="A trial that is to use the camera."),
            click.option(
                "--camera",
                "name",
                type=click.Choice(["overhead", "below"]),
                help="Which one of the trial it is.",
            ),
        )
    ):
        command = option(command)
    return command


def place_of(out: Path | None, trial: Path | None, name: str | None) -> Place:
    """Return the place that the options ask for."""
    from zfcal.online.camera_making import place_for

    if (out is None) == (trial is None):
        raise click.UsageError("Give -o FILE, or --trial TRIAL with --camera.")
    if (trial is None) != (name is None):
        raise click.UsageError("--trial and --camera go together.")
    return place_for(out=out, trial=trial, name=name)
