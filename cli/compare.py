"""`zfcal compare`: two sets of trials, and in what they differ."""

from __future__ import annotations

from typing import Any

import click

from .options import NAME, PLACE, makes_artifacts, speaks
from .output import Output
from .streams import roots_of

_AGAINST = "--against"


class _TwoSets(click.Command):
    """A command whose --against takes all words up to the next option."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Write --against before each word of its set, as click wants it."""
        written: list[str] = []
        within = False
        for word, following in zip(args, [*args, "-o"][1:], strict=True):
            if word == _AGAINST:
                if _is_option(following):
                    raise click.UsageError(f"{_AGAINST} needs the trials of set B.", ctx)
                within = True
                continue
            within = within and not _is_option(word)
            written += [_AGAINST, word] if within else [word]
        return super().parse_args(ctx, written)


def _is_option(word: str) -> bool:
    return word.startswith("-") and word != "-"


@click.command("compare", cls=_TwoSets)
@click.argument("trials", nargs=-1, required=True, metavar="A...", type=NAME)
@click.option(
    _AGAINST, multiple=True, required=True, type=NAME, metavar="B...", help="The trials of set B."
)
@click.option("-o", "--out", type=PLACE, help="Folder for compare.json and a picture.")
@click.option("--format", type=click.Choice(["png", "svg"]), help="Of the picture.  [png]")
@makes_artifacts
@speaks
def command(
    out: Output, /, trials: tuple[str, ...], against: tuple[str, ...], **options: Any
) -> None:
    r"""Compare two sets of trials: differences with intervals, and tests over whole trials.

    A trial counts once, however long it is. With fewer than four trials on a side
    nothing is tested: the table describes them and says what more trials could show.

    \b
    Example:
        zfcal compare treated1 treated2 treated3 treated4 --against control*/
        zfcal compare day1/* --against day2/* -o days
        zfcal compare a1 a2 a3 a4 --against b1 b2 b3 b4 --json
    """
    from zfcal.api.comparing import comparison_of

    from .comparison import compare_and_say

    asked = comparison_of(options)
    sets = roots_of(out, trials), roots_of(out, against)
    if not out.exit_code:
        out.bare = True
        out.attempt(lambda: compare_and_say(out, sets, asked))
