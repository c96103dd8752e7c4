"""Negative controls: silent where all is well, and able to fire."""

import numpy as np
import pytest

from zfcal.diagnose.controls import ask_controls, control_names
from zfcal.diagnose.screening import Screen
from zfcal.model.effects.alignment import LATE_S
from zfcal.model.extended import maximise
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_controls_are_silent_on_a_right_model(screen, seed):
    """One z for each, within four standard errors."""
    z = ask_controls(screen(seed), seed)
    assert z.shape == (len(control_names()),)
    assert np.abs(z).max() < 4


def test_controls_stay_silent_where_fish_have_a_memory(screen):
    """What depends on the own last turn does not depend on a turn that was dealt."""
    z = ask_controls(screen(71, {"turning-memory": {"strength": 0.8}}), 1)
    assert abs(z[1]) < 4


def test_a_seed_deals_the_turns(screen):
    """The same again with the same seed, others with another; the first control has none."""
    own = screen(11)
    one, again, other = (ask_controls(own, seed) for seed in (1, 1, 2))
    assert np.array_equal(one, again)
    assert one[0] == other[0]
    assert one[1] != other[1]


def test_headings_of_twelve_seconds_ago_are_noticed(worlds, base, fish):
    """Headings drawn about what the others' were then: the control fires."""
    scene, fitted = base
    turns, late = scene.turns, round(LATE_S / scene.dt_s)
    then = scene.states[np.maximum(turns.at - late, 0)]
    others = then[:, [HX, HY]].sum(axis=2) - then[np.arange(len(turns)), :, turns.who][:, [HX, HY]]
    others /= np.maximum(np.linalg.norm(others, axis=1), 1e-9)[:, None]

    def tilt(angle):
        return np.exp(np.outer(others[:, 0], np.cos(angle)) + np.outer(others[:, 1], np.sin(angle)))

    changed = worlds.redrawn(scene, fitted, np.random.default_rng(1), tilt)
    wrong = Screen(scene=changed, fitted=maximise(changed, fish))
    assert ask_controls(wrong, 1)[0] > 6


def test_the_recording_is_left_as_it_was(screen):
    """Controls ask other states, not changed ones."""
    own = screen(11)
    before = own.scene.states[:, [HX, HY, PAST_HX, PAST_HY]].copy()
    ask_controls(own, 3)
    assert np.array_equal(own.scene.states[:, [HX, HY, PAST_HX, PAST_HY]], before)
