"""The paper's own way of calibrating: one option for each deviation, and one for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click
from click.core import ParameterSource

from .options import adds

published_options = adds(
    click.option(
        "--as-published",
        is_flag=True,
        help="The paper's way: DEAP's NSGA-II from random genomes, no estimate, no renewal, "
        "nothing simulated anew, diversity over the population. Options given beside it count.",
    ),
    click.option(
        "--confirm",
        type=click.IntRange(min=0),
        default=10,
        show_default=True,
        help="So many of the best are simulated anew to choose one; 0: the search's own S chooses.",
    ),
    click.option(
        "--diversity",
        type=click.Choice(["merged", "population"]),
        default="merged",
        show_default=True,
        help="Distances within parents and offspring, or to the current population.",
    ),
    click.option(
        "--renewal/--no-renewal",
        default=True,
        show_default=True,
        help="Renew a fifth of the last population where the fish have changed.",
    ),
    click.option(
        "--sampler",
        type=click.Choice(["exact", "grid"]),
        default="exact",
        show_default=True,
        help="How headings are drawn: grid is the paper's numeric way, slower; one law.",
    ),
)


def as_asked(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options, those of the paper's way in place of what nobody gave.

    The way itself stands in `zfcal.stages.calibrate.searching`.

    Raises
    ------
    click.UsageError
        ``--champion``, the older name of ``--publish``, stands beside ``--as-published``.
    """
    if not options.get("as_published"):
        return dict(options)
    if options["champion"] is not None:
        raise click.UsageError("--as-published publishes by score: say otherwise by --publish.")
    from zfcal.stages.calibrate.searching import AS_PUBLISHED

    settings = AS_PUBLISHED.settings
    way = {
        "optimiser": settings.optimiser,
        "seed_likelihood": AS_PUBLISHED.seed_likelihood,
        "publish": settings.champion,
        "confirm": settings.n_confirmed,
        "diversity": settings.diversity,
        "renewal": settings.renews,
    }
    source = click.get_current_context().get_parameter_source
    unsaid = {
        name: value
        for name, value in way.items()
        if source(name) is not ParameterSource.COMMANDLINE
    }
    return {**options, **unsaid}
