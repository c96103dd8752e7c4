"""What functions return, loaded when it is asked for.

A type checker, `typing.get_type_hints` and the functions find it under the same names; a command,
which needs no tables, does not load them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pandas import DataFrame

    from zfcal.frames import TrialTables

__all__ = ["DataFrame", "TrialTables"]

_LAZY = {"DataFrame": "pandas", "TrialTables": "zfcal.frames"}


def __getattr__(name: str) -> Any:
    """Return what a function returns."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name]), name)
