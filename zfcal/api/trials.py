"""The trial that a function is given, how it goes about its work, and who hears of it."""

from __future__ import annotations

import inspect
import logging
import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from zfcal.api import tables
from zfcal.api.values import place, shown
from zfcal.errors import OptionError, ZfcalWarning
from zfcal.stages.events import Event, LeftOut, Made, Note, Planned, Tell
from zfcal.stages.streams import Work, work_at
from zfcal.stages.trial_context import Task


class HasRoot(Protocol):
    """The tables of a trial, and whatever else knows where it is."""

    @property
    def root(self) -> Path:
        """The trial's directory."""


TrialPath: TypeAlias = str | os.PathLike[str] | HasRoot
"""A trial's directory, a file in it, or its tables."""

_LOG = logging.getLogger("zfcal")


def work_of(trial: TrialPath) -> Work:
    """Return the trial that is meant, and the windows of it if a file of one is.

    Raises
    ------
    InputError
        It is not there, or lies in no trial.
    """
    return work_at(path_of(trial))


def roots_of(trials: TrialPath | Iterable[TrialPath]) -> list[Path]:
    """Return the directories of trials, each once.

    Raises
    ------
    InputError
        One is not there, or lies in no trial.
    """
    return list(dict.fromkeys(work_of(path).root for path in paths_of(trials)))


def paths_of(trials: TrialPath | Iterable[TrialPath]) -> list[Path]:
    """Return the paths of one trial or several, which need not be there."""
    # What has a root is one trial: tables are not loaded here to ask for their type.
    is_one = isinstance(trials, str | bytes | os.PathLike) or hasattr(trials, "root")
    each: Any = (trials,) if is_one or not isinstance(trials, Iterable) else trials
    return [path_of(trial) for trial in each]


def path_of(trial: TrialPath) -> Path:
    """Return the path of a trial, which need not be there.

    Raises
    ------
    OptionError
        It is neither a path nor the tables of a trial.
    """
    if isinstance(trial, str | os.PathLike):
        return place(trial)
    root = getattr(trial, "root", None)
    if not isinstance(root, Path):
        raise OptionError(
            f"{shown(trial)} is neither the path of a trial nor its tables.",
            hint="Of several trials, call it for each in a loop.",
        )
    return root


def task_of(options: Mapping[str, Any], ends_s: frozenset[int] | None = None) -> Task:
    """Return how to go about the work, from ``dry_run`` and ``force``."""
    return Task(dry_run=options["dry_run"], force=options["force"], ends_s=ends_s)


def tables_of(root: Path, findings: Path | None = None) -> tables.TrialTables:
    """Return the tables of a trial; what reads them is loaded now.

    Parameters
    ----------
    root
        The trial's directory.
    findings
        Where its findings are; None for the usual place.
    """
    return tables.TrialTables(root, findings=findings)


def heard_by(tell: Tell | None) -> Tell:
    """Return who hears what happens: whoever is given, or else warnings and the log ``zfcal``.

    Raises
    ------
    OptionError
        Who is given cannot be called.
    """
    if tell is None:
        return _Warns.of_caller()
    if not callable(tell):
        raise OptionError(f"tell: {shown(tell)} cannot be called with an event.")
    return tell


@dataclass(frozen=True, slots=True, kw_only=True)
class _Warns:
    """Warns of what is left out, and of what a stage warns of; the rest is logged.

    Parameters
    ----------
    file, line, module
        Where somebody has called zfcal: the warnings are shown there.
    said
        What Python remembers of them, of this call alone: the next one says them again.
    """

    file: str
    line: int
    module: str
    said: dict[Any, Any] = field(default_factory=dict)

    @classmethod
    def of_caller(cls) -> _Warns:
        """Return what warns where the call stands that is going on."""
        frame = inspect.currentframe()
        while frame is not None and frame.f_back is not None and _is_own(frame.f_globals):
            frame = frame.f_back
        if frame is None:
            return cls(file="zfcal", line=0, module="zfcal")
        module = str(frame.f_globals.get("__name__", ""))
        return cls(file=frame.f_code.co_filename, line=frame.f_lineno, module=module)

    def __call__(self, event: Event) -> None:
        """Hear an event."""
        match event:
            case LeftOut():
                self._warn(f"{event.problem} {event.hint}".strip())
            case Note(warning=True):
                self._warn(event.text)
            case Note():
                _LOG.info(event.text)
            case Made():
                _LOG.info("%s: made (%s)", event.path, event.reason)
            case Planned():
                _LOG.info("would make %s: %s", event.path, event.reason)

    def _warn(self, text: str) -> None:
        warnings.warn_explicit(
            text, ZfcalWarning, self.file, self.line, module=self.module, registry=self.said
        )


def _is_own(names: Mapping[str, Any]) -> bool:
    return str(names.get("__name__", "")).partition(".")[0] == "zfcal"
