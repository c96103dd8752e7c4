"""Cutting tracks into closed segments, for whoever brings them: import or simulation."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from zfcal.artifacts.atomic import remove
from zfcal.artifacts.freshness import relative_to
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.reading.contents import hash_of, hold_steady
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_extra, write_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import Note, Progress, Tell
from zfcal.stages.segments import END_KEY, STEP_S
from zfcal.stages.stage import Draft, Item, Output, Run, Write
from zfcal.stages.taken import unless_taken
from zfcal.stages.trial_context import Task
from zfcal.tracks import Tracks
from zfcal.trial import Trial

TRACKS = "zfcal.tracks/1"

STRETCH_KEY = "recording_s"
"""Extra metadata of every segment: the seconds from which and to which the recording goes."""

_LONGEST_S = 1e7
"""No recording goes on for so long, about 4 months."""

_MOST_NAMED = 3
"""Files that a message names: a folder of images has a million."""

_SLACK_S = 1e-6
"""A time this little before a segment's start is the start, but for rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """Tracks of a whole trial.

    Parameters
    ----------
    tracks
        All rows.
    end_s
        The second up to which the recording went, also if nobody was seen.
    extra
        Further metadata of every segment.
    """

    tracks: Tracks
    end_s: float
    extra: Mapping[str, JSON] = field(default_factory=dict)


def named_sources(root: Path, path: Path) -> dict[str, Path]:
    """Return the files of a source by the names under which they are recorded.

    A name is the path relative to the trial, or begins with the bare name of a
    source outside it: where it lay on somebody's disk does not bear on the result.

    Parameters
    ----------
    root
        The trial's directory.
    path
        A file, or a folder of files.
    """
    files = sorted(part for part in path.rglob("*") if part.is_file()) if path.is_dir() else [path]
    outside = relative_to(root, path).startswith("..")
    return {
        part.relative_to(path.parent).as_posix() if outside else relative_to(root, part): part
        for part in files
    }


def hash_sources(root: Path, path: Path) -> dict[str, str]:
    """Return how a source is recorded: the hash of each of its files, by `named_sources`."""
    found = {}
    for name, part in named_sources(root, path).items():
        # Readers of films and of other programs' tracks open it by its name.
        hold_steady(part)
        found[name] = hash_of(part)
    return found


def check_same_source(trial: Trial, command: str, *, sources: Collection[str], task: Task) -> None:
    """Refuse to replace tracks that came from somewhere else.

    Parameters
    ----------
    trial
        Whose tracks are to be written.
    command
        By which command.
    sources
        The names of its inputs, as lineage states them.
    task
        A forced one replaces all.

    Raises
    ------
    InputError
        A segment was made by another command or from a file of another name,
        and the task is not forced.
    """
    if task.force:
        return
    for start in segment_starts(trial.root):
        path = segment_path(trial.root, start)
        try:
            found = read_lineage(path)
        except (DamagedError, InputError):
            # It says not where it comes from: it is replaced as stale.
            continue
        same = found.command == command and set(found.inputs) == set(sources)
        if not (same or (found.command == command == "simulate")):
            raise InputError(
                f"{path}: comes from {found.command} of {_few(found.inputs, beside=sources)}, "
                f"expected none or {_few(sources, beside=found.inputs)}.",
                hint="One trial holds one recording: make another trial, or replace these "
                "tracks with --force.",
            )


def _few(names: Collection[str], *, beside: Collection[str]) -> str:
    """Return some of the names, those first that others do not have, and how many more."""
    known = set(beside)
    listed = ", ".join(sorted(names, key=lambda name: name in known)[:_MOST_NAMED])
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return f"{listed or 'no file'}{more}"


def starts_of_recording(root: Path) -> list[int]:
    """Return the starts of all segments that the recording has, written yet or not.

    Every segment says how far the whole recording goes, so that an import that was
    killed half-way is known to be unfinished. Empty where no segment says so.
    """
    for start in segment_starts(root):
        stretch = stretch_of(segment_path(root, start))
        if stretch is not None:
            return starts_between(*stretch)
    return []


def stretch_of(path: Path) -> tuple[float, float] | None:
    """Return from where to where a segment says that its recording goes; None for no word.

    What no recording can be (no two numbers, an end before the start, months) is no word.
    """
    try:
        said = read_extra(path).get(STRETCH_KEY)
    except (DamagedError, InputError):
        return None
    if not isinstance(said, list) or len(said) != 2:
        return None
    numbers = [n for n in said if isinstance(n, int | float) and not isinstance(n, bool)]
    # A comparison with NaN is false.
    if len(numbers) != 2 or not 0 <= numbers[0] <= numbers[1] < _LONGEST_S:
        return None
    return float(numbers[0]), float(numbers[1])


def has_ended(root: Path, whole: Collection[int]) -> bool:
    """Return whether a recording is there to its end.

    The last segment of a recording says from where to where it goes; that of a
    camera which may come back does not.

    Parameters
    ----------
    root
        The trial's directory.
    whole
        The segments that are there, by their starts.
    """
    for start in reversed(segment_starts(root)):
        if start not in whole:
            return False
        stretch = stretch_of(segment_path(root, start))
        if stretch is not None:
            needed = starts_between(*stretch)
            return needed[-1] == max(whole) and set(needed) <= set(whole)
    return False


def starts_between(first_s: float, end_s: float) -> list[int]:
    """Return the starts of the segments that a stretch of time touches, in seconds.

    >>> starts_between(61.0, 180.0)
    [60, 120]
    """
    first = int((first_s + _SLACK_S) // STEP_S) * STEP_S
    return list(range(first, max(int(np.ceil(end_s - _SLACK_S)), first + 1), STEP_S))


def segmented(
    run: Run, lineage: Lineage, starts: list[int], record: Callable[[], Recording]
) -> Item:
    """Return the segments of a recording, of which those missing or stale are written.

    Parameters
    ----------
    run
        On which trial, whose segments come from the same source: see `check_same_source`.
    lineage
        Of every segment.
    starts
        The seconds at which the segments start; empty where only the recording tells.
    record
        Returns the whole recording.
    """
    # To remove those that the recording does not reach any more is a reason as well.
    others = set(segment_starts(run.root)) - set(starts)
    outputs = [
        Output(
            path=segment_path(run.root, start),
            lineage=lineage,
            otherwise="others are there" if others else None,
        )
        for start in starts
    ]
    return Item(outputs=outputs, compute=lambda: _parts(run, lineage, record()), apart=True)


def _parts(run: Run, lineage: Lineage, recording: Recording) -> Iterator[Draft]:
    """Yield the segments, in order, and remove those of an earlier, longer recording.

    A minute in which nobody was seen has a segment without rows; the last one may be a part.
    """
    parts = list(cut(recording.tracks, recording.end_s))
    stretch: list[JSON] = [float(recording.tracks.time_s[0]), recording.end_s]
    for number, (start, tracks) in enumerate(parts, start=1):
        end_s = min(recording.end_s, float(start + STEP_S))
        extra: dict[str, JSON] = {**recording.extra, STRETCH_KEY: stretch, END_KEY: end_s}
        output = Output(path=segment_path(run.root, start), lineage=lineage)
        yield Draft(output=output, write=_writer(tracks, extra))
        run.tell(Progress(stage="segments", done=number, total=len(parts)))
    others = set(segment_starts(run.root)) - {start for start, _ in parts}
    remove_surplus([segment_path(run.root, start) for start in others], run.tell, run.task)


def remove_surplus(
    paths: Iterable[Path], tell: Tell, task: Task, *, of: str = "recording does"
) -> None:
    """Remove the files of minutes that are not reached any more, and tell each.

    Parameters
    ----------
    paths
        The files.
    tell
        Hears of them.
    task
        A dry run says what it would remove.
    of
        What does not reach there, with its verb.
    """
    why = f"the {of} not reach there any more."
    for path in paths:
        if task.dry_run:
            tell(Note(text=f"would remove {path}: {why}"))
            continue
        with unless_taken(path, tell):
            remove(path)
            tell(Note(text=f"{path}: removed, {why}"))


def _writer(tracks: Tracks, extra: Mapping[str, JSON]) -> Write:
    return lambda path, lineage: write_tracks(path, tracks, lineage, extra=extra)


def cut(tracks: Tracks, end_s: float) -> Iterator[tuple[int, Tracks]]:
    """Cut tracks into segments of 60 s, from the first row's to the last part.

    Parameters
    ----------
    tracks
        Sorted by frame.
    end_s
        The second up to which the recording went.

    Yields
    ------
    start : int
        The second at which the segment starts.
    tracks : Tracks
        The rows with ``start <= time_s < start + 60``; maybe none.
    """
    starts = starts_between(float(tracks.time_s[0]), end_s)
    edges = np.searchsorted(tracks.time_s, np.array([*starts, np.inf]) - _SLACK_S)
    for start, low, high in zip(starts, edges, edges[1:], strict=False):
        yield start, tracks.take(slice(int(low), int(high)))
