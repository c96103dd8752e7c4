"""Negative controls: questions whose answer is no in every tank.

A neighbour's heading of twelve seconds ago, and a last turn that was dealt at random.
One that is answered with yes in the final model says that the model, the filters or the
tracks are not what they are taken for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.scores import summed
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import find_effect
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY
from zfcal.model.scene import Scene

LATE_S = 12.0
NAMES = ("neighbours' heading 12 s ago", "a shuffled turn")


def ask_controls(screen: Screen, seed: int) -> Floats:
    """Return the z of each control, in the order of `NAMES`.

    Parameters
    ----------
    screen
        Of the model.
    seed
        Deals the turns.
    """
    scene = screen.scene
    asked = ((_late(scene), "alignment"), (_shuffled(scene, seed), "turning-memory"))
    return np.array([_ask(screen, other, name) for other, name in asked])


def _ask(screen: Screen, scene: Scene, name: str) -> float:
    effect = find_effect(name)
    shape = {p.name: p.default for p in effect.parameters if p.name != effect.strength}
    candidate = Candidate(effect=effect, shape=shape)
    return summed(candidate, screen.project(screen.heading_scores(scene, candidate))).z


def _late(scene: Scene) -> Scene:
    """Return a scene in which all have the heading of 12 s ago."""
    late = min(max(1, round(LATE_S / scene.dt_s)), len(scene.states) - 1)
    states = scene.states.copy()
    for row in (HX, HY):
        states[late:, row] = scene.states[:-late, row]
        states[:late, row] = 0.0
    return replace(scene, states=states)


def _shuffled(scene: Scene, seed: int) -> Scene:
    """Return a scene in which the last turns are dealt anew among all agents and times."""
    states = scene.states.copy()
    now = np.arctan2(states[:, HY], states[:, HX])
    turn = now - np.arctan2(states[:, PAST_HY], states[:, PAST_HX])
    dealt = np.random.default_rng([seed, 12]).permutation(turn.ravel()).reshape(turn.shape)
    states[:, PAST_HX], states[:, PAST_HY] = np.cos(now - dealt), np.sin(now - dealt)
    return replace(scene, states=states)
