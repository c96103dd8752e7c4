"""Bodies that lie across each other, fitted to the shades of their blob.

Each body is a midline with a constant bend and a fish's width along it, of its own length,
width and darkness. Where bodies overlap the darkest is seen. Poses are found by damped least
squares (Levenberg 1944, Marquardt 1963), compiled. Who they are is the business of others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.cameras._kernels import kernel
from zfcal.tracking import _beliefs, _kernels
from zfcal.tracking._kernels import summing

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

_NUDGE = np.array([0.25, 0.25, 0.03, 0.06])
"""By how much x, y, direction and bend are moved to see what it changes."""

_STEPS = 12
_BEND_MOST = 1.6
_PIXELS = 400.0
"""Pixels that count: more make it no more exact."""


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
    _kernels.prepare()
    _beliefs.prepare()
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
    # Rows of x and of y, so that a kernel runs along them.
    some = (
        np.ascontiguousarray(pixels[::every].T),
        np.ascontiguousarray(shares[::every]),
        body,
        due,
        poses,
        math.sqrt(every),
    )
    soft = max(_SOFT * body[:, 1].mean(), 2.0 * _RAMP_PX)
    _fit(*some, soft, _STEPS // 2, 3)
    cost = _fit(*some, _RAMP_PX, _STEPS, 4)
    return Fit(poses=poses, cost=cost)


@kernel
def _midline(pose: Floats, length: float, x: Floats, y: Floats) -> None:
    """Write the stations of a body's midline; from its middle both ways, by chords."""
    # A chord's direction is that of its middle.
    zero = 0
    while _ALONG[zero + 1] <= 0.0:
        zero += 1
    for way in (1, -1):
        at = 0.0
        px, py = pose[0], pose[1]
        k = zero + 1 if way > 0 else zero
        while 0 <= k < _ALONG.size:
            to = _ALONG[k]
            angle = pose[2] + pose[3] * 0.5 * (at + to)
            px += (to - at) * length * math.cos(angle)
            py += (to - at) * length * math.sin(angle)
            x[k], y[k] = px, py
            at = to
            k += way


@kernel
def _cover(pixels: Floats, body: Floats, pose: Floats, out: Floats, ramp: float) -> None:
    """Write how dark a body makes each pixel, given as rows of x and of y."""
    n, m = _ALONG.size, pixels.shape[1]
    length, half, darkness = body[0], 0.5 * body[1], body[2]
    x, y = np.empty(n), np.empty(n)
    _midline(pose, length, x, y)
    per_square = ((n - 1) / length) ** 2
    for p in range(m):
        out[p] = -1e9
    # Pixels in the inner loop, and no branch in it: so the compiler takes several at a time.
    for k in range(n - 1):
        x0, y0 = x[k], y[k]
        bx, by = x[k + 1] - x0, y[k + 1] - y0
        wide, wider = half * _PROFILE[k], half * (_PROFILE[k + 1] - _PROFILE[k])
        for p in range(m):
            ax, ay = pixels[0, p] - x0, pixels[1, p] - y0
            t = (ax * bx + ay * by) * per_square
            t = max(t, 0.0)
            t = min(t, 1.0)
            dx, dy = ax - t * bx, ay - t * by
            inside = wide + t * wider - math.sqrt(dx * dx + dy * dy)
            out[p] = max(out[p], inside)
    for p in range(m):
        shade = 0.5 + out[p] / ramp
        shade = max(shade, 0.0)
        out[p] = darkness * min(shade, 1.0)


@kernel
def _darkest(covers: Floats, but: int, out: Floats) -> None:
    """Write the darkest that bodies make each pixel, all but one of them."""
    out[:] = 0.0
    for b in range(covers.shape[0]):
        if b != but:
            for p in range(out.size):
                out[p] = max(out[p], covers[b, p])


@summing
def _product(one: Floats, other: Floats) -> float:
    """Return the sum of products, in the order that is fastest."""
    total = 0.0
    for p in range(one.size):
        total += one[p] * other[p]
    return total


@kernel
def _misfit(left: Floats, body: Floats, due: Floats, poses: Floats) -> float:
    """Return half the squared misfit of shades and of poses."""
    total = _product(left, left)
    for b in range(len(body)):
        spread = _PRIOR_LENGTH * body[b, 0]
        total += ((poses[b, 0] - due[b, 0]) / spread) ** 2
        total += ((poses[b, 1] - due[b, 1]) / spread) ** 2
        total += (math.sin(0.5 * (poses[b, 2] - due[b, 2])) * 2.0 / _PRIOR_TURN) ** 2
        total += (poses[b, 3] / _PRIOR_BEND) ** 2
    return 0.5 * total


@kernel
def _left(shares: Floats, covers: Floats, noise: float, out: Floats) -> None:
    """Write what bodies leave of each pixel's shade, in standard deviations."""
    _darkest(covers, -1, out)
    for p in range(out.size):
        out[p] = (shares[p] - out[p]) / noise


@kernel
def _slopes(  # noqa: PLR0913, PLR0917 - a kernel
    pixels: Floats, body: Floats, poses: Floats, covers: Floats, ramp: float, out: Floats
) -> None:
    """Write by how much each pixel's shade changes with each free number of each body."""
    m = pixels.shape[1]
    n_free = out.shape[0] // len(body)
    rest, moved = np.empty(m), np.empty(m)
    for b in range(len(body)):
        _darkest(covers, b, rest)
        for k in range(n_free):
            pose = poses[b].copy()
            pose[k] += _NUDGE[k]
            _cover(pixels, body[b], pose, moved, ramp)
            for p in range(m):
                # Only the darkest is seen.
                now = max(rest[p], covers[b, p])
                then = max(rest[p], moved[p])
                out[n_free * b + k, p] = (then - now) / _NUDGE[k]


@kernel
def _normal(  # noqa: PLR0913, PLR0917 - a kernel
    slopes: Floats, left: Floats, body: Floats, due: Floats, poses: Floats, noise: float
) -> tuple[Floats, Floats]:
    """Return the matrix and the right side of the normal equations."""
    size = slopes.shape[0]
    n_free = size // len(body)
    hess, grad = np.zeros((size, size)), np.zeros(size)
    for i in range(size):
        grad[i] = _product(slopes[i], left) / noise
        for j in range(i + 1):
            hess[i, j] = hess[j, i] = _product(slopes[i], slopes[j]) / noise**2
    for b in range(len(body)):
        at = n_free * b
        spread = (_PRIOR_LENGTH * body[b, 0]) ** -2
        for k in range(2):
            hess[at + k, at + k] += spread
            grad[at + k] -= (poses[b, k] - due[b, k]) * spread
        hess[at + 2, at + 2] += _PRIOR_TURN**-2
        grad[at + 2] -= math.sin(poses[b, 2] - due[b, 2]) * _PRIOR_TURN**-2
        if n_free > 3:
            hess[at + 3, at + 3] += _PRIOR_BEND**-2
            grad[at + 3] -= poses[b, 3] * _PRIOR_BEND**-2
    return hess, grad


@kernel
def _fit(  # noqa: PLR0913, PLR0917 - a kernel
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
    covers, left = np.empty((n, m)), np.empty(m)
    for b in range(n):
        _cover(pixels, body[b], poses[b], covers[b], ramp)
    _left(shares, covers, noise, left)
    cost = _misfit(left, body, due, poses)
    slopes = np.empty((n_free * n, m))
    damping = 0.1
    trial, trial_covers, trial_left = poses.copy(), covers.copy(), left.copy()
    for _ in range(steps):
        _slopes(pixels, body, poses, covers, ramp, slopes)
        hess, grad = _normal(slopes, left, body, due, poses, noise)
        gain = -1.0
        for _try in range(6):
            damped = hess.copy()
            for i in range(n_free * n):
                damped[i, i] *= 1.0 + damping
            change = np.linalg.solve(damped, grad)
            for b in range(n):
                for k in range(n_free):
                    trial[b, k] = poses[b, k] + change[n_free * b + k]
                trial[b, 3] = min(max(trial[b, 3], -_BEND_MOST), _BEND_MOST)
                _cover(pixels, body[b], trial[b], trial_covers[b], ramp)
            _left(shares, trial_covers, noise, trial_left)
            fresh = _misfit(trial_left, body, due, trial)
            if fresh < cost:
                gain = cost - fresh
                cost = fresh
                poses[:] = trial
                covers[:] = trial_covers
                left[:] = trial_left
                damping *= 0.3
                break
            damping *= 6.0
        if gain < 0.02 + 1e-3 * cost:
            break
    return cost
