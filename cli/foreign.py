"""Options that say of a foreign file what it does not tell itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from .options import POSITIVE, FiniteRange, adds

# Written out, since the library that knows them is heavy; a test compares the two.
FORMATS = (
    "csv",
    "cats",
    "trex",
    "idtracker",
    "trajectorytools",
    "mot",
    "sleap",
    "deeplabcut",
    "movement",
    "nwb",
    "robofish",
    "fishmodel",
)

_M_PER_MM = 0.001


def pair(text: str) -> tuple[float, float]:
    """Return the two numbers of a text such as ``0,1024``."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError as error:
        raise click.BadParameter(f"{text!r} is no pair of numbers such as 0,1024.") from error
    return x, y


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _columns(text: str) -> tuple[tuple[str, str], ...]:
    pairs = [part.split("=", 1) for part in _names(text)]
    if any(len(pair) != 2 for pair in pairs):
        raise click.BadParameter(f"{text!r} is no list such as time_s=t,x_m=x,y_m=y.")
    return tuple((ours, theirs) for ours, theirs in pairs)


def _body_axis(text: str) -> tuple[str, str]:
    parts = _names(text)
    if len(parts) != 2:
        raise click.BadParameter(f"{text!r} are no two body parts such as tail,head.")
    return parts[0], parts[1]


foreign_options = adds(
    click.option("--fps", type=POSITIVE, help="Frame rate; must be that of trial.toml."),
    click.option("--mm-per-px", type=POSITIVE, help="Scale of a file in pixels."),
    click.option(
        "--origin", type=pair, metavar="X,Y", help="Point of the file that becomes (0, 0)."
    ),
    click.option("--flip-y", is_flag=True, help="y counts downwards in the file: turn it up."),
    click.option("--noise-mm", type=FiniteRange(min=0), help="Position noise, sd per coordinate."),
    click.option("--robots", type=_names, metavar="NAME,...", help="Agents that are robots."),
    click.option(
        "--columns", type=_columns, metavar="OURS=THEIRS,...", help="Names of a CSV's columns."
    ),
    click.option("--keypoint", help="Body part taken as the position, or mean."),
    click.option("--body-axis", type=_body_axis, metavar="BACK,FRONT", help="Gives the heading."),
    click.option("--box", type=click.Choice(["corner", "centre"]), help="What x, y of MOT are."),
    click.option("--first-frame", type=int, help="Number of the first frame in the file."),
    click.option(
        "--min-confidence", type=FiniteRange(min=0), help="Positions below it count as missing."
    ),
)


def import_options(given: Mapping[str, Any]) -> dict[str, object]:
    """Return them in SI units, as `zfcal.readers.ImportOptions` names them."""
    # By identity: a first frame of 0 equals False, and is given.
    options = {
        key: value for key, value in given.items() if value is not None and value is not False
    }
    for ours, theirs in (("mm_per_px", "m_per_px"), ("noise_mm", "noise_m")):
        if ours in options:
            options[theirs] = options.pop(ours) * _M_PER_MM
    return options
