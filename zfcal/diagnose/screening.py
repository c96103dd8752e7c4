r"""Efficient scores of candidate effects in a fitted model.

Near its null an effect of strength b changes the density of a step by the factor
``1 + b s``; s is the effect's score, whose expectation given the past is zero when the
model is right. What the model's own parameters could explain is projected off, so

    z = sum(s~) / sqrt(sum(s~^2))

is standard normal for a right model, whatever the dependence along the trajectory (a
martingale; Rao 1948, Mathematical Proceedings of the Cambridge Philosophical Society 44:
50-57; Neyman 1959, C(alpha) tests). Headings are judged given the speed of the step.
Speeds are judged given the zone, by the covariance of their response with what the
effect responds to, within each zone; unless that is a place, within fields of the tank.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.chances import normal_of
from zfcal.diagnose.fields import fields_of, is_within_fields
from zfcal.diagnose.freezes import rest_score, rested_steps
from zfcal.diagnose.scores import (
    Score,
    Tables,
    basis_of,
    by_track,
    centred,
    summed,
    tables_of,
    tame,
)
from zfcal.model.directions import turned_by
from zfcal.model.effects import find_effect
from zfcal.model.extended import with_effect, without_effects
from zfcal.model.fitted import SCALES, Fitted, constants
from zfcal.model.kernels.scores import (
    component_score,
    factor_score,
    late_score,
    mean_waves,
    mixture_score,
    social_score,
)
from zfcal.model.kernels.state import SPEED, TRAIT, Packed
from zfcal.model.packing import pack
from zfcal.model.scene import Scene
from zfcal.model.views import (
    Polynomial,
    angles_of_moves,
    attended,
    components_of,
    factors_of,
    harmonics,
    late_sight,
    polynomial_of,
    speed_factor,
    turned_view,
    turns_of,
)
from zfcal.units import HEADING_MIN_STEP_M

_LEFT = 1e-4
"""Share of a score's squares below which the model explains all of it."""

_MOST_HARMONICS = 2

_LATE_SHARE = 0.3
"""Share of a late response that is asked for: all fish that respond late are seldom seen."""

_FAST_QUANTILE = 0.995


@dataclass(frozen=True, kw_only=True, eq=False)
class Screen:
    """A fitted model, ready to be asked for effects.

    Parameters
    ----------
    scene
        Measured, or simulated.
    fitted
        The model at its maximum likelihood there.
    """

    scene: Scene
    fitted: Fitted

    @cached_property
    def _tables(self) -> Tables:
        return tables_of(self.fitted)

    @cached_property
    def _bases(self) -> tuple[list[Floats], Floats]:
        """Return orthonormal bases of the model's own scores: per zone, and of its effects'."""
        zones = []
        for x, scores in zip(self.fitted.x, self.fitted.scores, strict=True):
            # A parameter at its bound explains nothing on the other side.
            open_ = np.ones(scores.shape[1], dtype=bool)
            open_[-1] = x[-1] > 2e-6
            zones.append(basis_of(scores[:, open_]))
        psi = self.fitted.effect_scores.copy()
        for basis, turns in zip(zones, self.fitted.turns, strict=True):
            psi[turns.rows] -= basis @ (basis.T @ psi[turns.rows])
        return zones, basis_of(psi)

    @cached_property
    def _mixtures(self) -> list[tuple[Floats, Floats, Floats, Floats]]:
        """What the scores of mixtures need of each zone's turns."""
        return [self._tables.mixtures(turns.rows) for turns in self.fitted.turns]

    @property
    def probability(self) -> Floats:
        """Probability of each cell of headings, shape (turn, cell)."""
        return self._tables.probability

    def project(self, scores: Floats, *, off_effects: bool = True) -> Floats:
        """Return scores of turns less what the model's own parameters could explain.

        Parameters
        ----------
        scores : ndarray, shape (turn,)
        off_effects
            Whether the parameters of its effects count as well as the base's. Projected
            off itself the score of an effect in the model is nothing, however it fits.
        """
        rest = np.where(self.fitted.used, scores, 0.0)
        zones, psi = self._bases
        for basis, turns in zip(zones, self.fitted.turns, strict=True):
            rest[turns.rows] -= basis @ (basis.T @ rest[turns.rows])
        return np.asarray(rest - psi @ (psi.T @ rest)) if off_effects else rest

    def ask(self, candidate: Candidate) -> Score:
        """Return the score of one candidate."""
        effect = candidate.effect
        if effect.on_speed:
            return self._ask_speed(candidate)
        scene = self.scene
        if effect.by_trait:
            # Scores by a trait of one; whoever has which shows in how they scatter.
            scene = replace(scene, states=scene.states.copy())
            scene.states[:, TRAIT] = 1.0
        raw = self.heading_scores(scene, candidate)
        if effect.by_trait:
            # The model's parameters are the same for all: they explain nothing of how fish differ.
            return self._scatter(candidate, np.where(self.fitted.used, raw, 0.0))
        steps = self.project(raw)
        if not (steps**2).sum() > _LEFT * (raw**2).sum():
            # What the model has already leaves but the error of its own approximation.
            steps = np.zeros_like(raw)
        return summed(candidate, steps)

    def own_scores(self, candidate: Candidate) -> Floats:
        """Return the scores of an effect that is in the model, not projected off itself."""
        if candidate.effect.on_speed:
            return self.ask(candidate).steps
        return self.project(self.heading_scores(self.scene, candidate), off_effects=False)

    def heading_scores(self, scene: Scene, candidate: Candidate) -> Floats:
        """Return the scores of an effect on the heading, before projection, shape (turn,).

        Parameters
        ----------
        scene
            Whose states the effect asks: the own scene, or one with other states.
        candidate
            What is asked for.
        """
        effect, fitted = candidate.effect, self.fitted
        if effect.lag is not None:
            return self._late_scores(candidate)
        base = without_effects(fitted.parameters)

        def at(strength: float) -> Packed:
            asked = {effect.name: candidate.values(strength)}
            return pack([replace(base, effects=asked)], scene.arena)

        # Mixtures are compared at a strength worth noticing, tilts next to none.
        tables, angle, strong = self._tables, fitted.view.seen_sr, candidate.asked_at
        total, some = np.zeros(len(scene.turns)), np.empty(len(scene.turns))
        shape = candidate.values(strong)
        if effect.calls("component", shape):
            parts = components_of(scene, at(strong), angle)
            if len(fitted.view.whole_rad):
                parts[:, :, 1:3] = turned_by(parts[:, :, 1:3], fitted.view.whole_rad[:, None])
            component_score(parts, scene.turns.taken, *tables.mixtures(), some)
            total += some / strong
        if effect.sight is not None:
            total += self._sight_scores(scene, at(strong)) / strong
        if any(effect.calls(kind, shape) for kind in ("rotation", "whole_rotation")):
            total += self._turned_scores(scene, at(effect.probe)) / effect.probe
        if effect.calls("factor", shape):
            form = polynomial_of({effect.name: shape})
            tilted = self._tilted_scores(scene, at(effect.probe), form)
            total += tilted * fitted.weight / effect.probe
        return total

    def _tilted_scores(self, scene: Scene, packed: Packed, form: Polynomial | None) -> Floats:
        """Return the change of the log density by factors on headings."""
        angle, probability = self.fitted.view.seen_sr, self.probability
        scores = np.empty(len(scene.turns))
        if form is None:
            tilt, tilt_taken = factors_of(scene, packed, angle, probability)
            factor_score(tilt, tilt_taken, probability, scores)
            return scores
        waves, zones, log_taken = harmonics(scene, packed, angle, form)
        expected, lands = self._mean_waves
        scores[:] = log_taken - (waves * expected[:, : waves.shape[1]]).sum(axis=1)
        return scores - (zones * lands).sum(axis=1)

    @cached_property
    def _mean_waves(self) -> tuple[Floats, Floats]:
        """Return what the model expects of cosines and sines, and of the landing zones."""
        turns = self.scene.turns
        waves = np.empty((len(turns), 1 + 2 * _MOST_HARMONICS))
        zones = np.empty((len(turns), turns.share.shape[2]))
        mean_waves(self.probability, turns.share, waves, zones)
        return waves, zones

    def _sight_scores(self, scene: Scene, packed: Packed) -> Floats:
        fitted, turns = self.fitted, scene.turns
        changed = attended(scene, packed, fitted.view.angle_sr)
        total = np.zeros(len(turns))
        for x, zone, mixtures in zip(fitted.x, fitted.turns, self._mixtures, strict=True):
            rows, own = zone.rows, x[:3] * SCALES
            some = np.empty(len(rows))
            social_score(
                fitted.view.toward[rows], changed[rows], fitted.view.angle_sr[rows], zone.taken,
                own[1], constants(own[:2])[1], own[2], *mixtures, some,
            )  # fmt: skip
            total[rows] = some
        return total

    def _turned_scores(self, scene: Scene, packed: Packed) -> Floats:
        """Return the scores of a mixture whose directions are turned."""
        fitted, scores = self.fitted, np.zeros(len(scene.turns))
        angles = turns_of(scene, packed, fitted.view.seen_sr)
        if not any(angle.any() for angle in angles):
            return scores
        view = turned_view(fitted.view, *angles)
        other, _, other_taken = replace(fitted, view=view).tables()
        mixture_score(other, other_taken, *self._tables.mixtures(), scores)
        return scores

    def _late_scores(self, candidate: Candidate) -> Floats:
        """Return the scores of a mixture with the model that responds late."""
        fitted = self.fitted
        values = candidate.values(_LATE_SHARE)
        packed = pack([with_effect(fitted.parameters, candidate.name, values)], self.scene.arena)
        toward, angle = late_sight(self.scene, packed, fitted.view.late)
        if len(fitted.view.whole_rad):
            toward = turned_by(toward, fitted.view.whole_rad[:, None])
        total = np.zeros(len(self.scene.turns))
        for x, zone, mixtures in zip(fitted.x, fitted.turns, self._mixtures, strict=True):
            rows, own = zone.rows, x[:3] * SCALES
            some = np.empty(len(rows))
            late_score(
                (fitted.view.toward[rows], fitted.view.angle_sr[rows]),
                (toward[rows], angle[rows]), zone.taken,
                own[1], constants(own[:2])[1], _LATE_SHARE * own[2], *mixtures, some,
            )  # fmt: skip
            total[rows] = some
        return total / _LATE_SHARE

    def _scatter(self, candidate: Candidate, steps: Floats) -> Score:
        """Return the scatter of individuals as a normal deviate (Q of Cochran 1954)."""
        sums, information = by_track(self.scene.turns.track, steps)
        own = information > 0
        sums, information = sums[own], information[own]
        if len(sums) < 2:
            return Score(candidate=candidate, z=0.0, strength=0.0, information=0.0, steps=steps)
        mean = sums.sum() / information.sum()
        q = float(((sums - mean * information) ** 2 / information).sum())
        each = sums / information
        spread2 = max(0.0, float(each.var(ddof=1) - (1 / information).mean()))
        return Score(
            candidate=candidate,
            z=normal_of(q, len(sums) - 1),
            strength=float(np.sqrt(spread2)),
            information=float(information.sum()),
            steps=steps,
        )

    @cached_property
    def _moves(self) -> Packed:
        return pack([self.fitted.parameters], self.scene.arena)

    @cached_property
    def _move_angles(self) -> Floats:
        return angles_of_moves(self.scene, self._moves)

    @cached_property
    def own_speeds(self) -> Floats:
        """Speeds with the model's effects divided out, in m/s, shape (move,)."""
        return self.scene.moves.speed_m_s / self.model_factor

    @cached_property
    def model_factor(self) -> Floats:
        """What the model's own effects make of the speed of each move, shape (move,)."""
        return self.speed_factor(self._moves)

    def speed_factor(self, packed: Packed) -> Floats:
        """Return the factor of effects on the speed of each move, seen as the fitted model sees."""
        return speed_factor(self.scene, packed, self._move_angles)

    @cached_property
    def still(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether each move was none, and whether the one before was none."""
        least = HEADING_MIN_STEP_M / self.scene.dt_s
        moves = self.scene.moves
        before = self.scene.states[moves.at, SPEED, moves.who]
        return moves.speed_m_s < least, before < least

    def still_for(self, steps: int) -> NDArray[np.bool_]:
        """Return whether each move was preceded by so many that were none, shape (move,)."""
        moves, least = self.scene.moves, HEADING_MIN_STEP_M / self.scene.dt_s
        still = moves.at >= steps - 1
        for back in range(steps):
            at = np.maximum(moves.at - back, 0)
            still &= self.scene.states[at, SPEED, moves.who] < least
        return np.asarray(still)

    def _ask_speed(self, candidate: Candidate) -> Score:
        effect = candidate.effect
        if effect.rests:
            rested = self.still_for(rested_steps(candidate))
            return rest_score(
                candidate, self.still[0], rested, self.scene.moves.zone, self.scene.dt_s
            )
        probe = replace(
            without_effects(self.fitted.parameters),
            effects={effect.name: candidate.values(effect.probe)},
        )
        factor = self.speed_factor(pack([probe], self.scene.arena))
        cue = np.log(np.maximum(factor, 1e-9)) / effect.probe
        kept, zone = self._swum, self.scene.moves.zone.astype(np.int64)
        within = self.fields if is_within_fields(candidate) else zone
        response = centred(self._tamed_speeds, within, kept)
        cue = tame(centred(cue, within, kept))
        score, squares = summed(candidate, cue * response), float((cue**2).sum())
        # A factor exp(s cue) changes the speed by s cue times its mean.
        unit = float(self.own_speeds[kept].mean()) if kept.any() else 1.0
        change = max(squares * unit, 1e-300)
        return replace(
            score,
            strength=score.strength * score.information / change,
            information=change**2 / max(score.information, 1e-300) if squares else 0.0,
        )

    @cached_property
    def _swum(self) -> NDArray[np.bool_]:
        """Return which moves count for effects on speed."""
        stopping = any(find_effect(name).rests for name in self.fitted.parameters.effects)
        n = len(self.scene.moves)
        return ~(self.still[0] | self.still[1]) if stopping else np.ones(n, dtype=bool)

    @cached_property
    def fields(self) -> NDArray[np.int64]:
        """Field of the tank in which each move began, shape (move,)."""
        return fields_of(self.scene, self._swum)

    @cached_property
    def _tamed_speeds(self) -> Floats:
        return np.asarray(np.minimum(self.own_speeds, np.quantile(self.own_speeds, _FAST_QUANTILE)))


def ask_all(screen: Screen, candidates: Sequence[Candidate], n_workers: int) -> list[Score]:
    """Return the scores of candidates, in their order; the numbers do not depend on workers."""
    if not candidates:
        return []
    _ = screen.project(np.zeros(len(screen.scene.turns)))
    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        return list(pool.map(screen.ask, candidates))
