r"""Statistics of single steps, measured and as the model expects them.

For a statistic :math:`h(\theta, c)` of a heading :math:`\theta` and of the state
:math:`c` in which the step began, a step's residual is

.. math:: r = h(\theta, c) - E_f[h \mid c]

with the model's own one-step density :math:`f`. When the model is right, residuals are
martingale differences: their sum over the root of the sum of their variances is standard
normal, whatever the dependence along a trajectory. This is what integrated step selection
asks of a fitted model (Fortin et al. 2005, Ecology 86: 1320-1330; Avgar et al. 2016,
Methods in Ecology and Evolution 7: 619-630), and used-habitat calibration plots (Fieberg
et al. 2018, Ecography 41: 737-752) are its graphical form.

Which of these stand out, and where, is in `located`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Bools, Floats
from zfcal.diagnose.kernels import (
    BEARING,
    DISTANCE,
    KNOWN,
    POLARISATION,
    QUANTITIES,
    TURN,
    TURN_SIZE,
    heading_moments,
    landing_chances,
)
from zfcal.diagnose.standing import Standing
from zfcal.diagnose.surroundings import Surroundings, signed_angle
from zfcal.model.fitted import Fitted
from zfcal.model.scene import Scene
from zfcal.units import HEADING_MIN_STEP_M

UNITS = {
    "turning": "rad",
    "turn size": "rad",
    "turn size in fast steps": "rad",
    "turn on in the sense of the last turn": "rad",
    "turn toward a nearest neighbour on the left": "rad",
    "turn toward a nearest neighbour on the right": "rad",
    "nearest neighbour's bearing": "rad",
    "nearest neighbour's distance": "m",
    "wall distance": "m",
    "speed": "m/s",
    "speed in the upper left quarter": "m/s",
    "speed in the upper right quarter": "m/s",
    "speed in the lower left quarter": "m/s",
    "speed in the lower right quarter": "m/s",
    "speed in company": "m/s",
    "speed after a fast step": "m/s",
    "speed beside fast neighbours": "m/s",
}
"""Units of the statistics that have one; of the others, cosines, shares and polarisation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """A statistic of single steps.

    Parameters
    ----------
    statistic
        What it is.
    rows : ndarray of bool, shape (step,)
        Steps for which it is defined.
    observed, expected, variance : ndarray, shape (step,)
        As measured, and mean and variance under the model given where everybody was.
    """

    statistic: str
    rows: Bools
    observed: Floats
    expected: Floats
    variance: Floats


def heading_statistics(standing: Standing) -> Iterator[Steps]:
    """Yield what headings show, step by step of the scene's turns."""
    scene, fitted, about = standing.scene, standing.fitted, standing.turns
    turns, probability = scene.turns, standing.probability
    n = len(turns)
    waves, quantities = np.empty((n, 4)), np.empty((n, QUANTITIES, 3))
    reach_m = turns.speed_m_s * scene.dt_s
    heading_moments(
        probability, turns.heading, turns.taken, about.table, reach_m, waves, quantities
    )
    used = fitted.used
    for step in (
        *_of_turns(quantities, about, turns.speed_m_s),
        *_of_directions(waves, turns.taken, about),
        _of_walls(waves, turns.taken, about, reach_m),
        *_of_landings(scene, fitted, probability),
    ):
        keep = step.rows & used
        yield Steps(
            statistic=step.statistic, rows=keep, observed=step.observed,
            expected=step.expected, variance=step.variance,
        )  # fmt: skip


def _of_turns(quantities: Floats, about: Surroundings, speed_m_s: Floats) -> Iterator[Steps]:
    everywhere = np.ones(len(quantities), dtype=bool)
    with_one = about.near >= 0
    side = signed_angle(about.toward_near, about.heading)
    last = signed_angle(about.heading, about.past)
    fast = speed_m_s > np.median(speed_m_s) if len(speed_m_s) else everywhere

    def take(name: str, column: int, rows: Bools, sign: Floats | float = 1.0) -> Steps:
        values = quantities[:, column]
        return Steps(
            statistic=name, rows=rows, observed=sign * values[:, 0],
            expected=sign * values[:, 1], variance=values[:, 2],
        )  # fmt: skip

    yield take("turning", TURN, everywhere)
    yield take("turn size", TURN_SIZE, everywhere)
    yield take("turn size in fast steps", TURN_SIZE, fast)
    yield take("turn on in the sense of the last turn", TURN, last != 0, np.sign(last))
    yield take("turn toward a nearest neighbour on the left", TURN, with_one & (side > 0))
    yield take("turn toward a nearest neighbour on the right", TURN, with_one & (side < 0), -1.0)
    yield take("polarisation", POLARISATION, about.table[:, KNOWN] > 0)
    yield take("nearest neighbour's distance", DISTANCE, with_one)
    yield take("nearest neighbour's bearing", BEARING, with_one)


def _along(name: str, axis: Floats, waves: Floats, taken: Floats, rows: Bools) -> Steps:
    """Return the cosine of the angle between the heading and a direction."""
    x, y = axis[:, 0], axis[:, 1]
    mean = waves[:, 0] * x + waves[:, 1] * y
    square = (x * x + y * y + waves[:, 2] * (x * x - y * y) + waves[:, 3] * 2 * x * y) / 2
    return Steps(
        statistic=name, rows=rows & (x * x + y * y > 0), observed=taken[:, 0] * x + taken[:, 1] * y,
        expected=mean, variance=square - mean * mean,
    )  # fmt: skip


def _of_directions(waves: Floats, taken: Floats, about: Surroundings) -> Iterator[Steps]:
    rows = np.ones(len(taken), dtype=bool)
    east = np.broadcast_to(np.array([1.0, 0.0]), taken.shape)
    for name, axis, where in (
        ("persistence", about.heading, rows),
        ("alignment", about.company_heading, rows),
        ("heading toward the nearest neighbour", about.toward_near, rows),
        ("heading toward the others' middle", about.toward_middle, rows),
        ("heading toward the robot", about.toward_robot, rows),
        ("heading on along the wall", about.along_wall, about.follows),
        ("heading toward the way out", about.toward_exit, rows),
        ("heading along x", east, rows),
        ("heading along y", east[:, ::-1], rows),
    ):
        yield _along(name, axis, waves, taken, where)


def _of_walls(waves: Floats, taken: Floats, about: Surroundings, reach_m: Floats) -> Steps:
    """Return the distance to the wall at the end, as if the nearest wall were straight."""
    away = about.from_wall * reach_m[:, None]
    step = _along("wall distance", away, waves, taken, np.ones(len(taken), dtype=bool))
    return Steps(
        statistic=step.statistic, rows=step.rows, observed=about.wall_m + step.observed,
        expected=about.wall_m + step.expected, variance=step.variance,
    )  # fmt: skip


def _of_landings(scene: Scene, fitted: Fitted, probability: Floats) -> Iterator[Steps]:
    """Yield, for each zone, whether a step led there, for steps that could."""
    turns = scene.turns
    weight = np.ones((len(turns), turns.share.shape[2]))
    for x, own in zip(fitted.x, fitted.turns, strict=True):
        weight[own.rows] = np.exp(x[3:-1])
    chance = landing_chances(probability, turns.share, weight)
    for zone, name in enumerate(scene.arena.zone_names):
        p = np.clip(chance[:, zone], 0.0, 1.0)
        yield Steps(
            statistic=f"going to {name}",
            rows=(p > 0) & (p < 1) & (turns.zone != zone + 1),
            observed=(turns.landing == zone + 1).astype(np.float64),
            expected=p,
            variance=p * (1 - p),
        )


def speed_statistics(standing: Standing) -> Iterator[Steps]:
    """Yield what speeds show, step by step of the scene's moves.

    A step's speed is drawn from what was measured in the zone where it begins, times
    what the model's effects make of it.
    """
    scene, about = standing.scene, standing.moves
    moves = scene.moves
    factor = standing.speed_factor
    still = moves.speed_m_s < HEADING_MIN_STEP_M / scene.dt_s
    speed, v_mean, v_variance = _by_zone(moves.speed_m_s / np.maximum(factor, 1e-6), moves.zone)
    expected, variance = factor * v_mean, factor * factor * v_variance
    observed = factor * speed
    _, still_mean, still_variance = _by_zone(still.astype(np.float64), moves.zone)
    was_still = about.speed_m_s < HEADING_MIN_STEP_M / scene.dt_s
    everywhere = np.ones(len(moves), dtype=bool)
    fast = about.speed_m_s > _median(about.speed_m_s)
    beside = about.pace_m_s > _median(about.pace_m_s)
    for name, rows in (
        ("speed", everywhere),
        ("speed in company", about.company > 0),
        ("speed after a fast step", fast),
        ("speed beside fast neighbours", beside),
    ):
        yield Steps(
            statistic=name, rows=rows, observed=observed, expected=expected, variance=variance
        )
    for name, rows in _quarters(scene, about):
        yield Steps(
            statistic=f"speed in the {name} quarter",
            rows=rows,
            observed=observed,
            expected=expected,
            variance=variance,
        )
    for name, rows in (("stillness", everywhere), ("stillness after stillness", was_still)):
        yield Steps(
            statistic=name, rows=rows, observed=still.astype(np.float64),
            expected=still_mean, variance=still_variance,
        )  # fmt: skip


def _quarters(scene: Scene, about: Surroundings) -> Iterator[tuple[str, Bools]]:
    x0, y0, x1, y1 = scene.arena.outline.bounds
    upper, right = about.y_m > (y0 + y1) / 2, about.x_m > (x0 + x1) / 2
    yield "upper left", upper & ~right
    yield "upper right", upper & right
    yield "lower left", ~upper & ~right
    yield "lower right", ~upper & right


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else np.inf


def _by_zone(values: Floats, zone: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Return the values, and their mean and variance in each one's zone."""
    n = np.maximum(np.bincount(zone), 1)
    mean = np.bincount(zone, values) / n
    square = np.bincount(zone, values**2) / n
    return values, mean[zone], np.maximum(square - mean**2, 0.0)[zone]
