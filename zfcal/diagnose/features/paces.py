"""What each name's features gain in the likelihood of speeds.

Speeds have no law but a measured one for each zone, so they are taken as normal scores: ranks
within a zone, put on the scale of a standard normal law (van der Waerden 1952, Indagationes
Mathematicae 14: 453-458). Fields of the tank and individuals have a mean of their own, which is
taken off. What is left is regressed on weights of what was there before the step: the gain is that
of the normal law, and all strengths and the spread are fitted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth
from scipy.special import ndtri
from scipy.stats import rankdata

from zfcal.arrays import Floats
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.steadiness import Course
from zfcal.model.effects import Effect, find_effect
from zfcal.model.features import AWAY_M
from zfcal.model.kernels.state import HX, HY, SPEED, ZONE, X, Y
from zfcal.model.paces import Pace, Swum
from zfcal.model.scene import Moves, Scene

_LEAST_MOVES = 50
"""Of a track that has a mean of its own; shorter ones have one together."""

_LEAST_OF_TRACK = 100
"""Moves per track, in the mean, from which features are asked."""

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
    """

    screen: Screen
    beside: tuple[Effect, ...] = ()

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

    @property
    def has_law(self) -> bool:
        """Whether speeds differ enough for normal scores, and tracks are long enough for a past."""
        n, n_tracks = len(self.rows), len(np.unique(self.turns.track))
        if n < _LEAST_OF_TRACK * max(n_tracks, 1):
            return False
        return int(np.unique(self._grains, return_counts=True)[1].max()) <= _MOST_ALIKE * n

    @cached_property
    def scores(self) -> Floats:
        """Normal scores less the means, of variance one, shape (move,)."""
        left = self._less_means(_normal_scores(self._grains, self.turns.zone))
        return np.asarray(left / max(float(left.std()), _LEAST))

    @cached_property
    def swum(self) -> Swum:
        """What was there before each move."""
        scene, moves = self.scene, self.turns
        at, who = moves.at, moves.who
        scores = _table(scene, moves, self.scores)
        states = scene.states
        columns = states.shape[2]
        each = [[j for j in range(columns) if j != i] for i in range(columns)]
        others = np.array(each, dtype=np.int64).reshape(columns, columns - 1)[who]
        own, theirs = states[at, :, who], np.moveaxis(states[at], 1, 2)
        theirs = np.take_along_axis(theirs, others[..., None], axis=1)
        here = theirs[..., ZONE] > 0
        away = np.hypot(
            theirs[..., X] - own[:, None, X], theirs[..., Y] - own[:, None, Y]
        )  # fmt: skip
        paces = _paces_of_all(states)[at[:, None], others]
        return Swum(
            last=_known(scores, scene, at, who, 1),
            before_last=_known(scores, scene, at, who, 2),
            third=_known(scores, scene, at, who, 3),
            last_turn_rad=_last_turn(states, at, who),
            others=np.where(here, np.nan_to_num(paces), 0.0),
            distance_m=np.where(here, np.nan_to_num(away, nan=AWAY_M), AWAY_M),
            here=here,
            time=at / max(1, len(scene.k) - 1),
            track=moves.track,
        )

    @cached_property
    def _also(self) -> Floats:
        """Orthonormal columns of what is there beside the means."""
        made = [
            self._less_means(feature.weights(self.swum))
            for effect in self.beside
            for feature in effect.paces
        ]
        return _span([np.zeros((len(self.rows), 0)), *made])

    @cached_property
    def _left(self) -> Floats:
        """Scores less all that is there."""
        return self.scores - self._also @ (self._also.T @ self.scores)

    @property
    def gained_beside(self) -> tuple[Floats, int]:
        """What features of what is there add to its model, shape (move,); number of strengths."""
        return _normal_gain(self.scores, self._left), self._also.shape[1]

    def gain(self, name: str, feature: Pace) -> Gain:
        """Return what a feature of an effect adds."""
        change, n = self._changed(feature)
        made = _normal_gain(self._left, self._left - change)
        return Gain(name=name, label=feature.label, log_p=made, n_strengths=n)

    def course(self, gain: Gain) -> Course:
        """Return what a feature gains at each move, and what it would if it were there."""
        effect = find_effect(gain.name)
        feature = next(each for each in effect.paces if each.label == gain.label)
        change, _ = self._changed(feature)
        apart = change * (self._left - change)
        return Course(apart=apart, expected=change**2 / 2, of=(self.scene, self.turns.at))

    def and_beside(self, effect: Effect) -> Paces:
        """Return fits in which one more effect is there."""
        made = replace(self, beside=(*self.beside, effect))
        kept = ("rows", "turns", "_groups", "scores", "swum")
        made.__dict__.update({key: getattr(self, key) for key in kept})
        return made

    def _changed(self, feature: Pace) -> tuple[Floats, int]:
        """Return by how much a feature changes each score, and the number of its strengths."""
        columns = self._less_means(feature.weights(self.swum))
        columns = columns - self._also @ (self._also.T @ columns)
        columns = columns[:, (columns**2).mean(axis=0) > _LEAST]
        found, _, rank, _ = np.linalg.lstsq(columns, self._left, rcond=None)
        return np.asarray(columns @ found), int(rank)


def pace_gains(paces: Paces, effects: Sequence[Effect]) -> list[Gain]:
    """Return what features of effects add to the law of speeds; those without are left out.

    Tracks of a few moves have no past to speak of: regressed on what is left of it beside a mean
    of their own, speeds would seem to swing (Nickell 1981, Econometrica 49: 1417-1426). Where a
    tenth of all moves have one speed there is no law of ranks.
    """
    if not paces.has_law:
        return []
    found = [
        paces.gain(effect.name, feature) for effect in effects for feature in effect.paces
    ]  # fmt: skip
    return [gain for gain in found if gain.n_strengths]


def _span(columns: Sequence[Floats]) -> Floats:
    """Return orthonormal columns with the span of all, of which some may be sums of others."""
    whole = np.concatenate(columns, axis=1)
    return np.asarray(orth(whole, rcond=_LEAST)) if whole.size else whole


def _means(values: Floats, group: NDArray[np.intp]) -> Floats:
    """Return the mean of each group, shape (group,) or (group, column)."""
    n = np.maximum(np.bincount(group), 1)
    if values.ndim == 1:
        return np.asarray(np.bincount(group, values) / n)
    return np.stack([np.bincount(group, column) / n for column in values.T], axis=1)


def _normal_scores(values: Floats, group: NDArray[np.int64]) -> Floats:
    """Return the normal scores of values within each group."""
    made = np.zeros_like(values)
    for number in np.unique(group):
        rows = group == number
        made[rows] = ndtri(rankdata(values[rows]) / (rows.sum() + 1))
    return made


def _table(scene: Scene, moves: Moves, values: Floats) -> Floats:
    """Return values of moves by the sample in which each ends, shape (sample, column)."""
    made = np.full((len(scene.k) + 1, scene.states.shape[2]), np.nan)
    made[moves.at + 1, moves.who] = values
    return made


def _known(
    scores: Floats, scene: Scene, at: NDArray[np.int64], who: NDArray[np.int64], ago: int
) -> Floats:
    """Return the scores of so many moves ago of the same track; 0 where there is none."""
    then = at + 1 - ago
    same = (then > 0) & (scene.tracks[np.maximum(then - 1, 0), who] == scene.tracks[at, who])
    return np.where(same, np.nan_to_num(scores[np.maximum(then, 0), who]), 0.0)


def _paces_of_all(states: Floats) -> Floats:
    """Return the normal score of everybody's last speed, robots' too, within the zone it began in.

    Shape (sample, column); NaN where it is not known.
    """
    speed, zone = states[:, SPEED], np.roll(states[:, ZONE], 1, axis=0)
    made = np.full(speed.shape, np.nan)
    known = np.isfinite(speed) & (speed >= 0) & (zone > 0)
    known[0] = False
    made[known] = _normal_scores(speed[known], zone[known].astype(np.int64))
    return made


def _last_turn(states: Floats, at: NDArray[np.int64], who: NDArray[np.int64]) -> Floats:
    """Return by how much the heading at a sample differs from that before it; 0 if unknown."""
    hx, hy = states[at, HX, who], states[at, HY, who]
    px, py = states[at - 1, HX, who], states[at - 1, HY, who]
    angle = np.arctan2(px * hy - py * hx, px * hx + py * hy)
    return np.where((at > 0) & np.isfinite(angle), np.abs(np.nan_to_num(angle)), 0.0)


def _normal_gain(before: Floats, after: Floats) -> Floats:
    """Return what a normal law gains at each step, its spread fitted before and after."""
    wide, narrow = (max(float((x**2).mean()), _LEAST) for x in (before, after))
    return 0.5 * (math.log(wide / narrow) + before**2 / wide - after**2 / narrow)
