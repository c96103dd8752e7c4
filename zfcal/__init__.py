"""Track, analyse, calibrate and drive: a robot among zebrafish.

``zfcal.open(trial)`` reads a trial's artifacts as pandas tables. The functions are the commands of
the same names: the same options, the same files.
"""

import sys
from importlib import import_module
from importlib.metadata import version
from inspect import Parameter, Signature, signature
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from zfcal.api.analysing import analyse
    from zfcal.api.calibrating import calibrate
    from zfcal.api.comparing import compare
    from zfcal.api.diagnosing import diagnose
    from zfcal.api.extending import extend
    from zfcal.api.reporting import report
    from zfcal.api.simulating import simulate
    from zfcal.errors import ZfcalError, ZfcalWarning
    from zfcal.frames import TrialTables
    from zfcal.frames import TrialTables as open  # noqa: A004, N813

__version__ = version("zfcal")

_LAZY = {
    "TrialTables": ("zfcal.frames", "TrialTables"),
    "ZfcalError": ("zfcal.errors", "ZfcalError"),
    "ZfcalWarning": ("zfcal.errors", "ZfcalWarning"),
    "analyse": ("zfcal.api.analysing", "analyse"),
    "calibrate": ("zfcal.api.calibrating", "calibrate"),
    "compare": ("zfcal.api.comparing", "compare"),
    "diagnose": ("zfcal.api.diagnosing", "diagnose"),
    "extend": ("zfcal.api.extending", "extend"),
    "open": ("zfcal.frames", "TrialTables"),
    "report": ("zfcal.api.reporting", "report"),
    "simulate": ("zfcal.api.simulating", "simulate"),
}
"""What it exports, by the module that has it: it is loaded when it is asked for."""

_BY_NAME = Parameter.KEYWORD_ONLY

_PACKAGES = ("calibrate", "diagnose", "report")
"""Of these the ones that are packages as well; each is both, whatever was imported before."""

__all__ = [
    "TrialTables",
    "ZfcalError",
    "ZfcalWarning",
    "analyse",
    "calibrate",
    "compare",
    "diagnose",
    "extend",
    "open",
    "report",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Return what is exported, and load it the first time."""
    if name not in _LAZY:
        raise AttributeError(f"module 'zfcal' has no attribute {name!r}")
    return import_module(f"zfcal.{name}") if name in _PACKAGES else _exported(name)


def __dir__() -> list[str]:
    """Return what is exported."""
    return sorted([*__all__, "__version__"])


def _exported(name: str) -> Any:
    module, own = _LAZY[name]
    return getattr(import_module(module), own)


def _call(function: Any) -> str:
    """Return how a function is called, an argument on a line, indented as in its docstring."""
    found = signature(function)
    lines = [f"        {each}," for each in map(str, found.parameters.values())]
    first = next(i for i, each in enumerate(found.parameters.values()) if each.kind is _BY_NAME)
    lines.insert(first, "        *,")
    return "\n".join([f"    {function.__name__}(", *lines, f"    ) -> {found.return_annotation}"])


class _CallablePackage(ModuleType):
    """A package that can be called, as the function of `zfcal` that has its name."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return self._function(*args, **options)

    def __reduce__(self) -> tuple[Any, ...]:
        return import_module, (self.__name__,)

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        # What `help` shows of a package has no other place for how it is called.
        first, _, rest = (self._function.__doc__ or "").partition("\n\n")
        return f"{first}\n\n{_call(self._function)}\n\n{rest}"

    @property
    def _function(self) -> Any:
        return _exported(self.__name__.rpartition(".")[2])

    @property
    def __signature__(self) -> Signature:
        return signature(self._function)


class _Root(ModuleType):
    """The package `zfcal`: Python hands it each package in it, once it is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _PACKAGES and type(value) is ModuleType:
            value.__class__ = _CallablePackage
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Root
