"""Which parameter values agree with a window as well as the champion does.

An acceptance region over the genomes that a round has evaluated, for lack of a
likelihood. What it can and cannot say stands at `parameter_intervals`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.behaviour.ceilings import Ceiling
from zfcal.calibrate.group import scale_gamma
from zfcal.model.effects.genome import genome_names, genome_ranges
from zfcal.parameters import Parameters

_QUANTILES = (0.025, 0.975)

_COVERED_MAX = 0.7
"""An interval wider than this share of the range identifies nothing."""

_MIN_COMPATIBLE = 20
"""With fewer compatible genomes no parameter counts as identified."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """The values of one parameter that agree with a window.

    Parameters
    ----------
    name
        Such as ``walls.kappa_0`` or ``walls.gamma.centre``.
    value
        The champion's.
    low, high
        2.5 and 97.5 % quantiles over the compatible genomes and the champion.
    identified
        Whether the window says something about the parameter.
    """

    name: str
    value: float
    low: float
    high: float
    identified: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Intervals:
    """The intervals of all parameters of a model.

    Parameters
    ----------
    parameters
        In the order of `zfcal.model.effects.genome.genome_names`; of the Z numbers of a gamma row
        Z - 1 are free, since each row is scaled to a maximum of one.
    threshold
        Genomes with at least this S are compatible.
    n_compatible
        How many are.
    within_ceiling
        Whether the champion scores no less than the low end of its own windows. If
        not, the model misses something, and the intervals are only relative to the
        best it can do.
    """

    parameters: tuple[Interval, ...]
    threshold: float
    n_compatible: int
    within_ceiling: bool


def acceptance_threshold(score: float, ceiling: Ceiling) -> tuple[float, bool]:
    """Return the least S that is compatible, and whether the champion reaches its ceiling.

    Parameters
    ----------
    score
        The champion's S against the window.
    ceiling
        What its own windows score.

    Returns
    -------
    threshold
        The low end of the champion's own windows. Where the champion lies below
        that, its S less the same margin below the mean, so that it is always in.
    within_ceiling
        Whether the champion reaches the low end.
    """
    mean, low, _ = ceiling.overall
    if score >= low:
        return low, True
    return score - (mean - low), False


def parameter_intervals(
    champion: Floats,
    evaluated: tuple[Floats, Floats],
    *,
    score: float,
    ceiling: Ceiling,
    template: Parameters,
) -> Intervals:
    """Return an interval per parameter: where the genomes lie that are compatible.

    Parameters
    ----------
    champion : ndarray, shape (gene,)
    evaluated
        Genes, shape (genome, gene), and S, shape (genome,), of all genomes that the
        round has evaluated; NaN is never compatible.
    score
        The champion's S against the window.
    ceiling
        What its own windows score.
    template
        The model that genomes complete.

    Notes
    -----
    A genome is compatible if its S on the window is not below the 2.5 % quantile of
    what the champion's own windows of that length score: such a score would be no
    surprise if the champion were the truth. Limits of this:

    * Genomes are where the search went, not drawn from a prior: a region that it
      never visited is not ruled out, and a crowded one weighs more. The
      quantiles are no confidence interval of known coverage.
    * Each parameter by itself: two that make up for each other both look unknown.
    * S sees four histograms, not the tracks. Intervals from the one-step likelihood
      are narrower where the model holds.
    * An evaluation shorter than the champion's long run scores a little lower for
      its own noise, which makes the region a little small.
    """
    threshold, within_ceiling = acceptance_threshold(score, ceiling)
    genes, scores = evaluated
    compatible = genes[scores >= threshold]
    n_zones, n = len(template.zones), len(champion)
    least, most = (ends[:n] for ends in genome_ranges(template))
    value = least + scale_gamma(champion, n_zones) * (most - least)
    values = np.vstack([value, least + scale_gamma(compatible, n_zones) * (most - least)])
    low, high = np.quantile(values, _QUANTILES, axis=0)
    low, high = np.minimum(low, value), np.maximum(high, value)
    known = (high - low <= _COVERED_MAX * (most - least)) & (len(compatible) >= _MIN_COMPATIBLE)
    columns = zip(genome_names(template)[:n], value, low, high, known, strict=True)
    return Intervals(
        parameters=tuple(
            Interval(name=name, value=float(v), low=float(a), high=float(b), identified=bool(k))
            for name, v, a, b, k in columns
        ),
        threshold=threshold,
        n_compatible=len(compatible),
        within_ceiling=within_ceiling,
    )
