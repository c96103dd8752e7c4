"""By how much positions err is told by the likelihood."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.features.noise import _peak, likely_noise_m
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene


@pytest.mark.slow
def test_exact_positions_have_no_noise(base):
    """Of the simulated law itself any noise is less likely."""
    scene, fitted = base
    assert likely_noise_m(scene, fitted) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("noise_m", [5e-4, 2e-3])
def test_noise_is_found_to_a_third(record, tank, fish, noise_m):
    """Half a millimetre and two, in ten minutes; eight draws find too little of two."""
    samples = record(32)
    rng = np.random.default_rng(5)
    there = samples.xy_m + noise_m * rng.standard_normal(samples.xy_m.shape)
    scene = make_scene(dataclasses.replace(samples, xy_m=there), tank)
    found_m = likely_noise_m(scene, maximise(scene, fish))
    assert found_m == pytest.approx(noise_m, rel=1 / 3)


@pytest.mark.parametrize(
    ("nats", "expected"),
    [([0.0, 4.0, 0.0], 1.0), ([3.0, 4.0, 3.0], 1.0), ([4.0, 4.0, 0.0], 2**-0.5), ([1.0, 2.0], 1.0)],
)
def test_the_top_of_a_parabola(nats, expected):
    """In the logarithm of the noise: between its neighbours, or at the last that was tried."""
    assert _peak(1.0, nats) == pytest.approx(expected)
