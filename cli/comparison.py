"""What `zfcal compare` does with its options, and how it tells what was found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .output import Output

if TYPE_CHECKING:
    from zfcal.errors import DamagedError
    from zfcal.report.comparison.compare import Kind, Sets
    from zfcal.stages.trial_context import Task

_HINT = "Make it again, or copy it again from where it was made."
_OF_FILES = {"kind": "--format", "dry_run": "--dry-run", "force": "--force"}


def check_options(options: Mapping[str, Any]) -> None:
    """Refuse options that are about files where none is written."""
    for name, word in _OF_FILES.items():
        if options[name] and options["folder"] is None:
            raise click.UsageError(f"{word} is about the files of --out: say where they go.")


def compare_sets(
    out: Output, roots: tuple[list[Path], list[Path]], options: Mapping[str, Any]
) -> None:
    """Compare two sets of trials: to standard output, or into a folder."""
    from zfcal.report.comparison.compare import Sets, compare
    from zfcal.stages.stage import settled
    from zfcal.stages.trial_context import Task, at_work

    sets = Sets(a=roots[0], b=roots[1])
    if options["folder"] is None:
        _tell(out, settled(lambda: compare(sets, _damage(out)), out.tell))
        return
    task = Task(dry_run=options["dry_run"], force=options["force"])
    with at_work(roots[0][0], "compare", task):
        settled(lambda: _into(out, sets, options, task), out.tell)


def _into(out: Output, sets: Sets, options: Mapping[str, Any], task: Task) -> None:
    from zfcal.report.comparison.compare import (
        DOCUMENT,
        comparison_files,
        comparison_reason,
        write_comparison,
    )
    from zfcal.stages.events import LeftOut, Made, Planned, UpToDate

    folder: Path = options["folder"]
    kind: Kind = options["kind"] or "png"
    reason = comparison_reason(sets, folder, kind=kind) or ("forced" if task.force else None)
    if reason is not None and task.dry_run:
        out.tell(Planned(path=folder / DOCUMENT, reason=reason))
        return
    if reason is None:
        document, paths = comparison_files(folder)
        for line in document["left_out"]:
            out.tell(LeftOut(path=Path(), problem=line, hint=_HINT))
    else:
        document, paths = write_comparison(sets, folder, _damage(out), kind=kind)
    for path in paths:
        out.tell(UpToDate(path=path) if reason is None else Made(path=path, reason=reason))
    _tell(out, document, to_stdout=False)


def _tell(out: Output, document: dict[str, Any], *, to_stdout: bool = True) -> None:
    """Tell what was found; the table is the result where no file is."""
    from zfcal.report.comparison.table import lines_of, missing_lines
    from zfcal.stages.events import Note

    text = "\n".join(lines_of(document))
    out.result(document, text=text if to_stdout else None)
    if not to_stdout:
        out.note(text)
    for line in missing_lines(document):
        out.note(line)
    for line in document["warnings"]:
        out.tell(Note(text=line, warning=True))


def _damage(out: Output) -> Callable[[DamagedError], None]:
    from zfcal.stages.events import LeftOut

    return lambda error: out.tell(LeftOut(path=Path(), problem=str(error), hint=error.hint))
