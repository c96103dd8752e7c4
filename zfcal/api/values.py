"""Values of options, as people type them and as Python has them.

What the command line has checked already passes unchanged. Knows no trial and opens no file.
"""

from __future__ import annotations

import math
import operator
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from zfcal.errors import OptionError

T = TypeVar("T")

PathLike: TypeAlias = str | os.PathLike[str]
Time: TypeAlias = float | str
"""Seconds, or a text such as ``50s``, ``2min`` or ``1.5h``."""

Stretch: TypeAlias = tuple[int, int] | str
"""From and to, in seconds since trial start, or a text such as ``0:900``."""

Names: TypeAlias = str | Iterable[str]
"""Names, or a text in which commas stand between them."""

_SECONDS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}


def seconds(value: Time) -> float:
    """Return the seconds of a positive time.

    >>> seconds("2min"), seconds(50)
    (120.0, 50.0)
    """
    if isinstance(value, str):
        found = re.fullmatch(r"\s*(\d*\.?\d+)\s*(s|min|h|)\s*", value)
        number = float(found.group(1)) * _SECONDS[found.group(2)] if found else 0.0
    else:
        number = float(value)
    if not 0 < number < math.inf:
        raise OptionError(f"{value!r} is no positive time such as 50s, 2min or 1h.")
    return number


def span(value: Stretch) -> tuple[int, int]:
    """Return start and end of a stretch, in whole seconds.

    >>> span("0:900"), span((0, 900))
    ((0, 900), (0, 900))
    """
    parts: Sequence[Any] = ()
    if not isinstance(value, str):
        parts = tuple(value)
    elif found := re.fullmatch(r"(\d+):(\d+)", value):
        parts = tuple(map(int, found.groups()))
    if len(parts) != 2 or not all(_is_second(part) for part in parts) or not parts[0] < parts[1]:
        raise OptionError(f"{value!r} is no stretch START:END in seconds, such as 0:900.")
    return int(parts[0]), int(parts[1])


def _is_second(value: Any) -> bool:
    return isinstance(value, int | float) and 0 <= value < math.inf and value == int(value)


def names(value: Names) -> tuple[str, ...]:
    """Return names one by one.

    >>> names("D, W"), names(["D", "W"])
    (('D', 'W'), ('D', 'W'))
    """
    parts = value.split(",") if isinstance(value, str) else value
    found = tuple(name.strip() for name in parts)
    if not all(found):
        raise OptionError(f"{value!r} holds an empty name; give them as D,W,O,T.")
    return found


def several(value: Names) -> tuple[str, ...]:
    """Return texts as a tuple, each once; a text alone is one.

    >>> several("alignment"), several(["a", "b", "a"])
    (('alignment',), ('a', 'b'))
    """
    return (value,) if isinstance(value, str) else tuple(dict.fromkeys(value))


def existing(value: PathLike) -> Path:
    """Return a path at which something is.

    Raises
    ------
    OptionError
        There is nothing.
    """
    path = Path(value)
    if not path.exists():
        raise OptionError(f"Path {str(path)!r} does not exist.")
    return path


def whole(least: int) -> Callable[[Any], int]:
    """Return what takes a whole number that is not below a least one."""

    def taken(value: Any) -> int:
        try:
            number = operator.index(value)
        except TypeError:
            raise OptionError(f"{value!r} is no whole number.") from None
        if number < least:
            raise OptionError(f"{number} is below {least}.")
        return number

    return taken


def number(*, low: float, is_open: bool = False) -> Callable[[Any], float]:
    """Return what takes a finite number from a low one on, or above it where that is open."""

    def taken(value: Any) -> float:
        try:
            found = float(value)
        except (TypeError, ValueError):
            raise OptionError(f"{value!r} is no number.") from None
        if not (low < found if is_open else low <= found) or not math.isfinite(found):
            raise OptionError(f"{value!r} is not {'above' if is_open else 'at least'} {low:g}.")
        return found

    return taken


def one_of(*words: T) -> Callable[[Any], T]:
    """Return what takes one of some words, or of some numbers, which may be texts."""

    def taken(value: Any) -> T:
        for word in words:
            if str(value) == str(word):
                return word
        raise OptionError(f"{value!r} is not one of {', '.join(map(repr, words))}.")

    return taken


def taken(options: Mapping[str, Any], how: Mapping[str, Callable[[Any], Any]]) -> dict[str, Any]:
    """Return options with the values that are given in their right form; None stays.

    Parameters
    ----------
    options
        By the names that they have in Python.
    how
        For each name what takes its value. Options that are not there are left out.

    Raises
    ------
    OptionError
        A value has another form; it says of which option.
    """
    found = dict(options)
    for name, take in how.items():
        if found.get(name) is not None:
            try:
                found[name] = take(found[name])
            except OptionError as error:
                raise OptionError(f"{long_option(name)}: {error}") from None
    return found


def long_option(name: str) -> str:
    """Return the long option that an argument is: ``--held-out`` of ``held_out``."""
    return f"--{name.replace('_', '-')}"
