"""Zebrafish in a ring corridor: from the published arrays to a CSV that zfcal imports.

The recordings are those of Papaspyros, Bonnet, Collignon and Mondada 2019, PLoS ONE
14(8) e0220559, as int16 arrays of pixels times ten, y down. idTracker marks positions
that it guessed while fish hid each other; they get a low confidence here, and whoever
imports the file decides about them.

The camera was not always in the same place: the ring's centre is fitted run by run.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from zfcal.artifacts.arenas import ring_document
from zfcal.errors import InputError

FPS = 15.0
M_PER_PX = 1.11 / 1024
"""The authors' scale."""

RADII_M = (0.19, 0.22, 0.26, 0.29)
"""Walls and borders of the zones, as in the arena ``ring``."""

ZONES = ("inner", "middle", "outer")
TOP_SPEED_M_S = 0.40
"""Range of V: beyond 0.20 m/s lie up to 17 % of the fish's steps, beyond 0.40 up to 1.2 %."""

GUESSED = 0.1
"""Confidence of a position that idTracker guessed."""

_DECIPX_MISSING = -32768
_N_SECTORS = 72
_LEAST_POINTS = 100
"""A sector with fewer points does not tell where the walls are."""

_EDGE_QUANTILE = 0.005
_EDGE_SCALE_PX = 2.0
"""Residuals far beyond it hardly count: an edge that nobody came near is no wall."""

_ROUNDS = 4

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RingRun:
    """Positions of one experiment.

    Parameters
    ----------
    xy_px : ndarray, shape (frame, agent, 2)
        y down; NaN where idTracker has nothing.
    guessed : ndarray of bool, shape (frame, agent)
        Where the position is idTracker's guess.
    robot
        The robot's column; None for fish alone.
    """

    xy_px: Floats
    guessed: NDArray[np.bool_]
    robot: int | None

    @property
    def n_fish(self) -> int:
        """Fish in the ring."""
        return self.xy_px.shape[1] - (self.robot is not None)

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return len(self.xy_px) / FPS

    @property
    def guessed_share(self) -> Floats:
        """Share of each column's positions that are guessed, shape (agent,).

        A robot's is far below any fish's: fish hide each other, and it is larger.
        """
        return self.guessed.mean(axis=0)

    def middle_share(self, fit: RingFit) -> Floats:
        """Return the share of its time that each column spends in the zone ``middle``."""
        away_m = (self.xy_px - np.asarray(fit.centre_px)) * M_PER_PX
        radius_m = np.hypot(away_m[..., 0], away_m[..., 1])
        inside = (radius_m >= RADII_M[1]) & (radius_m < RADII_M[2])
        return inside.sum(axis=0) / (~np.isnan(radius_m)).sum(axis=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RingFit:
    """Where the ring lies in the image, from where the fish went.

    Parameters
    ----------
    centre_px
        x and y of its centre, y down.
    inner_m, outer_m
        The radii between which the centres of bodies stay.
    residual_m
        Median distance of the sectors' edges from these two circles.
    """

    centre_px: tuple[float, float]
    inner_m: float
    outer_m: float
    residual_m: float


def read_ring(path: Path) -> RingRun:
    """Read one experiment.

    Parameters
    ----------
    path
        An ``.npz`` with ``pos_decipx`` (int16, shape (frame, agent, 2)), ``estimated``
        (bits packed over frames) and ``robot_index`` (-1 or none for fish alone).

    Raises
    ------
    InputError
        The file holds something else.
    """
    with np.load(path, allow_pickle=False) as archive:
        missing = {"pos_decipx", "estimated"} - set(archive.files)
        if missing:
            raise InputError(
                f"{path}: expected arrays pos_decipx and estimated, got {', '.join(archive.files)}."
            )
        decipx, packed = archive["pos_decipx"], archive["estimated"]
        robot = int(archive["robot_index"]) if "robot_index" in archive.files else -1
    if decipx.ndim != 3 or decipx.shape[2] != 2:
        raise InputError(f"{path}: expected pos_decipx (frame, agent, 2), got {decipx.shape}.")
    xy_px = decipx / 10.0
    xy_px[(decipx == _DECIPX_MISSING).any(axis=2)] = np.nan
    guessed = np.unpackbits(packed, axis=0)[: len(decipx)].astype(np.bool_)
    return RingRun(xy_px=xy_px, guessed=guessed, robot=robot if robot >= 0 else None)


def write_csv(run: RingRun, path: Path) -> None:
    """Write a run as CSV in pixels, a row per agent and frame in which it has a position."""
    frame, agent = np.nonzero(~np.isnan(run.xy_px).any(axis=2))
    columns = {
        "frame": frame,
        "agent": agent,
        "kind": np.where(agent == (-1 if run.robot is None else run.robot), "robot", "fish"),
        "x_px": run.xy_px[frame, agent, 0],
        "y_px": run.xy_px[frame, agent, 1],
        "confidence": np.where(run.guessed[frame, agent], GUESSED, 1.0),
    }
    pd.DataFrame(columns).to_csv(path, index=False)


def fit_ring(run: RingRun) -> RingFit:
    """Find the ring from where bodies were, guesses left out.

    Two circles around one centre are fitted to the inner and outer edges of the
    points in 72 sectors, an edge being the quantile 0.005 or 0.995 of the
    distances from the centre. A sector in which nobody came near the wall pulls
    little (Cauchy loss).

    Raises
    ------
    InputError
        Too few sectors hold enough points.
    """
    xy_px = run.xy_px[~np.isnan(run.xy_px).any(axis=2) & ~run.guessed]
    if len(xy_px) < _LEAST_POINTS:
        raise InputError(f"A ring needs at least {_LEAST_POINTS} points, got {len(xy_px)}.")
    middle_px = (xy_px.min(axis=0) + xy_px.max(axis=0)) / 2
    found = np.array([*middle_px, RADII_M[0] / M_PER_PX, RADII_M[-1] / M_PER_PX])
    residual = np.zeros(0)
    for _ in range(_ROUNDS):
        inner_px, outer_px = _edges(xy_px, found[:2])

        def misfit(ring: Floats, inner: Floats = inner_px, outer: Floats = outer_px) -> Floats:
            inside = np.hypot(*(inner - ring[:2]).T) - ring[2]
            return np.concatenate([inside, np.hypot(*(outer - ring[:2]).T) - ring[3]])

        found = least_squares(misfit, found, loss="cauchy", f_scale=_EDGE_SCALE_PX).x
        residual = misfit(found)
    return RingFit(
        centre_px=(float(found[0]), float(found[1])),
        inner_m=float(found[2]) * M_PER_PX,
        outer_m=float(found[3]) * M_PER_PX,
        residual_m=float(np.median(np.abs(residual))) * M_PER_PX,
    )


def _edges(xy_px: Floats, centre_px: Floats) -> tuple[Floats, Floats]:
    """Return a point on the inner and one on the outer edge of each sector that has enough."""
    away = xy_px - centre_px
    radius, angle = np.hypot(*away.T), np.arctan2(away[:, 1], away[:, 0])
    sector = np.floor(angle / (2 * np.pi) % 1 * _N_SECTORS).astype(np.intp)
    counts = np.bincount(sector, minlength=_N_SECTORS)
    known = np.flatnonzero(counts >= _LEAST_POINTS)
    if len(known) < _N_SECTORS // 4:
        raise InputError(
            f"Only {len(known)} of {_N_SECTORS} sectors of the ring hold {_LEAST_POINTS} points."
        )
    limits = [_EDGE_QUANTILE, 1 - _EDGE_QUANTILE]
    radii = np.array([np.quantile(radius[sector == one], limits) for one in known])
    middle = 2 * np.pi * (known + 0.5) / _N_SECTORS
    along = np.column_stack([np.cos(middle), np.sin(middle)])
    return centre_px + radii[:, :1] * along, centre_px + radii[:, 1:] * along


def ring_arena() -> dict[str, Any]:
    """Return the arena ``ring`` with a range of speeds that holds these fish's."""
    document = ring_document(RADII_M, ZONES)
    document["name"] = "ring"
    document["bins"]["V"] = [0.0, TOP_SPEED_M_S]
    return document
