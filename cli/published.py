"""The paper's own way of calibrating: one option for each deviation, and one for all of them."""

from __future__ import annotations

import click

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
        help="So many of the best are simulated anew to choose one; 0: the search's own S "
        "chooses.  [default: 10]",
    ),
    click.option(
        "--diversity",
        type=click.Choice(["merged", "population"]),
        help="Distances within parents and offspring, or to the current population.  "
        "[default: merged]",
    ),
    click.option(
        "--renewal/--no-renewal",
        default=None,
        help="Renew a fifth of the last population where the fish have changed.  "
        "[default: renewal]",
    ),
    click.option(
        "--sampler",
        type=click.Choice(["exact", "grid"]),
        default="exact",
        show_default=True,
        help="How headings are drawn: grid is the paper's numeric way, slower; one law.",
    ),
)
"""None where nobody says it: `zfcal.api.rounds` puts in what is usual, or what the paper did."""
