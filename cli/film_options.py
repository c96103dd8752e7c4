"""Options of the camera images that `zfcal simulate --video` draws."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import EXISTING, PLACE, Command, adds

if TYPE_CHECKING:
    from zfcal.virtual.images.look import Look

_OPTIONS = adds(
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


def film_options(command: Command) -> Command:
    """Add --video, --video-file, --look, --draw and --photograph, as ``film``."""

    @functools.wraps(command)
    def run(
        *args: Any,
        video: bool,
        video_file: Path | None,
        look: str | None,
        changes: tuple[str, ...],
        photograph: Path | None,
        **options: Any,
    ) -> None:
        given = {"--look": look, "--draw": changes, "--photograph": photograph}
        film = None
        if video or video_file is not None:
            from zfcal.virtual.film import FilmOptions

            film = FilmOptions(
                look=_look(look, changes),
                photograph=photograph,
                seed=options["seed"],
                video=video_file,
            )
        elif any(given.values()):
            name = next(name for name, value in given.items() if value)
            raise click.UsageError(f"{name} is about images: add --video.")
        command(*args, film=film, **options)

    return _OPTIONS(run)


def _look(preset: str | None, changes: tuple[str, ...]) -> Look:
    from zfcal.virtual.images.look import USUAL, look_of

    return look_of(preset or USUAL, dict(map(_change, changes)))


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
