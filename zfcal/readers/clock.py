"""Does the file run at the frame rate that it should? And the frames of its times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.optimize import isotonic_regression

from zfcal.arrays import Bools, Floats, Ints
from zfcal.errors import InputError

_RATE_TOLERANCE = 0.02
"""Share by which a clock may be off before it is another frame rate."""

_TWO_RATES = 1.2
"""Ratio between parts of a file above which it has two frame rates."""

_BLOCK = 20
_MAX_BLOCKS = 10

_SURE = 0.25
"""Steps that are all nearer to whole frames than this leave no doubt."""

_FAR = 20.0
"""Frames of a gap across which phases are not averaged."""

_WINDOW = 600
"""Rows over which phases are averaged: few enough for a clock's rate to be steady."""

_BESIDE = 1.5
"""Frames by which rows may lie beside their times."""

_BESIDE_WINDOW = 61
"""Rows whose median lies so: a computer that was busy for some rows wrote those late."""

_LEAST = 40
"""Rows that tell a rate; fewer have that of the others."""

_NEAREST_FIRST = np.argsort(np.abs(np.arange(-80, 81)), kind="stable")
_FACTORS = 1 + 5e-4 * np.arange(-80, 81)[_NEAREST_FIRST]
"""Rates that are tried, the expected one first: it holds where nothing tells another."""


def check_rate(path: Path, time_s: Floats, *, fps: float, frame: Ints | None = None) -> None:
    """Refuse a file whose times advance at another rate than ``fps``, or at two rates.

    Gaps and stray rows are left out: a step is regular when it is half to 1.5
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
        regular = (steps > 0.499 * usual) & (steps < 1.5 * usual)
    return float(counts[regular].sum() / steps[regular].sum())


def _compare(path: Path, rate_hz: float, fps: float, *, n_steps: int) -> None:
    # A time is rounded once at either end of a stretch: a short one tells its rate less well.
    tolerance = max(_RATE_TOLERANCE, 0.1 / n_steps)
    if not abs(rate_hz / fps - 1) <= tolerance:
        raise InputError(
            f"{path}: the times advance at {rate_hz:.4g} Hz, expected fps = {fps:.6g} Hz.",
            hint=f"Give --fps {rate_hz:.4g}, the same as in trial.toml, if the file is right.",
        )


def frames_of(path: Path, time_s: Floats, fps: float) -> Ints:
    """Return frame numbers of times that waver, as a computer's clock gives them.

    Where each step is close to whole frames it is rounded. Otherwise the jitter is
    taken out first: a step that is rounded up costs a frame for good, since the short
    one behind it still takes a frame of its own.

    Parameters
    ----------
    path
        Named in the message.
    time_s : ndarray of float64, shape (row,)
        Strictly ascending, a row a frame at most.
    fps
        In hertz.

    Returns
    -------
    ndarray of int64, shape (row,)
        From 0, strictly ascending. A row is off by a frame at most where a frame is lost beside
        it; jitter is averaged out up to a standard deviation of about 0.3 frames. A row too many
        moves those around it by a frame at most.

    Raises
    ------
    InputError
        Rows too many would move others by more than 1.5 frames.

    Notes
    -----
    The share of a frame by which times lie beside the grid of frames is a circular mean over
    some hundred rows: lost frames, which are whole, do not move it. What is left over is rounded
    in one with all other rows, by isotonic regression: a row takes a later place than the one
    before it, and an empty frame is kept where the rows that follow need it.
    """
    steps = np.diff(time_s) * fps
    whole = np.maximum(np.rint(steps), 1.0)
    if (np.abs(steps - whole) < _SURE).all():
        return np.concatenate([[0.0], np.cumsum(whole)]).astype(np.int64)
    stretches = np.split(np.arange(len(time_s)), np.flatnonzero(steps > _FAR) + 1)
    rate = _local_rates(time_s * fps, stretches)
    # Across a gap the rates on both sides count alike.
    at = np.concatenate([[0.0], np.cumsum(steps * (rate[1:] + rate[:-1]) / 2)])
    phase = np.concatenate([_mean_phase(at[rows]) for rows in stretches])
    at -= np.unwrap(phase) / (2 * np.pi)
    row = np.arange(len(at))
    frame = row + np.rint(isotonic_regression(at - row).x).astype(np.int64)
    _check_beside(path, time_s, frame - at, fps=fps)
    return frame - frame[0]


def _check_beside(path: Path, time_s: Floats, beside: Floats, *, fps: float) -> None:
    """Refuse rows that have no frame of their own: those behind them would come ever later."""
    far = np.abs(median_filter(beside, _BESIDE_WINDOW)) > _BESIDE
    if not far.any():
        return
    at = int(np.argmax(far))
    close = np.flatnonzero(np.diff(time_s) * fps < 0.5) + 1
    named = f", first at {time_s[close[0]]:.10g} s" if len(close) else ""
    raise InputError(
        f"{path}: more rows than frames. About {time_s[at]:.6g} s rows lie "
        f"{abs(beside[at]):.1f} frames beside their times; {len(close)} rows come less than half "
        f"a frame after the one before{named}. Expected a row a frame, each "
        f"{1000 / fps:.4g} ms.",
        hint="Remove the rows that stand twice, in the program that made the file.",
    )


def _local_rates(at: Floats, stretches: list[Ints]) -> Floats:
    """Return how fast the grid runs at each row, as a factor of the expected rate.

    It is the factor at which the phases of a window's rows agree best. That of all windows
    together holds for a window as well, unless its own is clearly better.
    """
    parts = [part for rows in stretches for part in _windows(rows)]
    power = np.array([_agreement(at[part]) for part in parts])
    common = int(np.argmax(power.sum(axis=0)))
    best = np.argmax(power, axis=1)
    clear = power.max(axis=1) > 2 * power[:, common]
    rates = _FACTORS[np.where(clear, best, common)]
    return np.repeat(rates, [len(part) for part in parts])


def _windows(rows: Ints) -> list[Ints]:
    return np.array_split(rows, max(round(len(rows) / _WINDOW), 1))


def _agreement(at: Floats) -> Floats:
    """Return the squared length of the sum of phases for each of `_FACTORS`."""
    if len(at) < _LEAST:
        return np.zeros(len(_FACTORS))
    turns = np.exp(2j * np.pi * np.outer(_FACTORS, at - at[0]))
    length: Floats = np.abs(turns.sum(axis=1)) ** 2
    return length


def _mean_phase(at: Floats) -> Floats:
    """Return the circular mean of the phases around each row, in radians."""
    turns = np.exp(2j * np.pi * at)
    real, imaginary = (
        uniform_filter1d(part, _WINDOW, mode="constant") for part in (turns.real, turns.imag)
    )
    phase: Floats = np.arctan2(imaginary, real)
    return phase


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
