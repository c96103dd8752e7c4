"""`zfcal.diagnose`, and what its command does with its options."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, overload

from zfcal.api import tables
from zfcal.api.trials import TrialPath, heard_by, tables_of, task_of, work_of
from zfcal.api.values import (
    Names,
    PathLike,
    Stretch,
    existing,
    flag,
    formats,
    number,
    one_of,
    place,
    seed,
    span,
    taken,
    whole,
    width_mm,
)
from zfcal.diagnose.document import read_document
from zfcal.errors import OptionError
from zfcal.report.diagnosis.render_pool import RenderPool
from zfcal.report.diagnosis.words import fired_control, verdict_sentence
from zfcal.report.options import Printing
from zfcal.stages.diagnose.diagnose import DiagnoseOptions, open_case
from zfcal.stages.diagnose.diagnose import diagnose as diagnose_trial
from zfcal.stages.diagnose.findings import FILE
from zfcal.stages.events import Event, Note, Result, Tell

_FORMS = {
    "model": existing,
    "null_replicates": one_of(39, 199),
    "noise_mm": number(low=0),
    "window": span,
    "seed": seed,
    "workers": whole(1),
    "out": place,
    "format": formats,
    "width": width_mm,
}


def diagnosis_of(options: Mapping[str, Any]) -> DiagnoseOptions:
    """Return how to diagnose, as the options of the command say.

    Parameters
    ----------
    options
        By the names of the arguments of `diagnose`.

    Raises
    ------
    OptionError
        One has another form, or could not take effect.
    """
    asked = taken(options, _FORMS, needed={"quick": flag})
    n_null, noise_mm = asked["null_replicates"], asked["noise_mm"]
    if asked["quick"] and n_null is not None:
        raise OptionError("--quick simulates no null: leave out --null-replicates, or --quick.")
    usual = DiagnoseOptions()
    return DiagnoseOptions(
        model=asked["model"],
        n_null=usual.n_null if n_null is None else n_null,
        quick=asked["quick"],
        noise_m=None if noise_mm is None else noise_mm / 1e3,
        window_s=asked["window"],
        seed=asked["seed"],
        n_workers=asked["workers"],
        out_dir=asked["out"],
    )


def printing_of(options: Mapping[str, Any]) -> Printing:
    """Return the form of the pictures, as the options of the command say.

    Parameters
    ----------
    options
        By the names of the arguments of `diagnose`.

    Raises
    ------
    OptionError
        One has another form.
    """
    asked = taken(options, _FORMS, needed={"quick": flag})
    return Printing(formats=asked["format"] or ("png",), width_mm=asked["width"])


def tell_findings(tell: Tell, root: Path, event: Event, *, in_words: bool = True) -> None:
    """Pass an event on; warn of findings that are not to be trusted, and say their verdict.

    Parameters
    ----------
    tell
        Hears of it.
    root
        The trial.
    event
        What happened.
    in_words
        Whether to say the verdict.
    """
    tell(event)
    if not isinstance(event, Result):
        return
    findings = read_document(event.value)
    if says := fired_control(findings):
        tell(Note(text=f"{root}: {says}", warning=True))
    if in_words:
        tell(Note(text=f"{root}: {verdict_sentence(findings)}."))


@overload
def diagnose(
    trial: TrialPath,
    *,
    model: PathLike | None = None,
    null_replicates: Literal[39, 199] | None = None,
    quick: bool = False,
    noise_mm: float | None = None,
    window: Stretch | None = None,
    seed: int | None = None,
    workers: int | None = None,
    out: PathLike | None = None,
    format: Names | None = None,
    width: float | str | None = None,
    dry_run: Literal[False] = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables: ...
@overload
def diagnose(
    trial: TrialPath,
    *,
    model: PathLike | None = None,
    null_replicates: Literal[39, 199] | None = None,
    quick: bool = False,
    noise_mm: float | None = None,
    window: Stretch | None = None,
    seed: int | None = None,
    workers: int | None = None,
    out: PathLike | None = None,
    format: Names | None = None,
    width: float | str | None = None,
    dry_run: bool,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables | None: ...
def diagnose(
    trial: TrialPath,
    *,
    model: PathLike | None = None,
    null_replicates: Literal[39, 199] | None = None,
    quick: bool = False,
    noise_mm: float | None = None,
    window: Stretch | None = None,
    seed: int | None = None,
    workers: int | None = None,
    out: PathLike | None = None,
    format: Names | None = None,
    width: float | str | None = None,
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables | None:
    """Find the effect that a model misses: ``zfcal diagnose``.

    Writes ``diagnosis/findings.json`` with pictures and ``report.html``, unless they are up to
    date. Findings about a model that has effects already go to ``diagnosis/NAME/``, after the
    model's file.

    Parameters
    ----------
    trial
        Its directory, a file in it, or its tables.
    model
        Another model than that of the newest round.
    null_replicates
        Trials simulated without any effect, to measure what chance does: 39, unless ``quick``.
    quick
        Take that from theory instead: seconds, less sure.
    noise_mm
        Position noise, standard deviation per coordinate, in millimetres.
    window
        From and to in seconds: only this stretch.
    seed
        Of the random numbers; None for the trial's.
    workers
        Threads; None for one per core. The numbers do not depend on it.
    out
        Folder that the findings go into; None for the usual one.
    format
        Of the pictures: ``png``, ``svg`` and ``pdf``, one or several; by default ``png``.
    width
        Of the pictures on paper: ``single`` (85 mm), ``double`` (174 mm) or millimetres. None for
        the screen.
    dry_run
        Write nothing; `tell` gets what would be made, and why.
    force
        Make what is up to date again.
    tell
        Function that gets an event for every file, for what is left out, and for progress
        (`zfcal.stages.events`). By default what is left out, and a control that fired, are
        warnings. The rest, such as the verdict, is logged as ``zfcal``.

    Returns
    -------
    TrialTables
        Of the trial. ``findings()`` are those of this call: a row per effect and parameter,
        none where no effect is missing; ``attrs["verdict"]`` is the verdict. None in a dry run that
        would make them: those that are there have other inputs or options.

    Raises
    ------
    OptionError
        An option has a wrong type or value, or would have no effect.
    InputError
        There is no trial or no model, or they do not fit each other.
    StorageError
        The disk is full, or a place cannot be written.
    LockedError
        The same command is running on the trial.

    Notes
    -----
    Pictures are drawn in this process: no other is started.

    Examples
    --------
    >>> import zfcal
    >>> found = zfcal.diagnose("trial", quick=True, seed=1).findings()
    >>> found.attrs["verdict"]  # 200 s are too little to name an effect
    'untestable'
    """
    given = locals()
    chosen, task, root = diagnosis_of(given), task_of(given), work_of(trial).root
    hears = functools.partial(tell_findings, heard_by(tell), root)
    # Processes of its own would import the script that calls this once more.
    with RenderPool(ahead=False, printing=printing_of(given)) as pool:
        made = diagnose_trial(root, chosen, hears, task=task, draw=pool)
    if made is None and task.dry_run:
        return None
    return tables_of(root, made or open_case(root, chosen).folder / FILE)
