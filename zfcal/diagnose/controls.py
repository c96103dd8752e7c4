"""Negative controls: questions whose answer is no in every tank.

Each belongs to an effect, which is asked of states that tell it nothing, such as a
neighbour's heading of twelve seconds ago.
One that is answered with yes in the final model says that the model, the filters or the
tracks are not what they are taken for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import candidate_of
from zfcal.diagnose.scores import summed
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import all_effects


def control_names() -> tuple[str, ...]:
    """Return the names of the controls, in the order of the effects that they belong to."""
    return tuple(effect.control.name for effect in all_effects() if effect.control)


def ask_controls(screen: Screen, seed: int) -> Floats:
    """Return the z of each control, in the order of their names.

    Parameters
    ----------
    screen
        Of the model.
    seed
        Of what a control draws.
    """
    scene, found = screen.scene, []
    for effect in all_effects():
        if effect.control:
            random = np.random.default_rng([seed, 12])
            states = effect.control.states(scene.states, scene.dt_s, random)
            candidate = candidate_of(effect.name, {})
            asked = screen.heading_scores(replace(scene, states=states), candidate)
            found.append(summed(candidate, screen.project(asked)).z)
    return np.array(found)
