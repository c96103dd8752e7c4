"""Whether a further effect is there, or is what an earlier one of another form leaves over.

An effect in the model has the form that we gave it. Its true form may be another: it may fade
along the walls, grow with the speed, differ between fish, reach farther. What the model lacks
then is, to first order, the effect's own score times something that was known before the
step, or its score at another shape. Where the model is right these sum to nothing, as every
score does, and so they can be projected off the score of a further effect as the scores of
the model's own parameters are. An effect that is there stands as before; what was left over
falls.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate, candidates_of
from zfcal.diagnose.scores import Score, basis_of
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.surroundings import surroundings
from zfcal.model.scene import Moves, Scene

_OUTLASTS = 0.75
"""Share of its standard errors that an effect must keep."""

_FAR_M, _NEAR_M, _WALLS_M = 1.0, 0.01, 0.1
_SEEN = 0.02
"""Share of the steps of which a fish must have as many to be asked for itself."""


def outlasts(score: Score, screen: Screen, earlier: Sequence[Candidate]) -> bool:
    """Return whether an effect is asked for beside other forms of those that were added before.

    Parameters
    ----------
    score
        Of the effect in the model that has the others.
    screen
        That model.
    earlier
        The effects that were added to it, at their shapes. One that acts on headings leaves
        nothing over in speeds, and the other way round.
    """
    asked = score.candidate.effect
    if not asked.in_any_steps:
        return True
    alike = [
        each for each in earlier if each.effect.on_speed == asked.on_speed and not each.effect.rests
    ]
    if not alike:
        return True
    scene = screen.scene
    about = _modulators(scene, scene.moves if asked.on_speed else scene.turns)
    columns = np.concatenate([_forms(screen, each, about) for each in alike], axis=1)
    basis = basis_of(columns)
    rest = score.steps - basis @ (basis.T @ score.steps)
    return bool(abs(_z(rest)) > _OUTLASTS * abs(_z(score.steps)))


def _z(steps: Floats) -> float:
    return float(steps.sum() / max(np.sqrt((steps**2).sum()), 1e-300))


def _forms(screen: Screen, candidate: Candidate, about: Floats) -> Floats:
    """Return the scores of other forms of an effect in the model, shape (step, form)."""
    shapes = candidates_of((candidate.effect,), screen.scene.arena)
    others = [screen.own_scores(each) for each in shapes if each.shape != candidate.shape]
    return np.column_stack([screen.own_scores(candidate)[:, None] * about, *others])


def _modulators(scene: Scene, steps: Moves) -> Floats:
    """Return what an effect's strength may depend on, known when a step begins.

    Returns
    -------
    ndarray, shape (step, modulator)
        Ones, then columns of mean zero and standard deviation one, or of zeros.
    """
    about = surroundings(scene, steps)
    near_m = np.where(np.isfinite(about.near_m), about.near_m, _FAR_M)
    columns = [
        np.log(near_m + _NEAR_M),
        about.company,
        np.minimum(about.wall_m, _WALLS_M),
        about.x_m,
        about.y_m,
        about.x_m**2,
        about.y_m**2,
        about.x_m * about.y_m,
        about.speed_m_s,
        about.time_s,
        (about.heading * about.past).sum(axis=1),
        (about.heading * about.toward_near).sum(axis=1),
        (about.heading * about.toward_middle).sum(axis=1),
    ]
    ids, counts = np.unique(steps.track, return_counts=True)
    seen = ids[counts > _SEEN * len(steps)]
    columns += [(steps.track == own).astype(np.float64) for own in seen[1:]]
    table = np.column_stack(columns)
    spread = table.std(axis=0)
    return np.column_stack(
        [np.ones(len(steps)), (table - table.mean(axis=0)) / np.where(spread > 0, spread, 1.0)]
    )
