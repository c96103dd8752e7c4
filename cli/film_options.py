"""Options of the camera images that `zfcal simulate --video` draws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import EXISTING, PLACE

if TYPE_CHECKING:
    from zfcal.online.film import FilmOptions

Command = Callable[..., None]

_NEEDS_VIDEO = ("look", "photograph", "changes")


def film_options(command: Command) -> Command:
    """Add --video, --video-file, --look, --draw and --photograph."""
    for option in reversed(
        (
            click.option("--video", is_flag=True, help="Also draw what the cameras see."),
            click.option(
                "--video-file",
                "video_file",
                type=PLACE,
                metavar="FILE",
                help="Also as a plain video: .avi and .mkv are lossless, .mp4 is small.",
            ),
            click.option(
                "--look",
                type=click.Choice(["clean", "usual", "hard"]),
                help="How easy the images are.  [default: usual]",
            ),
            click.option(
                "--draw",
                "changes",
                multiple=True,
                metavar="NAME=VALUE",
                help="Change a value of the look, such as noise_grey=4; see docs/video.md.",
            ),
            click.option(
                "--photograph",
                type=EXISTING,
                metavar="FILE",
                help="Of the empty tank from above, instead of a drawn one.",
            ),
        )
    ):
        command = option(command)
    return command


def filmed(*, video: bool, video_file: Path | None, **given: Any) -> FilmOptions | None:
    """Return what is to be drawn; None if nothing is.

    Raises
    ------
    UsageError
        An option about images is given, and no images are asked for.
    """
    if not video and video_file is None:
        for name in _NEEDS_VIDEO:
            if given[name]:
                option = "--draw" if name == "changes" else f"--{name}"
                raise click.UsageError(f"{option} is about images: add --video.")
        return None
    from zfcal.online.film import FilmOptions
    from zfcal.vision.look import USUAL, look_of

    changes = dict(_change(text) for text in given["changes"])
    look = look_of(given["look"] or USUAL, changes)
    return FilmOptions(look=look, photograph=given["photograph"], seed=given["seed"])


def _change(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    try:
        if value == "none":
            return name, None
        if name == "jpeg_quality":
            return name, int(value)
        numbers = tuple(map(float, value.split(",")))
    except ValueError:
        raise click.UsageError(f"--draw takes NAME=VALUE with a number, got {text!r}.") from None
    return name, numbers if len(numbers) > 1 else numbers[0]
