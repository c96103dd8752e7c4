"""How far a model is from held-out minutes, before and after effects were added.

``closed = (before - after) / (before - floor)``: 0 for a model that is no better than the
one without the effects, 1 for one that is as near to the data as to its own simulations.
Intervals come from drawing the held-out minutes anew, with replacement (Efron 1979, Annals
of Statistics 7: 1-26); the models stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.scores import FeatureScores, Scores, population_scores
from zfcal.behaviour.statistics import Statistics
from zfcal.diagnose.findings import Gap
from zfcal.diagnose.heldout import Gains, Steps
from zfcal.model.simulate import Counts
from zfcal.stages.extend.halves import Halves

N_DRAWS = 1000
_SIDES = (2.5, 97.5)
_HAS_GAP = 0.975
_LEAST_Z = 2.0
"""Standard errors; half the square is the gain in nats. Less cannot be told from nothing."""

FEATURES = ("D", "W", "O", "T")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Draws:
    """How often each held-out minute is drawn.

    Parameters
    ----------
    blocks : ndarray of int, shape (block,)
        Which minutes are held out.
    weights : ndarray, shape (1 + draw, block)
        The first row is one each: what was measured.
    """

    blocks: NDArray[np.intp]
    weights: Floats

    def sums(self, by_block: Floats) -> Floats:
        """Return sums over the drawn minutes, shape (1 + draw,)."""
        return np.asarray(self.weights @ by_block[self.blocks])


def draw_blocks(halves: Halves, random: np.random.Generator, n: int = N_DRAWS) -> Draws:
    """Return the held-out minutes as they are, and drawn anew n times."""
    blocks = np.flatnonzero(halves.held_out)
    size = len(blocks)
    drawn = random.multinomial(size, np.full(size, 1 / size), size=n)
    return Draws(blocks=blocks, weights=np.vstack([np.ones(size), drawn]).astype(np.float64))


def make_gap(
    measure: str,
    values: tuple[Floats, Floats],
    floor: Floats,
    placebo: Floats,
    *,
    is_gap: bool = True,
) -> Gap:
    """Return an entry of a gap.

    Parameters
    ----------
    measure
        Its name.
    values : tuple of ndarray, shape (1 + draw,)
        Before and after, as measured, and as drawn anew; NaN where there is none.
    floor, placebo : ndarray, shape (1 + draw,)
        Where 2.5 % of the draws or more leave no gap to the floor, there may be none to be
        closed: the share is NaN then.
    is_gap
        Whether what lies between before and floor, as measured, is more than nothing.
    """
    side, (before, after) = -1.0 if measure == "effect" else 1.0, values
    closed = shares(before, after, floor, side)
    if not (is_gap and (closed[1:] == closed[1:]).mean() >= _HAS_GAP):
        closed, placebo = np.full_like(closed, np.nan), np.full_like(closed, np.nan)
    return Gap(
        measure=measure,
        before=float(before[0]),
        after=float(after[0]),
        floor=float(floor[0]),
        closed=float(closed[0]),
        interval=_interval(closed[1:]),
        placebo=float(shares(before, placebo, floor, side)[0]),
    )


def shares(before: Floats, after: Floats, floor: Floats, side: float) -> Floats:
    """Return the share of each gap that is closed; NaN where there is no gap.

    Parameters
    ----------
    before, after, floor : ndarray, shape (draw,)
    side
        1 where more is better, -1 where less is.
    """
    gap = side * (floor - before)
    open_ = gap > 1e-12 * np.maximum(1.0, np.abs(before))
    return np.where(open_, side * (after - before) / np.where(open_, gap, 1.0), np.nan)


def _interval(closed: Floats) -> tuple[float, float]:
    known = closed[~np.isnan(closed)]
    if not known.size:
        return math.nan, math.nan
    low, high = np.percentile(known, _SIDES)
    return float(low), float(high)


def likelihood_gap(
    halves: Halves, draws: Draws, gains: Sequence[Gains], placebo: Sequence[Gains]
) -> Gap:
    """Return the gap in log likelihood per step, in nats.

    Parameters
    ----------
    halves, draws
        The held-out minutes.
    gains
        Of headings, and of speeds where an effect changes these.
    placebo
        Likewise; empty without one.
    """
    before, gain, expected = (
        _sum([_mean(halves, draws, getattr(each, part)) for each in gains])
        for part in ("base", "gain", "expected")
    )
    wrong = np.full(len(before), np.nan)
    if placebo:
        wrong = _sum([_mean(halves, draws, each.gain) for each in placebo])
    nats = float(_sum([_sums(halves, draws, each.expected)[0] for each in gains])[0])
    return make_gap(
        "nats_per_step",
        (before, before + gain),
        before + expected,
        before + wrong,
        is_gap=nats >= _LEAST_Z**2 / 2,
    )


def _sum(parts: Sequence[Floats]) -> Floats:
    return np.asarray(np.sum(parts, axis=0))


def _mean(halves: Halves, draws: Draws, steps: Steps) -> Floats:
    sums, counts = _sums(halves, draws, steps)
    return sums / np.maximum(counts, 1.0)


def _sums(halves: Halves, draws: Draws, steps: Steps) -> tuple[Floats, Floats]:
    sums, counts = steps.by_block(halves.block, len(halves.learnt))
    return draws.sums(sums), draws.sums(counts)


def effect_gap(halves: Halves, draws: Draws, statistics: tuple[Steps, Steps, Steps | None]) -> Gap:
    """Return the gap in an effect's own statistic: size of z over the root of the steps.

    Its floor is the mean size of a standard normal.

    Parameters
    ----------
    halves, draws
        The held-out minutes.
    statistics
        In the models without the effect, with it, and with the placebo.
    """
    none = np.full(len(draws.weights), np.nan)
    values = [none if each is None else _size(halves, draws, each) for each in statistics]
    before = statistics[0]
    _, counts = before.by_block(halves.block, len(halves.learnt))
    floor = math.sqrt(2 / math.pi) / np.sqrt(np.maximum(draws.sums(counts), 1.0))
    z = float(values[0][0] * math.sqrt(draws.sums(counts)[0]))
    pair = (values[0], values[1])
    return make_gap("effect", pair, floor, values[2], is_gap=z >= _LEAST_Z)


def _size(halves: Halves, draws: Draws, steps: Steps) -> Floats:
    n = len(halves.learnt)
    sums, counts = steps.by_block(halves.block, n)
    squares, _ = Steps(at=steps.at, values=steps.values**2).by_block(halves.block, n)
    information = np.sqrt(np.maximum(draws.sums(squares), 1e-300))
    return np.abs(draws.sums(sums)) / information / np.sqrt(np.maximum(draws.sums(counts), 1.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """What a calibrated model scores on the held-out minutes.

    Parameters
    ----------
    scores
        Its similarities.
    long_run
        Its own long simulation.
    ceiling
        What it reaches against itself.
    """

    scores: Scores
    long_run: Statistics
    ceiling: Ceiling


def feature_gaps(
    halves: Halves, draws: Draws, models: tuple[Judged, Judged, Judged | None]
) -> list[Gap]:
    """Return the gaps in S against its ceiling and in D, W, O and T.

    Parameters
    ----------
    halves, draws
        The held-out minutes.
    models
        Without the effects, with them, and the placebo.
    """
    counts = _drawn_counts(halves, draws)
    before, after, placebo = (
        _Drawn(model, None if model is None else population_scores(counts, model.long_run))
        for model in models
    )
    n = len(draws.weights)
    over = [each.of("S", n) / each.top("S", n) for each in (before, after, placebo)]
    made = [make_gap("S_over_ceiling", (over[0], over[1]), np.ones(n), over[2])]
    for name in FEATURES:
        ours = [each.of(name, n) for each in (before, after, placebo)]
        made.append(make_gap(name, (ours[0], ours[1]), after.top(name, n), ours[2]))
    return made


@dataclass(frozen=True, slots=True)
class _Drawn:
    """A model's scores on all draws; NaN without a model."""

    model: Judged | None
    scores: FeatureScores | None

    def of(self, feature: str, n: int) -> Floats:
        if self.scores is None:
            return np.full(n, np.nan)
        name = feature if feature == "S" else f"I_{feature}"
        return np.asarray(getattr(self.scores, name), dtype=np.float64)

    def top(self, feature: str, n: int) -> Floats:
        return np.full(n, np.nan if self.model is None else self.model.ceiling.of(feature)[0])


def _drawn_counts(halves: Halves, draws: Draws) -> Counts:
    """Return the counts of the held-out minutes, as measured and drawn anew."""
    weights = draws.weights.astype(np.int64)

    def pooled(name: str) -> NDArray[np.int64]:
        parts = np.stack([getattr(halves.statistics[b], name) for b in draws.blocks])
        return np.tensordot(weights, parts, axes=1)

    return Counts(**{name: pooled(name) for name in Counts._fields})
