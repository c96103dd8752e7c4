"""`zfcal extend`: add the missing effect, calibrate anew, and show the gap shrink."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .durations import seconds
from .options import (
    EXISTING,
    PLACE,
    Fours,
    makes_artifacts,
    seed_option,
    speaks,
    takes_trials,
)
from .output import Output
from .streams import each_trial

if TYPE_CHECKING:
    from zfcal.stages.streams import Work


@click.command("extend")
@takes_trials
@click.option(
    "--effect",
    "names",
    multiple=True,
    metavar="NAME",
    help="Add this one; repeat it for several.  [default: those in the findings]",
)
@click.option("--findings", type=EXISTING, help="Take these.  [default: diagnosis/findings.json]")
@click.option("--generations", type=click.IntRange(min=0), help="Per model.  [default: 15]")
@click.option("--budget", "budget_s", type=seconds, metavar="TIME", help="Per model, such as 50s.")
@click.option(
    "--population", type=Fours(), default=60, show_default=True, help="A multiple of four."
)
@seed_option("Seed of the random numbers.  [default: the trial's]")
@click.option("--workers", type=click.IntRange(min=1), help="Threads.  [default: one per core]")
@click.option("-o", "--out", "output", type=PLACE, help="Model.  [default: models/extended.toml]")
@makes_artifacts
@speaks
def command(out: Output, trials: tuple[str, ...], **options: Any) -> None:
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
    from .extension import choose, extend_one

    chosen, task = choose(options, trials)
    out.bare = len(trials) == 1
    roots: dict[Path, None] = {}

    def collect(found: Work) -> None:
        roots[found.root] = None

    each_trial(out, trials, collect)
    for root in roots:
        out.attempt(functools.partial(extend_one, out, root, chosen, task))
