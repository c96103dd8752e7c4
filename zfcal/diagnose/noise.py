r"""How exact the positions of a recording are: noise, quantisation, losses, changes of id.

A model's null has to pass through what the tracker did, so this must be known. Noise is
taken as white: independent between frames, of one standard deviation per coordinate.

Between two steps of the model a simulated agent goes straight, at one speed, so for three
frames :math:`x_0, x_1, x_2` of one step the second difference :math:`x_0 - 2 x_1 + x_2` is
noise alone, of variance :math:`6 \sigma^2`. A real fish also accelerates in between:

.. math:: \langle d_1^2 \rangle = 6 \sigma^2 + A, \quad
          \langle d_2^2 \rangle = 6 \sigma^2 + 16 A

at one and at two frames' distance, for a smooth path, so that
:math:`\sigma^2 = (16 \langle d_1^2 \rangle - \langle d_2^2 \rangle) / 90`. A path is not smooth
at a few frames a second while the fish beats its tail; hence only the quietest stretches
count, each for what it is under noise alone.

Where a recording has no frames between steps, there is only the wall to go by: where agents
are as frequent at every distance from the wall, noise puts some beyond it, to a mean depth of
:math:`\sigma \sqrt{2 \pi} / 4`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.special import gammainc, gammaincinv

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints
from zfcal.tracks import Tracks

_STRETCH_S = 2.0
_QUIET = 0.1
"""Quantile of stretches that counts as quiet."""

_LEAST_STRETCHES = 20
_JUMP = 12.0
"""Times the usual mean square beyond which a stretch holds a change of id, which is no noise."""

_LEAST_BEYOND = 50
_LARGEST_M = 0.02
"""Farther beyond the wall than that is no noise."""

_QUANTUM_SAMPLE = 20_000
_POLYLINE_RATIO = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """What a tracker did to positions.

    Parameters
    ----------
    sd_m
        Standard deviation of each coordinate in each frame, in metres.
    how
        ``stated``, ``straight steps``, ``quiet stretches`` or ``beyond the wall``.
    quantum_m
        Smallest spacing between coordinates; 0 where there is none to be seen.
    missing
        Share of frames in which an agent that had been there was not seen.
    gap_s
        Mean length of such a gap; NaN without one.
    swaps
        Track ids that began while the recording ran: an agent came back under another id.
    """

    sd_m: float
    how: str
    quantum_m: float
    missing: float
    gap_s: float
    swaps: int


def estimate_noise(
    tracks: Tracks,
    *,
    fps: float,
    dt_s: float,
    arena: Arena | None = None,
    stated_m: float | None = None,
) -> Noise | None:
    """Return how exact positions are; None where it cannot be told.

    Parameters
    ----------
    tracks
        At the full frame rate, before any sampling.
    fps
        Frames per second.
    dt_s
        The model's step.
    arena
        For recordings without frames between steps; None to do without.
    stated_m
        Noise that the source states; it counts before any estimate.
    """
    if len(tracks) < 3 or tracks.frame[-1] - tracks.frame[0] < 2:
        return None
    sd_m, how = _level(tracks, fps, max(1, round(fps * dt_s)), arena)
    if stated_m is not None:
        sd_m, how = stated_m, "stated"
    if not math.isfinite(sd_m):
        return None
    missing, gap_s, swaps = _losses(tracks, fps)
    return Noise(
        sd_m=sd_m,
        how=how,
        quantum_m=quantum_of(np.concatenate([tracks.x_m, tracks.y_m])),
        missing=missing,
        gap_s=gap_s,
        swaps=swaps,
    )


def _level(tracks: Tracks, fps: float, per_step: int, arena: Arena | None) -> tuple[float, str]:
    if per_step >= 2:
        found = from_frames(tracks, fps=fps, per_step=per_step)
        if math.isfinite(found[0]):
            return found
    depth = beyond_wall(tracks, arena) if arena is not None else math.nan
    return (depth, "beyond the wall") if math.isfinite(depth) else (math.nan, "unknown")


def from_frames(tracks: Tracks, *, fps: float, per_step: int) -> tuple[float, str]:
    """Return the noise from frames between the model's steps, and from which kind of path.

    Parameters
    ----------
    fps
        Frames per second.
    per_step
        Frames in a step of the model, two or more.

    Returns
    -------
    sd_m : float
        NaN where there are too few frames in a row.
    how : str
    """
    near, frame, track = _second_differences(tracks, 1)
    far, far_frame, far_track = _second_differences(tracks, 2)
    if len(near) < _LEAST_STRETCHES:
        return math.nan, "unknown"
    corner = frame % per_step == 0
    straight = _is_polyline(near, corner)
    stretch = _stretches(frame, track, fps)
    if straight or not len(far):
        kept = ~corner
        return _of_straight(near[kept], stretch[kept]), "straight steps"
    both = _matched(frame, track, far_frame, far_track)
    return _of_smooth(near[both[0]], far[both[1]], stretch[both[0]]), "quiet stretches"


def _second_differences(tracks: Tracks, apart: int) -> tuple[Floats, Ints, NDArray[np.int32]]:
    """Return second differences of x and y, the middle frame, and the track."""
    order = np.lexsort((tracks.frame, tracks.agent))
    frame, agent = tracks.frame[order], tracks.agent[order]
    xy = np.stack([tracks.x_m[order], tracks.y_m[order]], axis=1)
    if len(frame) <= 2 * apart:
        return np.empty((0, 2)), np.empty(0, np.int64), np.empty(0, np.int32)
    a, b, c = slice(0, -2 * apart), slice(apart, -apart), slice(2 * apart, None)
    rows = (agent[a] == agent[c]) & (frame[c] - frame[a] == 2 * apart)
    return (xy[a] - 2 * xy[b] + xy[c])[rows], frame[b][rows], agent[b][rows]


def _is_polyline(near: Floats, corner: NDArray[np.bool_]) -> bool:
    """Tell whether paths bend at the model's steps and nowhere else."""
    size = np.abs(near).mean(axis=1)
    if not corner.any() or corner.all():
        return False
    between = float(np.median(size[~corner]))
    return float(np.median(size[corner])) > _POLYLINE_RATIO * max(between, 1e-12)


def _stretches(frame: Ints, track: NDArray[np.int32], fps: float) -> Ints:
    per = max(3, round(_STRETCH_S * fps))
    return np.unique(np.stack([track.astype(np.int64), frame // per]), axis=1,
                     return_inverse=True)[1].ravel()  # fmt: skip


def _of_straight(differences: Floats, stretch: Ints) -> float:
    """Return the noise from the mean squares of stretches, all but those with a jump."""
    count, mean = _mean_squares((differences**2).sum(axis=1) / 2, stretch)
    mean = mean[count >= np.median(count)]
    if len(mean) < _LEAST_STRETCHES:
        return math.nan
    return math.sqrt(float(mean[mean <= _JUMP * np.median(mean)].mean()) / 6)


def _of_smooth(near: Floats, far: Floats, stretch: Ints) -> float:
    count, first = _mean_squares((near**2).sum(axis=1) / 2, stretch)
    _, second = _mean_squares((far**2).sum(axis=1) / 2, stretch)
    whole = count >= np.median(count)
    if whole.sum() < _LEAST_STRETCHES:
        return math.nan
    first, second = first[whole], second[whole]
    calm = first <= np.quantile(first, _QUIET)
    # Stretches were chosen for small first differences: what that does to noise alone.
    df = 2 * float(np.median(count)) / 1.94
    edge = _chi2_quantile(_QUIET, df)
    shrunk = float(gammainc(df / 2 + 1, edge / 2)) / _QUIET
    most = float(first[calm].mean()) / (6 * shrunk)
    curved = (float(second[calm].mean()) - float(first[calm].mean()) / shrunk) / 15
    return math.sqrt(max(most - max(curved, 0.0) / 6, 0.0))


def _chi2_quantile(share: float, df: float) -> float:
    # As scipy.stats has it, whose import takes longer than all the rest of a tracker's.
    return 2 * float(gammaincinv(df / 2, share))


def _mean_squares(squares: Floats, stretch: Ints) -> tuple[Ints, Floats]:
    count = np.bincount(stretch)
    return count, np.bincount(stretch, squares) / np.maximum(count, 1)


def _matched(
    frame: Ints, track: NDArray[np.int32], far_frame: Ints, far_track: NDArray[np.int32]
) -> tuple[Ints, Ints]:
    """Return rows of both that have the same middle frame and track."""
    span = int(max(frame.max(), far_frame.max())) + 1
    one = track.astype(np.int64) * span + frame
    other = far_track.astype(np.int64) * span + far_frame
    _, rows, far_rows = np.intersect1d(one, other, return_indices=True)
    return rows, far_rows


def beyond_wall(tracks: Tracks, arena: Arena) -> float:
    r"""Return the noise from the depth to which positions lie beyond the wall, in metres.

    With agents as frequent at all distances :math:`w` from a straight wall, positions beyond
    it have a mean depth of
    :math:`\int_0^\infty \int_w^\infty (e - w) \varphi_\sigma(e)\,de\,dw \big/
    \int_0^\infty \Phi(-w/\sigma)\,dw = \sigma \sqrt{2 \pi} / 4`.

    NaN where fewer than 50 lie beyond.
    """
    points = shapely.points(np.stack([tracks.x_m, tracks.y_m], axis=1))
    depth = np.atleast_1d(shapely.distance(arena.outline, points))
    depth = depth[(depth > 0) & (depth < _LARGEST_M)]
    if len(depth) < _LEAST_BEYOND:
        return math.nan
    return float(depth.mean()) * 4 / math.sqrt(2 * math.pi)


def quantum_of(values: Floats) -> float:
    """Return the spacing of coordinates that lie on a grid; 0 where they do not.

    Parameters
    ----------
    values : ndarray, shape (row,)
        In metres.
    """
    some = np.unique(values[:_QUANTUM_SAMPLE])
    gaps = np.diff(some)
    gaps = gaps[gaps > 1e-9]
    if len(gaps) < _LEAST_STRETCHES:
        return 0.0
    least = float(np.quantile(gaps, 0.05))
    multiples = gaps / least
    off = np.abs(multiples - np.rint(multiples))
    return least if float(np.quantile(off, 0.9)) < 0.02 else 0.0


def _losses(tracks: Tracks, fps: float) -> tuple[float, float, int]:
    """Return the share of frames missing, the mean gap in seconds, and new ids."""
    frames = int(tracks.frame[-1] - tracks.frame[0]) + 1
    missing, gaps, swaps = 0, 0, 0
    for kind in np.unique(tracks.kind):
        own = tracks.take(tracks.kind == kind)
        present = np.bincount(own.frame - tracks.frame[0], minlength=frames)
        # An agent more in a hundredth of the frames is a false detection.
        n = int(np.quantile(present, 0.99))
        short = np.maximum(n - present, 0)
        missing += int(short.sum())
        gaps += int(np.maximum(np.diff(short, prepend=0), 0).sum())
        swaps += max(0, len(np.unique(own.agent)) - n)
    agents = missing + len(tracks)
    gap_s = missing / gaps / fps if gaps else math.nan
    return missing / agents, gap_s, swaps
