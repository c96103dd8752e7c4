"""What the options of `zfcal diagnose` come to; its command is in ``diagnose``."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from .output import Output
from .streams import STDIN

if TYPE_CHECKING:
    from zfcal.stages.diagnose.diagnose import DiagnoseOptions
    from zfcal.stages.events import Event
    from zfcal.stages.trial_context import Task


def choose(options: Mapping[str, Any], trials: tuple[str, ...]) -> tuple[DiagnoseOptions, Task]:
    """Return how to diagnose, and how to go about it.

    Raises
    ------
    click.UsageError
        Two options contradict each other, or one could not take effect.
    """
    from zfcal.stages.diagnose.diagnose import DiagnoseOptions
    from zfcal.stages.trial_context import Task

    _check_together(options, trials)
    noise_mm = options["noise_mm"]
    chosen = DiagnoseOptions(
        model=options["model"],
        n_null=int(options["n_null"]),
        quick=options["quick"],
        noise_m=None if noise_mm is None else noise_mm / 1e3,
        window_s=options["window_s"],
        seed=options["seed"],
        n_workers=options["workers"],
        out_dir=options["out_dir"],
    )
    return chosen, Task(dry_run=options["dry_run"], force=options["force"])


def _check_together(options: Mapping[str, Any], trials: tuple[str, ...]) -> None:
    source = click.get_current_context().get_parameter_source("n_null")
    if options["quick"] and source is not ParameterSource.DEFAULT:
        raise click.UsageError(
            "--quick simulates no null: leave out --null-replicates, or --quick."
        )
    if options["out_dir"] is not None and (len(trials) != 1 or trials[0] == STDIN):
        raise click.UsageError("-o is for one trial: its findings would overwrite each other's.")


def diagnose_all(out: Output, roots: Iterable[Path], chosen: DiagnoseOptions, task: Task) -> None:
    """Diagnose trials, draw their pages, and say in words what each comes to."""
    from zfcal.report.diagnosis.render_pool import RenderPool
    from zfcal.stages.diagnose.diagnose import diagnose

    with RenderPool() as pool:
        for root in roots:
            tell = functools.partial(tell_and_warn, out, root, in_words=True)
            work = functools.partial(diagnose, root, chosen, tell, task=task, draw=pool)
            out.attempt(work)


def tell_and_warn(out: Output, root: Path, event: Event, *, in_words: bool = False) -> None:
    """Pass an event on; warn of findings that are not to be trusted, and say their verdict."""
    from zfcal.diagnose.document import read_document
    from zfcal.report.diagnosis.words import fired_control, verdict_sentence
    from zfcal.stages.events import Note, Result

    out.tell(event)
    if not isinstance(event, Result):
        return
    findings = read_document(event.value)
    if says := fired_control(findings):
        out.tell(Note(text=f"{root}: {says}", warning=True))
    # The document of several trials holds their verdicts, and all that is said.
    if in_words and (out.bare or not out.as_json):
        out.note(f"{root}: {verdict_sentence(findings)}.")
