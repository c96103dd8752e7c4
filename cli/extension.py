"""What the options of `zfcal extend` come to; its command is in ``extend``."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .diagnosis import tell_and_warn
from .output import Output
from .streams import STDIN

if TYPE_CHECKING:
    from zfcal.stages.extend.extend import ExtendOptions
    from zfcal.stages.trial_context import Task


def choose(options: Mapping[str, Any], trials: tuple[str, ...]) -> tuple[ExtendOptions, Task]:
    """Return what to add and how, and how to go about it.

    Raises
    ------
    click.UsageError
        Two options contradict each other, or one could not take effect.
    """
    from zfcal.calibrate.task import Settings
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.extend.extend import ExtendOptions
    from zfcal.stages.trial_context import Task

    _check_together(options, trials)
    calibration = CalibrateOptions(
        settings=Settings(population=options["population"], generations=options["generations"]),
        budget_s=options["budget_s"],
        seed=options["seed"],
        n_workers=options["workers"],
    )
    chosen = ExtendOptions(
        names=tuple(dict.fromkeys(options["names"])),
        findings=options["findings"],
        calibration=calibration,
        output=options["output"],
    )
    return chosen, Task(dry_run=options["dry_run"], force=options["force"])


def _check_together(options: Mapping[str, Any], trials: tuple[str, ...]) -> None:
    if options["generations"] is not None and options["budget_s"] is not None:
        raise click.UsageError(
            "A calibration ends after --generations or with its --budget: give one."
        )
    if len(trials) == 1 and trials[0] != STDIN:
        return
    for name, option in (("findings", "--findings"), ("output", "-o")):
        if options[name] is not None:
            raise click.UsageError(f"{option} is for one trial, got several or a pipe.")


def extend_one(out: Output, root: Path, chosen: ExtendOptions, task: Task) -> None:
    """Extend the model of one trial and draw the findings' page anew."""
    from zfcal.report.diagnosis.render_pool import RenderPool
    from zfcal.stages.extend.extend import extend

    tell = functools.partial(tell_and_warn, out, root)
    with RenderPool(ahead=False) as pool:
        extend(root, chosen, tell, task=task, draw=pool)
