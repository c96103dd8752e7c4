"""How large an agent looks: the solid angle of a flat diamond seen from a head.

Neighbours are worked on all pairs at once, in arrays, since the compiler
turns such loops into vector instructions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel, lean

LENGTH_M = 0.02
WIDTH_M = 0.02
HEIGHT_M = 0.01
REPULSION_M = 0.02
"""Nearer than this a neighbour is swum away from."""

_BACK_M = LENGTH_M / 3.0
_OUT_M = WIDTH_M / 2.0
_UP_M = HEIGHT_M / 2.0
_MOST_M2 = _UP_M * max(LENGTH_M, WIDTH_M) * (1.0 + 1e-9)
_SERIES_LIMIT = 0.1
_NOWHERE_M = 1e-100
_INSIDE = 1e100
"""In place of a tangent: the observer's head is in, or right at, the other's body."""


class Sight(NamedTuple):
    """Who is where and how large; observer i sees agent j at ``i * n + j``.

    Attributes
    ----------
    dx_m, dy_m
        From the observer's head to the other's head, in metres.
    hx, hy
        Unit vector of the other's heading.
    ahead_m
        The offset's component along the observer's heading.
    toward_per_m
        Result: times the offset it is the unit vector toward the other, or
        away from it when it is nearer than 0.02 m.
    angle_sr
        Result: solid angle in steradians; 0 for the agent itself and for what
        is not in its field of view.
    """

    dx_m: Floats
    dy_m: Floats
    hx: Floats
    hy: Floats
    ahead_m: Floats
    toward_per_m: Floats
    angle_sr: Floats


@kernel
def make_sight(n_pairs: int) -> Sight:
    """Return empty sight for so many ordered pairs, an agent and itself included."""
    return Sight(
        np.zeros(n_pairs), np.zeros(n_pairs), np.zeros(n_pairs), np.zeros(n_pairs),
        np.zeros(n_pairs), np.zeros(n_pairs), np.zeros(n_pairs),
    )  # fmt: skip


@inlined
def in_vectors(n_pairs: int) -> int:
    """Return the next multiple of eight: what is left beside whole vectors costs far more."""
    return (n_pairs + 7) // 8 * 8


@inlined
def most_sr(away_m: float) -> float:
    """Return what a body covers at most whose head is farther away than a body length.

    Notes
    -----
    Let m be the point under the top, at distance D, and e the elevation of the
    top: ``tan e = (H / 2) / D``. From outside the pair with the largest
    difference of azimuth spans the whole body, so m lies between the two, at
    turns p and q from them, and ``A = 4 atan(tan(p / 2) tan(e / 2)) + 4
    atan(tan(q / 2) tan(e / 2))`` (areas of right spherical triangles). As
    ``atan x <= x`` and ``tan(x / 2) <= tan(x) / 2`` below a right angle,

        A <= (H / 2) / D * (tan p + tan q).

    Each tangent is an offset across the line of sight over a length along it.
    The offsets add up to no more than the longest diagonal, and the lengths
    are no less than ``d - L``, just as ``D >= d - L / 3``.
    """
    return _MOST_M2 / ((away_m - _BACK_M) * (away_m - LENGTH_M))


@lean
def see(sight: Sight, cos_fov: float) -> None:
    """Write direction and solid angle of every neighbour, as `see_first` does."""
    see_first(sight.dx_m.size, sight, cos_fov)


@lean
def see_first(n_pairs: int, sight: Sight, cos_fov: float) -> None:
    """Write direction and solid angle of the first neighbours.

    Parameters
    ----------
    n_pairs
        So many of them.
    sight
        With the first five arrays filled.
    cos_fov
        Cosine of the field of view to each side; below -1 for all round.

    Notes
    -----
    Among head, tail and the two sides the pair with the largest difference of
    azimuth, with the top and with the bottom, spans two triangles. Their solid
    angles are equal, each ``2 atan(n / d)`` (van Oosterom and Strackee 1983,
    IEEE Transactions on Biomedical Engineering 30), so the body covers
    ``4 atan(n / d)``. Nearly all arguments are small: a series, and the exact
    function for the rest. Two heads at one place do not see each other.
    """
    dx_m, dy_m, hx, hy, out_sr = sight.dx_m, sight.dy_m, sight.hx, sight.hy, sight.angle_sr
    # One array is written in each loop: with more the compiler gives up on vectors.
    for k in range(n_pairs):
        out_sr[k] = math.sqrt(dx_m[k] * dx_m[k] + dy_m[k] * dy_m[k])
    for k in range(n_pairs):
        toward = 1.0 / max(out_sr[k], _NOWHERE_M)
        sight.toward_per_m[k] = toward if out_sr[k] >= REPULSION_M else -toward
    for k in range(n_pairs):
        x1, y1 = dx_m[k], dy_m[k]
        x2, y2 = x1 - LENGTH_M * hx[k], y1 - LENGTH_M * hy[k]
        mx, my = x1 - _BACK_M * hx[k], y1 - _BACK_M * hy[k]
        x3, y3 = mx - _OUT_M * hy[k], my + _OUT_M * hx[k]
        x4, y4 = mx + _OUT_M * hy[k], my - _OUT_M * hx[k]
        n1 = out_sr[k]
        n2 = math.sqrt(x2 * x2 + y2 * y2)
        n3 = math.sqrt(x3 * x3 + y3 * y3)
        n4 = math.sqrt(x4 * x4 + y4 * y4)
        # Cosines times the product of all norms' partner: compare dot * n_c * n_d.
        best = (x1 * x2 + y1 * y2) * n3 * n4
        ax, ay, bx, by, na, nb = x1, y1, x2, y2, n1, n2
        c = (x1 * x3 + y1 * y3) * n2 * n4
        better = c < best
        best = c if better else best
        bx, by, nb = (x3 if better else bx), (y3 if better else by), (n3 if better else nb)
        c = (x1 * x4 + y1 * y4) * n2 * n3
        better = c < best
        best = c if better else best
        bx, by, nb = (x4 if better else bx), (y4 if better else by), (n4 if better else nb)
        c = (x2 * x3 + y2 * y3) * n1 * n4
        better = c < best
        best = c if better else best
        ax, ay, na = (x2 if better else ax), (y2 if better else ay), (n2 if better else na)
        bx, by, nb = (x3 if better else bx), (y3 if better else by), (n3 if better else nb)
        c = (x2 * x4 + y2 * y4) * n1 * n3
        better = c < best
        best = c if better else best
        ax, ay, na = (x2 if better else ax), (y2 if better else ay), (n2 if better else na)
        bx, by, nb = (x4 if better else bx), (y4 if better else by), (n4 if better else nb)
        c = (x3 * x4 + y3 * y4) * n1 * n2
        better = c < best
        ax, ay, na = (x3 if better else ax), (y3 if better else ay), (n3 if better else na)
        bx, by, nb = (x4 if better else bx), (y4 if better else by), (n4 if better else nb)
        nt = math.sqrt(mx * mx + my * my + _UP_M * _UP_M)
        above = _UP_M * abs(ax * by - ay * bx)
        below = (
            na * nt * nb
            + (ax * mx + ay * my) * nb
            + (ax * bx + ay * by) * nt
            + (mx * bx + my * by) * na
        )
        q = above / below if below > 0.0 else _INSIDE
        s = q * q
        series = q * (
            1.0
            - s * (1 / 3 - s * (1 / 5 - s * (1 / 7 - s * (1 / 9 - s * (1 / 11 - s * (1 / 13))))))
        )
        # A negative value asks for the arc tangent below.
        angle = 4.0 * series if q < _SERIES_LIMIT else -q
        out_sr[k] = angle if (sight.ahead_m[k] >= n1 * cos_fov) & (n1 > 0.0) else 0.0
    for k in range(n_pairs):
        if out_sr[k] == -_INSIDE:
            out_sr[k] = _solid_angle_exact(dx_m[k], dy_m[k], hx[k], hy[k])
        elif out_sr[k] < 0.0:
            out_sr[k] = 4.0 * math.atan(-out_sr[k])


@inlined
def _cosine(a: tuple[float, float], b: tuple[float, float]) -> float:
    norms = math.sqrt((a[0] * a[0] + a[1] * a[1]) * (b[0] * b[0] + b[1] * b[1]))
    return (a[0] * b[0] + a[1] * b[1]) / norms


@kernel
def _solid_angle_exact(dx_m: float, dy_m: float, hx: float, hy: float) -> float:
    """Return the solid angle of one neighbour by the arc tangent itself."""
    mx, my = dx_m - _BACK_M * hx, dy_m - _BACK_M * hy
    head = (dx_m, dy_m)
    tail = (dx_m - LENGTH_M * hx, dy_m - LENGTH_M * hy)
    left = (mx - _OUT_M * hy, my + _OUT_M * hx)
    right = (mx + _OUT_M * hy, my - _OUT_M * hx)
    best, a, b = 2.0, head, tail
    for c, d in (
        (head, tail), (head, left), (head, right), (tail, left), (tail, right), (left, right),
    ):  # fmt: skip
        cosine = _cosine(c, d)
        if cosine < best:
            best, a, b = cosine, c, d
    na, nb = math.sqrt(a[0] ** 2 + a[1] ** 2), math.sqrt(b[0] ** 2 + b[1] ** 2)
    nt = math.sqrt(mx * mx + my * my + _UP_M * _UP_M)
    above = _UP_M * abs(a[0] * b[1] - a[1] * b[0])
    below = (
        na * nt * nb
        + (a[0] * mx + a[1] * my) * nb
        + (a[0] * b[0] + a[1] * b[1]) * nt
        + (mx * b[0] + my * b[1]) * na
    )
    return 4.0 * math.atan2(above, below)
