"""Options that several commands share, so that each means the same everywhere."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from zfcal.api import values
from zfcal.errors import OptionError
from zfcal.trial import LARGEST_SEED

from .output import HAS_VOICE, Output

Command = Callable[..., None]
Decorator = Callable[[Command], Command]
_EMPTY = "The name is empty: is a variable of the shell not set?"


class PathName(click.Path):
    """A path by its name; the current folder is ``.`` and not a name that is empty.

    Parameters
    ----------
    is_made
        Whether a command makes what is there: no paths come to that on standard input.
    **how
        As of `click.Path`.
    """

    def __init__(self, *, is_made: bool = False, **how: Any) -> None:
        super().__init__(path_type=Path, **how)
        self._is_made = is_made

    def convert(
        self,
        value: str | os.PathLike[str],
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> Any:
        """Return the path."""
        if not os.fspath(value):
            self.fail(_EMPTY, param, ctx)
        if self._is_made and os.fspath(value) == "-":
            self.fail("Give a folder: what is made is not named on standard input.", param, ctx)
        return super().convert(value, param, ctx)


class Name(click.types.StringParamType):
    """A text that names something, such as a trial, a file or a device."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the text."""
        if not value:
            self.fail(_EMPTY, param, ctx)
        return str(value)


EXISTING = PathName(exists=True)
PLACE = PathName()
NEW_PLACE = PathName(is_made=True)
NAME = Name()


class FiniteRange(click.FloatRange):
    """A range of numbers; what is no finite number lies in none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number; NaN passes every comparison of click's own."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is no finite number.", param, ctx)
        return number


class _Fours(click.IntRange):
    """Whole numbers from four on that four divides: two tournaments of two make one pair."""

    def __init__(self) -> None:
        super().__init__(min=4)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number."""
        number = int(super().convert(value, param, ctx))
        if number % 4:
            low = number - number % 4
            self.fail(f"{number} is no multiple of four; take {low} or {low + 4}.", param, ctx)
        return number


POSITIVE = FiniteRange(min=0, min_open=True)
SEED = click.IntRange(min=0, max=LARGEST_SEED)


def checked(take: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return what takes an option's text as Python's argument of the name does."""

    @functools.wraps(take)
    def taken(text: str) -> Any:
        try:
            return take(text)
        except OptionError as error:
            raise click.BadParameter(str(error)) from None

    return taken


names = checked(values.names)


def adds(*options: Decorator) -> Decorator:
    """Return what gives a command options, in the order in which its help lists them."""
    return lambda command: functools.reduce(
        lambda made, option: option(made), reversed(options), command
    )


figure_options = adds(
    click.option(
        "--format",
        type=checked(values.formats),
        metavar="NAMES",
        help="Of the figures: png, svg and pdf, such as png,pdf.  [default: png]",
    ),
    click.option(
        "--width",
        type=checked(values.width_mm),
        metavar="WIDTH",
        help="Of the figures on paper: single (85 mm), double (174 mm), or such as 120mm.",
    ),
)


def laid_out(command: Command) -> Command:
    """Keep the lines of the example in the help as they are.

    click knows such a paragraph by a backspace, which a raw docstring spells out.
    """
    command.__doc__ = (command.__doc__ or "").replace("\\b\n", "\b\n")
    return command


def speaks(command: Command, *, as_json: str = "One JSON document instead of paths.") -> Command:
    """Give a command its voice: ``out``, and --json, -v, -q, --traceback.

    ``as_json`` is what its help says of --json.
    """

    @click.option("--json", "as_json", is_flag=True, help=as_json)
    @click.option("-v", "--verbose", count=True, help="Say why each file was made; -vv traces.")
    @click.option("-q", "--quiet", is_flag=True, help="Only errors and files left out.")
    @click.option("--traceback", is_flag=True, expose_value=False, help="Show where a bug arose.")
    @functools.wraps(command)
    def run(*, as_json: bool, verbose: int, quiet: bool, **options: Any) -> None:
        context = click.get_current_context()
        if quiet and verbose:
            raise click.UsageError("--quiet and --verbose contradict each other.")
        name = context.info_name or ""
        context.meta[HAS_VOICE] = True
        with Output(name, as_json=as_json, verbose=verbose, quiet=quiet) as out:
            _obey(command, out, options)
        context.exit(out.exit_code)

    return laid_out(run)


def _obey(command: Command, out: Output, options: dict[str, Any]) -> None:
    """Run a command; options that cannot be are wrong usage."""
    try:
        command(out, **options)
    except OptionError as error:
        raise click.UsageError(str(error)) from None


makes_artifacts = adds(
    click.option(
        "-n", "--dry-run", is_flag=True, help="Say what would be made and why; write nothing."
    ),
    click.option("--force", is_flag=True, help="Make it again, even if it is up to date."),
)

takes_trials = click.argument("trials", nargs=-1, required=True, metavar="TRIAL...", type=NAME)
"""Trials, or - for paths of artifacts on standard input."""


population_option = click.option(
    "--population", type=_Fours(), default=60, show_default=True, help="A multiple of four."
)

workers_option = click.option(
    "--workers", type=click.IntRange(min=1), help="Threads.  [default: one per core]"
)


def seed_option(text: str) -> Decorator:
    """Add --seed, a whole number from 0 on that a TOML file can hold."""
    return click.option("--seed", type=SEED, default=None, help=text)


tank_options = adds(
    click.option(
        "--arena",
        type=NAME,
        metavar="NAME|FILE",
        help="An arena by name, or a GeoJSON file in metres.",
    ),
    click.option("--radius-m", type=POSITIVE, help="Radius of a circular arena, in metres."),
    click.option("--side-m", type=POSITIVE, help="Side of an open-square arena, in metres."),
    click.option("--fish", "n_fish", type=click.IntRange(min=0), help="Number of fish."),
)
"""The tank and the fish in it."""

arena_options = adds(
    tank_options,
    click.option("--robot", is_flag=True, help="One robot; the same as --robots 1."),
    click.option("--robots", "n_robots", type=click.IntRange(min=0), help="Number of robots."),
)
"""What describes the tank and who swims in it."""


new_trial_options = adds(
    click.option(
        "--arena",
        type=NAME,
        metavar="NAME|FILE",
        help="Arena of a new trial; default: the model's.",
    ),
    click.option("--fish", type=click.IntRange(min=0), help="Its fish."),
    click.option("--robot", is_flag=True, help="One robot; the same as --robots 1."),
    click.option("--robots", type=click.IntRange(min=0), help="Its robots."),
    click.option("--fps", type=POSITIVE, help="Its frame rate, in hertz."),
)
"""What a simulation may say of a trial that it makes."""
