"""Times as people type them: 50s, 2min, 1.5h, or plain seconds; stretches as 0:900."""

from __future__ import annotations

import math
import re

import click

_SECONDS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}


def seconds(text: str) -> float:
    """Return the seconds of a positive time such as ``50s``."""
    found = re.fullmatch(r"\s*(\d*\.?\d+)\s*(s|min|h|)\s*", text)
    value = float(found.group(1)) * _SECONDS[found.group(2)] if found else 0.0
    if not 0 < value < math.inf:
        raise click.BadParameter(f"{text!r} is no positive time such as 50s, 2min or 1h.")
    return value


def span(text: str) -> tuple[int, int]:
    """Return start and end, in seconds, of a stretch such as ``0:900``."""
    found = re.fullmatch(r"(\d+):(\d+)", text)
    if not found or not int(found.group(1)) < int(found.group(2)):
        raise click.BadParameter(f"{text!r} is no stretch START:END in seconds, such as 0:900.")
    return int(found.group(1)), int(found.group(2))
