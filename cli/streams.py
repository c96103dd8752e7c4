"""The trials that a command is given: as arguments, or as paths on standard input."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from .output import Output

if TYPE_CHECKING:
    from zfcal.stages.events import Tell
    from zfcal.stages.streams import Work

STDIN = "-"

_LONGEST_PATH = 4096
"""Characters: more than a system takes."""

_SHOWN = 20
"""Characters of a line that is no path."""


def each_trial(out: Output, trials: Sequence[str], work: Callable[[Work], object]) -> None:
    """Work on each trial in turn; where one fails, the others still have theirs.

    Parameters
    ----------
    out
        Takes the errors.
    trials
        Directories, or ``-`` for paths of artifacts on standard input, which
        are worked on as they come.
    work
        What to do with one.
    """
    if STDIN in trials and len(trials) > 1:
        raise click.UsageError("- stands alone: the trials come on standard input.")
    if trials == (STDIN,):
        _each_line(out, sys.stdin, work)
        return
    for trial in trials:
        out.attempt(functools.partial(_one, Path(trial), work))


def roots_of(out: Output, trials: Sequence[str]) -> list[Path]:
    """Return the directories that `each_trial` would work on, each once."""
    roots: dict[Path, None] = {}
    each_trial(out, trials, lambda found: roots.setdefault(found.root))
    return list(roots)


def trials_together(
    out: Output, trials: Sequence[str], work: Callable[[Work, Tell], None], *, n_threads: int
) -> None:
    """Work on several trials at the same time; what is said is as if they came in turn.

    Parameters
    ----------
    out
        Takes events and errors.
    trials
        Directories. One that is named twice is worked on once.
    work
        What to do with one, and who hears of it.
    n_threads
        Simulations that can be done at the same time.
    """
    from zfcal.stages.side_by_side import at_once, side_by_side

    places: dict[Path, Path] = {}
    for trial in trials:
        places.setdefault(Path(trial).resolve(), Path(trial))
    jobs = [functools.partial(_one, place, work) for place in places.values()]
    n_at_once = at_once(len(jobs), n_threads)
    side_by_side(jobs, out.tell, out.attempt, n_at_once=n_at_once)


def _one(path: Path, work: Callable[..., object], *tell: Tell) -> None:
    from zfcal.stages.streams import work_at

    work(work_at(path), *tell)


def _each_line(out: Output, stream: TextIO, work: Callable[[Work], object]) -> None:
    from zfcal.stages.streams import Work, work_of

    roots: dict[Path, None] = {}

    def at(text: str) -> None:
        found = work_of(_path_of(text))
        roots[found.root] = None
        work(found)

    for text in _lines(stream):
        out.attempt(functools.partial(at, text))
    if not roots:
        out.note("No artifact came on standard input: nothing to do.")
    for root in roots:
        # The lines were hints; the directory is the truth.
        out.attempt(functools.partial(work, Work(root=root)))


def _lines(stream: TextIO) -> Iterable[str]:
    for line in stream:
        if text := line.rstrip("\n"):
            yield text


def _path_of(text: str) -> Path:
    """Return the path that a line is; what no system takes for one is shown in short."""
    if "\0" not in text and len(text) <= _LONGEST_PATH:
        return Path(text)
    from zfcal.errors import InputError

    raise InputError(
        f"standard input: a line of {len(text)} characters that begins with {text[:_SHOWN]!r} "
        "is no path.",
        hint="Give the paths of artifacts, one a line, as other commands write them.",
    )
