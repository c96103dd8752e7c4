"""Bodies that lie across each other, fitted to the shades of their blob.

Each body is a midline with a constant bend and a fish's width along it, of its own length,
width and darkness. Where bodies overlap the darkest is seen. Poses are found by damped least
squares (Levenberg 1944, Marquardt 1963), compiled. Who they are is the business of others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])

_PROFILE = np.array([0.12, 0.22, 0.36, 0.56, 0.76, 0.93, 1.0, 0.9, 0.55])
"""Width along the body, from tail to snout, as a share of the greatest."""

_AT = np.linspace(-0.5, 0.5, len(_PROFILE))
_MIDDLE = float((_PROFILE * _AT).sum() / _PROFILE.sum())
_ALONG = _AT - _MIDDLE
_SD = math.sqrt(float((_PROFILE * _ALONG**2).sum() / _PROFILE.sum()))
_MEAN_WIDTH = float(_PROFILE.mean())

_RAMP_PX = 1.6
"""An edge is as wide as this, by the lens and the pixels."""

_SOFT = 0.6
"""Body widths of an edge at first: bodies that are beside theirs still feel where it is."""

_NOISE = 0.15
"""Spread of a pixel's shade about the model's, as a share of a body's."""

_PRIOR_LENGTH, _PRIOR_TURN, _PRIOR_BEND = 0.2, 0.6, 0.6
"""Spread about the expected pose: body lengths, radians, and bend in radians."""

_STEPS = 12
_BEND_MOST = 1.6
_PIXELS = 400.0
"""Pixels that count: more make it no more exact."""


def _kernel(function: F) -> F:
    """Compile a function, and keep it for the next start where there is a place to."""
    try:
        compiled: Any = njit(cache=True, nogil=True)(function)
    except RuntimeError:
        compiled = njit(nogil=True)(function)
    return compiled


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """One animal's body.

    Parameters
    ----------
    length_px, width_px
        From tail to snout, and where it is widest.
    darkness
        Share of the tank's grey that it takes.
    """

    length_px: float
    width_px: float
    darkness: float

    @classmethod
    def of(cls, *, sd_length_px: float, area_px: float, darkness: float) -> Build:
        """Return the body of a silhouette.

        Parameters
        ----------
        sd_length_px
            Four standard deviations along its axis.
        area_px
            Pixels covered.
        darkness
            Where it covers a pixel wholly.
        """
        length = sd_length_px / 4 / _SD
        return cls(length_px=length, width_px=area_px / length / _MEAN_WIDTH, darkness=darkness)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """Poses that explain a blob.

    Parameters
    ----------
    poses : ndarray, shape (body, 4)
        x and y in pixels, direction of the head, and by how much the head is turned against
        the tail, in radians.
    cost
        Half the squared misfit, in standard deviations: minus the log likelihood.
    """

    poses: Floats
    cost: float


def prepare() -> None:
    """Compile, so that the first crossing does not have to wait for it."""
    some, body = np.zeros((1, 3)), Build(length_px=9.0, width_px=3.0, darkness=0.5)
    fit(np.zeros((1, 2)), np.zeros(1), [body], some, some)


def fit(pixels: Floats, shares: Floats, builds: list[Build], due: Floats, start: Floats) -> Fit:
    """Return the poses of bodies that best explain the shades of a blob, near where they are due.

    Parameters
    ----------
    pixels : ndarray, shape (pixel, 2)
        Those of the blob, and some around it.
    shares : ndarray, shape (pixel,)
        By how much each is darker than the empty tank, as a share of that.
    builds
        The bodies.
    due : ndarray, shape (body, 3)
        Where each is expected: x, y, direction.
    start : ndarray, shape (body, 3)
        From where the search begins.
    """
    every = max(1, round(len(pixels) / _PIXELS))
    body = np.array([(b.length_px, b.width_px, b.darkness) for b in builds])
    poses = np.column_stack([start, np.zeros(len(start))])
    some = (pixels[::every], shares[::every], body, due, poses, math.sqrt(every))
    soft = max(_SOFT * body[:, 1].mean(), 2.0 * _RAMP_PX)
    _fit(*some, soft, _STEPS // 2, 3)
    cost = _fit(*some, _RAMP_PX, _STEPS, 4)
    return Fit(poses=poses, cost=cost)


@_kernel
def _cover(  # noqa: PLR0913, PLR0917 - a kernel
    pixels: Floats,
    length: float,
    width: float,
    darkness: float,
    pose: Floats,
    out: Floats,
    ramp: float,
) -> None:
    """Write how dark a body makes each pixel."""
    n = _ALONG.size
    x, y = np.empty(n), np.empty(n)
    reach = 0.5 * width + ramp
    step = length / (n - 1)
    # From the middle both ways; a chord's direction is that of its middle.
    zero = 0
    while _ALONG[zero + 1] <= 0.0:
        zero += 1
    for way in (1, -1):
        at = 0.0
        px, py = pose[0], pose[1]
        k = zero + 1 if way > 0 else zero
        while 0 <= k < n:
            to = _ALONG[k]
            angle = pose[2] + pose[3] * 0.5 * (at + to)
            px += (to - at) * length * math.cos(angle)
            py += (to - at) * length * math.sin(angle)
            x[k], y[k] = px, py
            at = to
            k += way
    far = 0.75 * length + reach
    for p in range(pixels.shape[0]):
        u, v = pixels[p, 0], pixels[p, 1]
        out[p] = 0.0
        if (u - pose[0]) ** 2 + (v - pose[1]) ** 2 > far * far:
            continue
        best = -1e9
        for k in range(n - 1):
            ax, ay = u - x[k], v - y[k]
            bx, by = x[k + 1] - x[k], y[k + 1] - y[k]
            t = (ax * bx + ay * by) / (step * step)
            t = min(max(t, 0.0), 1.0)
            dx, dy = ax - t * bx, ay - t * by
            inside = 0.5 * width * (_PROFILE[k] + t * (_PROFILE[k + 1] - _PROFILE[k])) - math.sqrt(
                dx * dx + dy * dy
            )
            best = max(best, inside)
        out[p] = darkness * min(max(0.5 + best / ramp, 0.0), 1.0)


@_kernel
def _misfit(  # noqa: PLR0913, PLR0917 - a kernel
    shares: Floats, covers: Floats, body: Floats, due: Floats, poses: Floats, noise: float
) -> float:
    """Return half the squared misfit of shades and of poses."""
    total = 0.0
    for p in range(shares.size):
        top = 0.0
        for b in range(covers.shape[0]):
            top = max(top, covers[b, p])
        total += ((shares[p] - top) / noise) ** 2
    for b in range(covers.shape[0]):
        spread = _PRIOR_LENGTH * body[b, 0]
        total += ((poses[b, 0] - due[b, 0]) / spread) ** 2
        total += ((poses[b, 1] - due[b, 1]) / spread) ** 2
        total += (math.sin(0.5 * (poses[b, 2] - due[b, 2])) * 2.0 / _PRIOR_TURN) ** 2
        total += (poses[b, 3] / _PRIOR_BEND) ** 2
    return 0.5 * total


@_kernel
def _fit(  # noqa: PLR0912, PLR0913, PLR0917 - one kernel
    pixels: Floats,
    shares: Floats,
    body: Floats,
    due: Floats,
    poses: Floats,
    coarse: float,
    ramp: float,
    steps: int,
    n_free: int,
) -> float:
    """Move poses, in place, until they fit; return the misfit."""
    n, m = body.shape[0], shares.size
    noise = _NOISE * body[:, 2].mean() / coarse * math.sqrt(2.0)
    covers, moved = np.empty((n, m)), np.empty(m)
    for b in range(n):
        _cover(pixels, body[b, 0], body[b, 1], body[b, 2], poses[b], covers[b], ramp)
    cost = _misfit(shares, covers, body, due, poses, noise)
    slopes = np.zeros((4 * n, m))
    nudge = np.array([0.25, 0.25, 0.03, 0.06])
    damping = 0.1
    trial, trial_covers = poses.copy(), covers.copy()
    for _ in range(steps):
        hess, grad = np.zeros((4 * n, 4 * n)), np.zeros(4 * n)
        for b in range(n):
            for k in range(n_free):
                pose = poses[b].copy()
                pose[k] += nudge[k]
                _cover(pixels, body[b, 0], body[b, 1], body[b, 2], pose, moved, ramp)
                for p in range(m):
                    # Only the darkest is seen.
                    rest = 0.0
                    for c in range(n):
                        if c != b:
                            rest = max(rest, covers[c, p])
                    now, then = max(rest, covers[b, p]), max(rest, moved[p])
                    slopes[4 * b + k, p] = (then - now) / nudge[k] / noise
        for p in range(m):
            top = 0.0
            for b in range(n):
                top = max(top, covers[b, p])
            left = (shares[p] - top) / noise
            for i in range(4 * n):
                s = slopes[i, p]
                if s != 0.0:
                    grad[i] += s * left
                    for j in range(i + 1):
                        hess[i, j] += s * slopes[j, p]
        for b in range(n):
            spread = (_PRIOR_LENGTH * body[b, 0]) ** -2
            for k in range(2):
                hess[4 * b + k, 4 * b + k] += spread
                grad[4 * b + k] -= (poses[b, k] - due[b, k]) * spread
            away = poses[b, 2] - due[b, 2]
            hess[4 * b + 2, 4 * b + 2] += _PRIOR_TURN**-2
            grad[4 * b + 2] -= math.sin(away) * _PRIOR_TURN**-2
            hess[4 * b + 3, 4 * b + 3] += _PRIOR_BEND**-2
            grad[4 * b + 3] -= poses[b, 3] * _PRIOR_BEND**-2
        for i in range(4 * n):
            for j in range(i):
                hess[j, i] = hess[i, j]
        better = False
        gain = 0.0
        for _try in range(6):
            damped = hess.copy()
            for i in range(4 * n):
                damped[i, i] *= 1.0 + damping
            change = np.linalg.solve(damped, grad)
            for b in range(n):
                for k in range(4):
                    trial[b, k] = poses[b, k] + change[4 * b + k]
                trial[b, 3] = min(max(trial[b, 3], -_BEND_MOST), _BEND_MOST)
                _cover(pixels, body[b, 0], body[b, 1], body[b, 2], trial[b], trial_covers[b], ramp)
            fresh = _misfit(shares, trial_covers, body, due, trial, noise)
            if fresh < cost:
                gain = cost - fresh
                cost = fresh
                poses[:] = trial
                covers[:] = trial_covers
                damping *= 0.3
                better = True
                break
            damping *= 6.0
        if not better or gain < 0.02 + 1e-3 * cost:
            break
    return cost
