"""Likelihood of speeds with and without an effect on them.

Speeds are measured, not modelled: each zone has its own law. An effect multiplies the
draw by a factor, so the likelihood is that of the draws with the factor divided out,
as far as it differs between draws,

    log f(v | c) = log f0(v / factor) - log factor

where f0 is a histogram of the zone with the weight of a few draws spread over its bins,
taken from those very draws. How strong an effect is, and whether it holds on minutes that it
was not fitted to, is told within fields of the tank (`zfcal.diagnose.fields`), each with a pace
of its own. What it gains beside other effects is told without as well: places are among these.

Freezing is a chain of two states instead: see `zfcal.diagnose.rests`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.fields import is_known, is_within_fields
from zfcal.diagnose.rests import ChainFit, Runs, fit_chain, runs_of
from zfcal.diagnose.screening import Screen
from zfcal.model.extended import bounds_of, without_effects
from zfcal.model.kernels.curves import MORE, has_curve
from zfcal.model.packing import pack
from zfcal.parameters import Parameters

_BINS = 20
_SPARE, _MOST_BINS = 2, 200
"""Bins beyond the fastest speed: draws without a factor may be faster than any speed."""

_SMOOTH = 0.5
_FAST_QUANTILE = 0.995
_DIFFERENCE = 1e-3
_MOST_LOOKS = 150
"""At curves of a strength."""

_RAREST = 1e-6
"""Chance per step below which fish never stop."""


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
        Log likelihood that it adds to each step, in nats: within fields, or across them at the size
        that is most likely there, whichever is more.
    """

    values: dict[str, float]
    interval: tuple[float, float]
    gain: Floats


def log_density(
    speed: Floats,
    factor: Floats,
    zone: NDArray[np.int64],
    learnt: NDArray[np.bool_] | None = None,
    field: NDArray[np.int64] | None = None,
) -> Floats:
    """Return the log density of speeds, each zone's law taken from the same draws.

    Parameters
    ----------
    speed, factor : ndarray, shape (step,)
        In m/s, and the effects' factor on the draw.
    zone : ndarray of int64, shape (step,)
    learnt : ndarray of bool, shape (step,)
        Draws that the laws are taken from; all by default.
    field : ndarray of int64, shape (step,)
        Parts of the zones that each have a pace of their own; none by default.

    Returns
    -------
    ndarray, shape (step,)
        In nats, per m/s.
    """
    known = np.ones(len(speed), dtype=bool) if learnt is None else learnt
    if field is not None and len(field):
        factor = factor * _pace(speed / factor, zone, known, field)
    log_p = np.empty_like(speed)
    for number in np.unique(zone):
        rows = zone == number
        log_p[rows] = _in_zone(speed[rows], factor[rows], known[rows])
    return log_p


def _pace(
    draws: Floats, zone: NDArray[np.int64], known: NDArray[np.bool_], field: NDArray[np.int64]
) -> Floats:
    """Return how much faster fish are in each draw's field than in its zone, by the known draws.

    One draw of the zone's mean is added to each field, which may hold next to nothing.
    """
    usual = draws[known] if known.any() else draws
    tamed = np.where(known, np.minimum(draws, np.quantile(usual, _FAST_QUANTILE)), 0.0)
    means = np.bincount(zone, tamed) / np.maximum(np.bincount(zone, known), 1.0)
    relative = tamed / np.maximum(means, 1e-9)[zone]
    paces = (np.bincount(field, relative) + 1) / (np.bincount(field, known) + 1)
    return np.asarray(paces[field])


def _in_zone(speed: Floats, factor: Floats, known: NDArray[np.bool_]) -> Floats:
    """Return the log density of one zone's speeds, its law that of the known draws.

    A factor on all of them alike says nothing. The bins are those of the speeds, whatever
    the factors: bins that move along fit steps of the law better or worse, and that
    would pose as an effect.
    """
    if not known.any():
        known = np.ones_like(known)
    relative = factor / np.exp(np.log(factor[known]).mean())
    own = speed / relative
    width = _end(speed[known]) / _BINS
    n_bins = int(np.clip(np.ceil(_end(own[known]) / width), _BINS + _SPARE, _MOST_BINS))
    return _polygon(own / width, known, n_bins) - np.log(width * relative)


def _end(draws: Floats) -> float:
    return max(float(np.quantile(draws, 0.999)) * 1.02, 1e-9)


def _polygon(place: Floats, known: NDArray[np.bool_], n_bins: int) -> Floats:
    """Return the log of a frequency polygon over bins of width one."""
    place = np.minimum(place, n_bins * (1.0 - 1e-12)) - 0.5
    low = np.floor(place).astype(np.int64)
    share = place - low
    below, above = np.clip(low, 0, n_bins - 1), np.clip(low + 1, 0, n_bins - 1)
    counts = np.bincount(below[known], weights=1 - share[known], minlength=n_bins)
    counts += np.bincount(above[known], weights=share[known], minlength=n_bins)
    density = (counts + _SMOOTH) / (known.sum() + n_bins * _SMOOTH)
    return np.asarray(np.log((1 - share) * density[below] + share * density[above]))


def fit_speed(
    screen: Screen, candidate: Candidate, start: float, *, bend: bool = False
) -> SpeedFit:
    """Return an effect on speed at its maximum likelihood, its shape as it is.

    Parameters
    ----------
    screen
        The model that it is added to.
    candidate
        The effect, at a shape.
    start
        A strength to start from.
    bend
        Whether its curve is fitted as well, if it has one.
    """
    if candidate.effect.rests:
        return _fit_stops(screen, candidate)
    all_ = np.ones(len(screen.scene.moves), dtype=bool)
    likelihood = _Likelihood.of(screen, candidate, all_)
    if bend and has_curve(candidate.shape):
        likelihood, start = likelihood.bent(start)
        candidate = likelihood.candidate
    low, high = bounds_of(candidate.name, candidate.effect.strength)
    best = likelihood.maximum(start)
    by = max(0.05 * abs(best), 1e-3 * (high - low))
    middle = float(np.clip(best, low + by, high - by))
    here, up, down = (float(likelihood.log_p(middle + d * by).sum()) for d in (0, 1, -1))
    curvature = (2 * here - up - down) / by**2
    half = 1.96 / math.sqrt(curvature) if curvature > 0 else math.inf
    gains = [likelihood.log_p(best) - likelihood.without()]
    if likelihood.field is not None:
        # Beside suspects that say where fish are fast it counts that this one may say so as well.
        across = replace(likelihood, field=None)
        gains.append(across.log_p(across.maximum(best)) - across.without())
    return SpeedFit(
        values=candidate.values(best),
        interval=(max(low, best - half), min(high, best + half)),
        gain=max(gains, key=lambda gain: float(gain.sum())),
    )


def held_out_gain(
    screen: Screen, candidate: Candidate, start: float, learnt: NDArray[np.bool_]
) -> Floats:
    """Return what an effect on speed adds to each step when it is fitted to some of them.

    Parameters
    ----------
    screen
        The model that it is added to.
    candidate
        The effect, at a shape.
    start
        A strength to start from.
    learnt : ndarray of bool, shape (move,)
        Steps that the strength, the laws of the zones and the paces of fields are taken from.

    Returns
    -------
    ndarray, shape (move,)
        In nats; NaN in fields of which too few steps are learnt from.
    """
    if candidate.effect.rests:
        runs = runs_of(screen)
        found = chain_of(runs, candidate, screen.scene.dt_s, learnt)
        return runs.log_chance(found.chain) - runs.log_chance(found.alike)
    likelihood = _Likelihood.of(screen, candidate, learnt)
    if has_curve(candidate.shape):
        likelihood, start = likelihood.bent(start)
    gain = likelihood.log_p(likelihood.maximum(start)) - likelihood.without()
    field = likelihood.field
    return gain if field is None else np.where(is_known(field, learnt), gain, np.nan)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Likelihood:
    """Log densities of a recording's speeds by the strength of an effect."""

    screen: Screen
    candidate: Candidate
    learnt: NDArray[np.bool_]
    field: NDArray[np.int64] | None

    @classmethod
    def of(cls, screen: Screen, candidate: Candidate, learnt: NDArray[np.bool_]) -> _Likelihood:
        """Return them within fields, unless the effect is a place."""
        field = screen.fields if is_within_fields(candidate) else None
        return cls(screen=screen, candidate=candidate, learnt=learnt, field=field)

    def without(self) -> Floats:
        return self._at(self.screen.model_factor)

    def log_p(self, strength: float) -> Floats:
        screen = self.screen
        model = _alone(screen, self.candidate.values(strength))
        factor = screen.speed_factor(pack([model(self.candidate.name)], screen.scene.arena))
        return self._at(screen.model_factor * factor)

    def _at(self, factor: Floats) -> Floats:
        moves = self.screen.scene.moves
        return log_density(moves.speed_m_s, factor, moves.zone, self.learnt, self.field)

    def maximum(self, start: float) -> float:
        """Return the strength that is most likely on the steps that are learnt from."""
        low, high = bounds_of(self.candidate.name, self.candidate.effect.strength)
        reach = max(3 * abs(start), 0.02 * (high - low))
        found = optimize.minimize_scalar(
            lambda strength: -float(self.log_p(strength)[self.learnt].sum()),
            bounds=(max(low, -reach), min(high, reach)),
            method="bounded",
            options={"xatol": 1e-3 * reach, "maxiter": 25},
        )
        return float(found.x)

    def bent(self, start: float) -> tuple[_Likelihood, float]:
        """Return them with the most likely curve, and the strength there (Nelder and Mead 1965)."""
        effect = self.candidate.effect
        keys = (effect.strength, *MORE)
        limits = [bounds_of(effect.name, key) for key in keys]
        first = np.array([start, *(self.candidate.shape[key] for key in MORE)])
        by = np.array([0.05 * (high - low) for low, high in limits])

        def at(x: Floats) -> tuple[_Likelihood, float]:
            strength, *more = map(float, x)
            shape = self.candidate.shape | dict(zip(MORE, more, strict=True))
            return replace(self, candidate=replace(self.candidate, shape=shape)), strength

        def loss(x: Floats) -> float:
            likelihood, strength = at(x)
            return -float(likelihood.log_p(strength)[self.learnt].sum())

        found = optimize.minimize(
            loss,
            first,
            method="Nelder-Mead",
            bounds=limits,
            options={
                "initial_simplex": np.vstack([first, first + np.diag(by)]),
                "maxfev": _MOST_LOOKS,
                "xatol": 0.01 * float(by.max()),
                "fatol": 0.05,
            },
        )
        return at(found.x)


class _alone:  # noqa: N801 - a function of two steps
    """A model with one effect alone."""

    def __init__(self, screen: Screen, values: dict[str, float]) -> None:
        self._base = without_effects(screen.fitted.parameters)
        self._values = values

    def __call__(self, name: str) -> Parameters:
        return replace(self._base, effects={name: self._values})


def _fit_stops(screen: Screen, candidate: Candidate) -> SpeedFit:
    """Return the chain of swimming and resting that fits best; beside it draws by zone alone."""
    runs, dt_s = runs_of(screen), screen.scene.dt_s
    found = chain_of(runs, candidate, dt_s)
    chain, (error, _) = found.chain, found.errors
    rate = -math.log1p(-chain.begins) / dt_s
    # The error of a logit is that of a log, but for what is left of the chance.
    times = math.exp(min(1.96 * error * (1 - chain.begins), 700.0))
    low, high = bounds_of(candidate.name, candidate.effect.strength)
    return SpeedFit(
        values=candidate.values(rate) | {candidate.effect.rests: -dt_s / math.log(chain.stays)},
        interval=(max(low, rate / times), min(high, rate * times)),
        gain=runs.log_chance(chain) - runs.log_chance(found.alike),
    )


def chain_of(
    runs: Runs, candidate: Candidate, dt_s: float, learnt: NDArray[np.bool_] | None = None
) -> ChainFit:
    """Return the chain of swimming and resting that fits a recording's moves best.

    Parameters
    ----------
    runs
        Of the moves.
    candidate
        The effect, whose bounds hold.
    dt_s
        Between samples.
    learnt : ndarray of bool, shape (move,)
        Moves that it is taken from; all by default.
    """
    rows = np.ones(len(runs.now), dtype=bool) if learnt is None else learnt
    effect = candidate.effect
    (_, most), (least_s, most_s) = (
        bounds_of(effect.name, key) for key in (effect.strength, effect.rests)
    )
    begins = (_RAREST, 1 - math.exp(-most * dt_s))
    return fit_chain(
        runs.counts(rows), (begins, (math.exp(-dt_s / least_s), math.exp(-dt_s / most_s)))
    )
