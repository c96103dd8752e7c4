"""Overhead and below in one frame: what brings the robot of one camera onto that of the other.

Both cameras see the robot drive: overhead as one blob among the fish, below by its LEDs.
Found are how much later the clock below is, and how its positions must be turned and
shifted. Neither the ids of the blobs nor a first guess of the shift are trusted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from scipy.optimize import least_squares

from zfcal.arrays import Bools, Floats, Ints
from zfcal.errors import InputError

_LONGEST_OFFSET_S = 2.0
_LEAST_EXTENT_M = 0.1
_LEAST_TIME_S = 5.0
_LEAST_SHARE = 0.5
"""Of the time below, in which a blob overhead must be where the robot should be."""

_LONGEST_GAP_S = 0.25
"""Positions farther apart in time are not joined by a line."""

_NEAR_M = 0.02
_GATES_M = (0.06, 0.04, 0.03, _NEAR_M)
_SCALE_M = 0.003
_BLOCK_S = 5.0
_CELL_M = 0.015
_N_VOTES = 400
_LEAST_FRAMES = 20
_MIRRORED_SHARE = 0.7
_MM = 1000.0

_OFFSETS_S = np.arange(-20, 21) * 0.1
_ANGLES_RAD = np.deg2rad(np.arange(-60, 60) * 3.0)
_SMALL_RAD = math.radians(13)
_PLAIN_SHARE = 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Spots:
    """Positions over time that one camera saw; several may belong to one instant.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        By the camera's clock, never falling.
    xy_m : ndarray, shape (n, 2)
        In metres of the arena. Rows with NaN are left out.
    """

    time_s: Floats
    xy_m: Floats

    def __post_init__(self) -> None:
        if self.time_s.ndim != 1 or self.xy_m.shape != (len(self.time_s), 2):
            raise InputError(
                f"Spots need shapes (n,) and (n, 2), got {self.time_s.shape} and {self.xy_m.shape}."
            )
        if not np.all(np.diff(self.time_s) >= 0):
            raise InputError("The times of spots must not fall, and must be finite.")

    def known(self) -> Spots:
        """Return those with a position."""
        seen = np.isfinite(self.xy_m).all(axis=1)
        return Spots(time_s=self.time_s[seen], xy_m=self.xy_m[seen])


@dataclass(frozen=True, slots=True, kw_only=True)
class Alignment:
    """How the positions below come onto those overhead.

    Parameters
    ----------
    offset_s
        To be added to times below to have them by the clock overhead.
    angle_rad
        Turn of the positions below, counter-clockwise about the origin.
    shift_m
        What is then added to them.
    share
        Share of the frames, of those in which below saw the robot, that have a blob where
        it should be.
    time_s : ndarray, shape (k,)
        Frames overhead with such a blob.
    blobs_m : ndarray, shape (k, 2)
        That blob.
    below_m : ndarray, shape (k, 2)
        Where below saw the robot then, as it stands.
    held_out_m : ndarray, shape (k, 2)
        Where an alignment by the other half of the blocks of five seconds puts `below_m`,
        less the blob.
    """

    offset_s: float
    angle_rad: float
    shift_m: tuple[float, float]
    share: float
    time_s: Floats
    blobs_m: Floats
    below_m: Floats
    held_out_m: Floats

    @property
    def residual_m(self) -> Floats:
        """Where the positions below come to lie, less the blobs; shape (k, 2)."""
        return self.moved(self.below_m) - self.blobs_m

    @property
    def before_m(self) -> Floats:
        """The same without the turn and the shift; shape (k, 2)."""
        return self.below_m - self.blobs_m

    def moved(self, xy_m: Floats) -> Floats:
        """Return positions below as overhead sees them; shape (..., 2)."""
        return _moved(xy_m, self.angle_rad, np.array(self.shift_m))


def align_spots(overhead: Spots, below: Spots) -> Alignment:
    """Find how the positions of one robot below come onto the blobs overhead.

    Parameters
    ----------
    overhead
        All blobs that the camera overhead saw: fish and robot.
    below
        The robot's positions by its LEDs, at most one an instant.

    Raises
    ------
    InputError
        There is too little to go by: the robot hardly moved, was hardly seen by both
        cameras at the same time, or is not to be found overhead.
    """
    overhead, below = overhead.known(), below.known()
    _check(overhead, below)
    found = _found(overhead, below)
    if not found.share >= _LEAST_SHARE:
        _explain(overhead, below, found.share)
    return found


def time_blocks(time_s: Floats) -> Bools:
    """Return every other block of five seconds: what one half foretells of the other."""
    return np.asarray((time_s // _BLOCK_S).astype(np.int64) % 2 == 0)


def _found(overhead: Spots, below: Spots) -> Alignment:
    frames = _Frames.of(overhead)
    # Cameras that were calibrated are hardly ever far off: that is looked at first.
    for angles_rad in (_ANGLES_RAD[abs(_ANGLES_RAD) < _SMALL_RAD], _ANGLES_RAD):
        values = _voted(frames, below, angles_rad)
        for gate_m in _GATES_M:
            values = _refined(frames, below, values, gate_m)
        found = _alignment(frames, below, values)
        if found.share >= _PLAIN_SHARE:
            break
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _Frames:
    """The blobs overhead by frame: times of frames, and for each blob its frame's number."""

    time_s: Floats
    number: Ints
    blobs_m: Floats

    @classmethod
    def of(cls, spots: Spots) -> _Frames:
        time_s, number = np.unique(spots.time_s, return_inverse=True)
        return cls(time_s=time_s, number=number.astype(np.int64), blobs_m=spots.xy_m)

    def nearest(self, places_m: Floats) -> tuple[Ints, Floats]:
        """Return for each frame the row of the blob nearest to a place, and its distance."""
        away = np.hypot(*(self.blobs_m - places_m[self.number]).T)
        away = np.where(np.isnan(away), np.inf, away)
        order = np.lexsort((away, self.number))
        _, first = np.unique(self.number[order], return_index=True)
        rows = order[first]
        return rows, away[rows]


def _voted(frames: _Frames, below: Spots, angles_rad: Floats) -> Floats:
    """Return offset, angle and shift with which most frames have a blob where it should be.

    For the right offset and angle the vectors from the robot to its own blob are all the
    same, those to fish are not: the fullest cell of their histogram tells, whoever is whom.
    """
    few = np.linspace(0, len(frames.time_s) - 1, min(_N_VOTES, len(frames.time_s))).astype(int)
    chosen = np.isin(frames.number, few)
    blobs, number = frames.blobs_m[chosen], frames.number[chosen]
    middle = below.xy_m.mean(axis=0)
    best = (-1.0, np.zeros(4))
    for offset_s in _OFFSETS_S:
        places = _at(below, frames.time_s - offset_s)[number] - middle
        known = np.isfinite(places[:, 0])
        for angle in angles_rad:
            turned = _turned(places[known], angle)
            votes, shift = _fullest_cell(blobs[known] - turned)
            # Nearer to no turn and no offset, when it is all the same.
            votes -= 1e-3 * (abs(angle) + abs(offset_s))
            if votes > best[0]:
                centre = shift - _turned(middle, angle)
                best = (votes, np.array([offset_s, angle, *centre]))
    return best[1]


def _fullest_cell(vectors: Floats) -> tuple[float, Floats]:
    if not len(vectors):
        return 0.0, np.zeros(2)
    cells = np.floor(vectors / _CELL_M).astype(np.int64)
    low = cells.min(axis=0)
    across, up = (cells - low).T
    n_up = int(up.max()) + 2
    counts = np.bincount(across * n_up + up, minlength=(int(across.max()) + 2) * n_up)
    grid = counts.reshape(-1, n_up)
    # Two by two cells: a cluster may lie on the border of one.
    sums = grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]
    place = np.array(np.unravel_index(int(sums.argmax()), sums.shape))
    return float(sums.max()), (place + low + 1) * _CELL_M


def _refined(frames: _Frames, below: Spots, start: Floats, gate_m: float) -> Floats:
    """Return the alignment by the blobs that lie within a gate of where one puts the robot."""
    rows, _, near = _partners(frames, below, start, gate_m)
    if near.sum() < _LEAST_FRAMES:
        return start
    return _fit(below, frames.time_s[near], frames.blobs_m[rows[near]], start)


def _partners(
    frames: _Frames, below: Spots, values: Floats, gate_m: float
) -> tuple[Ints, Floats, Bools]:
    places = _moved(_at(below, frames.time_s - values[0]), values[1], values[2:])
    rows, away = frames.nearest(places)
    return rows, places, away <= gate_m


def _fit(below: Spots, time_s: Floats, blobs_m: Floats, start: Floats) -> Floats:
    def residuals(values: Floats) -> Floats:
        off = _moved(_at(below, time_s - values[0]), values[1], values[2:]) - blobs_m
        return np.where(np.isfinite(off), off, 0.0).ravel()

    scale = np.array([0.1, 0.1, 0.05, 0.05])
    found = least_squares(
        residuals,
        start,
        loss="soft_l1",
        f_scale=_SCALE_M,
        x_scale=scale,
        bounds=(
            [-_LONGEST_OFFSET_S - 0.5, -np.inf, -np.inf, -np.inf],
            [_LONGEST_OFFSET_S + 0.5, np.inf, np.inf, np.inf],
        ),
    )
    return found.x


def _alignment(frames: _Frames, below: Spots, values: Floats) -> Alignment:
    rows, places, near = _partners(frames, below, values, _NEAR_M)
    n_seen = int(np.isfinite(places[:, 0]).sum())
    if near.sum() < _LEAST_FRAMES:
        near[:] = False
    time_s, blobs_m = frames.time_s[near], frames.blobs_m[rows[near]]
    held_out_m = np.full(blobs_m.shape, np.nan)
    if len(time_s):
        held_out_m = _held_out(below, time_s, blobs_m, values)
    return Alignment(
        offset_s=float(values[0]),
        angle_rad=float((values[1] + math.pi) % (2 * math.pi) - math.pi),
        shift_m=(float(values[2]), float(values[3])),
        share=float(near.sum() / max(n_seen, 1)),
        time_s=time_s,
        blobs_m=blobs_m,
        below_m=_at(below, time_s - values[0]),
        held_out_m=held_out_m,
    )


def _held_out(below: Spots, time_s: Floats, blobs_m: Floats, start: Floats) -> Floats:
    errors = np.full(blobs_m.shape, np.nan)
    even = time_blocks(time_s)
    for half in (even, ~even):
        if half.sum() >= _LEAST_FRAMES and (~half).any():
            values = _fit(below, time_s[half], blobs_m[half], start)
            moved = _moved(_at(below, time_s[~half] - values[0]), values[1], values[2:])
            errors[~half] = moved - blobs_m[~half]
    return errors


def _at(below: Spots, time_s: Floats) -> Floats:
    """Return the robot's place at times, on the line between two sightings; NaN in gaps."""
    places = np.column_stack([np.interp(time_s, below.time_s, below.xy_m[:, i]) for i in (0, 1)])
    after = np.clip(np.searchsorted(below.time_s, time_s), 1, len(below.time_s) - 1)
    gap = below.time_s[after] - below.time_s[after - 1]
    inside = (time_s >= below.time_s[0]) & (time_s <= below.time_s[-1])
    return np.where((inside & (gap <= _LONGEST_GAP_S))[:, None], places, np.nan)


def _turned(xy_m: Floats, angle_rad: float) -> Floats:
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return np.asarray(xy_m @ np.array([[cos, sin], [-sin, cos]]), np.float64)


def _moved(xy_m: Floats, angle_rad: float, shift_m: Floats) -> Floats:
    return _turned(np.asarray(xy_m, np.float64), angle_rad) + shift_m


def _check(overhead: Spots, below: Spots) -> None:
    for spots, name in ((overhead, "overhead"), (below, "below")):
        if len(spots.time_s) < _LEAST_FRAMES:
            raise InputError(
                f"The camera {name} saw something in {len(spots.time_s)} frames only, "
                f"{_LEAST_FRAMES} are needed.",
                hint="Record a minute in which the robot drives all over the tank.",
            )
    together_s = min(overhead.time_s[-1], below.time_s[-1]) - max(
        overhead.time_s[0], below.time_s[0]
    )
    if not together_s >= _LEAST_TIME_S:
        raise InputError(
            f"Both cameras saw the tank together for {max(together_s, 0.0):.1f} s, "
            f"{_LEAST_TIME_S:g} s are needed.",
            hint="Do both recordings show the same minutes, and count from the same start?",
        )
    extent_m = float(np.ptp(below.xy_m, axis=0).max())
    if not extent_m >= _LEAST_EXTENT_M:
        raise InputError(
            f"The robot moved over {extent_m * _MM:.0f} mm, {_LEAST_EXTENT_M * _MM:.0f} mm are "
            "needed to measure a turn.",
            hint="Record a minute in which the robot drives all over the tank.",
        )


def _explain(overhead: Spots, below: Spots, share: float) -> NoReturn:
    mirrored = _found(overhead, Spots(time_s=below.time_s, xy_m=below.xy_m * [-1.0, 1.0]))
    if mirrored.share >= _MIRRORED_SHARE:
        raise InputError(
            "One of the cameras is calibrated mirrored: turned over, the positions below agree "
            f"with those overhead in {mirrored.share:.0%} of the frames.",
            hint="Check the order of the corners or the signs of the points; overhead is seen "
            "from above, below from below (zfcal inspect shows seen_from).",
        )
    raise InputError(
        "The robot that the camera below sees is not among the blobs overhead: at best "
        f"{share:.0%} of its positions have one within {_NEAR_M * _MM:.0f} mm.",
        hint="Do both recordings show the same minutes? Are both cameras calibrated?",
    )
