"""The closed track segments of a trial: on the camera's clock, on the model's, in its arena.

Windows overlap, and a pipe visits the same segments again and again, so what was
located is remembered, by the content of the file.
"""

from __future__ import annotations

import math
import os
from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

from zfcal.arena import Arena
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON
from zfcal.artifacts.reading.contents import hash_of, one_content
from zfcal.artifacts.reading.limits import check_size
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.artifacts.segments import read_segment, segment_name, segment_path, segment_starts
from zfcal.artifacts.tables import read_extra, read_tracks
from zfcal.behaviour.located import Located, locate
from zfcal.behaviour.pooling import Pool
from zfcal.errors import DamagedError, InputError, ZfcalError
from zfcal.stages.events import LeftOut, Tell
from zfcal.stages.trial_context import OpenTrial, open_trial
from zfcal.tracks import GUESS
from zfcal.units import SEGMENT_S

STEP_S = int(SEGMENT_S)
END_KEY = "end_s"
"""Extra metadata of a segment: the second up to which the recording filled it."""

_ROUNDING_S = 1e-6
"""Times are sums and quotients of floating-point numbers: 150 s may be a hair more."""

_SHORT_GAP_S = 1.0
"""A shorter gap between two segments is none: coverage is told in whole seconds."""

_REMEMBERED = 200_000
"""Points kept in memory, some 12 MB: two hours of five agents at 5 Hz."""

_AT_LEAST = 3
"""Segments kept in memory however many points they hold: those of a window."""


def segment_hashes(root: Path, starts: Iterable[int]) -> dict[int, str]:
    """Return the SHA-256 of segments by the second at which they start.

    Raises
    ------
    InputError
        One is missing or cannot be read.
    """
    return {start: hash_of(f"{root}/{segment_name(start)}") for start in starts}


def segment_files(root: Path, span_s: tuple[int, int] | None) -> list[Path]:
    """Return the segments that a stretch of time touches, all for None, in order of time."""
    starts = segment_starts(root) if span_s is None else touched(root, span_s)
    return [segment_path(root, start) for start in starts]


def touched(root: Path, span_s: tuple[int, int]) -> list[int]:
    """Return the seconds at which the segments begin that a stretch of time touches, in order."""
    return [start for start in segment_starts(root) if span_s[0] - STEP_S < start < span_s[1]]


def readable(paths: Iterable[Path], tell: Tell) -> list[Path]:
    """Return the files that can be opened and are not too large; the others are told as left out.

    Nobody looks at what they hold: a file that nothing is made from may change.
    """
    found = []
    for path in paths:
        problem = _problem_of(path)
        if problem is None:
            found.append(path)
        else:
            tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))
    return found


def guess_options(paths: Iterable[Path]) -> dict[str, JSON]:
    """Return how guesses count, as a lineage states it; nothing where there are none.

    Models and findings from the time when nobody saw a guess do not state it.
    """

    def has_guesses(path: Path) -> bool:
        try:
            return bool((read_tracks(path).confidence < GUESS).any())
        except (DamagedError, InputError):
            return False

    return {"guesses": "seen"} if any(map(has_guesses, paths)) else {}


def _problem_of(path: Path) -> ZfcalError | None:
    try:
        with open_regular(path) as file:
            check_size(path, file.seek(0, os.SEEK_END))
    except OSError as error:
        return unreadable(path, error)
    except DamagedError as error:
        return error
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pooled:
    """What everybody did over some segments.

    Parameters
    ----------
    pool
        The counts. They grow when more segments are pooled: ask before that.
    hashes
        SHA-256 of each segment, by its start.
    problems
        By their start, those that cannot be read and count nothing, and why.
    """

    pool: Pool
    hashes: dict[int, str] = field(default_factory=dict)
    problems: dict[int, ZfcalError] = field(default_factory=dict)


@final
class Segments:
    """Reads the segments of trials, each once.

    A trial's settings may change between two questions; what depends on them is
    then located anew.
    """

    def __init__(self) -> None:
        self._located: OrderedDict[tuple[str, ...], Located] = OrderedDict()
        self._arenas: dict[tuple[str, str], Arena] = {}
        self._pooled: dict[tuple[str, ...], Pooled] = {}

    def open(self, root: Path) -> OpenTrial:
        """Open a trial; as long as its arena file stays, it is the very same arena."""
        with one_content():
            opened = open_trial(root)
            hashes = hash_inputs(root, opened.arena_files)
        key = (str(root.absolute()), "".join(hashes.values()) or opened.trial.arena)
        arena = self._arenas.setdefault(key, opened.arena)
        return OpenTrial(trial=opened.trial, arena=arena)

    def read(self, opened: OpenTrial, start_s: int) -> Located:
        """Return where everybody was in a segment.

        Raises
        ------
        DamagedError
            The file is damaged, of another schema, or holds what no tracker writes.
        """
        path = segment_path(opened.trial.root, start_s)
        # What is remembered under a hash was read from the bytes that have it.
        with one_content():
            key = (str(path.absolute()), hash_of(path), *_clock(opened))
            if key not in self._located:
                self._located[key] = locate(read_segment(opened.trial, start_s)[1], opened.arena)
                self._forget()
        return self._located[key]

    def _forget(self) -> None:
        n_points = sum(map(len, self._located.values()))
        while n_points > _REMEMBERED and len(self._located) > _AT_LEAST:
            _, oldest = self._located.popitem(last=False)
            n_points -= len(oldest)

    def read_or_tell(self, opened: OpenTrial, start_s: int, tell: Tell) -> Located | None:
        """Return what `read` does; None for a segment that is left out, which is told."""
        try:
            return self.read(opened, start_s)
        except (DamagedError, InputError) as error:
            path = segment_path(opened.trial.root, start_s)
            tell(LeftOut(path=path, problem=str(error), hint=error.hint))
            return None

    def pool(self, opened: OpenTrial, hashes: dict[int, str], tell: Tell) -> Pooled:
        """Return what everybody did over some segments, each of which is read once.

        Where the segments that were pooled the last time come first again,
        unchanged, the others are added to them.

        Parameters
        ----------
        opened
            The trial.
        hashes
            The segments by their start, in order of time, from `segment_hashes`.
        tell
            Hears of segments that are left out.
        """
        key = (str(opened.trial.root.absolute()), *_clock(opened))
        known = self._pooled.get(key)
        if known is None or [*known.hashes.items()] != [*hashes.items()][: len(known.hashes)]:
            known = self._pooled[key] = Pooled(pool=Pool(opened.arena))
        for start, digest in [*hashes.items()][len(known.hashes) :]:
            try:
                known.pool.add(self.read(opened, start))
            except (DamagedError, InputError) as error:
                known.problems[start] = error
            known.hashes[start] = digest
        for start, problem in known.problems.items():
            path = segment_path(opened.trial.root, start)
            tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))
        return known


def _clock(opened: OpenTrial) -> tuple[str, ...]:
    """Return what else bears on where everybody was; an arena that was opened stays the same."""
    return str(opened.trial.fps), str(opened.trial.dt_s), str(id(opened.arena))


def is_whole(root: Path, start_s: int, *, fps: float) -> bool:
    """Return whether the recording went on to the end of a segment.

    The importer writes down where it ended; without that a segment is whole when
    its last row lies within two frames of the end. A damaged one counts as whole:
    whoever reads it says what is wrong.
    """
    try:
        end_s = _end_of(root, start_s, past_last_s=2 / fps)
    except (DamagedError, InputError):
        return True
    return bool(end_s >= start_s + SEGMENT_S - 0.5 / fps)


def _end_of(root: Path, start_s: int, *, past_last_s: float) -> float:
    """Return where the recording of a segment ends: as it states, or a while past its last row."""
    path = segment_path(root, start_s)
    end_s = read_extra(path).get(END_KEY)
    if isinstance(end_s, int | float):
        return float(end_s)
    time_s = read_tracks(path).time_s
    return float(time_s[-1]) + past_last_s if len(time_s) else float(start_s)


def covered(root: Path, span_s: tuple[int, int], *, fps: float) -> list[tuple[int, int]]:
    """Return the parts of a stretch of time that tracks cover, in order, in whole seconds.

    A part begins with its first row, and ends where the recording of a segment ended before the
    next one began. A second that is covered in part counts, and a shorter gap is none.

    Parameters
    ----------
    root
        The trial's directory.
    span_s
        From and to, in seconds since trial start.
    fps
        Frame rate of the tracks, in hertz.

    Raises
    ------
    InputError, DamagedError
        A segment of that stretch cannot be read.
    """
    known = set(segment_starts(root))
    found: list[tuple[float, float]] = []
    for start in touched(root, span_s):
        # What came before the stretch is not looked at: it may be damaged.
        before_s = found[-1][1] if found else float(start if start - STEP_S in known else -1)
        begin_s = before_s if before_s >= start else _begin_of(root, start)
        end_s = _end_of(root, start, past_last_s=1 / fps)
        is_to_end = end_s >= start + STEP_S - 2 / fps
        end_s = float(start + STEP_S) if is_to_end else end_s
        if found and begin_s - before_s < _SHORT_GAP_S:
            begin_s = found.pop()[0]
        found.append((begin_s, end_s))
    whole = (
        (max(span_s[0], math.floor(a + _ROUNDING_S)), min(span_s[1], math.ceil(b - _ROUNDING_S)))
        for a, b in found
    )
    return [(a, b) for a, b in whole if a < b]


def _begin_of(root: Path, start_s: int) -> float:
    """Return the time of a segment's first row; where it begins, without any."""
    time_s = read_tracks(segment_path(root, start_s)).time_s
    return float(time_s[0]) if len(time_s) else float(start_s)
