"""An effect's own statistic, step by step and against what it responds to, for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.findings import Trace
from zfcal.diagnose.naming import Refit
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import Effect
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY, SPEED, WALL, ZONE, X, Y
from zfcal.model.scene import Moves, Scene

_BINS = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cue:
    name: str
    values: Floats


def trace(score: Score, before: Screen, after: Refit) -> Trace:
    """Return the efficient scores of an effect, without it and with it in the model.

    Parameters
    ----------
    score
        Of the effect in the model without it.
    before
        That model.
    after
        The model with it.

    Notes
    -----
    Scores are in units of their own standard deviation. A model expects zero of them;
    what is left when the effect is in it is what it does not explain.
    """
    scene = before.scene
    steps: Moves = scene.moves if score.candidate.effect.on_speed else scene.turns
    unit = float(score.steps.std()) or 1.0
    own = np.sign(score.z or 1.0) * score.steps / unit
    left = np.sign(score.z or 1.0) * after.screen.own_scores(score.candidate) / unit
    states = scene.states[steps.at, :, steps.who]
    cue = _cue(score.candidate.effect, scene, steps)
    middle, observed = _binned(cue.values, own)
    _, rest = _binned(cue.values, left)
    return Trace(
        time_s=scene.time_s(steps),
        x_m=states[:, X],
        y_m=states[:, Y],
        track=steps.track,
        before=own,
        after=left,
        cue=middle,
        observed=observed,
        expected_before=np.zeros_like(observed),
        expected_after=observed - rest,
        cue_name=cue.name,
        response_name="score of the effect (standard deviations a step)",
    )


def _cue(effect: Effect, scene: Scene, steps: Moves) -> _Cue:
    states = scene.states[steps.at, :, steps.who]
    if effect.shown_against == "time":
        return _Cue(name="time (min)", values=scene.time_s(steps) / 60)
    if effect.shown_against == "speed":
        return _Cue(name="speed of the step before (cm/s)", values=100 * states[:, SPEED])
    if effect.shown_against == "turn":
        return _Cue(name="the last turn (degrees to the left)", values=_last_turn_deg(states))
    if effect.shown_against == "wall" or scene.n_fish + scene.n_robots < 2:
        return _Cue(name="distance to the wall (cm)", values=100 * states[:, WALL])
    return _Cue(name="distance to the nearest neighbour (cm)", values=100 * _nearest(scene, steps))


def _last_turn_deg(states: Floats) -> Floats:
    """Return by how much each turned in the step before, in degrees; NaN without a step before."""
    now, before = states[:, [HX, HY]], states[:, [PAST_HX, PAST_HY]]
    sine = before[:, 0] * now[:, 1] - before[:, 1] * now[:, 0]
    turn = np.degrees(np.arctan2(sine, (now * before).sum(axis=1)))
    known = (now != 0).any(axis=1) & (before != 0).any(axis=1)
    return np.where(known, turn, np.nan)


def _nearest(scene: Scene, steps: Moves) -> Floats:
    all_ = scene.states[steps.at]
    rows = np.arange(len(steps))
    away = np.hypot(
        all_[:, X] - all_[rows, X, steps.who][:, None],
        all_[:, Y] - all_[rows, Y, steps.who][:, None],
    )
    away[rows, steps.who] = np.inf
    away[all_[:, ZONE] == 0] = np.inf
    nearest = away.min(axis=1)
    return np.where(np.isfinite(nearest), nearest, np.nan)


def _binned(cue: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the middle of each of twelve equally full bins, and the mean there."""
    known = ~np.isnan(cue)
    cue, values = cue[known], values[known]
    if len(cue) < _BINS:
        return np.zeros(0), np.zeros(0)
    order = np.argsort(cue, kind="stable")
    groups = np.array_split(order, _BINS)
    middle = np.array([np.median(cue[group]) for group in groups])
    return middle, np.array([values[group].mean() for group in groups])
