"""Likelihood of speeds with and without an effect on them.

Speeds are measured, not modelled: each zone has its own law. An effect multiplies the
draw by a factor, so the likelihood is that of the draws with the factor divided out,

    log f(v | c) = log f0(v / factor) - log factor

where f0 is a histogram of the zone with the weight of a few draws spread over its bins,
taken from those very draws. Freezing is a chain of two states instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.screening import Screen
from zfcal.model.extended import bounds_of, without_effects
from zfcal.model.packing import pack
from zfcal.parameters import Parameters

Floats = NDArray[np.float64]

_BINS = 20
_SMOOTH = 0.5
_DIFFERENCE = 1e-3
_STEPS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedFit:
    """An effect on speed at its maximum likelihood.

    Parameters
    ----------
    values
        The effect's parameters.
    interval
        95 % interval of the strength.
    gain : ndarray, shape (move,)
        Log likelihood that it adds to each step, in nats.
    """

    values: dict[str, float]
    interval: tuple[float, float]
    gain: Floats


def log_density(speed: Floats, factor: Floats, zone: NDArray[np.int64]) -> Floats:
    """Return the log density of speeds, each zone's law taken from the same draws.

    Parameters
    ----------
    speed, factor : ndarray, shape (step,)
        In m/s, and the effects' factor on the draw.
    zone : ndarray of int64, shape (step,)

    Returns
    -------
    ndarray, shape (step,)
        In nats, per m/s.
    """
    own = speed / factor
    log_p = np.empty_like(own)
    for number in np.unique(zone):
        rows = zone == number
        log_p[rows] = _smooth_log_density(own[rows])
    return log_p - np.log(factor)


def _smooth_log_density(draws: Floats) -> Floats:
    """Return the log of a frequency polygon over equal shares of the draws' range."""
    top = float(np.quantile(draws, 0.999)) * 1.02 + 1e-9
    place = np.minimum(draws / top, 1.0 - 1e-12) * _BINS - 0.5
    low = np.floor(place).astype(np.int64)
    share = place - low
    counts = np.zeros(_BINS)
    np.add.at(counts, np.clip(low, 0, _BINS - 1), 1 - share)
    np.add.at(counts, np.clip(low + 1, 0, _BINS - 1), share)
    density = (counts + _SMOOTH) / (len(draws) + _BINS * _SMOOTH) * _BINS / top
    at = (1 - share) * density[np.clip(low, 0, _BINS - 1)]
    return np.asarray(np.log(at + share * density[np.clip(low + 1, 0, _BINS - 1)]))


def fit_speed(screen: Screen, candidate: Candidate, start: float) -> SpeedFit:
    """Return an effect on speed at its maximum likelihood, its shape as it is.

    Parameters
    ----------
    screen
        The model that it is added to.
    candidate
        The effect, at a shape.
    start
        A strength to start from.
    """
    if candidate.effect.stops:
        return _fit_stops(screen, candidate)
    moves = screen.scene.moves
    before = screen.model_factor
    without = log_density(moves.speed_m_s, before, moves.zone)
    low, high = bounds_of(candidate.name, candidate.effect.strength)

    def log_p(strength: float) -> Floats:
        model = _alone(screen, candidate.values(strength))
        factor = screen.speed_factor(pack([model(candidate.name)], screen.scene.arena))
        return log_density(moves.speed_m_s, before * factor, moves.zone)

    reach = max(3 * abs(start), 0.02 * (high - low))
    found = optimize.minimize_scalar(
        lambda strength: -float(log_p(strength).sum()),
        bounds=(max(low, -reach), min(high, reach)),
        method="bounded",
        options={"xatol": 1e-3 * reach, "maxiter": 25},
    )
    best = float(found.x)
    by = max(0.05 * abs(best), 1e-3 * (high - low))
    middle = float(np.clip(best, low + by, high - by))
    here, up, down = (float(log_p(middle + d * by).sum()) for d in (0, 1, -1))
    curvature = (2 * here - up - down) / by**2
    half = 1.96 / math.sqrt(curvature) if curvature > 0 else math.inf
    return SpeedFit(
        values=candidate.values(best),
        interval=(max(low, best - half), min(high, best + half)),
        gain=log_p(best) - without,
    )


class _alone:  # noqa: N801 - a function of two steps
    """A model with one effect alone."""

    def __init__(self, screen: Screen, values: dict[str, float]) -> None:
        self._base = without_effects(screen.fitted.parameters)
        self._values = values

    def __call__(self, name: str) -> Parameters:
        return replace(self._base, effects={name: self._values})


def _fit_stops(screen: Screen, candidate: Candidate) -> SpeedFit:
    """Return the chain of moving and staying that fits best; beside it draws by zone alone.

    Its chance of staying differs after one step at rest, which may be a short draw, and after
    two, which hardly are.
    """
    now, before = screen.still
    zone, dt_s = screen.scene.moves.zone, screen.scene.dt_s
    gain = np.zeros(len(now))
    stays = float(now[before].mean()) if before.any() else 0.0
    twice = screen.still_for(2)
    again = float(now[twice].mean()) if twice.any() else stays
    once = before & ~twice
    once_more = float(now[once].mean()) if once.any() else stays
    for number in np.unique(zone):
        rows = zone == number
        alike = np.clip(now[rows].mean(), 1e-6, 1 - 1e-6)
        moving = rows & ~before
        stopping = np.clip(now[moving].mean() if moving.any() else alike, 1e-6, 1 - 1e-6)
        chance = np.where(before[rows], np.where(twice[rows], again, once_more), stopping)
        chance = np.clip(chance, 1e-6, 1 - 1e-6)
        gain[rows] = np.where(now[rows], np.log(chance / alike), np.log((1 - chance) / (1 - alike)))
    # What stays without the effect: the share of draws too short to be told from none.
    short = float(now[~before].mean()) if (~before).any() else 0.0
    # One draw that is short is no rest: how long rests last shows in those of two steps.
    held = float(np.clip((again - short) / max(1 - short, 1e-9), 1e-6, 0.999))
    duration_s = -dt_s / math.log(held)
    entries = _entries(now, before, screen)
    rate = entries / max(float((~before).sum()) * dt_s, 1e-9)
    (_, longest) = bounds_of(candidate.name, "duration_s")
    half = 1.96 * rate / math.sqrt(max(entries, 1.0))
    return SpeedFit(
        values=candidate.values(rate) | {"duration_s": float(np.clip(duration_s, 0.1, longest))},
        interval=(max(0.0, rate - half), rate + half),
        gain=gain,
    )


def _entries(now: NDArray[np.bool_], before: NDArray[np.bool_], screen: Screen) -> float:
    """Return how many rests of two steps or more began, beyond those by short draws alone."""
    moves = screen.scene.moves
    order = np.lexsort((moves.at, moves.who))
    starts = now[order] & ~before[order]
    goes_on = np.zeros(len(order), dtype=bool)
    next_one = (np.diff(moves.at[order]) == 1) & (np.diff(moves.who[order]) == 0)
    goes_on[:-1] = next_one & now[order][1:]
    long = float((starts & goes_on).sum())
    short = float(now[~before].mean()) if (~before).any() else 0.0
    return max(0.0, long - short * float(starts.sum()))
