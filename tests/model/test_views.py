"""What agents of a scene saw: as a simulation has it when it asks an effect."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from zfcal.model.packing import pack
from zfcal.model.scene import make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.model.views import angles_of_moves, speed_factor
from zfcal.tracks import Samples

MATCHING = {"speed-matching": {"exponent": 0.8, "focus": 2.0}}
SEEN = {
    "at once": {},
    "late": {"reaction-delay": {"delay_s": 0.4}},
    "of those in front": {"rear-blind-zone": {"ignored": 1.0}},
    "late, of those in front": {
        "reaction-delay": {"delay_s": 0.4},
        "rear-blind-zone": {"ignored": 1.0},
    },
}


@pytest.mark.parametrize("others", SEEN.values(), ids=SEEN.keys())
def test_a_speed_is_what_was_drawn_times_the_factor(two_rooms, model, others):
    """All draws are from one bin, 0.06 to 0.08 m/s: without the factor speeds lie in it."""
    one_bin = tuple(float(b == 3) for b in range(10))
    zones = tuple(dataclasses.replace(zone, speed_frequency=one_bin) for zone in model.zones)
    swims = dataclasses.replace(model, zones=zones, effects=MATCHING | others)
    xy_m, _ = simulate_tracks(swims, two_rooms, n_agents=5, n_steps=600, seed=3)
    samples = Samples(
        dt_s=model.dt_s,
        k=np.arange(600),
        agent=np.arange(1, 6, dtype=np.int32),
        kind=np.zeros(5, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones((600, 5), dtype=np.float32),
    )
    scene = make_scene(samples, two_rooms)
    packed = pack([swims], two_rooms)

    factor = speed_factor(scene, packed)

    settled = (scene.moves.at > 5) & (scene.moves.speed_m_s > 0.002)
    drawn = (scene.moves.speed_m_s / factor)[settled]
    assert settled.sum() > 2_500
    assert np.ptp(factor) > 0.3
    inside = (drawn > 0.06 - 1e-6) & (drawn < 0.08 + 1e-6)
    assert inside.mean() > 0.999
    assert np.array_equal(speed_factor(scene, packed, angles_of_moves(scene, packed)), factor)
