"""`zfcal diagnose`: where a model and tracks disagree, and which effect is missing."""

from __future__ import annotations

from typing import Any

import click

from .durations import span
from .options import (
    EXISTING,
    PLACE,
    FiniteRange,
    figure_options,
    makes_artifacts,
    seed_option,
    speaks,
    takes_trials,
    workers_option,
)
from .output import Output
from .streams import STDIN, roots_of


def _listed(name: str) -> str:
    """Return the name by which help lists an option; an earlier one goes on working."""
    return "null-replicates" if name == "null" else name


@click.command("diagnose", context_settings={"token_normalize_func": _listed})
@takes_trials
@click.option("--model", type=EXISTING, help="Another model than that of the newest round.")
@click.option(
    "--null-replicates",
    type=click.Choice(["39", "199"]),
    help="Trials simulated without any effect, to measure what chance does.  [default: 39]",
)
@click.option("--quick", is_flag=True, help="Take that from theory instead: seconds, less sure.")
@click.option("--noise-mm", type=FiniteRange(min=0), help="Position noise, sd per coordinate.")
@click.option("--window", type=span, metavar="START:END", help="Only this stretch.")
@seed_option("Seed of the random numbers.  [default: the trial's]")
@workers_option
@click.option("-o", "--out", type=PLACE, help="Folder.  [default: TRIAL/diagnosis]")
@figure_options
@makes_artifacts
@speaks
def command(out: Output, /, trials: tuple[str, ...], **options: Any) -> None:
    r"""Find the effect that a model misses: where it shows, what it is, how sure that is.

    Writes diagnosis/findings.json with pictures and report.html. Findings about a
    model that has effects already go to diagnosis/NAME/, after the model's file.

    \b
    Example:
        zfcal diagnose trial
        zfcal diagnose trial --quick --json
        zfcal diagnose trial --model trial/models/extended.toml
        zfcal diagnose trial --format pdf --width double
        zfcal diagnose day1 day2 --window 0:1800 --noise-mm 0.5
    """
    from zfcal.api.diagnosing import diagnosis_of, printing_of
    from zfcal.api.trials import task_of

    from .diagnosis import diagnose_all
    from .heaps import share_one_heap

    share_one_heap()
    chosen = diagnosis_of(options)
    if chosen.out_dir is not None and (len(trials) != 1 or trials[0] == STDIN):
        raise click.UsageError("-o is for one trial: its findings would overwrite each other's.")
    out.bare = len(trials) == 1
    roots = roots_of(out, trials)
    diagnose_all(out, roots, chosen, task_of(options), printing=printing_of(options))
