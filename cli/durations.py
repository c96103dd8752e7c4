"""Times as people type them: 50s, 2min, 1.5h, or plain seconds; stretches as 0:900."""

from __future__ import annotations

import click

from zfcal.api import values
from zfcal.errors import OptionError


def seconds(text: str) -> float:
    """Return the seconds of a positive time such as ``50s``."""
    try:
        return values.seconds(text)
    except OptionError as error:
        raise click.BadParameter(str(error)) from None


def span(text: str) -> tuple[int, int]:
    """Return start and end, in seconds, of a stretch such as ``0:900``."""
    try:
        return values.span(text)
    except OptionError as error:
        raise click.BadParameter(str(error)) from None
