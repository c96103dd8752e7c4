"""What each name's features gain in the likelihood of speeds.

Speeds have no law but a measured one for each zone, so they are taken as normal scores: ranks
within a zone, put on the scale of a standard normal law (van der Waerden 1952, Indagationes
Mathematicae 14: 453-458). Fields of the tank and individuals have a mean of their own, which is
taken off. What is left is regressed on weights of what was there before the step: the gain is that
of the normal law, and all strengths and the spread are fitted. What changes a few speeds, and not
their mean, is fitted to the law of scores of each fish (`zfcal.diagnose.features.spreads`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth
from scipy.special import chdtrc

from zfcal.arrays import Floats
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.spreads import Drawn, Spreads
from zfcal.diagnose.features.swum import normal_scores, scores_of_speeds, swum_of
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import LEVEL
from zfcal.diagnose.steadiness import Course
from zfcal.model.effects import Effect, find_effect
from zfcal.model.paces import Copied, Pace, PaceFeature, Spread, Swum
from zfcal.model.scene import Moves, Scene

_LEAST_MOVES = 50
"""Of a track that has a mean of its own; shorter ones have one together."""

_LEAST_OF_TRACK = 100
"""Moves per track, in the mean, from which features are asked; or lengths of the past asked for."""

_GRAIN_M_S = 1e-4
"""Speeds that differ by less count as the same: ranks would make much of rounding."""

_MOST_ALIKE = 0.1
"""Share of moves that may have the same speed."""

_MOST_ROUNDS = 200
"""In which means are taken off."""

_LEAST = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Paces:
    """Fits of features to the speeds of a recording.

    Parameters
    ----------
    screen
        The model; what its effects do to speeds is divided out.
    beside
        Effects that are there, whatever form they have.
    given
        Effects on headings that depend on the speed: what speeds show of these counts as well.
    """

    screen: Screen
    beside: tuple[Effect, ...] = ()
    given: tuple[Effect, ...] = ()

    @property
    def scene(self) -> Scene:
        """The recording."""
        return self.screen.scene

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Moves of fish that swim, and swam before."""
        still, was_still = self.screen.still
        return np.flatnonzero(~(still | was_still))

    @cached_property
    def turns(self) -> Moves:
        """The moves that count."""
        moves = self.scene.moves
        return Moves(
            at=moves.at[self.rows],
            who=moves.who[self.rows],
            track=moves.track[self.rows],
            zone=moves.zone[self.rows],
            speed_m_s=moves.speed_m_s[self.rows],
        )

    @cached_property
    def _groups(self) -> tuple[NDArray[np.intp], ...]:
        """Fields of the tank and individuals, each with a mean of its own; short tracks are one."""
        fields, tracks = (
            np.unique(group, return_inverse=True)[1]
            for group in (self.screen.fields[self.rows], self.turns.track)
        )
        is_long = np.bincount(tracks, minlength=1) >= _LEAST_MOVES
        return fields, np.where(is_long[tracks], tracks + 1, 0) if len(tracks) else tracks

    def _less_means(self, values: Floats) -> Floats:
        """Return values less the means of both groupings, by turns until nothing changes.

        So they become what is orthogonal to both (von Neumann 1950, Functional Operators II).
        """
        left = np.array(values, dtype=np.float64)
        for _ in range(_MOST_ROUNDS):
            before = left.copy()
            for group in self._groups:
                left -= _means(left, group)[group]
            if np.abs(left - before).max(initial=0.0) < _LEAST:
                break
        return left

    @cached_property
    def _grains(self) -> Floats:
        return np.round(self.screen.own_speeds[self.rows] / _GRAIN_M_S)

    @cached_property
    def _moves_per_track(self) -> float:
        return len(self.rows) / max(1, len(np.unique(self.turns.track)))

    def looks_back(self, feature: PaceFeature) -> bool:
        """Return whether tracks are long enough for the past that a feature looks at.

        The more steps a mean is over, the more of it is the track's own mean that is taken off.
        """
        if not isinstance(feature, Pace):
            return True
        return self._moves_per_track * self.scene.dt_s >= _LEAST_OF_TRACK * feature.past_s

    @property
    def has_law(self) -> bool:
        """Whether speeds differ enough for normal scores, and tracks are long enough for a past."""
        n = len(self.rows)
        if self._moves_per_track < _LEAST_OF_TRACK:
            return False
        return int(np.unique(self._grains, return_counts=True)[1].max()) <= _MOST_ALIKE * n

    @cached_property
    def _raw(self) -> tuple[Floats, float, Floats]:
        """Normal scores; the spread of what is left of them less the means; that itself."""
        raw = normal_scores(self._grains, self.turns.zone)
        left = self._less_means(raw)
        return raw, max(float(left.std()), _LEAST), left

    @cached_property
    def scores(self) -> Floats:
        """Normal scores less the means, of variance one, shape (move,)."""
        _, spread, left = self._raw
        return np.asarray(left / spread)

    @cached_property
    def swum(self) -> Swum:
        """What was there before each move."""
        return swum_of(self.scene, self.turns, self.scores)

    @cached_property
    def _also(self) -> Floats:
        """Orthonormal columns of what is there beside the means."""
        own = [each for effect in self.beside for each in effect.paces if isinstance(each, Pace)]
        own += [each for effect in self.given for each in effect.paces_given]
        made = [self._less_means(feature.weights(self.swum)) for feature in own]
        return _span([np.zeros((len(self.rows), 0)), *made])

    @cached_property
    def _left(self) -> Floats:
        """Scores less all that is there."""
        return self.scores - self._also @ (self._also.T @ self.scores)

    @cached_property
    def _spreads(self) -> Spreads:
        """The law of what is left of the scores, with what is there of those that bend it.

        As for a tilt of headings: each is fitted once, where it gains more than chance.
        """
        return self._bent[0]

    @cached_property
    def _bent(self) -> tuple[Spreads, Floats, int]:
        """That law, what bends it, shape (move,), and by how many strengths."""
        own = self._left / self._wide
        spreads = Spreads(scores=own, who=self._groups[1])
        made, n = np.zeros(len(own)), 0
        for effect in self.beside:
            for feature in effect.paces:
                if isinstance(feature, Pace):
                    continue
                drawn = self._drawn(feature, spreads)
                gained = max(float(drawn.log_p.sum()), 0.0)
                if drawn.n_strengths and chdtrc(drawn.n_strengths, 2 * gained) < LEVEL:
                    spreads = spreads.beside(drawn)
                    made, n = made + drawn.log_p, n + drawn.n_strengths
        return spreads, made, n

    @cached_property
    def _wide(self) -> float:
        return max(float(self._left.std()), _LEAST)

    @property
    def gained_beside(self) -> tuple[Floats, int]:
        """What features of what is there add to its model, shape (move,); number of strengths."""
        _, bent, n = self._bent
        return _normal_gain(self.scores, self._left) + bent, self._also.shape[1] + n

    def prepare(self) -> None:
        """Work out what all features need, before they are asked side by side."""
        _ = (self.swum, self._spreads, self._factor)

    def gain(self, name: str, feature: PaceFeature) -> Gain:
        """Return what a feature of an effect adds."""
        made, n = self._gained(feature)
        if not isinstance(feature, Pace) and feature.ago is not None:
            made = made - _beyond_chance(*self._gained(_ago(feature)))
        return Gain(name=name, label=feature.label, log_p=made, n_strengths=n)

    def _gained(self, feature: PaceFeature) -> tuple[Floats, int]:
        if isinstance(feature, Pace):
            change, n = self._changed(feature)
            return _normal_gain(self._left, self._left - change), n
        drawn = self._drawn(feature, self._spreads)
        return drawn.log_p, drawn.n_strengths

    def course(self, gain: Gain) -> Course:
        """Return what a feature gains at each move, and what it would if it were there."""
        effect = find_effect(gain.name)
        feature = next(each for each in effect.paces if each.label == gain.label)
        of = (self.scene, self.turns.at)
        if isinstance(feature, Pace):
            change, _ = self._changed(feature)
            return Course(apart=change * (self._left - change), expected=change**2 / 2, of=of)
        drawn = self._drawn(feature, self._spreads)
        return Course(apart=drawn.log_p - drawn.expected, expected=drawn.expected, of=of)

    def and_beside(self, effect: Effect) -> Paces:
        """Return fits in which one more effect is there."""
        made = replace(self, beside=(*self.beside, effect))
        kept = ("rows", "turns", "_groups", "_raw", "scores", "swum")
        made.__dict__.update({key: getattr(self, key) for key in kept})
        return made

    def _changed(self, feature: Pace) -> tuple[Floats, int]:
        """Return by how much a feature changes each score, and the number of its strengths."""
        columns = _some(self._beside_means(feature.weights(self.swum)))
        found, _, rank, _ = np.linalg.lstsq(columns, self._left, rcond=None)
        return np.asarray(columns @ found), int(rank)

    def _beside_means(self, values: Floats) -> Floats:
        columns = self._less_means(values)
        return np.asarray(columns - self._also @ (self._also.T @ columns))

    def _drawn(self, feature: Spread | Copied, spreads: Spreads) -> Drawn:
        """Return what a feature adds to the law of scores that is there."""
        if isinstance(feature, Spread):
            columns = self._less_means(feature.weights(self.swum))
            return spreads.spread(_span([columns]) * math.sqrt(len(columns)))
        speeds = feature.of(self.swum) / self._factor[:, None]
        raw = scores_of_speeds(speeds, self.screen.own_speeds[self.rows], self.turns.zone)
        # As the own score of the step: less the means of its groups, and what is there.
        own, spread, _ = self._raw
        apart = own - self._left * spread
        about = (raw - apart[:, None]) / (spread * self._wide)
        return spreads.copied(about, feature.weights(self.swum))

    @cached_property
    def _factor(self) -> Floats:
        return np.asarray(self.screen.model_factor[self.rows])


def pace_gains(paces: Paces, effects: Sequence[Effect], *, n_workers: int = 1) -> list[Gain]:
    """Return what features of effects add to the law of speeds; those without are left out.

    Tracks of a few moves have no past to speak of: regressed on what is left of it beside a mean
    of their own, speeds would seem to swing (Nickell 1981, Econometrica 49: 1417-1426). Where a
    tenth of all moves have one speed there is no law of ranks.

    Parameters
    ----------
    paces
        Fits.
    effects
        Those that are asked.
    n_workers
        Threads; the numbers do not depend on them.
    """
    if not paces.has_law:
        return []
    asked = [
        (effect.name, feature)
        for effect in effects
        for feature in effect.paces
        if paces.looks_back(feature)
    ]
    paces.prepare()
    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        found = list(pool.map(lambda pair: paces.gain(*pair), asked))
    return [gain for gain in found if gain.n_strengths]


def _span(columns: Sequence[Floats]) -> Floats:
    """Return orthonormal columns with the span of all, of which some may be sums of others."""
    whole = _some(np.concatenate(columns, axis=1))
    return np.asarray(orth(whole, rcond=_LEAST)) if whole.size else whole


def _some(columns: Floats) -> Floats:
    """Return the columns that are more than rounding."""
    return np.asarray(columns[:, (columns**2).mean(axis=0) > _LEAST])


def _ago(feature: Spread | Copied) -> Spread | Copied:
    """Return a feature of what was there before that."""
    if isinstance(feature, Copied):
        return replace(feature, of=feature.ago)
    return feature if feature.ago is None else replace(feature, weights=feature.ago)


def _beyond_chance(log_p: Floats, n_strengths: int) -> Floats:
    """Return what is gained less what as many strengths gain on nothing, half a nat each (Wilks).

    It is taken off in proportion, and nothing is left of a gain that is no larger.
    """
    whole = float(log_p.sum())
    share = max(0.0, 1 - n_strengths / 2 / whole) if whole > 0 else 0.0
    return np.asarray(share * log_p)


def _means(values: Floats, group: NDArray[np.intp]) -> Floats:
    """Return the mean of each group, shape (group,) or (group, column)."""
    n = np.maximum(np.bincount(group), 1)
    if values.ndim == 1:
        return np.asarray(np.bincount(group, values) / n)
    return np.stack([np.bincount(group, column) / n for column in values.T], axis=1)


def _normal_gain(before: Floats, after: Floats) -> Floats:
    """Return what a normal law gains at each step, its spread fitted before and after."""
    wide, narrow = (max(float((x**2).mean()), _LEAST) for x in (before, after))
    return 0.5 * (math.log(wide / narrow) + before**2 / wide - after**2 / narrow)
