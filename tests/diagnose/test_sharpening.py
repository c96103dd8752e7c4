"""A model whose replicates look, through the measurement, like the recording."""

import dataclasses

import numpy as np
import pytest

from zfcal.diagnose.null import Chain, Measurement
from zfcal.diagnose.sharpening import sharpened
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene

NOISE_M = 0.0015


@pytest.fixture(scope="module")
def blurred(record, tank, fish):
    """Return the chain of ten minutes of natural fish whose positions err by 1.5 mm."""
    exact = record(43, minutes=10.0)
    wrong_m = np.random.default_rng(2).normal(0.0, NOISE_M, exact.xy_m.shape)
    samples = dataclasses.replace(exact, xy_m=exact.xy_m + wrong_m)
    return Chain(
        samples=samples, arena=tank, fitted=maximise(make_scene(samples, tank), fish),
        measurement=Measurement(noise_m=NOISE_M), seed=3,
    )  # fmt: skip


@pytest.fixture(scope="module")
def sharp(blurred):
    """Return it with the model that makes what was fitted."""
    return sharpened(blurred)


def _kappas(parameters):
    return np.array([(zone.kappa_0, zone.kappa_f) for zone in parameters.zones[1:]])


def test_the_maker_is_sharper_than_what_was_fitted(blurred, sharp):
    """By walls and in the centre, and nearer to the fish that swam (9 and 8, and 20)."""
    assert (_kappas(sharp.simulated) > _kappas(blurred.simulated)).all()
    assert sharp.fitted is blurred.fitted


@pytest.mark.slow
def test_its_replicates_are_fitted_as_the_recording_was(blurred, sharp):
    """Inverse concentrations of three replicates: their mean error is less than half of that
    without.
    """
    wanted = 1 / _kappas(blurred.fitted.parameters)

    def off(chain):
        found = [1 / _kappas(chain.screen(k).fitted.parameters) for k in range(3)]
        return np.abs(np.mean(found, axis=0) - wanted).mean()

    assert off(sharp) < 0.5 * off(blurred)


def test_without_noise_hardly_anything_is_moved(record, tank, fish):
    """Concentrations stay within a quarter: the luck of two simulations."""
    samples = record(43, minutes=10.0)
    plain = Chain(
        samples=samples, arena=tank, fitted=maximise(make_scene(samples, tank), fish),
        measurement=Measurement(), seed=3,
    )  # fmt: skip
    moved = _kappas(sharpened(plain).simulated) / _kappas(plain.simulated)
    assert np.abs(np.log(moved[:, 0])).max() < 0.25
