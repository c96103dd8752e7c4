"""What the options of `zfcal diagnose` come to; its command is in ``diagnose``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from .output import Output
from .streams import STDIN

if TYPE_CHECKING:
    from zfcal.online.diagnose import DiagnoseOptions
    from zfcal.online.opening import Task


def choose(options: Mapping[str, Any], trials: tuple[str, ...]) -> tuple[DiagnoseOptions, Task]:
    """Return how to diagnose, and how to go about it.

    Raises
    ------
    click.UsageError
        Two options contradict each other, or one could not take effect.
    """
    from zfcal.online.diagnose import DiagnoseOptions
    from zfcal.online.opening import Task

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
        raise click.UsageError("--quick simulates no null: leave out --null, or --quick.")
    if options["out_dir"] is not None and (len(trials) != 1 or trials[0] == STDIN):
        raise click.UsageError("-o is for one trial: its findings would overwrite each other's.")


def diagnose_one(out: Output, root: Path, chosen: DiagnoseOptions, task: Task) -> None:
    """Diagnose one trial and draw its page."""
    from zfcal.online.diagnose import diagnose
    from zfcal.report import diagnosis_page

    diagnose(root, chosen, out.tell, task=task, draw=diagnosis_page)
