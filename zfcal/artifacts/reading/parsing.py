"""Text of JSON and TOML to values, of which none ends a run: every fault is a `ValueError`.

The parsers themselves give up in several ways on a document that nests too deep, and take
hours for one whose keys have thousands of parts. What a document means is checked elsewhere.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable
from typing import Any, NoReturn

_DEEPEST = 100
"""Tables in tables, lists in lists: what people and zfcal write has fewer than ten."""

_LONG_KEY = re.compile(r"(?:[\w\"'-]{1,64}[ \t]*\.[ \t]*){100}")
"""A dotted key of so many parts: the time that each takes grows with the square of them."""

_TOO_DEEP = f"it nests deeper than {_DEEPEST}"


def json_of(text: str | bytes, *, not_finite: bool = False) -> Any:
    """Return what a text of JSON holds; a key that stands twice is an error.

    Parameters
    ----------
    text
        The text.
    not_finite
        Whether NaN and Infinity may stand where numbers do, as many programs write them though
        JSON has no word for them; whoever reads checks each number. Otherwise they are errors.

    Raises
    ------
    ValueError
        It is no JSON, or nests too deep.
    """
    try:
        constant = float if not_finite else _refuse
        found = json.loads(text, parse_constant=constant, object_pairs_hook=_object)
    except (RecursionError, MemoryError) as error:
        raise ValueError(_TOO_DEEP) from error
    _check_values(found)
    return found


def toml_of(text: str) -> dict[str, Any]:
    """Return what a text of TOML holds.

    Raises
    ------
    ValueError
        It is no TOML, nests too deep, or has a key of a hundred parts.
    """
    if _LONG_KEY.search(text):
        raise ValueError(_TOO_DEEP)
    try:
        found = tomllib.loads(text)
    except (RecursionError, MemoryError) as error:
        raise ValueError(_TOO_DEEP) from error
    _check_values(found)
    return found


def _check_values(value: object) -> None:
    """Refuse what later steps could not go through: deep nests, and numbers beyond 64 bits."""
    layer = [value]
    for _ in range(_DEEPEST):
        for each in layer:
            if isinstance(each, int) and not -(2**63) <= each < 2**64:
                message = f"the whole number {str(each)[:20]}... has more than 64 bits"
                raise ValueError(message)
        layer = [item for each in layer if isinstance(each, dict | list) for item in _items(each)]
        if not layer:
            return
    raise ValueError(_TOO_DEEP)


def _items(value: dict[Any, Any] | list[Any]) -> Iterable[object]:
    return value.values() if isinstance(value, dict) else value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            message = f"the key {name[:60]!r} stands twice in one object"
            raise ValueError(message)
        found[name] = value
    return found


def _refuse(word: str) -> NoReturn:
    message = f"{word} is not a number in JSON"
    raise ValueError(message)
