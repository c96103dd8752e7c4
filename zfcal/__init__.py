"""Track, analyse, calibrate and drive: a robot among zebrafish.

``zfcal.open(trial)`` reads a trial's artifacts as pandas tables.
"""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from zfcal.errors import ZfcalError
    from zfcal.frames import TrialTables
    from zfcal.frames import TrialTables as open  # noqa: A004, N813

__version__ = version("zfcal")

_LAZY = {
    "TrialTables": ("zfcal.frames", "TrialTables"),
    "ZfcalError": ("zfcal.errors", "ZfcalError"),
    "open": ("zfcal.frames", "TrialTables"),
}
"""What it exports, by the module that has it: pandas is loaded when it is asked for."""

__all__ = ["TrialTables", "ZfcalError", "open"]


def __getattr__(name: str) -> Any:
    """Return what is exported, and load it the first time."""
    if name not in _LAZY:
        raise AttributeError(f"module 'zfcal' has no attribute {name!r}")
    module, own = _LAZY[name]
    return getattr(import_module(module), own)


def __dir__() -> list[str]:
    """Return what is exported."""
    return sorted([*__all__, "__version__"])
