"""Options of the camera images that `zfcal simulate --video` draws."""

from __future__ import annotations

import click

from .options import EXISTING, PLACE, adds

film_options = adds(
    click.option("--video", is_flag=True, help="Also draw what the cameras see."),
    click.option(
        "--video-file",
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
"""What to draw, and how."""
