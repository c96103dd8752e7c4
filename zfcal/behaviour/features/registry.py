"""Which statistics there are: the files beside this one, and those of other packages.

A package adds its own with an entry point in the group ``zfcal.statistics``, which names a
module with ``STATISTICS``, or a package of such modules. Ours is one of these.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.metadata import entry_points
from types import MappingProxyType, ModuleType

from zfcal.behaviour import features
from zfcal.behaviour.features.statistic import Statistic
from zfcal.errors import InputError

_GROUP = "zfcal.statistics"
"""Name of the entry points."""

SCORED = ("D", "W", "O", "T")
"""What S is the mean of, in the paper's order."""

COUNTED = ("D", "W", "O", "T", "V")
"""What every file of statistics holds, and what the compiled simulation counts itself."""


@cache
def statistics() -> MappingProxyType[str, Statistic]:
    """Return all statistics by name: D, W, O, T and V first, the others by name.

    Raises
    ------
    InputError
        A package that names statistics cannot be imported or has none, or two statistics
        have one name.
    """
    found: dict[str, Statistic] = {}
    for statistic in _all():
        known = found.setdefault(statistic.name, statistic)
        if known is not statistic:
            raise InputError(
                f"Two statistics are called {statistic.name!r}: {known.label!r} and "
                f"{statistic.label!r}.",
                hint="Rename the one of your own package.",
            )
    names = (*COUNTED, *sorted(found.keys() - set(COUNTED)))
    return MappingProxyType({name: found[name] for name in names})


def named(name: str) -> Statistic:
    """Return the statistic with a name.

    Raises
    ------
    InputError
        There is none.
    """
    known = statistics()
    if name not in known:
        raise InputError(f"No statistic is called {name!r}.", hint=f"There are {', '.join(known)}.")
    return known[name]


def ordered(names: Sequence[str]) -> tuple[str, ...]:
    """Return names once each, in the order of `statistics`; an `InputError` if one is unknown."""
    wanted = {named(name).name for name in names}
    return tuple(name for name in statistics() if name in wanted)


def further(names: Sequence[str]) -> tuple[str, ...]:
    """Return those names that are not of D, W, O, T and V, in order."""
    return tuple(name for name in ordered(names) if name not in COUNTED)


def _all() -> Iterator[Statistic]:
    # Ours is listed as an entry point too; this finds it where zfcal is not installed.
    yield from _statistics_of(features)
    for point in sorted(entry_points(group=_GROUP), key=lambda point: (point.name, point.value)):
        try:
            module = point.load()
        except Exception as error:
            raise InputError(
                f"The statistics {point.value!r} of the entry point {point.name!r} cannot be "
                f"imported: {type(error).__name__}: {error}.",
                hint="Mend or uninstall the package that names them.",
            ) from error
        yield from _statistics_of(module)


def _statistics_of(module: ModuleType) -> Iterator[Statistic]:
    """Yield the statistics of a module, or of all modules of a package."""
    parts = [module]
    if hasattr(module, "__path__"):
        names = sorted(part.name for part in pkgutil.iter_modules(module.__path__))
        parts += [importlib.import_module(f"{module.__name__}.{name}") for name in names]
    found = [one for part in parts for one in getattr(part, "STATISTICS", ())]
    if not found or not all(isinstance(one, Statistic) for one in found):
        raise InputError(
            f"{getattr(module, '__name__', module)!r} names no statistics.",
            hint="Each of its modules lists its own in STATISTICS = (Statistic(...),).",
        )
    yield from found
