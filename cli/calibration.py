"""How rounds are done: options of `zfcal calibrate` and `zfcal watch`, and what they come to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from .durations import seconds
from .options import EXISTING, Decorator, adds, population_option, seed_option, workers_option
from .published import as_asked, published_options

if TYPE_CHECKING:
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.trial_context import Task

    MakeTask = Callable[[frozenset[int] | None], Task]


def round_options(*, generations: str = "", budget: str = "") -> Decorator:
    """Add how a round is done; the texts say which of generations and budget is the default."""
    optimisers = click.Choice(["zfcal", "deap"])
    return adds(
        click.option("--generations", type=click.IntRange(min=0), help=f"Per round.{generations}"),
        click.option(
            "--budget",
            "budget_s",
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
            default="zfcal",
            show_default=True,
            help="NSGA-II as arrays, or with DEAP's operators.",
        ),
        click.option(
            "--seed-likelihood/--no-seed-likelihood",
            default=True,
            show_default=True,
            help="Let the maximum-likelihood estimate join the first population.",
        ),
        click.option(
            "--model", type=EXISTING, help="Another model to calibrate than the trial's first."
        ),
        click.option(
            "--publish",
            type=click.Choice(["forward", "score", "likelihood"]),
            help="Which model is handed on: by the rule whose models have been better so far, the "
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


def choose(options: Mapping[str, Any]) -> tuple[CalibrateOptions, MakeTask]:
    """Return how to calibrate, and what makes a task of the windows that are asked for.

    Raises
    ------
    click.UsageError
        Two options contradict each other, or one could not take effect.
    """
    from zfcal.behaviour.features.registry import SCORED, further
    from zfcal.calibrate.task import Settings
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.trial_context import Task

    options = as_asked(options)
    _check_together(options)
    settings = Settings(
        population=options["population"],
        generations=options["generations"],
        runs=options["runs"],
        steps=options["steps"],
        optimiser=options["optimiser"],
        champion=CHAMPIONS[published_by(options) or "score"],
        features=options.get("features", SCORED),
        n_confirmed=options["confirm"],
        diversity=options["diversity"],
        renews=options["renewal"],
        sampler=options["sampler"],
    )
    if options.get("cluster") is not None and further(settings.features):
        raise click.UsageError("--cluster counts D, W, O, T and V: no other --features.")
    chosen = CalibrateOptions(
        settings=settings,
        budget_s=options["budget_s"],
        seed=options["seed"],
        n_workers=options["workers"],
        baselines=options["baselines"],
        seed_likelihood=options["seed_likelihood"],
        model=options["model"],
        keeps_way=published_by(options) is None and options["window"] is None,
    )

    def task(ends_s: frozenset[int] | None) -> Task:
        return Task(dry_run=options["dry_run"], force=options["force"], ends_s=ends_s)

    return chosen, task


CHAMPIONS: dict[str, Any] = {
    "forward": "forward",
    "score": "score",
    "likelihood": "likely",
    "likely": "likely",
}
"""What `zfcal.calibrate.task.Settings` calls each way to publish."""


def published_by(options: Mapping[str, Any]) -> str | None:
    """Return who hands models on, by the option's name or its older one; None where unsaid."""
    if options["publish"] and options["champion"]:
        raise click.UsageError("--publish and --champion say the same: give one.")
    found: str | None = options["publish"] or options["champion"]
    return found


def _check_together(options: Mapping[str, Any]) -> None:
    if options["generations"] is not None and options["budget_s"] is not None:
        raise click.UsageError("A round ends after --generations or with its --budget: give one.")
    publish = published_by(options)
    if publish in {"likely", "likelihood"} and not options["seed_likelihood"]:
        raise click.UsageError(
            "--publish likelihood is the estimate, which --no-seed-likelihood omits."
        )
    if publish == "forward" and options["window"] is not None:
        raise click.UsageError("--publish forward judges round after round: --window has one.")
    if options["window"] is None:
        for name in ("held_out", "output"):
            if options[name] is not None:
                option = "-o" if name == "output" else "--held-out"
                raise click.UsageError(f"{option} belongs to --window, which is not given.")
    elif options["output"] is None:
        raise click.UsageError("--window needs -o FILE: its model is none of the trial's rounds.")
    if options["cluster"] is not None and options["workers"] is not None:
        raise click.UsageError("--workers are threads of this machine: with --cluster it has none.")
