"""What a feature of an effect gains in likelihood."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from zfcal.arrays import Floats
from zfcal.diagnose.features.false_gains import NO_NOISE, ByNoise


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gain:
    """What a feature adds to the log likelihood.

    Parameters
    ----------
    name, label
        Of the effect, and of its feature.
    log_p : ndarray, shape (step,)
        Log density that it adds to each step of the law.
    n_strengths
        That were fitted.
    n_tried
        Features of which this one was the best.
    kind
        What these are called; empty where it is the only one.
    noise
        What noise of positions alone makes it gain.
    without_noise
        Whether it gains that by the law of exact positions.
    common : ndarray, shape (step,), optional
        Log density that what all fish do alike adds to each step, of a feature of how they differ
        which may count with it: see `whole`.
    n_common
        Strengths of that.
    apart
        What it was without that, which has the chance.
    forms
        Shapes of the effect in a model that say the same.
    is_idle
        Whether it promised nothing, and was not fitted.
    """

    name: str
    label: str
    log_p: Floats
    n_strengths: int
    n_tried: int = 1
    kind: str = ""
    noise: ByNoise = NO_NOISE
    without_noise: bool = False
    common: Floats | None = None
    n_common: int = 0
    apart: Gain | None = None
    forms: tuple[Mapping[str, float], ...] = ()
    is_idle: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """Name, and what the feature is called on any recording."""
        return self.name, self.kind or self.label

    @property
    def nats(self) -> float:
        """Log likelihood gained, less what noise and as many idle strengths would (Akaike 1974)."""
        more = self.noise.more(self.n_strengths)
        return float(self.log_p.sum()) - more - self.n_strengths

    @property
    def p(self) -> float:
        """Chance of such a gain where nothing is missing."""
        if self.apart is not None:
            return self.apart.p
        chance = self.noise.chance(float(self.log_p.sum()), self.n_strengths)
        return min(1.0, self.n_tried * chance)

    @property
    def whole(self) -> Gain:
        """It with what all fish do alike, where that counts; its chance stays what it is."""
        if self.common is None:
            return self
        return replace(
            self, log_p=self.log_p + self.common, n_strengths=self.n_strengths + self.n_common,
            common=None, n_common=0, apart=self,
        )  # fmt: skip


Idle: TypeAlias = tuple[str, str, bool]
"""Key of a feature, and whether it is asked by the law of exact positions."""


def idle_of(gains: Iterable[Gain]) -> frozenset[Idle]:
    """Return which features were not worth a fit, by which law."""
    return frozenset((*gain.key, gain.without_noise) for gain in gains if gain.is_idle)
