"""How rounds are done: options of `zfcal calibrate` and `zfcal watch`.

What they come to is in `zfcal.api.rounds`.
"""

from __future__ import annotations

import click

from .durations import seconds
from .options import EXISTING, Decorator, adds, population_option, seed_option, workers_option
from .published import published_options


def round_options(*, generations: str = "", budget: str = "") -> Decorator:
    """Add how a round is done; the texts say which of generations and budget is the default."""
    optimisers = click.Choice(["zfcal", "deap"])
    return adds(
        click.option("--generations", type=click.IntRange(min=0), help=f"Per round.{generations}"),
        click.option(
            "--budget",
            type=seconds,
            metavar="TIME",
            help=f"Wall-clock time per round, such as 50s.{budget}",
        ),
        population_option,
        click.option(
            "--runs",
            type=click.IntRange(min=1),
            default=1,
            show_default=True,
            help="Simulations an evaluation.",
        ),
        click.option(
            "--steps",
            type=click.IntRange(min=1),
            default=3000,
            show_default=True,
            help="Steps of each of them.",
        ),
        click.option(
            "--optimiser",
            type=optimisers,
            help="NSGA-II as arrays, or with DEAP's operators.  [default: zfcal]",
        ),
        click.option(
            "--seed-likelihood/--no-seed-likelihood",
            default=None,
            help="Let the maximum-likelihood estimate join the first population.  "
            "[default: seed-likelihood]",
        ),
        click.option(
            "--model", type=EXISTING, help="Another model to calibrate than the trial's first."
        ),
        click.option(
            "--publish",
            type=click.Choice(["forward", "score", "likelihood"]),
            help="Which model is published: by the rule whose models have been better so far, the "
            "best by its score, or the estimate if its score allows.  [default: forward; a trial "
            "that has models keeps its way]",
        ),
        click.option(
            "--champion",
            type=click.Choice(["score", "likely", "likelihood"]),
            hidden=True,
            help="The older name of --publish.",
        ),
        published_options,
        click.option(
            "--baselines", is_flag=True, help="Score random search and the last model too."
        ),
        seed_option("Seed of the random numbers.  [default: the trial's]"),
        workers_option,
    )
