"""`zfcal.report`, and what its command does with its options."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from zfcal.api.trials import TrialPath, heard_by, roots_of, task_of
from zfcal.api.values import Names, PathLike, flag, formats, one_of, place, taken, width_mm
from zfcal.errors import DamagedError, InputError, ZfcalError
from zfcal.report.options import AS_USUAL, FILMS, Printing, ReportOptions
from zfcal.report.page import (
    PAGE,
    report_files,
    report_left_out,
    report_options,
    report_plan,
    report_reason,
    write_report,
)
from zfcal.stages.events import LeftOut, Made, Planned, Tell, UpToDate
from zfcal.stages.making import settled
from zfcal.stages.trial_context import Task, at_work

_TOGETHER = Path("report")
_HINT = "Make it again, or copy it again from where it was made."


def how_of(options: Mapping[str, Any]) -> ReportOptions:
    """Return how a report is made, from options with the names of `report`'s arguments."""
    printing = Printing(formats=options["format"] or ("png",), width_mm=options["width"])
    return ReportOptions(published=options["published"], printing=printing, film=options["film"])


def write_page(
    roots: Sequence[Path],
    out: Path | None,
    tell: Tell,
    *,
    task: Task,
    how: ReportOptions = AS_USUAL,
) -> Path:
    """Write the report of trials, unless it is up to date; of several, then that of each.

    The page of each of several trials keeps the options that it was made with.

    Parameters
    ----------
    roots
        The trials' directories.
    out
        Where it goes; None for ``report`` in the trial, or here if there are several.
    tell
        Hears of every file, and of what is left out.
    task
        How to go about it.
    how
        What the report shows, and in which form.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        There are no trials, or one of them is none.
    """
    if not roots:
        raise InputError("A report needs at least one trial.")
    roots = each_once(roots)
    if len(roots) == 1:
        return _write_one(roots, out, tell, task=task, how=how)
    # First that of the set: where its trials or options do not go together, nothing is written.
    page = _write_one(roots, out or _TOGETHER, tell, task=task, how=how)
    failed = None
    for root in roots:
        if out is not None and out.resolve() == (root / "report").resolve():
            continue  # The page of the set is there.
        try:
            # Each page keeps its own options: it may have a film, or figures for a journal.
            _write_one([root], None, tell, task=task, how=report_options(root) or how)
        except ZfcalError as error:
            failed = failed or error
    if failed is not None:
        raise failed
    return page


def _write_one(
    roots: Sequence[Path], folder: Path | None, tell: Tell, *, task: Task, how: ReportOptions
) -> Path:
    def work() -> None:
        reason = report_reason(roots, folder, how) or ("forced" if task.force else None)
        if reason is None:
            for path in report_files(roots, folder):
                tell(UpToDate(path=path))
            for line in report_left_out(roots, folder):
                tell(LeftOut(path=Path(), problem=line, hint=_HINT))
        elif task.dry_run:
            for path in report_plan(roots, folder, how=how, on_damage=tell_damage(tell)):
                tell(Planned(path=path, reason=reason))
        else:
            for path in write_report(roots, folder, how=how, on_damage=tell_damage(tell)):
                tell(Made(path=path, reason=reason))

    with at_work(roots[0], "report", task):
        settled(work, tell)
    return (folder or roots[0] / "report") / PAGE


def each_once(roots: Sequence[Path]) -> list[Path]:
    """Return the directories of trials, each once, however it is spelt."""
    return list({root.resolve(): root for root in reversed(roots)}.values())[::-1]


def tell_damage(tell: Tell) -> Callable[[DamagedError], None]:
    """Return what tells of a damaged file that it is left out."""
    return lambda error: tell(LeftOut(path=Path(), problem=str(error), hint=error.hint))


def report(
    trials: TrialPath | Iterable[TrialPath],
    *,
    out: PathLike | None = None,
    format: Names | None = None,
    width: float | str | None = None,
    film: Literal["mp4", "gif"] | None = None,
    published: bool = False,
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> Path:
    """Write a page with figures, of one trial or of several in one report: ``zfcal report``.

    The page holds its figures; they lie beside it as files too. Over several trials it shows mean
    and standard deviation per window, and a table whose rows lead to the page of each trial, which
    is written where it is missing or its inputs have changed. What is up to date stays.

    Parameters
    ----------
    trials
        One trial or several: directories, or their tables. One that is named twice counts once.
    out
        Folder that it goes into; None for ``TRIAL/report``, or of several trials ``report``. The
        page of each of several trials is in ``TRIAL/report`` all the same. It keeps the format,
        width, film and published scores that it was made with; a new one has those given here.
    format
        Of the figures: ``png``, ``svg`` and ``pdf``, one or several; by default ``png``.
    width
        Of the figures on paper: ``single`` (85 mm), ``double`` (174 mm) or millimetres. None for
        the screen.
    film
        ``mp4`` or ``gif``: a film of the last window beside the model that was calibrated last,
        ``film.mp4`` or ``film.gif`` in the report; of one trial.
    published
        Draw the published scores, which are of other fish, beside these.
    dry_run
        Write nothing; `tell` gets whether it would be made, and why.
    force
        Make it again, even if it is up to date.
    tell
        Function that gets an event for every file, and for what is left out
        (`zfcal.stages.events`). By default what is left out is a warning, and the rest is logged
        as ``zfcal``.

    Returns
    -------
    Path
        The page, also where a dry run has not made it.

    Raises
    ------
    OptionError
        An option has a wrong type or value.
    InputError
        There is none, one is no trial, or their arenas have other zones.
    StorageError
        The disk is full, or the place cannot be written.
    LockedError
        The same command is running on the first trial.

    Examples
    --------
    >>> import zfcal
    >>> print(zfcal.report("trial"))
    trial/report/index.html
    """
    how = {"out": place, "format": formats, "width": width_mm, "film": one_of(*FILMS)}
    asked, hears = taken(locals(), how, needed={"published": flag}), heard_by(tell)
    return write_page(roots_of(trials), asked["out"], hears, task=task_of(asked), how=how_of(asked))
