"""`zfcal.extend`, and what its command does with its options."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from zfcal.api.diagnosing import tell_findings
from zfcal.api.trials import TrialPath, heard_by, task_of, work_of
from zfcal.api.values import (
    Names,
    PathLike,
    Time,
    existing,
    place,
    seconds,
    seed,
    several,
    taken,
    whole,
)
from zfcal.calibrate.task import Settings
from zfcal.errors import OptionError
from zfcal.report.diagnosis.render_pool import RenderPool
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import Tell
from zfcal.stages.extend.extend import ExtendOptions
from zfcal.stages.extend.extend import extend as extend_trial
from zfcal.stages.trial_context import Task

_FORMS = {
    "findings": existing,
    "generations": whole(0),
    "budget": seconds,
    "seed": seed,
    "workers": whole(1),
    "out": place,
}
_NEEDED = {"effect": several, "population": whole(4)}


def extension_of(options: Mapping[str, Any]) -> ExtendOptions:
    """Return what to add and how, as the options of the command say.

    Parameters
    ----------
    options
        By the names of the arguments of `extend`.

    Raises
    ------
    OptionError
        One has another form, or two contradict each other.
    """
    asked = taken(options, _FORMS, needed=_NEEDED)
    if asked["generations"] is not None and asked["budget"] is not None:
        raise OptionError("A calibration ends after --generations or with its --budget: give one.")
    calibration = CalibrateOptions(
        settings=Settings(population=asked["population"], generations=asked["generations"]),
        budget_s=asked["budget"],
        seed=asked["seed"],
        n_workers=asked["workers"],
    )
    return ExtendOptions(
        names=asked["effect"],
        findings=asked["findings"],
        calibration=calibration,
        output=asked["out"],
    )


def extend_one(root: Path, chosen: ExtendOptions, tell: Tell, *, task: Task) -> Path | None:
    """Extend the model of one trial and draw the findings' page anew; return the model."""
    hears = functools.partial(tell_findings, tell, root, in_words=False)
    with RenderPool(ahead=False) as pool:
        return extend_trial(root, chosen, hears, task=task, draw=pool)


def extend(
    trial: TrialPath,
    *,
    effect: Names = (),
    findings: PathLike | None = None,
    generations: int | None = None,
    budget: Time | None = None,
    population: int = 60,
    seed: int | None = None,
    workers: int | None = None,
    out: PathLike | None = None,
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> Path | None:
    """Add the missing effect to the model, and show how the gap shrinks: ``zfcal extend``.

    Fits on every other minute and judges on the others. Writes ``models/extended.toml``,
    and before and after into the findings and their page. Findings that are missing or stale
    are made first.

    Parameters
    ----------
    trial
        Its directory, a file in it, or its tables.
    effect
        Add this one, or these; none for those that the findings name.
    findings
        Take these; None for ``diagnosis/findings.json``.
    generations
        Of each of the three calibrations; 15 unless there is a budget.
    budget
        Wall-clock time of each, in seconds, or such as ``"50s"``.
    population
        Genomes, a multiple of four.
    seed
        Of the random numbers; None for the trial's.
    workers
        Threads; None for one per core. The numbers do not depend on it.
    out
        Where the model goes; None for ``models/extended.toml``, or the next number after it.
    dry_run
        Write nothing; `tell` gets what would be made, and why.
    force
        Make what is up to date again.
    tell
        Function that gets an event for every file, for what is left out, and for progress
        (`zfcal.stages.events`). By default what is left out, and a control that fired, are
        warnings. The rest is logged as ``zfcal``.

    Returns
    -------
    Path or None
        The extended model, for `zfcal.diagnose` or `zfcal.simulate`; None where there is nothing
        to add, or in a dry run.

    Raises
    ------
    OptionError
        An option has a wrong type or value, or two contradict each other.
    InputError
        There is no trial, its tracks are too few, or an effect is unknown or there already.
    StorageError
        The disk is full, or a place cannot be written.
    LockedError
        The same command is running on the trial.

    Examples
    --------
    >>> import zfcal
    >>> print(zfcal.extend("trial", effect="turning-bias", generations=0, population=4))
    trial/models/extended.toml
    """
    chosen, task = extension_of(locals()), task_of(locals())
    return extend_one(work_of(trial).root, chosen, heard_by(tell), task=task)
