"""From the times of NWB's series to the frames of a video.

A series has times, or a start and a rate. sleap-io, which leaves out samples in which a part was
not seen, writes a rate wherever the steps that are left are equal: a track that was seen twice,
seven frames apart, is stated to run at a seventh of the rate, cut to whole hertz. Without a rate
of its own it counts a frame as a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.clock import check_declared, check_rate, frames_of

_COUNTED = (
    "Times are whole seconds: each is taken as the number of a frame, at {fps:g} frames per "
    "second, as sleap-io has it where the file has no rate."
)

_SAME = 0.05
"""Times of two series nearer than this, in frames, are of one frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """When the samples of a series are.

    Parameters
    ----------
    where
        What it is called in messages.
    start_s
        Time of the first sample, in seconds; NaN without samples.
    n_samples
        How many there are.
    time_s : ndarray of float64, shape (sample,), optional
        Strictly ascending; None where the file has a rate instead.
    rate_hz
        Not negative; 0, as sleap-io cuts slow ones, is no rate. None where each sample has a time.
    by_sleap
        Whether sleap-io wrote it.
    """

    where: str
    start_s: float
    n_samples: int
    time_s: Floats | None
    rate_hz: float | None
    by_sleap: bool

    def is_strided(self, fps: float) -> bool:
        """Whether the rate is that of every second frame or fewer, cut to whole hertz."""
        if self.rate_hz is None or not self.by_sleap:
            return False
        strides = np.arange(2, int(fps) + 2)
        return bool(np.isin(self.rate_hz, np.floor(fps / strides)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Frames:
    """Frames of each series, None for one that is passed over, and what a person should know."""

    of: tuple[Ints | None, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def frames_from(path: Path, clocks: Sequence[Clock], fps: float) -> Frames:
    """Return the frames of the samples of each series.

    Parameters
    ----------
    path
        Named in messages.
    clocks
        All series of the file.
    fps
        The rate that is expected, in hertz.

    Raises
    ------
    InputError
        Series run at another rate or at several, or two samples are in one frame.
    """
    filled = [clock for clock in clocks if clock.n_samples]
    counted = _count_frames(filled, fps)
    file_fps = 1.0 if counted else fps
    placed = [clock for clock in filled if not clock.is_strided(file_fps)]
    if filled and not placed:
        found = max(filled, key=lambda clock: clock.rate_hz or 0.0)
        if found.rate_hz:
            check_declared(path, found.rate_hz, fps)
        raise InputError(
            f"{path}: {found.where}: expected a starting_time with a positive rate, got "
            f"{found.start_s:g} and {found.rate_hz:g}."
        )
    notes = _one_rate(path, placed, file_fps)
    numbered = _counted(placed) if counted else _timed(path, placed, fps)
    frames = dict(zip(map(id, placed), numbered, strict=True))
    nothing = [(id(clock), np.empty(0, dtype=np.int64)) for clock in clocks if not clock.n_samples]
    frames |= dict(nothing)
    of = tuple(frames.get(id(clock)) for clock in clocks)
    start_s = min((clock.start_s for clock in placed), default=0.0)
    if start_s and not counted:
        notes = (*notes, f"Times are counted from the first sample, {start_s:g} s in the file.")
    return Frames(
        of=of,
        notes=(*notes, *_left_out(clocks, of)),
        warnings=(_COUNTED.format(fps=fps),) if counted else (),
    )


def _count_frames(clocks: Sequence[Clock], fps: float) -> bool:
    """Whether sleap-io took a frame for a second: all times are whole, in steps of one."""
    if not clocks or fps < 2 or not all(clock.by_sleap for clock in clocks):
        # Below 2 Hz a rate of 1 Hz may be the right one, cut.
        return False
    if any(clock.rate_hz not in {None, 0.0, 1.0} for clock in clocks):
        return False
    time_s = _seconds(clocks)
    steps_s = np.diff(time_s)
    whole = time_s[0] >= 0 and (time_s == np.rint(time_s)).all()
    return bool(whole and steps_s.size and steps_s.min() == 1)


def _seconds(clocks: Sequence[Clock]) -> Floats:
    """Return all times, ascending; of a series whose rate is nothing, that of its start."""
    times = [
        clock.start_s + np.arange(clock.n_samples if clock.rate_hz else 1)
        if clock.time_s is None
        else clock.time_s
        for clock in clocks
    ]
    return np.unique(np.concatenate(times))


def _one_rate(path: Path, clocks: Sequence[Clock], fps: float) -> tuple[str, ...]:
    """Refuse series that state another rate than is expected, or several."""
    stated = {clock.rate_hz: clock.where for clock in clocks if clock.rate_hz is not None}
    notes = dict.fromkeys(note for rate in stated for note in check_declared(path, rate, fps))
    if len(stated) > 1:
        several = ", ".join(f"{rate:.6g} Hz ({where})" for rate, where in sorted(stated.items()))
        raise InputError(
            f"{path}: expected one rate for all series, got {several}.",
            hint="Import what runs at another rate into a trial of its own.",
        )
    return tuple(notes)


def _counted(clocks: Sequence[Clock]) -> list[Ints]:
    times = (
        clock.start_s + np.arange(clock.n_samples) if clock.time_s is None else clock.time_s
        for clock in clocks
    )
    return [np.rint(time_s).astype(np.int64) for time_s in times]


def _timed(path: Path, clocks: Sequence[Clock], fps: float) -> list[Ints]:
    """Return frames of one clock for all: wavering times are counted from one to the next."""
    if not clocks:
        return []
    starts = np.array([clock.start_s for clock in clocks if clock.time_s is None])
    times = [clock.time_s for clock in clocks if clock.time_s is not None]
    shared = _apart(np.concatenate([starts, *times]), fps)
    frame = frames_of(path, shared, fps)
    found: list[Ints] = []
    for clock in clocks:
        if clock.time_s is None:
            found.append(_at(shared, frame, np.array([clock.start_s])) + np.arange(clock.n_samples))
            continue
        own = _at(shared, frame, clock.time_s)
        if not (np.diff(own) > 0).all():
            raise InputError(
                f"{path}: {clock.where} has two samples in a frame, at {fps:g} frames per second; "
                "expected one."
            )
        if len(starts):
            # The stated rate fits: times that are left out between these are known.
            check_rate(path, clock.time_s, fps=fps, frame=own)
        found.append(own)
    if not len(starts):
        check_rate(path, shared, fps=fps)
    return found


def _apart(time_s: Floats, fps: float) -> Floats:
    """Return times ascending, of those of one instant the first."""
    ascending = np.unique(time_s)
    return ascending[np.diff(ascending, prepend=-np.inf) * fps > _SAME]


def _at(shared: Floats, frame: Ints, time_s: Floats) -> Ints:
    """Return the frames of times that are in ``shared``, or little later."""
    return frame[np.searchsorted(shared, time_s, side="right") - 1]


def _left_out(clocks: Sequence[Clock], of: Sequence[Ints | None]) -> tuple[str, ...]:
    empty = ", ".join(clock.where for clock in clocks if not clock.n_samples)
    rateless = ", ".join(
        f"{clock.where} ({clock.n_samples} samples)"
        for clock, own in zip(clocks, of, strict=True)
        if own is None
    )
    notes = []
    if empty:
        notes.append(f"Without samples: {empty}.")
    if rateless:
        notes.append(f"The stated rate does not give the frames, passed over: {rateless}.")
    return tuple(notes)
