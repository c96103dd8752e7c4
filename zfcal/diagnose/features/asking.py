"""Features asked of a law: those of all names, and beside effects that are there."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from scipy.special import chdtrc

from zfcal.arrays import Floats
from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.gains import Gain, Idle
from zfcal.diagnose.features.landings import leaned
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import best_by_name, tried
from zfcal.diagnose.selection import LEVEL
from zfcal.model.effects import Effect
from zfcal.model.features import (
    Feature,
    Landing,
    Leaving,
    Mixed,
    OneOf,
    Sharper,
    Single,
    Tilt,
    Turned,
)

_KEPT = 2
"""Fits that a law keeps: each holds some hundred megabytes of half an hour of five fish."""

_NEAR_BEST = 0.5
"""Share of the nats of the best one below which a feature is not fitted anew."""


def gains_of(  # noqa: PLR0913 - the last ones have defaults
    law: Law,
    effects: Sequence[Effect],
    *,
    kinds: Collection[tuple[str, str]] | None = None,
    beside: Sequence[Effect] = (),
    beyond: Floats | None = None,
    idle: Collection[Idle] = (),
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
        Names and kinds of those that are asked for, fitted even if they promise nothing; None for
        all. Of several of a kind none is fitted that promises nothing, either way.
    beside
        Effects that are there: whatever form they have, what they explain is not asked.
    beyond : ndarray, shape (step,), optional
        Log densities that are to be gained over, in place of the law's own.
    idle
        Those that count as tried and are not looked at: see `idle_of`.
    n_workers
        Threads; the numbers do not depend on them.
    """
    fits = fits_beside(law, beside)
    if beyond is not None:
        fits = replace(fits, beyond=beyond)
    law = fits.law
    asked = [
        (effect.name, feature)
        for effect in effects
        for feature in _askable(law, effect)
        if kinds is None or _key(effect.name, feature) in kinds
    ]
    is_exact = not law.noise_m > 0
    nothing = [_nothing(fits, *pair) for pair in asked if (*_key(*pair), is_exact) in idle]
    asked = [pair for pair in asked if (*_key(*pair), is_exact) not in idle]
    fits.prepare([feature for _, feature in asked])
    fit_all = kinds is not None
    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        found = list(pool.map(lambda pair: _gains(fits, *pair, fit_all=fit_all), asked))
        # One fish has nobody to follow: then a feature of who is who has no strength at all.
        some = [pair for pairs in found for pair in pairs if pair[1].n_strengths]
        hopeful = _hopeful([*nothing, *(gain for _, gain in some)])
        if any(isinstance(feature, Landing) and gain in hopeful for feature, gain in some):
            some = _off_walls(fits, asked, some, pool.map, fit_all=fit_all)
            hopeful = _hopeful([*nothing, *(gain for _, gain in some)])
        return nothing + list(pool.map(lambda pair: _refitted(fits, pair, hopeful), some))


def _off_walls(
    fits: Fits,
    asked: Sequence[tuple[str, Feature]],
    found: Sequence[tuple[Single, Gain]],
    each: Callable[..., Iterable[list[tuple[Single, Gain]]]],
    *,
    fit_all: bool,
) -> list[tuple[Single, Gain]]:
    """Return what was found, landings fitted beside what all walls have in common.

    That takes as long as all landings together, so it is asked where one of them stands out.

    Parameters
    ----------
    each
        Maps a function over them.
    """
    beside = fits.beside_walls
    if beside is fits:
        return list(found)
    landings = [pair for pair in asked if _is_landing(pair[1])]
    others = [pair for pair in found if not isinstance(pair[0], Landing)]
    beside.prepare([feature for _, feature in landings])
    made = each(lambda pair: _gains(beside, *pair, fit_all=fit_all), landings)
    return others + [pair for pairs in made for pair in pairs]


def _is_landing(feature: Feature) -> bool:
    return isinstance(_one(feature), Landing)


def _one(feature: Feature) -> Single:
    """Return a feature, or the first of those of one sort."""
    return feature.features[0] if isinstance(feature, OneOf) else feature


def _hopeful(gains: Sequence[Gain]) -> list[Gain]:
    """Return the best feature of each name that may turn out to gain most."""
    n_tried = tried(gains)
    best = best_by_name(gains)
    most = max((gain.nats for gain in best), default=0.0)
    return [
        gain
        for gain in best
        if gain.p * n_tried[gain.name] < LEVEL and gain.nats > _NEAR_BEST * most
    ]


def _refitted(fits: Fits, asked: tuple[Single, Gain], hopeful: Sequence[Gain]) -> Gain:
    feature, gain = asked
    is_hopeful = any(gain is each for each in hopeful)
    if isinstance(feature, Tilt) and feature.over is None and is_hopeful:
        return fits.refitted(feature, gain)
    return gain


def best_feature(fits: Fits, effect: Effect) -> tuple[Single, Gain] | None:
    """Return the feature of an effect that gains most; None where none can be fitted."""
    asked = [(effect.name, feature) for feature in _askable(fits.law, effect)]
    fits.prepare([feature for _, feature in asked])
    found = [pair for each in asked for pair in _gains(fits, *each, fit_all=True)]
    best = _most(found)
    if best is not None and isinstance(best[0], Landing):
        return _most(_off_walls(fits, asked, found, map, fit_all=True))
    return best


def _most(found: Sequence[tuple[Single, Gain]]) -> tuple[Single, Gain] | None:
    some = [pair for pair in found if pair[1].n_strengths]
    return max(some, key=lambda pair: pair[1].nats, default=None)


def _askable(law: Law, effect: Effect) -> list[Feature]:
    """Return the features of an effect that a tank allows: not all have a zone to leave into."""
    return [
        feature for feature in effect.features(law.scene.arena) if _has_a_zone(law, _one(feature))
    ]


def _has_a_zone(law: Law, feature: Single) -> bool:
    return not isinstance(feature, Leaving) or law.zone_into(feature.into) > 0


def fits_beside(law: Law, effects: Sequence[Effect]) -> Fits:
    """Return fits in which effects are there, in whatever form their features can have.

    What adds to the mixture is fitted with the base's parameters, each time; a tilt or a factor on
    leaving once, where it gains more than chance. A law of exact positions keeps them for who asks
    again; that of noisy ones has many draws, each with what it needs of its own.

    Parameters
    ----------
    law
        Of the steps; its model has these effects in forms of ours.
    effects
        Those without features are left out.
    """
    if law.noise_m > 0:
        return _beside(law, effects)
    names = tuple(effect.name for effect in effects)
    if names not in law.beside:
        if len(law.beside) >= _KEPT:
            # The first ones are those of what a model has; others are asked one after the other.
            law.beside.popitem()
        law.beside[names] = _beside(law, effects)
    found: Fits = law.beside[names]
    return found


def _beside(law: Law, effects: Sequence[Effect]) -> Fits:
    fits = Fits(law=law)
    also: list[Mixed] = []
    for effect in effects:
        for feature in _askable(law, effect):
            if isinstance(feature, OneOf) and feature.features[0].over is not None:
                # What has to be gained more than, such as attention by the time, is no part of it.
                continue
            chosen, n_tried = _chosen(fits, feature)
            for each in chosen:
                if isinstance(each, Mixed):
                    also.append(_either_way(each))
                else:
                    law = _absorbed(law, each, n_tried)
                    fits = Fits(law=law)
    return Fits(law=law, also=tuple(also))


def _chosen(fits: Fits, feature: Feature) -> tuple[Sequence[Single], int]:
    """Return a feature, or the most promising of several, and of how many it is that."""
    if isinstance(feature, OneOf):
        return fits.most_promising(feature, 1), feature.n_tried
    return [feature], 1


def _either_way(feature: Mixed) -> Mixed:
    """Return a feature that may go either way: a model's form of its effect may have too much.

    Of a component there cannot be less than none. A model that has too much of one has less of
    its own (`Law.own_parameters`).
    """
    if isinstance(feature, Sharper):
        return feature
    if isinstance(feature, Turned):
        return replace(feature, low=None)
    return replace(feature, high=feature.high or None)


def _absorbed(law: Law, feature: Tilt | Leaving | Landing, n_tried: int) -> Law:
    """Return a law with a factor on headings or landings, if that gains more than chance.

    It is the best of so many that were tried.
    """
    fits = Fits(law=law)
    if isinstance(feature, Tilt):
        feature = replace(feature, low=None)
    made = fits.fit(feature)
    if n_tried * chdtrc(len(made.strengths), 2 * max(float(made.log_p.sum()), 0.0)) > LEVEL:
        return law
    if isinstance(feature, Tilt):
        return law.absorbing(bent=leaned(law, feature, made.factor))
    if isinstance(feature, Landing):
        return law.absorbing(bent=fits.landings.bent(feature, made))
    return law.absorbing(leaving=(law.zone_into(feature.into), made.factor))


def kind_of(feature: Feature) -> str:
    """Return what a feature is called on any recording: of places another one is best on each."""
    return feature.kind if isinstance(feature, OneOf) else feature.label


def _key(name: str, feature: Feature) -> tuple[str, str]:
    """Return the key that gains of a feature have."""
    return name, kind_of(feature)


def _nothing(fits: Fits, name: str, feature: Feature) -> Gain:
    """Return that a feature adds nothing; it counts as one that was asked for."""
    made = fits.nothing(name, _one(feature))
    if isinstance(feature, OneOf):
        return replace(made, n_tried=feature.n_tried, kind=feature.kind)
    return made


def _gains(
    fits: Fits, name: str, feature: Feature, *, fit_all: bool = False
) -> list[tuple[Single, Gain]]:
    """Return a feature, or the most promising of several, with what they add."""
    if not isinstance(feature, OneOf):
        of = fits.gain if fit_all or fits.may_gain(feature) else fits.nothing
        return [(feature, of(name, feature))]
    chosen = fits.most_promising(feature)
    if not chosen:
        return [(_one(feature), _nothing(fits, name, feature))]
    return [
        (each, replace(fits.gain(name, each), n_tried=feature.n_tried, kind=feature.kind))
        for each in chosen
    ]
