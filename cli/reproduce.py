"""`zfcal reproduce`: published scores from archived trials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .durations import seconds
from .foreign import FORMATS, foreign_options
from .options import EXISTING, PLACE, makes_artifacts, seed_option, speaks, tank_options
from .output import Output
from .reproducing import check_together, reproduce_archives, reproduce_virtual


@click.command("reproduce")
@click.argument("archives", nargs=-1, metavar="[ARCHIVE]...", type=PLACE)
@click.option("--reference", type=EXISTING, help="Published scores.  [default: the paper's]")
@click.option(
    "--scoring",
    type=click.Choice(["paper", "legacy"]),
    help="legacy: as the authors' scripts compute S.  [default: the reference's]",
)
@click.option(
    "--way",
    type=click.Choice(["as-published", "default"]),
    default="as-published",
    show_default=True,
    help="How models are made.",
)
@click.option("--generations", type=click.IntRange(min=0), help="Per round.  [default: 15]")
@click.option("--twin", is_flag=True, help="Virtual trials as the paper's, in place of archives.")
@click.option(
    "--trials", "n_trials", type=click.IntRange(min=1), help="Of the twin.  [default: 10]"
)
@click.option(
    "--duration", type=seconds, metavar="TIME", help="Of a twin's trial.  [default: 30min]"
)
@click.option("-o", "--out", "folder", type=PLACE, help="Where it goes.  [default: reproduced]")
@click.option("--format", "format_", type=click.Choice(FORMATS), help="Of the archives' tracks.")
@tank_options
@click.option("--robot", is_flag=True, help="One robot, which the file itself names.")
@foreign_options
@seed_option("Of the first trial that is made.  [default: 1; of the twin 9001]")
@makes_artifacts
@speaks
def command(out: Output, archives: tuple[Path, ...], folder: Path | None, **options: Any) -> None:
    r"""Compare scores of archived trials with published ones.

    An archive is a trial, or tracks in a format of `zfcal import`; it is only
    read. Each gets a trial in DIR, which is analysed and calibrated by the
    ordinary commands. The verdict over all contrasts is agrees (exit code 0),
    disagrees or undecided (4).

    \b
    Example:
        zfcal reproduce day*/
        zfcal reproduce positions-*.txt --arena two-rooms --fish 4 --robot --fps 15
        zfcal reproduce day*/ --reference ours-2025.toml --way default -o again
        zfcal reproduce --twin -o twin
    """
    check_together(archives, options)
    place = folder or Path("reproduced")
    work = reproduce_virtual if options["twin"] else reproduce_archives
    out.attempt(lambda: work(out, archives, place, options))
