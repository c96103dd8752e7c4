r"""Whether a model and measured tracks disagree at all, in whatever way.

Ranks of headings and speeds (`ranks`) are uniform and independent of all that came before
when the model is right. Asked are:

* uniformity, over all steps and in each bin of each context: with scores :math:`p_k` of
  mean 0 and variance 1, :math:`\sum_b \sum_k (\sum_{s \in b} p_k)^2 / n_b` is a chi-square;
* serial correlation: products of an agent's score with its own one to five steps before,
  and with its nearest neighbour's at the same step and one to five before;
* bursts: correlation of all agents' scores within 1, 3, 10 and 30 s;
* pulses at regular times (`pulses`) of the scores' sum over agents;
* what is `rare`: headings that the model hardly expects, and runs of like speeds.

Each is turned into a standard normal number z that is large where the model is wrong, and
the largest of all counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtr

from zfcal.arrays import Floats, Ints
from zfcal.diagnose.chances import LEAST_IN_BIN, by_context, normal_of
from zfcal.diagnose.contexts import contexts, speed_context
from zfcal.diagnose.kernels import product_sums
from zfcal.diagnose.null import UNLIKE, moments_of
from zfcal.diagnose.pulses import pulses
from zfcal.diagnose.ranks import DEGREES, heading_ranks, scores_of, speed_ranks
from zfcal.diagnose.rare import rare_statistics, run_statistics
from zfcal.diagnose.standing import Standing
from zfcal.model.scene import Moves, Scene

LAGS = 5
_BINS = 20
_BURSTS, _PULSES = "bursts", "pulses"
_BURSTS_S = (1.0, 3.0, 10.0, 30.0)
_AXES = ("angle to the x axis", "angle to the y axis")
_PRIOR_WEIGHT, _PRIOR_WEIGHT_SHARP = 10.0, 100.0
"""Replicates that the theory, a spread of one, counts for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Omnibus:
    """Whether a model and measured tracks disagree.

    Parameters
    ----------
    p
        Probability of a largest statistic like this when the model is right, by
        Bonferroni's inequality.
    worst
        The statistic that is largest.
    z
        Its value, in standard deviations of the null.
    statistics
        All of them, likewise.
    """

    p: float
    worst: str
    z: float
    statistics: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Scores:
    """Scores of one order of ranks, and which steps they belong to."""

    name: str
    steps: Moves
    values: Floats
    near: Ints
    contexts: Mapping[str, Ints]

    @property
    def known(self) -> NDArray[np.bool_]:
        return np.asarray(np.isfinite(self.values[:, 0]))


def statistics(standing: Standing, rng: np.random.Generator) -> dict[str, float]:
    """Return the statistics of the omnibus test by name, each standard normal in the null.

    Parameters
    ----------
    standing
        The scene under the model that is doubted.
    rng
        For the ranks within a cell of headings.
    """
    scene = standing.scene
    made: dict[str, float] = {}
    compass: list[Floats] = []
    for scores in _scored(standing, rng):
        if scores.known.sum() < LEAST_IN_BIN:
            continue
        if scores.steps is scene.turns:
            made[f"{scores.name}: uniformity"] = _uniformity(scores)
        for name, bins in scores.contexts.items():
            made[f"{scores.name} by {name}"] = by_context(scores.values, bins)
        made |= dict(_serial(scores, scene))
        made |= dict(_in_time(scores, scene))
        if scores.name in _AXES:
            compass.append(_summed_up(scores, scene)[0])
    if compass:
        made[f"compass: {_PULSES}"] = pulses(np.stack(compass), scene.dt_s).z
    made |= rare_statistics(standing)
    made |= run_statistics(standing, rng)
    return {name: z for name, z in made.items() if math.isfinite(z)}


def _scored(standing: Standing, rng: np.random.Generator) -> Iterator[_Scores]:
    scene, fitted, about = standing.scene, standing.fitted, standing.turns
    turns, moves = scene.turns, scene.moves
    sorted_by = contexts(scene, turns, about)
    sorted_by["own speed"] = speed_context(turns.speed_m_s)
    for name, ranks in heading_ranks(turns, about, standing.probability, rng).items():
        values = scores_of(np.where(fitted.used, ranks, np.nan))
        yield _Scores(name=name, steps=turns, values=values, near=about.near, contexts=sorted_by)
    about = standing.moves
    sorted_by = contexts(scene, moves, about)
    # Speeds are ranked within their zones: that says nothing.
    del sorted_by["zone"]
    ranks = speed_ranks(moves, standing.speed_factor, rng)
    yield _Scores(
        name="speed", steps=moves, values=scores_of(ranks), near=about.near, contexts=sorted_by
    )


def _uniformity(scores: _Scores) -> float:
    ranks = scores.values[scores.known, 0] / math.sqrt(3.0) / 2 + 0.5
    count = np.bincount(np.minimum(ranks * _BINS, _BINS - 1).astype(np.int64), minlength=_BINS)
    expected = len(ranks) / _BINS
    return normal_of(float(((count - expected) ** 2).sum() / expected), _BINS - 1)


def _serial(scores: _Scores, scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield correlations with former scores of one's own and of the nearest neighbour."""
    rows = np.full((len(scene.k) + LAGS, scene.states.shape[2]), -1, dtype=np.int64)
    steps = scores.steps
    rows[steps.at + LAGS, steps.who] = np.arange(len(steps))
    track, near = steps.track, np.maximum(scores.near, 0)
    for lag in range(1, LAGS + 1):
        before = rows[steps.at + LAGS - lag, steps.who]
        before = np.where(track[before] == track, before, -1)
        yield f"{scores.name}, own {lag} before", _products(scores.values, before)
    for lag in range(LAGS + 1):
        other = np.where(scores.near >= 0, rows[steps.at + LAGS - lag, near], -1)
        if lag == 0:
            # Two that are each other's nearest count once.
            mutual = (other >= 0) & (near[other] == steps.who) & (near > steps.who)
            other = np.where(mutual, -1, other)
        yield f"{scores.name}, nearest neighbour's {lag} before", _products(scores.values, other)


def _products(values: Floats, other: Ints) -> float:
    sums = np.zeros(values.shape[1])
    n = product_sums(values, other, sums)
    return normal_of(float((sums**2).sum()) / n, sums.size) if n >= LEAST_IN_BIN else math.nan


def _summed_up(scores: _Scores, scene: Scene, power: int = 1) -> Floats:
    """Return sums of scores, or of their squares, over agents, shape (degree, sample)."""
    known = scores.known
    made = np.zeros((DEGREES, len(scene.k)))
    for row, column in enumerate(scores.values[known].T):
        made[row] = np.bincount(scores.steps.at[known], column**power, len(scene.k))
    return made


def _in_time(scores: _Scores, scene: Scene) -> Iterator[tuple[str, float]]:
    sums, squares = _summed_up(scores, scene), _summed_up(scores, scene, 2)
    for length_s in _BURSTS_S:
        per = max(1, round(length_s / scene.dt_s))
        yield f"{scores.name}: {_BURSTS} of {length_s:g} s", _burst(sums, squares, per)
    for series, which in zip(sums, ("", " of size"), strict=True):
        yield f"{scores.name}: {_PULSES}{which}", pulses(series[None], scene.dt_s).z


def _burst(sums: Floats, squares: Floats, per: int) -> float:
    """Return how far scores of one stretch of time go together: their sum over pairs."""
    starts = np.arange(0, sums.shape[1], per)
    whole = np.add.reduceat(sums, starts, axis=1) ** 2
    own = np.add.reduceat(squares, starts, axis=1)
    pairs = whole - own
    # Every pair's product has mean 0 and variance 1, whatever the others'.
    spread = np.sqrt((pairs**2).sum(axis=1))
    if not (spread > 0).all():
        return math.nan
    return float((pairs.sum(axis=1) / spread).sum() / math.sqrt(DEGREES))


def judge(
    measured: Mapping[str, float],
    nulls: Sequence[Mapping[str, float]] = (),
    *,
    sharp: bool = False,
) -> Omnibus:
    """Return what the statistics come to.

    Parameters
    ----------
    measured
        From `statistics`.
    nulls
        Likewise, of simulations of the fitted model through the same measurement; without
        them the analytic null counts.
    sharp
        Positions are so sharp that the theory holds. Replicates are few, and Student's law for
        few of them asks for one standard deviation more than it.
    """
    n = len(nulls)
    prior = _PRIOR_WEIGHT_SHARP if sharp else _PRIOR_WEIGHT
    made: dict[str, float] = {}
    tails: dict[str, float] = {}
    for name, z in measured.items():
        drawn = np.array([[null[name]] for null in nulls if name in null]).reshape(-1, 1)
        moments = moments_of(drawn, prior)
        centre = float(moments.centre[0])
        spread = math.hypot(float(moments.spread_of_one_more(len(drawn))[0]), UNLIKE * centre)
        made[name] = (z - centre) / spread if n else z
        tails[name] = float(stdtr(moments.df, -made[name])) if n else float(ndtr(-z))
    if not made:
        return Omnibus(p=1.0, worst="", z=math.nan)
    worst = min(tails, key=lambda name: tails[name])
    p = min(1.0, tails[worst] * len(tails))
    return Omnibus(p=p, worst=worst, z=made[worst], statistics=made)
