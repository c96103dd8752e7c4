"""Values of options, as people type them and as Python has them.

What the command line has checked already passes unchanged. Knows no trial and opens no file.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from zfcal.errors import OptionError
from zfcal.report.options import FORMATS, NARROWEST_MM, WIDEST_MM, WIDTHS_MM
from zfcal.trial import LARGEST_SEED

T = TypeVar("T")

PathLike: TypeAlias = str | os.PathLike[str]
Time: TypeAlias = float | str
"""Seconds, or a text such as ``50s``, ``2min`` or ``1.5h``."""

Stretch: TypeAlias = tuple[int, int] | str
"""From and to, in seconds since trial start, or a text such as ``0:900``."""

Names: TypeAlias = str | Iterable[str]
"""Names, or a text in which commas stand between them."""

_SECONDS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}
_MOST_SHOWN = 60


def seconds(value: Time) -> float:
    """Return the seconds of a positive time.

    >>> seconds("2min"), seconds(50)
    (120.0, 50.0)
    """
    number = 0.0
    if isinstance(value, str):
        if found := re.fullmatch(r"\s*(\d*\.?\d+)\s*(s|min|h|)\s*", value):
            number = float(found.group(1)) * _SECONDS[found.group(2)]
    elif _is_number(plain := _plain(value)):
        number = _as_float(plain)
    if not 0 < number < math.inf:
        raise OptionError(f"{shown(value)} is no positive time such as 50s, 2min or 1h.")
    return number


def span(value: Stretch) -> tuple[int, int]:
    """Return start and end of a stretch, in whole seconds.

    >>> span("0:900"), span((0, 900))
    ((0, 900), (0, 900))
    """
    parts: Sequence[Any] = ()
    if not isinstance(value, str):
        parts = tuple(map(_plain, value)) if isinstance(value, Iterable) else ()
    elif found := re.fullmatch(r"(\d+):(\d+)", value):
        parts = tuple(map(int, found.groups()))
    if len(parts) != 2 or not all(map(_is_second, parts)) or not parts[0] < parts[1]:
        raise OptionError(f"{shown(value)} is no stretch START:END in seconds, such as 0:900.")
    return int(parts[0]), int(parts[1])


def _is_second(value: Any) -> bool:
    return _is_number(value) and 0 <= value < math.inf and value == int(value)


def _plain(value: Any) -> Any:
    """Return a scalar of numpy as Python has it; anything else as it is."""
    return value.item() if getattr(value, "ndim", None) == 0 else value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _as_float(value: float | str) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def names(value: Names) -> tuple[str, ...]:
    """Return names one by one.

    >>> names("D, W"), names(["D", "W"])
    (('D', 'W'), ('D', 'W'))
    """
    parts = value.split(",") if isinstance(value, str) else value
    if not isinstance(parts, Iterable):
        raise OptionError(f"{shown(value)} is neither a name nor a list of names.")
    found = tuple(map(_stripped, parts))
    if not all(found):
        raise OptionError(f"{shown(value)} holds an empty name; give them as D,W,O,T.")
    return found


def _stripped(name: Any) -> str:
    if not isinstance(name, str):
        raise OptionError(f"{shown(name)} is no name.")
    return name.strip()


def several(value: Names) -> tuple[str, ...]:
    """Return names one by one, each once.

    >>> several("alignment"), several(["a", "b", "a"]), several("a,b")
    (('alignment',), ('a', 'b'), ('a', 'b'))
    """
    return tuple(dict.fromkeys(names(value)))


def formats(value: Names) -> tuple[str, ...]:
    """Return the formats of figures, each once.

    >>> formats("png,pdf"), formats(["svg"])
    (('png', 'pdf'), ('svg',))
    """
    found = several(value)
    for each in found:
        if each not in FORMATS:
            raise OptionError(f"{shown(each)} is not one of {', '.join(map(repr, FORMATS))}.")
    return found


def width_mm(value: float | str) -> float:
    """Return the width of figures on paper, in millimetres.

    >>> width_mm("single"), width_mm("120mm"), width_mm(120)
    (85.0, 120.0, 120.0)
    """
    if isinstance(value, str) and value in WIDTHS_MM:
        return WIDTHS_MM[value]
    plain = value.removesuffix("mm").strip() if isinstance(value, str) else value
    try:
        found = number(low=NARROWEST_MM)(plain)
    except OptionError:
        found = math.inf
    if not found <= WIDEST_MM:
        raise OptionError(
            f"{shown(value)} is no width: single (85 mm), double (174 mm), or millimetres from "
            f"{NARROWEST_MM:g} to {WIDEST_MM:g}, such as 120mm."
        )
    return found


def text(value: str) -> str:
    """Return a text."""
    if not isinstance(value, str):
        raise OptionError(f"{shown(value)} is no text.")
    return value


def flag(value: Any) -> bool:
    """Return yes or no; a text such as ``no`` is neither."""
    plain = _plain(value)
    if not isinstance(plain, bool):
        raise OptionError(f"{shown(value)} is neither True nor False.")
    return plain


def place(value: PathLike) -> Path:
    """Return a path, which need not be there."""
    found = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(found, str):
        raise OptionError(f"{shown(value)} is no path.")
    if not found:
        raise OptionError("The name of a path is empty; the current folder is '.'.")
    return Path(value)


def existing(value: PathLike) -> Path:
    """Return a path at which something is.

    Raises
    ------
    OptionError
        There is nothing, or the value is no path.
    """
    found = place(value)
    if not found.exists():
        raise OptionError(f"Path {str(found)!r} does not exist.")
    return found


def whole(least: int, most: int | None = None) -> Callable[[Any], int]:
    """Return what takes a whole number that is not below a least one, nor above a most."""

    def taken(value: Any) -> int:
        number = _plain(value)
        if not isinstance(number, int) or isinstance(number, bool):
            raise OptionError(f"{shown(value)} is no whole number.")
        if number < least:
            raise OptionError(f"{number} is below {least}.")
        if most is not None and number > most:
            raise OptionError(f"{number} is above {most}.")
        return number

    return taken


seed = whole(0, LARGEST_SEED)
"""Takes a whole number from 0 on that a TOML file can hold."""


def number(*, low: float, is_open: bool = False) -> Callable[[Any], float]:
    """Return what takes a finite number from a low one on, or above it where that is open."""

    def taken(value: Any) -> float:
        plain = _plain(value)
        if not _is_number(plain) and not isinstance(plain, str):
            raise OptionError(f"{shown(value)} is no number.")
        try:
            found = _as_float(plain)
        except ValueError:
            raise OptionError(f"{shown(value)} is no number.") from None
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
        raise OptionError(f"{shown(value)} is not one of {', '.join(map(repr, words))}.")

    return taken


def shown(value: Any) -> str:
    """Return a value as a message names it: on one line, and not long."""
    words = " ".join(repr(value).split())
    return words if len(words) <= _MOST_SHOWN else f"{words[:_MOST_SHOWN]}..."


def taken(
    options: Mapping[str, Any],
    how: Mapping[str, Callable[[Any], Any]],
    *,
    needed: Mapping[str, Callable[[Any], Any]] | None = None,
) -> dict[str, Any]:
    """Return options with the values that are given in their right form.

    Parameters
    ----------
    options
        By the names that they have in Python.
    how
        For each name what takes its value; None stays. Options that are not there are left out.
    needed
        The same for those that are never None; ``dry_run`` and ``force`` always are.

    Raises
    ------
    OptionError
        A value has another form; it says of which option.
    """
    always = {**_ALWAYS, **(needed or {})}
    found = dict(options)
    for name, take in {**how, **always}.items():
        if name in found and (name in always or found[name] is not None):
            try:
                found[name] = take(found[name])
            except OptionError as error:
                raise OptionError(f"{long_option(name)}: {error}") from None
    return found


_ALWAYS: dict[str, Callable[[Any], Any]] = {"dry_run": flag, "force": flag}


def long_option(name: str) -> str:
    """Return the long option that an argument is: ``--held-out`` of ``held_out``."""
    return f"--{name.replace('_', '-')}"
