"""Features of leaving: factors on steps that end in another zone, beside one for each zone left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.diagnose.features.climbing import Fit, climb
from zfcal.diagnose.features.law import Law
from zfcal.model.features import Leaving

_MOST = 6.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Left:
    """Steps that may end in a zone.

    Parameters
    ----------
    may : ndarray of bool, shape (step,)
        Which ones.
    each : ndarray, shape (step, zone)
        One for the zone in which a step begins that may end there.
    chance : ndarray, shape (step,)
        That it does, under the law.
    landed : ndarray, shape (step,)
        One where it does.
    """

    may: NDArray[np.bool_]
    each: Floats
    chance: Floats
    landed: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Leavings:
    """Fits of features of leaving.

    Parameters
    ----------
    law
        Of the steps.
    """

    law: Law

    def fit(self, feature: Leaving) -> Fit:
        """Return a feature at the maximum, and what it adds to each step."""
        left, null = self._left(feature.into)
        weights = feature.weights(self.law.draws[0].seen) * left.may[:, None]
        columns = np.concatenate([left.each, weights], axis=1)
        made = self._fitted(left, columns, weights.shape[1])
        return replace(made, log_p=made.log_p - null)

    def scores(self, feature: Leaving, no_lapse: Floats) -> tuple[Floats, Floats]:
        """Return the scores of a feature's weights, and of leaving each zone, (step, weight).

        Parameters
        ----------
        no_lapse : ndarray, shape (step,)
            Probability of each step that it was none.
        """
        left, _ = self._left(feature.into)
        apart = (no_lapse * (left.landed - left.chance) * left.may)[:, None]
        return apart * feature.weights(self.law.draws[0].seen), apart * left.each

    def _left(self, into: str) -> tuple[_Left, Floats]:
        """Return which steps may leave, and their log densities without a feature."""
        if into not in self._kept:
            left = self._of(into)
            self._kept[into] = left, self._fitted(left, left.each, 0).log_p
        return self._kept[into]

    @cached_property
    def _kept(self) -> dict[str, tuple[_Left, Floats]]:
        return {}

    def _of(self, into: str) -> _Left:
        law, zone = self.law, self.law.zone_into(into)
        chance = (law.cells * law.share_of(zone)).sum(axis=1) / law.cells.sum(axis=1)
        may = np.asarray(((law.turns.zone == law.between) == (into == "again")) & (chance > 0))
        zones = np.unique(law.turns.zone[may])
        return _Left(
            may=may,
            each=((law.turns.zone[:, None] == zones) & may[:, None]).astype(np.float64),
            chance=chance,
            landed=(law.turns.landing == zone).astype(np.float64),
        )

    def _fitted(self, left: _Left, columns: Floats, n_strengths: int) -> Fit:
        law, lapses, n = self.law, self.law.lapses, columns.shape[1]
        base = np.exp(law.log_here) * law.base[0][:, 0] / law.cells.sum(axis=1)

        def density(x: Floats) -> tuple[Floats, Floats]:
            log_factor = columns @ x[:n]
            factor = np.exp(log_factor)
            whole = 1 - left.chance + left.chance * factor
            return base * np.exp(log_factor * left.landed) / whole, left.chance * factor / whole

        def objective(x: Floats) -> tuple[float, Callable[[], Floats]]:
            found, chance = density(x)
            value, own, slopes = lapses.mixed(found, x[n:])
            ahead = own * (left.landed - chance)
            return value, lambda: np.column_stack([ahead[:, None] * columns, slopes])

        peak = climb(objective, np.append(np.zeros(n), lapses.start), [(-_MOST, _MOST)] * n)
        return Fit(
            log_p=lapses.log_mixed(density(peak.x)[0], peak.x[n:]),
            peak=peak,
            n=n_strengths,
            n_lapses=len(lapses.start),
            scale=np.ones(1),
            factor=columns @ peak.x[:n],
        )
