"""`zfcal extend`: add the missing effect, calibrate anew, and show the gap shrink."""

from __future__ import annotations

import functools
from typing import Any

import click

from .durations import seconds
from .options import (
    EXISTING,
    PLACE,
    makes_artifacts,
    population_option,
    seed_option,
    speaks,
    takes_trials,
    workers_option,
)
from .output import Output
from .streams import STDIN, roots_of


@click.command("extend")
@takes_trials
@click.option(
    "--effect",
    multiple=True,
    metavar="NAME",
    help="Add this one; repeat it for several.  [default: those in the findings]",
)
@click.option("--findings", type=EXISTING, help="Take these.  [default: diagnosis/findings.json]")
@click.option("--generations", type=click.IntRange(min=0), help="Per model.  [default: 15]")
@click.option("--budget", type=seconds, metavar="TIME", help="Per model, such as 50s.")
@population_option
@seed_option("Seed of the random numbers.  [default: the trial's]")
@workers_option
@click.option("-o", "--out", type=PLACE, help="Model.  [default: models/extended.toml]")
@makes_artifacts
@speaks
def command(out: Output, /, trials: tuple[str, ...], **options: Any) -> None:
    r"""Add the missing effect to the model and show on held-out minutes that the gap shrinks.

    Learns from every other minute: fits the effect, then calibrates the model with it,
    without it, and with a wrong effect instead. Judges the three on the other minutes.
    Writes models/extended.toml, and before and after into the findings and their page.

    \b
    Example:
        zfcal extend trial
        zfcal extend trial --effect alignment --generations 30 --seed 1
        zfcal diagnose trial --model trial/models/extended.toml
    """
    from zfcal.api.extending import extend_one, extension_of
    from zfcal.api.trials import task_of

    from .heaps import share_one_heap

    share_one_heap()
    chosen, task = extension_of(options), task_of(options)
    _check_one(trials, options)
    out.bare = len(trials) == 1
    for root in roots_of(out, trials):
        out.attempt(functools.partial(extend_one, root, chosen, out.tell, task=task))


def _check_one(trials: tuple[str, ...], options: dict[str, Any]) -> None:
    """Refuse options that name one file where there are several trials."""
    if len(trials) == 1 and trials[0] != STDIN:
        return
    for name, option in (("findings", "--findings"), ("out", "-o")):
        if options[name] is not None:
            raise click.UsageError(f"{option} is for one trial, got several or a pipe.")
