"""How alike two groups are: I_D, I_W, I_O, I_T and their geometric mean S.

One implementation for a whole population of candidates and for two windows.
D, W, O, T and S are the names of the paper (Cazenille et al., data analysis).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from zfcal.arrays import Floats, Ints
from zfcal.behaviour.features.registry import named as named_statistic
from zfcal.behaviour.histograms import similarity
from zfcal.behaviour.statistics import Statistics, check_zones
from zfcal.errors import InputError

NAN = float("nan")


class Counts(Protocol):
    """What is compared: counts of one window, or of many along leading axes."""

    @property
    def distance(self) -> Ints:
        """D, shape (..., zone, 10)."""

    @property
    def wall(self) -> Ints:
        """W, shape (..., zone, 10)."""

    @property
    def occupation(self) -> Ints:
        """O, shape (..., zone)."""

    @property
    def transition(self) -> Ints:
        """T, shape (..., zone, zone)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedScore:
    """How alike two groups are in statistics that were named: a score that is not S.

    Parameters
    ----------
    features
        Their names.
    similarities
        Similarity of each, the mean over zones; NaN where neither side has a count.
    value
        Geometric mean of those that are not NaN.
    n_features
        How many those are.
    """

    features: tuple[str, ...]
    similarities: tuple[float, ...]
    value: float
    n_features: int


class FeatureScores(NamedTuple):
    """Scores of many candidates; NaN where a zone or a feature has no count on both sides.

    Attributes
    ----------
    D, W, T : ndarray, shape (candidate, zone)
        Similarity of each zone's histogram.
    I_D, I_W, I_O, I_T : ndarray, shape (candidate,)
        Similarity of each feature: D, W and T as the mean over their zones.
    S : ndarray, shape (candidate,)
        Geometric mean of the features that are not NaN.
    n_features : ndarray of int, shape (candidate,)
        How many those are.
    """

    D: Floats
    W: Floats
    T: Floats
    I_D: Floats
    I_W: Floats
    I_O: Floats
    I_T: Floats
    S: Floats
    n_features: Ints

    @property
    def features(self) -> Floats:
        """The vectors (I_D, I_W, I_O, I_T), shape (candidate, 4)."""
        return np.stack([self.I_D, self.I_W, self.I_O, self.I_T], axis=-1)

    def each(self, zone_names: tuple[str, ...]) -> list[Scores]:
        """Return the candidates' scores one by one.

        Parameters
        ----------
        zone_names
            The arena's zones, in its order.
        """
        columns = [column.tolist() for column in self]
        return [
            Scores(zone_names=zone_names, **dict(zip(self._fields, row, strict=True)))
            for row in zip(*columns, strict=True)
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """How alike two groups are; NaN where neither side has a count.

    Parameters
    ----------
    zone_names
        The arena's zones, in its order.
    D, W, T
        Similarity of each zone's distances, wall distances and transitions.
    I_D, I_W, I_O, I_T
        Similarity of each feature, in [0, 1].
    S
        Geometric mean of the features that are not NaN.
    n_features
        How many those are.
    named
        The score of other statistics, where these are what counts; None for S.
    """

    zone_names: tuple[str, ...]
    D: tuple[float, ...]
    W: tuple[float, ...]
    T: tuple[float, ...]
    I_D: float
    I_W: float
    I_O: float
    I_T: float
    S: float
    n_features: int
    named: NamedScore | None = None

    def __post_init__(self) -> None:
        for name in ("D", "W", "T"):
            values = tuple(getattr(self, name))
            if len(values) != len(self.zone_names):
                raise InputError(
                    f"Scores of {len(self.zone_names)} zones need as many {name}, "
                    f"got {len(values)}."
                )
            object.__setattr__(self, name, values)

    @property
    def overall(self) -> float:
        """What decides: S, or the score of the statistics that were named."""
        return self.S if self.named is None else self.named.value

    @property
    def values(self) -> tuple[float, ...]:
        """Every score, in the order of `score_keys`."""
        return (*self.D, self.I_D, *self.W, self.I_W, *self.T, self.I_T, self.I_O, self.S)


def score_keys(zone_names: tuple[str, ...]) -> tuple[tuple[str, str | None], ...]:
    """Return what each of a comparison's scores is of.

    Parameters
    ----------
    zone_names
        The arena's zones, in its order.

    Returns
    -------
    tuple of (feature, zone)
        D, W and T zone by zone and, with zone None, as the mean; then O and S.
    """
    by_zone = tuple((feature, zone) for feature in "DWT" for zone in (*zone_names, None))
    return (*by_zone, ("O", None), ("S", None))


def population_scores(counts: Counts, control: Counts) -> FeatureScores:
    """Score many candidates against one control group, or each against its own.

    Parameters
    ----------
    counts
        Counts with a leading axis over candidates.
    control
        Counts without leading axis, or with one that broadcasts.

    Returns
    -------
    FeatureScores
        A zone that has no count on both sides is left out of the mean; on one
        side only it scores 0.

    Raises
    ------
    InputError
        The two sides have different zones or bins.
    """
    for name in ("distance", "wall", "occupation", "transition"):
        ours, theirs = getattr(counts, name).shape, getattr(control, name).shape
        n_axes = 1 if name == "occupation" else 2
        if ours[-n_axes:] != theirs[-n_axes:]:
            raise InputError(
                f"Counts of {name} differ in zones or bins: {ours[-n_axes:]} and "
                f"{theirs[-n_axes:]}.",
                hint="Both sides must come from the same arena.",
            )
    return from_zones(
        D=similarity(counts.distance, control.distance),
        W=similarity(counts.wall, control.wall),
        O=similarity(counts.occupation, control.occupation),
        T=similarity(counts.transition, control.transition),
    )


def from_zones(*, D: Floats, W: Floats, O: Floats, T: Floats) -> FeatureScores:  # noqa: E741
    """Return the scores that follow from the zones' similarities.

    Parameters
    ----------
    D, W, T : ndarray, shape (candidate, zone)
        Similarities; NaN where a zone is left out.
    O : ndarray, shape (candidate,)
        Similarity of the occupation.

    Returns
    -------
    FeatureScores
    """
    I_D, I_W, I_T = _mean(D), _mean(W), _mean(T)
    S, n_features = geometric_mean(np.stack([I_D, I_W, O, I_T], axis=-1))
    return FeatureScores(
        D=D, W=W, T=T, I_D=I_D, I_W=I_W, I_O=O, I_T=I_T, S=S, n_features=n_features
    )


def similarities(
    counts: Mapping[str, Ints], control: Mapping[str, Ints], features: Sequence[str]
) -> Floats:
    """Return how alike many candidates and a control group are in some statistics.

    Parameters
    ----------
    counts
        Of each statistic, with a leading axis over candidates.
    control
        The same without that axis.
    features
        Names of the statistics.

    Returns
    -------
    ndarray, shape (candidate, feature)
        The mean over zones, as in `population_scores`; NaN where neither side has a count.
    """
    columns = []
    for name in features:
        alike = named_statistic(name).compare(counts[name], control[name])
        columns.append(_mean(alike) if alike.ndim > 1 else alike)
    return np.stack(columns, axis=-1)


def named_scores(features: Sequence[str], values: Floats) -> list[NamedScore]:
    """Return the scores that follow from similarities, shape (candidate, feature), one by one."""
    score, n_features = geometric_mean(values)
    return [
        NamedScore(features=tuple(features), similarities=tuple(row), value=value, n_features=n)
        for row, value, n in zip(values.tolist(), score.tolist(), n_features.tolist(), strict=True)
    ]


def compare(a: Statistics, b: Statistics) -> Scores:
    """Return how alike two windows are.

    Parameters
    ----------
    a, b
        Statistics in one arena. The order does not matter.

    Returns
    -------
    Scores

    Raises
    ------
    InputError
        Their zones differ.
    """
    check_zones(a.zone_names, b.zone_names)
    scores = population_scores(_Single(*(getattr(a, name)[None] for name in _Single._fields)), b)
    return scores.each(a.zone_names)[0]


class _Single(NamedTuple):
    """A population of one."""

    distance: Ints
    wall: Ints
    occupation: Ints
    transition: Ints


def _mean(values: Floats) -> Floats:
    """Return the mean over the last axis of what is not NaN; NaN where all is."""
    known = ~np.isnan(values)
    total, n = np.where(known, values, 0.0).sum(axis=-1), known.sum(axis=-1)
    return np.where(n > 0, total / np.where(n > 0, n, 1), np.nan)


def geometric_mean(values: Floats) -> tuple[Floats, Ints]:
    """Return the geometric mean over the last axis of what is not NaN, and of how many."""
    known = ~np.isnan(values)
    n = known.sum(axis=-1)
    product = np.where(known, values, 1.0).prod(axis=-1)
    return np.where(n > 0, product ** (1.0 / np.where(n > 0, n, 1)), np.nan), n.astype(np.int64)
