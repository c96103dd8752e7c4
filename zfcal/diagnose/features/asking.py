"""Features asked of a law: those of all names, and beside effects that are there."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from scipy.special import chdtrc

from zfcal.arrays import Floats
from zfcal.diagnose.features.gains import Fits, Gain
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.selection import LEVEL
from zfcal.model.effects import Effect
from zfcal.model.features import Component, Feature, Leaving, OneOf, Tilt, Turned

_MOST_LESS = 1.0
"""By how much less of a component there may be than in the model, where an effect is there."""


def gains_of(  # noqa: PLR0913 - the last ones have defaults
    law: Law,
    effects: Sequence[Effect],
    *,
    kinds: Collection[tuple[str, str]] | None = None,
    beside: Sequence[Effect] = (),
    beyond: Floats | None = None,
    n_workers: int = 1,
) -> list[Gain]:
    """Return what features of effects add to a law.

    Parameters
    ----------
    law
        Of the steps.
    effects
        Those without features are left out.
    kinds
        Names and kinds of those that are asked for; None for all.
    beside
        Effects that are there: whatever form they have, what they explain is not asked.
    beyond : ndarray, shape (step,), optional
        Log densities that are to be gained over, in place of the law's own.
    n_workers
        Threads; the numbers do not depend on them.
    """
    fits = replace(fits_beside(law, beside), beyond=beyond)
    law = fits.law
    fits.prepare()
    has_rooms = law.between > 0
    asked = [
        (effect.name, feature)
        for effect in effects
        for feature in effect.features(law.scene.arena)
        if (kinds is None or (effect.name, kind_of(feature)) in kinds)
        and (has_rooms or not isinstance(feature, Leaving))
    ]
    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        found = list(pool.map(lambda pair: _gains(fits, *pair), asked))
    # One fish has nobody to follow: then a feature of who is who has no strength at all.
    return [gain for some in found for gain in some if gain.n_strengths]


def fits_beside(law: Law, effects: Sequence[Effect]) -> Fits:
    """Return fits in which effects are there, in whatever form their features can have.

    What adds to the mixture is fitted with the base's parameters, each time; a tilt or a factor on
    leaving once, where it gains more than chance.

    Parameters
    ----------
    law
        Of the steps; its model has these effects in forms of ours.
    effects
        Those without features are left out.
    """
    fits = Fits(law=law)
    also: list[Component | Turned] = []
    for effect in effects:
        for feature in effect.features(law.scene.arena):
            chosen = fits.most_promising(feature, 1) if isinstance(feature, OneOf) else [feature]
            for each in chosen:
                if isinstance(each, Component | Turned):
                    also.append(_either_way(each))
                elif isinstance(each, Tilt) or law.between:
                    law = _absorbed(law, each)
                    fits = Fits(law=law)
    return Fits(law=law, also=tuple(also))


def _either_way(feature: Component | Turned) -> Component | Turned:
    """Return a feature that may also take away: a model's form of its effect may have too much."""
    if isinstance(feature, Turned):
        return replace(feature, low=None)
    low = -(feature.high or _MOST_LESS) if feature.low == 0.0 else feature.low
    return replace(feature, low=low, high=feature.high or None)


def _absorbed(law: Law, feature: Tilt | Leaving) -> Law:
    """Return a law with a tilt or a factor on leaving, if that gains more than chance."""
    fits = Fits(law=law)
    if isinstance(feature, Tilt):
        feature = replace(feature, low=None)
        gain, there, n = fits.tilt(feature)
    else:
        gain, there, n = fits.leaving(feature)
    if chdtrc(n, 2 * max(float(gain.sum()), 0.0)) > LEVEL:
        return law
    if isinstance(feature, Tilt):
        return law.absorbing(leaning=there)
    return law.absorbing(leaving=there)


def kind_of(feature: Feature) -> str:
    """Return what a feature is called on any recording: of places another one is best on each."""
    return feature.kind if isinstance(feature, OneOf) else feature.label


def _gains(fits: Fits, name: str, feature: Feature) -> list[Gain]:
    return fits.best_of(name, feature) if isinstance(feature, OneOf) else [fits.gain(name, feature)]
