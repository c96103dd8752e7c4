"""Time stamps of images: frames are numbered by them, gaps and duplicates counted.

Nothing is papered over: a frame that is missing is a number that is missing, and a
frame whose stamp does not advance is dropped and counted. Where images come from is
the business of `video`, `sequence` and `live`.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol, final

from zfcal.cameras.frames import Frame, Image
from zfcal.errors import InputError

SAME_RATE = 0.02
"""Two frame rates that differ by no more than this share are called the same."""

_GAIN = 0.15
"""Share of a stamp's deviation by which the expected phase follows it."""

_RATED = 12
"""Stamps from which the rate of a source is taken before anything is tracked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shot:
    """An image as its camera gave it, not numbered yet.

    Parameters
    ----------
    time_s
        The camera's time stamp, in seconds since the start of the trial.
    image : ndarray of uint8, shape (height, width) or (height, width, 3)
    """

    time_s: float
    image: Image


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something of a source that could not be read, and what to do about it.

    Parameters
    ----------
    says
        What, in a sentence that begins with the name of the file.
    hint
        What to do about it.
    end_s
        Images from this second on are none of it; infinite where that is unknown.
    """

    says: str
    hint: str = ""
    end_s: float = math.inf


class Source(Protocol):
    """Where images come from.

    Attributes
    ----------
    name
        For messages: a path or an address.
    is_live
        Whether images come when they come, and never again.
    rate_hz
        What the source states; None where it states nothing.
    length_s
        How long it says it is; None where that is unknown.
    notes
        What is worth knowing of it, such as how images got their times.
    problems
        What could not be read; grows while `shots` is read.
    """

    name: str
    is_live: bool
    rate_hz: float | None
    length_s: float | None
    notes: list[str]
    problems: list[Problem]

    def shots(self) -> Iterator[Shot]:
        """Yield the images in the order in which they were taken."""
        ...


@dataclass(slots=True, kw_only=True)
class Tally:
    """What was counted while frames were numbered.

    Parameters
    ----------
    frames
        Those that were numbered.
    duplicates
        Those dropped, since their stamp was not later than the one before.
    gaps, missing
        How often frames were missing, and how many in all.
    longest_s
        The longest time between two frames.
    """

    frames: int = 0
    duplicates: int = 0
    gaps: int = 0
    missing: int = 0
    longest_s: float = 0.0

    def __str__(self) -> str:
        parts = [f"{self.frames} frames"]
        if self.gaps:
            parts.append(
                f"{self.missing} missing in {self.gaps} gaps (the longest {self.longest_s:.3g} s)"
            )
        if self.duplicates:
            parts.append(f"{self.duplicates} whose time did not advance were dropped")
        return ", ".join(parts)


@final
class FrameClock:
    """Gives frames their numbers: time in frame periods, robust against jitter.

    Each stamp is compared with the one expected from those before, which follow it
    slowly. So neither jitter of a third of a period nor a camera that runs a little
    fast or slow makes a gap where none is.

    Parameters
    ----------
    fps
        Frame rate of the trial, in hertz.
    after
        Number and time of the last frame of a recording that goes on.
    """

    def __init__(self, fps: float, *, after: tuple[int, float] | None = None) -> None:
        self._fps = fps
        self._number, self._time_s = after or (-1, -math.inf)
        self._expected_s = self._time_s
        self.tally = Tally()

    def number(self, time_s: float) -> int | None:
        """Return the number of the frame with a stamp; None for a duplicate.

        Parameters
        ----------
        time_s
            Seconds since the start of the trial.
        """
        if not time_s > self._time_s:
            self.tally.duplicates += 1
            return None
        if self._number < 0:
            self._number = max(0, round(time_s * self._fps))
            self._expected_s = time_s
        else:
            self._advance(time_s)
        self._time_s = time_s
        self.tally.frames += 1
        return self._number

    def _advance(self, time_s: float) -> None:
        steps = max(1, round((time_s - self._expected_s) * self._fps))
        due_s = self._expected_s + steps / self._fps
        self._expected_s = due_s + _GAIN * (time_s - due_s)
        self._number += steps
        if steps > 1:
            self.tally.gaps += 1
            self.tally.missing += steps - 1
            self.tally.longest_s = max(self.tally.longest_s, time_s - self._time_s)


def number_frames(shots: Iterable[Shot], clock: FrameClock) -> Iterator[Frame]:
    """Yield frames with their numbers; duplicates are counted by the clock and dropped."""
    for shot in shots:
        time_s = in_nanoseconds(shot.time_s)
        number = clock.number(time_s)
        if number is not None:
            yield Frame(number=number, time_s=time_s, image=shot.image)


def in_nanoseconds(time_s: float) -> float:
    """Return a time as a file of whole nanoseconds gives it back.

    So that what is tracked live has the very times of its recording.
    """
    time_ns = round(time_s * 1e9)
    return time_ns // 10**9 + time_ns % 10**9 / 1e9


def with_rate(
    shots: Iterable[Shot], *, fps: float, name: str, tolerance: float = SAME_RATE
) -> Iterator[Shot]:
    """Yield the same images, once the rate of the first dozen was found to be the trial's.

    Raises
    ------
    InputError
        It is another one.
    """
    shots = iter(shots)
    first = list(itertools.islice(shots, _RATED))
    steps = [b.time_s - a.time_s for a, b in itertools.pairwise(first)]
    steps = [step for step in steps if step > 0]
    if len(steps) >= 2:
        check_rate(1 / statistics.median(steps), fps=fps, name=name, tolerance=tolerance)
    yield from first
    yield from shots


def check_rate(rate_hz: float, *, fps: float, name: str, tolerance: float = SAME_RATE) -> None:
    """Refuse a source whose frame rate is not the trial's.

    Raises
    ------
    InputError
        They differ by more than the tolerance.
    """
    if not abs(rate_hz / fps - 1) <= tolerance:
        raise InputError(
            f"{name}: has {rate_hz:.4g} frames a second, trial.toml says fps = {fps:g}.",
            hint="Set fps in trial.toml to that of the camera, and dt_s to a whole number of "
            "frames.",
        )
