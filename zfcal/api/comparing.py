"""`zfcal.compare`, and what its command does with its options."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias, overload

from zfcal.api import tables
from zfcal.api.reporting import each_once, tell_damage
from zfcal.api.trials import TrialPath, heard_by, roots_of, task_of
from zfcal.api.values import PathLike, one_of, place, taken
from zfcal.errors import OptionError
from zfcal.report.comparison.compare import (
    DOCUMENT,
    Kind,
    Sets,
    comparison_files,
    comparison_reason,
    write_comparison,
)
from zfcal.report.comparison.compare import compare as compare_trials
from zfcal.report.comparison.table import missing_lines, statements
from zfcal.stages.events import LeftOut, Made, Note, Planned, Tell, UpToDate
from zfcal.stages.making import settled
from zfcal.stages.trial_context import at_work

Trials: TypeAlias = TrialPath | Iterable[TrialPath]

_HINT = "Make it again, or copy it again from where it was made."
_OF_FILES = ("format", "dry_run", "force")


def comparison_of(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of the command in their right form.

    Parameters
    ----------
    options
        By the names of the arguments of `compare`.

    Raises
    ------
    OptionError
        One has another form, or is about files where none is written.
    """
    asked = taken(options, {"out": place, "format": one_of("png", "svg")})
    for name in _OF_FILES:
        if asked[name] and asked["out"] is None:
            word = name.replace("_", "-")
            raise OptionError(f"--{word} is about the files of --out: say where they go.")
    return asked


def compare_sets(
    roots: tuple[Sequence[Path], Sequence[Path]], asked: Mapping[str, Any], tell: Tell
) -> dict[str, Any] | None:
    """Compare two sets of trials; into a folder where one is asked for.

    Parameters
    ----------
    roots
        Directories of the trials of each set.
    asked
        From `comparison_of`.
    tell
        Hears of every file, and of what is left out.

    Returns
    -------
    dict or None
        Fits ``schemas/compare.schema.json``; None in a dry run that would make it.
    """
    sets = Sets(a=each_once(roots[0]), b=each_once(roots[1]))
    if asked["out"] is None:
        return settled(lambda: compare_trials(sets, tell_damage(tell)), tell)
    with at_work(roots[0][0], "compare", task_of(asked)):
        return settled(lambda: _into(sets, asked, tell), tell)


def _into(sets: Sets, asked: Mapping[str, Any], tell: Tell) -> dict[str, Any] | None:
    folder: Path = asked["out"]
    kind: Kind = asked["format"] or "png"
    reason = comparison_reason(sets, folder, kind=kind) or ("forced" if asked["force"] else None)
    if reason is not None and asked["dry_run"]:
        tell(Planned(path=folder / DOCUMENT, reason=reason))
        return None
    if reason is None:
        document, paths = comparison_files(folder)
        for line in document["left_out"]:
            tell(LeftOut(path=Path(), problem=line, hint=_HINT))
    else:
        document, paths = write_comparison(sets, folder, tell_damage(tell), kind=kind)
    for path in paths:
        tell(UpToDate(path=path) if reason is None else Made(path=path, reason=reason))
    return document


def tell_comparison(document: Mapping[str, Any], tell: Tell) -> None:
    """Tell which trials are missing where, and what to beware of."""
    for line in missing_lines(document):
        tell(Note(text=line))
    for line in document["warnings"]:
        tell(Note(text=line, warning=True))


@overload
def compare(
    trials: Trials,
    *,
    against: Trials,
    out: PathLike | None = None,
    format: Literal["png", "svg"] | None = None,
    dry_run: Literal[False] = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.DataFrame: ...
@overload
def compare(
    trials: Trials,
    *,
    against: Trials,
    out: PathLike | None = None,
    format: Literal["png", "svg"] | None = None,
    dry_run: bool,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.DataFrame | None: ...
def compare(
    trials: Trials,
    *,
    against: Trials,
    out: PathLike | None = None,
    format: Literal["png", "svg"] | None = None,
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.DataFrame | None:
    """Compare two sets of trials: differences with intervals, and tests: ``zfcal compare``.

    A trial counts once, however long it is. With fewer than four trials on a side nothing is
    tested, and p is missing.

    Parameters
    ----------
    trials
        Set A: one trial or several, directories or their tables. One that is named twice counts
        once.
    against
        Set B.
    out
        Folder for ``compare.json`` and a picture; None to write nothing.
    format
        Of the picture; PNG by default.
    dry_run
        Write nothing; `tell` gets whether the files would be made, and why.
    force
        Make the files again, even if they are up to date.
    tell
        Function that gets an event for every file, and for what is left out
        (`zfcal.stages.events`). By default what is left out, and what needs care, are warnings,
        and the rest is logged as ``zfcal``.

    Returns
    -------
    DataFrame
        One row per quantity: ``name``, ``label``, ``unit``, ``of`` (its group), of each set ``n``
        (trials), ``mean`` and ``sd`` (``n_a`` to ``sd_b``), ``difference`` (A less B) with its
        95 % interval ``low`` to ``high``, all of these in ``unit``; the effect size ``g``,
        ``g_low`` to ``g_high``; ``p``, ``p_family`` (among all quantities), and why it is
        ``untested``. What is not known is NaN. ``attrs["says"]`` has what was tested and what
        came of it, in sentences; ``attrs["document"]`` all of it, as in ``compare.json``. None in
        a dry run that would make the files.

    Raises
    ------
    OptionError
        An option has a wrong type or value, or is about files where none is written.
    InputError
        A set is empty, one is no trial, or one is in both sets.
    StorageError
        The disk is full, or the place cannot be written.
    LockedError
        The same command is running on the first trial.

    Examples
    --------
    >>> import zfcal
    >>> found = zfcal.compare("trial", against="alone")
    >>> found[["n_a", "n_b"]].max().tolist()
    [1, 1]
    >>> print(found.attrs["says"][0])  # doctest: +ELLIPSIS
    Nothing is tested: there are 1 and 1 trial, and a test needs 4 on each side...
    """
    asked, hears = comparison_of(locals()), heard_by(tell)
    document = compare_sets((roots_of(trials), roots_of(against)), asked, hears)
    if document is None:
        return None
    tell_comparison(document, hears)
    return _table(document)


def _table(document: dict[str, Any]) -> tables.DataFrame:
    import pandas as pd

    rows = [_columns(row) for row in document["statistics"]]
    table = pd.DataFrame(rows, columns=list(_COLUMNS))
    known = [name for name in _COLUMNS if name not in _WORDS]
    table = table.astype({name: "int64" if name in _COUNTS else "float64" for name in known})
    table.attrs = {"says": statements(document), "document": document}
    return table


_WORDS = ("name", "label", "unit", "of", "untested")
_COUNTS = ("n_a", "n_b")
_COLUMNS = (
    *("name", "label", "unit", "of", "n_a", "mean_a", "sd_a", "n_b", "mean_b", "sd_b"),
    *("difference", "low", "high", "g", "g_low", "g_high", "p", "p_family", "untested"),
)
"""Of the table of a comparison."""


def _columns(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row of the document flat, by the names of the table's columns."""
    sides = {
        f"{key}_{name.lower()}": row[name][key] for name in "AB" for key in ("n", "mean", "sd")
    }
    low, high = row["interval"] or (None, None)
    g_low, g_high = row["g_interval"] or (None, None)
    said = {name: row[name] for name in _COLUMNS if name in row}
    return {**said, **sides, "low": low, "high": high, "g_low": g_low, "g_high": g_high}
