"""The trial that a function is given, how it goes about its work, and who hears of it."""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from zfcal.stages.events import Event, LeftOut, Made, Note, Planned, Tell
from zfcal.stages.streams import Work, work_at
from zfcal.stages.trial_context import Task

if TYPE_CHECKING:
    from zfcal.frames import TrialTables

TrialPath: TypeAlias = Union[str, os.PathLike[str], "TrialTables"]
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
    is_one = isinstance(trials, str | os.PathLike) or hasattr(trials, "root")
    each: Iterable[Any] = (trials,) if is_one else trials  # type: ignore[assignment]
    return [path_of(trial) for trial in each]


def path_of(trial: TrialPath) -> Path:
    """Return the path of a trial, which need not be there."""
    return Path(trial) if isinstance(trial, str | os.PathLike) else trial.root


def task_of(options: Mapping[str, Any], ends_s: frozenset[int] | None = None) -> Task:
    """Return how to go about the work, from ``dry_run`` and ``force``."""
    return Task(dry_run=options["dry_run"], force=options["force"], ends_s=ends_s)


def tables_of(root: Path, findings: Path | None = None) -> TrialTables:
    """Return the tables of a trial; what reads them is loaded now.

    Parameters
    ----------
    root
        The trial's directory.
    findings
        Where its findings are; None for the usual place.
    """
    from zfcal.frames import TrialTables

    return TrialTables(root, findings=findings)


def heard_by(tell: Tell | None) -> Tell:
    """Return who hears what happens: whoever is given, or else warnings and the log ``zfcal``."""
    return _warn if tell is None else tell


def _warn(event: Event) -> None:
    """Warn of what is left out, and of what a stage warns of; the rest is logged."""
    match event:
        case LeftOut():
            warnings.warn(f"{event.problem} {event.hint}".strip(), stacklevel=2)
        case Note(warning=True):
            warnings.warn(event.text, stacklevel=2)
        case Note():
            _LOG.info(event.text)
        case Made():
            _LOG.info("%s: made (%s)", event.path, event.reason)
        case Planned():
            _LOG.info("would make %s: %s", event.path, event.reason)
