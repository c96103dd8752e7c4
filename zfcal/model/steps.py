"""Measured tracks as steps of the model: who saw what, and where they went.

A step is one agent at one sample: the state that it decided in, and the
heading that it took. The likelihood of a model asks nothing else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.errors import InputError
from zfcal.model.kernels.compiled import kernel
from zfcal.model.kernels.geometry import Tank, clearance, nearest_wall, zone_of
from zfcal.model.kernels.likelihood import PER_CELL
from zfcal.model.kernels.perception import make_sight, see
from zfcal.model.tank import tank_of
from zfcal.tracks import Samples
from zfcal.units import HEADING_MIN_STEP_M

Floats = NDArray[np.float64]

ANGLES = 64
"""Cells of the integral over headings.

With 256 of them the estimates from half an hour differ by a hundredth of their
standard errors: a von Mises law of kappa 30 is 10 degrees wide, and within a
cell the landing zone is looked up at four places.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Steps with a heading before and after, sorted by sample, then agent.

    Parameters
    ----------
    k : ndarray of int64, shape (step,)
        Sample at which the step starts.
    agent : ndarray of int32, shape (step,)
    zone, landing : ndarray of int64, shape (step,)
        Zone ids at the start and at the end.
    speed_m_s : ndarray, shape (step,)
    heading, taken : ndarray, shape (step, 2)
        Unit vectors: of the last displacement, and of this step.
    along_wall : ndarray, shape (step, 2)
        Unit vector perpendicular to the line to the nearest wall.
    toward : ndarray, shape (step, other, 2)
        Unit vectors to the neighbours' heads (away from them when too near).
    angle_sr : ndarray, shape (step, other)
        Solid angles; 0 for those that are not seen or not there.
    share : ndarray of uint8, shape (step, ANGLES, zone)
        For each cell of headings, how many of its 4 places land in each zone
        at the step's speed.
    """

    k: NDArray[np.int64]
    agent: NDArray[np.int32]
    zone: NDArray[np.int64]
    landing: NDArray[np.int64]
    speed_m_s: Floats
    heading: Floats
    taken: Floats
    along_wall: Floats
    toward: Floats
    angle_sr: Floats
    share: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.k)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Steps:
        """Return the chosen steps."""
        return Steps(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})


def steps_of(samples: Samples, arena: Arena, *, fov_rad: float) -> Steps:
    """Return the usable steps of measured tracks.

    A step needs its agent under one id at three samples in a row, inside the
    tank and none of them a guess, with two displacements of at least 2 mm (a shorter one has no
    heading). What is guessed is seen by the others all the same. A neighbour's heading is that of
    its last displacement of that length; one that never moved is taken to swim straight away.

    Parameters
    ----------
    samples
        Positions on the model's clock; a little outside counts as at the wall.
    fov_rad
        Field of view to each side.
    """
    if samples.xy_m.shape[1] == 0 or len(samples.k) < 3:
        raise InputError(
            f"A likelihood needs agents at three samples in a row, got {len(samples.k)} samples "
            f"of {samples.xy_m.shape[1]} agents."
        )
    xy, _ = arena.settle(samples.xy_m)
    tank = tank_of(arena)
    zone = _zones(np.ascontiguousarray(xy), tank)
    moved = np.diff(xy, axis=0)
    length = np.hypot(moved[..., 0], moved[..., 1])
    heading = _headings(moved, length)
    usable = (length[:-1] >= HEADING_MIN_STEP_M) & (length[1:] >= HEADING_MIN_STEP_M)
    usable &= (zone[1:-1] > 0) & (zone[2:] > 0)
    sure = ~samples.guessed
    usable &= sure[:-2] & sure[1:-1] & sure[2:]
    at, agent = np.nonzero(usable)
    at += 1
    speed = length[at, agent] / samples.dt_s
    cos_fov = -2.0 if fov_rad >= math.pi else math.cos(fov_rad)
    seen = _see(xy, heading, at, agent, cos_fov, tank)
    reach = length[at, agent]
    share = landing_shares(xy[at, agent], reach, tank, len(arena.zones), ANGLES, PER_CELL)
    return Steps(
        k=samples.k[at],
        agent=samples.agent[agent],
        zone=zone[at, agent],
        landing=zone[at + 1, agent],
        speed_m_s=speed,
        heading=heading[at, agent],
        taken=moved[at, agent] / reach[:, None],
        along_wall=seen[2],
        toward=seen[0],
        angle_sr=seen[1],
        share=share,
    )


def _headings(moved: Floats, length: Floats) -> Floats:
    """Return each agent's heading at each sample, carried on while it stays; NaN at first."""
    heading = np.full((len(moved) + 1, *moved.shape[1:]), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.where(
            (length >= HEADING_MIN_STEP_M)[..., None], moved / length[..., None], np.nan
        )
    for k in range(len(moved)):
        heading[k + 1] = np.where(np.isnan(unit[k]), heading[k], unit[k])
    return heading


@kernel
def _zones(xy: Floats, tank: Tank) -> NDArray[np.int64]:
    zones = np.zeros(xy.shape[:2], dtype=np.int64)
    for k in range(xy.shape[0]):
        for i in range(xy.shape[1]):
            if xy[k, i, 0] == xy[k, i, 0]:  # NaN is not itself
                zones[k, i] = zone_of(xy[k, i, 0], xy[k, i, 1], tank)
    return zones


@kernel
def _see(
    xy: Floats,
    heading: Floats,
    at: NDArray[np.int64],
    agent: NDArray[np.int64],
    cos_fov: float,
    tank: Tank,
) -> tuple[Floats, Floats, Floats]:
    """Return directions and solid angles of neighbours, and directions along the wall."""
    n = xy.shape[1]
    toward = np.zeros((at.size, n, 2))
    angle = np.zeros((at.size, n))
    wall = np.zeros((at.size, 2))
    sight = make_sight(n)
    for s in range(at.size):
        k, i = at[s], agent[s]
        x, y = xy[k, i, 0], xy[k, i, 1]
        for j in range(n):
            dx, dy = xy[k, j, 0] - x, xy[k, j, 1] - y
            hx, hy = heading[k, j, 0], heading[k, j, 1]
            if not dx * dx + dy * dy > 0.0:  # itself, missing, or at one place
                dx, dy = 0.0, 0.0
            elif not hx * hx + hy * hy > 0.0:
                away = math.sqrt(dx * dx + dy * dy)
                hx, hy = dx / away, dy / away
            sight.dx_m[j], sight.dy_m[j] = dx, dy
            sight.hx[j], sight.hy[j] = hx, hy
            sight.ahead_m[j] = dx * heading[k, i, 0] + dy * heading[k, i, 1]
        see(sight, cos_fov)
        for j in range(n):
            if sight.angle_sr[j] > 0.0:
                angle[s, j] = sight.angle_sr[j]
                toward[s, j, 0] = sight.dx_m[j] * sight.toward_per_m[j]
                toward[s, j, 1] = sight.dy_m[j] * sight.toward_per_m[j]
        _, wall[s, 0], wall[s, 1] = nearest_wall(x, y, tank)
    return toward, angle, wall


@kernel
def landing_shares(
    xy: Floats, reach: Floats, tank: Tank, n_zones: int, angles: int, per_cell: int
) -> NDArray[np.uint8]:
    """Count the landing zones of each cell; cell g is about the angle 2 pi g / angles."""
    share = np.zeros((len(xy), angles, n_zones), dtype=np.uint8)
    places = angles * per_cell
    ux, uy = np.empty(places), np.empty(places)
    for p in range(places):
        theta = 2.0 * math.pi * ((p + 0.5) / places - 0.5 / angles)
        ux[p], uy[p] = math.cos(theta), math.sin(theta)
    for s in range(len(xy)):
        x, y = xy[s, 0], xy[s, 1]
        if reach[s] < clearance(x, y, tank):  # no border is that near
            share[s, :, zone_of(x, y, tank) - 1] = per_cell
            continue
        until, zone, step = 0, 0, reach[s] * 2.0 * math.pi / places
        for p in range(places):
            if p >= until:
                to_x, to_y = x + reach[s] * ux[p], y + reach[s] * uy[p]
                zone, until = zone_of(to_x, to_y, tank), p + 1
                if zone > 0:  # those after it are in the same zone, as far as it is clear
                    until += int(min(clearance(to_x, to_y, tank) / step, float(places)))
            if zone > 0:
                share[s, p // per_cell, zone - 1] += 1
    return share
