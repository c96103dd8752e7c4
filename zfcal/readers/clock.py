"""Does the file run at the frame rate that it should? And the frames of its times."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from zfcal.arrays import Bools, Floats, Ints
from zfcal.errors import InputError

_RATE_TOLERANCE = 0.02
"""Share by which a clock may be off before it is another frame rate."""

_TWO_RATES = 1.2
"""Ratio between parts of a file above which it has two frame rates."""

_BLOCK = 20
_MAX_BLOCKS = 10


def check_rate(path: Path, time_s: Floats, *, fps: float, frame: Ints | None = None) -> None:
    """Refuse a file whose times advance at another rate than ``fps``, or at two rates.

    Gaps and stray rows are left out: a step is regular when it is 0.4 to 1.5
    times the median of its neighbourhood, or its length is told by `frame`.

    Parameters
    ----------
    path
        Named in the message.
    time_s : ndarray of float64, shape (frame,)
        Strictly ascending.
    fps
        The rate that is expected, in hertz.
    frame : ndarray of int64, shape (frame,), optional
        Frame numbers of the times, strictly ascending.
    """
    if len(time_s) < 2:
        return
    steps = np.diff(time_s)
    counts = np.ones(len(steps)) if frame is None else np.diff(frame).astype(np.float64)
    blocks = np.array_split(np.arange(len(steps)), min(max(len(steps) // _BLOCK, 1), _MAX_BLOCKS))
    rates = np.array([_rate(steps[b], counts[b], told=frame is not None) for b in blocks])
    other = np.maximum(rates / rates[0], rates[0] / rates) > _TWO_RATES
    if other.any():
        at = int(np.argmax(other))
        raise InputError(
            f"{path}: two frame rates, {rates[0]:.4g} Hz at first and {rates[at]:.4g} Hz from "
            f"about {time_s[blocks[at][0]]:.4g} s on; expected one, fps = {fps:.6g}.",
            hint="Cut the file where the rate changes and import the parts into two trials.",
        )
    _compare(path, _rate(steps, counts, told=frame is not None), fps, n_steps=len(steps))


def _rate(steps: Floats, counts: Floats, *, told: bool) -> float:
    regular: Bools = np.ones(len(steps), dtype=np.bool_)
    if not told:
        # The lower median is a step that occurs: half way between two would suit neither.
        usual = np.partition(steps, (len(steps) - 1) // 2)[(len(steps) - 1) // 2]
        regular = (steps > 0.4 * usual) & (steps < 1.5 * usual)
    return float(counts[regular].sum() / steps[regular].sum())


def _compare(path: Path, rate_hz: float, fps: float, *, n_steps: int) -> None:
    # A time is rounded once at either end of a stretch: a short one tells its rate less well.
    tolerance = max(_RATE_TOLERANCE, 0.1 / n_steps)
    if not abs(rate_hz / fps - 1) <= tolerance:
        raise InputError(
            f"{path}: the times advance at {rate_hz:.4g} Hz, expected fps = {fps:.6g} Hz.",
            hint=f"Give --fps {rate_hz:.4g}, the same as in trial.toml, if the file is right.",
        )


def frames_of(time_s: Floats, fps: float) -> Ints:
    """Return frame numbers: whole frames since the row before, at least one.

    A wall clock wavers: rounding each time by itself would put two rows into one
    frame whenever the times drift past the middle of a frame.

    Parameters
    ----------
    time_s : ndarray of float64, shape (row,)
        Strictly ascending.
    fps
        In hertz.

    Returns
    -------
    ndarray of int64, shape (row,)
        From 0.
    """
    steps = np.maximum(np.rint(np.diff(time_s) * fps), 1).astype(np.int64)
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(steps)])


def check_declared(path: Path, declared_hz: float, fps: float) -> tuple[str, ...]:
    """Refuse a file that states another rate; return a note when it only rounds it.

    Parameters
    ----------
    path
        Named in the message.
    declared_hz
        What the file says. A whole number may stand for a rate less than 1 Hz
        away: several trackers cut the digits off.
    fps
        The rate that is expected, in hertz.
    """
    if not 0 < declared_hz < np.inf:
        return (f"The file states no usable frame rate ({declared_hz!r}).",)
    difference = abs(declared_hz - fps)
    cut_off = float(declared_hz).is_integer() and difference < 1
    if not (difference <= _RATE_TOLERANCE * fps or cut_off):
        raise InputError(
            f"{path}: the file states {declared_hz:.6g} frames per second, expected fps = "
            f"{fps:.6g}.",
            hint="Both must be the rate of the video: correct --fps and trial.toml, or the file.",
        )
    if difference > 1e-6 * fps:
        return (f"The file states {declared_hz:.6g} frames per second, {fps:.6g} is taken.",)
    return ()
