"""What the agents of a scene's steps have about them, as the statistics of a diagnosis ask it.

Cues here are plain geometry, whatever a model makes of them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.diagnose.kernels import (
    COMPANY,
    KNOWN,
    MIDDLE_X,
    MIDDLE_Y,
    NEAR,
    NEAR_M,
    NEAR_X,
    NEAR_Y,
    PACE,
    ROBOT_X,
    ROBOT_Y,
    SUM_HX,
    SUM_HY,
    surroundings_of,
)
from zfcal.model.fitted import Fitted
from zfcal.model.kernels.state import (
    FOLLOWS,
    HX,
    HY,
    MOUTH_X,
    MOUTH_Y,
    PAST_HX,
    PAST_HY,
    SPEED,
    TAU_X,
    TAU_Y,
    WALL,
    X,
    Y,
)
from zfcal.model.scene import Moves, Scene

COMPANY_M = 0.10
"""Others as near as that are company: about a body length and a step of 0.2 s each."""

_LEAST = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What the agents of some steps had about them when the step began.

    Unit vectors are (0, 0) where there is nothing to point at.

    Parameters
    ----------
    time_s, x_m, y_m, wall_m : ndarray, shape (step,)
        When and where; distance to the wall.
    table : ndarray, shape (step, SURROUNDINGS)
        Columns as in `zfcal.diagnose.kernels`.
    near : ndarray of int64, shape (step,)
        Column of the nearest other one, -1 without.
    near_m, company, pace_m_s : ndarray, shape (step,)
        Distance to it, infinite without; others within `COMPANY_M`, and their mean
        speed, NaN without.
    speed_m_s : ndarray, shape (step,)
        Speed of the step before.
    heading, past, toward_near, toward_middle, toward_robot : ndarray, shape (step, 2)
        Own heading, that of a step before, and unit vectors to the nearest other one,
        the others' centroid and the nearest robot.
    company_heading, along_wall, from_wall, toward_exit : ndarray, shape (step, 2)
        Mean heading of the company, the wall's direction in the present sense of travel,
        the way from it, and the way out of a room.
    follows : ndarray of bool, shape (step,)
        Whether it is near a wall, or the zone follows walls.
    """

    time_s: Floats
    x_m: Floats
    y_m: Floats
    wall_m: Floats
    table: Floats
    near: NDArray[np.int64]
    near_m: Floats
    company: Floats
    pace_m_s: Floats
    speed_m_s: Floats
    heading: Floats
    past: Floats
    toward_near: Floats
    toward_middle: Floats
    toward_robot: Floats
    company_heading: Floats
    along_wall: Floats
    from_wall: Floats
    toward_exit: Floats
    follows: NDArray[np.bool_]

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Surroundings:
        """Return the chosen steps."""
        return Surroundings(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})


def surroundings(scene: Scene, steps: Moves) -> Surroundings:
    """Return what the agents of some of a scene's steps had about them."""
    table = surroundings_of(scene.states, steps.at, steps.who, COMPANY_M)
    own = scene.states[steps.at, :, steps.who]
    heading, along = own[:, [HX, HY]], own[:, [TAU_X, TAU_Y]]
    sense = np.where((heading * along).sum(axis=1) < 0, -1.0, 1.0)
    company_heading = _unit(table[:, [SUM_HX, SUM_HY]])
    company_heading[table[:, KNOWN] == 0] = 0.0
    return Surroundings(
        time_s=scene.time_s(steps),
        x_m=own[:, X],
        y_m=own[:, Y],
        wall_m=own[:, WALL],
        table=table,
        near=table[:, NEAR].astype(np.int64),
        near_m=table[:, NEAR_M],
        company=table[:, COMPANY],
        pace_m_s=np.where(table[:, COMPANY] > 0, table[:, PACE], np.nan),
        speed_m_s=own[:, SPEED],
        heading=heading,
        past=own[:, [PAST_HX, PAST_HY]],
        toward_near=table[:, [NEAR_X, NEAR_Y]],
        toward_middle=table[:, [MIDDLE_X, MIDDLE_Y]],
        toward_robot=table[:, [ROBOT_X, ROBOT_Y]],
        company_heading=company_heading,
        along_wall=along * sense[:, None],
        # TAU is the way from the wall, turned to the left.
        from_wall=np.stack([along[:, 1], -along[:, 0]], axis=1),
        toward_exit=own[:, [MOUTH_X, MOUTH_Y]],
        follows=(own[:, FOLLOWS] > 0) | (own[:, WALL] < scene.arena.wall_zone_m),
    )


def _unit(vectors: Floats) -> Floats:
    length = np.hypot(vectors[:, 0], vectors[:, 1])
    return np.where((length > _LEAST)[:, None], vectors / np.maximum(length, _LEAST)[:, None], 0.0)


def signed_angle(of: Floats, about: Floats) -> Floats:
    """Return the angle of vectors counted from others, in radians; left is positive.

    0 where either is (0, 0).
    """
    cross = about[:, 0] * of[:, 1] - about[:, 1] * of[:, 0]
    return np.asarray(np.arctan2(cross, (about * of).sum(axis=1)))


def lapse_of(fitted: Fitted) -> Floats:
    """Return the probability of a lapse of each turn, shape (turn,)."""
    lapse = np.zeros(len(fitted.log_p))
    for x, turns in zip(fitted.x, fitted.turns, strict=True):
        lapse[turns.rows] = x[-1]
    return lapse


def probabilities(fitted: Fitted, table: Floats | None = None) -> Floats:
    """Return the probability of each cell of headings, lapses included.

    A lapse is a heading at random among those that land inside.

    Parameters
    ----------
    table : ndarray, shape (turn, cell)
        The second table of `Fitted.tables`, where it is at hand.
    """
    table = fitted.tables()[1] if table is None else table
    inside, lapse = table > 0, lapse_of(fitted)[:, None]
    return np.asarray(
        table * (1 - lapse) + inside * lapse / np.maximum(inside.sum(axis=1, keepdims=True), 1)
    )
