"""The shape of a fish seen from above: a midline that bends, and a width along it.

The position of a body is the centroid of the area of its silhouette, on the plane of
the arena. The tail fin, which light shines through, is no part of the silhouette.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats

FIN_SHARE = 0.16
"""Length of the tail fin, as a share of the whole."""

WIDTH_SHARE = 0.155
"""The body's greatest width, as a share of its length without the fin."""

_STATIONS = np.concatenate([np.linspace(0.0, 0.12, 7)[:-1], np.linspace(0.12, 1.0, 16)])
"""Along the body from the snout (0) to the root of the tail fin (1)."""

# An adult zebrafish from above: blunt snout, widest behind the gills, thin at the tail.
_WIDTH = np.interp(
    _STATIONS,
    [0.0, 0.02, 0.05, 0.10, 0.18, 0.28, 0.40, 0.55, 0.70, 0.85, 1.0],
    [0.16, 0.42, 0.63, 0.80, 0.94, 1.00, 0.95, 0.76, 0.50, 0.30, 0.20],
)
_FIN_STATIONS = np.array([1.0, 1.06, 1.12, 1.0 + FIN_SHARE / (1 - FIN_SHARE)])
_FIN_WIDTH = np.array([0.20, 0.26, 0.30, 0.22])
_WAVES = 0.9
"""Waves of the body's undulation along its length."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies:
    """Bodies at one instant, as they are to be drawn.

    Parameters
    ----------
    xy_m : ndarray, shape (body, 2)
        Centroids of the silhouettes, in metres.
    heading_rad : ndarray, shape (body,)
        Direction of the head.
    length_m : ndarray, shape (body,)
        From snout to tip of the tail fin.
    bend_rad : ndarray, shape (body,)
        Angle by which the direction of the tail lags behind that of the head:
        positive in a turn to the left.
    wave_rad : ndarray, shape (body,)
        Amplitude of the tail's direction in the stroke of swimming.
    phase_rad : ndarray, shape (body,)
        Phase of that stroke.
    contrast : ndarray, shape (body,), optional
        How much darker than the floor each is, as a share of what a body usually is.
    """

    xy_m: Floats
    heading_rad: Floats
    length_m: Floats
    bend_rad: Floats
    wave_rad: Floats
    phase_rad: Floats
    contrast: Floats | None = None

    def __len__(self) -> int:
        return len(self.heading_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlines:
    """Outlines of bodies, in metres, their silhouettes' centroids at their positions.

    Parameters
    ----------
    left_m, right_m : ndarray, shape (body, station, 2)
        The two sides from snout to tail.
    fin_m : ndarray, shape (body, corner, 2)
        The tail fin.
    """

    left_m: Floats
    right_m: Floats
    fin_m: Floats

    @property
    def silhouette_m(self) -> Floats:
        """The outline once round, shape (body, corner, 2)."""
        return np.concatenate([self.left_m, self.right_m[:, ::-1]], axis=1)


def outlines_of(bodies: Bodies) -> Outlines:
    """Return the outlines of bodies.

    Parameters
    ----------
    bodies
        Their positions and postures.

    Returns
    -------
    Outlines
        Moved so that the centroid of each silhouette is the body's position.
    """
    stations = np.concatenate([_STATIONS, _FIN_STATIONS[1:]])
    length_m = (bodies.length_m * (1 - FIN_SHARE))[:, None]
    axis_rad = bodies.heading_rad[:, None] + _posture(bodies, stations)
    along = np.stack([np.cos(axis_rad), np.sin(axis_rad)], axis=-1)
    steps = np.diff(stations)[None, :, None] * (along[:, 1:] + along[:, :-1]) / 2
    midline = np.concatenate([np.zeros_like(along[:, :1]), -np.cumsum(steps, axis=1)], axis=1)
    midline *= length_m[..., None]
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    width = np.concatenate([_WIDTH, _FIN_WIDTH[1:]]) * WIDTH_SHARE / 2
    aside = width[None, :, None] * length_m[..., None] * across
    left, right = midline + aside, midline - aside
    n = len(_STATIONS)
    ring = np.concatenate([left[:, :n], right[:, n - 1 :: -1]], axis=1)
    shift = (bodies.xy_m - centroids(ring))[:, None]
    fin = np.concatenate([left[:, n - 1 :], right[:, : n - 2 : -1]], axis=1)
    return Outlines(left_m=left[:, :n] + shift, right_m=right[:, :n] + shift, fin_m=fin + shift)


def _posture(bodies: Bodies, stations: Floats) -> Floats:
    """Return the direction along the body against the head's, shape (body, station)."""
    lag = -bodies.bend_rad[:, None] * stations**1.5
    stroke = np.sin(2 * np.pi * _WAVES * stations - bodies.phase_rad[:, None])
    return lag + bodies.wave_rad[:, None] * (0.08 + 0.92 * stations**2) * stroke


def centroids(polygons: Floats) -> Floats:
    """Return the centroids of the areas of polygons.

    Parameters
    ----------
    polygons : ndarray, shape (polygon, corner, 2)
        Corners once round.

    Returns
    -------
    ndarray, shape (polygon, 2)
    """
    # About the first corner: products of nearly equal numbers lose digits.
    origin = polygons[:, :1]
    here = polygons - origin
    there = np.roll(here, -1, axis=1)
    cross = here[..., 0] * there[..., 1] - here[..., 1] * there[..., 0]
    weighted = ((here + there) * cross[..., None]).sum(axis=1)
    return origin[:, 0] + weighted / (3 * cross.sum(axis=1))[:, None]
