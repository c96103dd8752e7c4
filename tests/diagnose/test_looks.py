"""Noise is measured by two replicates, by six where these leave a doubt; looks explain names."""

from types import SimpleNamespace

import numpy as np
import pytest

from zfcal.diagnose import heading_look, looks, speed_look
from zfcal.diagnose.case import QUICK_REPLICATES
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.looks import noise_of_features


def gain_of(nats, name="alignment"):
    """Return a gain of so many nats with one strength, before those are taken off."""
    return Gain(name=name, label="x", log_p=np.full(400, nats / 400), n_strengths=1)


@pytest.fixture
def asked(monkeypatch):
    """Return what noise makes some gains, of what each replicate gains, and which were asked."""

    def of(gains, replicates):
        numbers = []

        def run_null(_chain, ask, some, *, n_workers):
            assert n_workers == 2
            numbers.extend(some)
            return [ask(number, number) for number in some]

        monkeypatch.setattr(looks, "run_null", run_null)
        case = SimpleNamespace(chain=None, question=SimpleNamespace(n_workers=2))
        found = noise_of_features(
            case,
            gains,
            lambda number, _effects: [
                gain_of(own[number], gain.name) for gain, own in zip(gains, replicates, strict=True)
            ],
        )
        return found, numbers

    return of


@pytest.mark.parametrize(
    ("nats", "of_noise", "is_in_doubt"),
    [
        (20.0, 18.0, False),  # Noise makes as much.
        (10.0, 4.0, False),  # It makes as much in one of twenty.
        (15.0, 4.0, True),  # In one of a hundred.
        (20.0, 5.0, True),
        (14.0, 0.0, True),  # Two that make nothing say little of a third.
        (60.0, 0.0, True),
        (400.0, 5.0, False),  # A small part of that.
        (400.0, 30.0, True),  # It makes no such gain, but how much of it counts for the order.
    ],
)
def test_further_replicates_are_asked_where_two_leave_a_doubt(asked, nats, of_noise, is_in_doubt):
    """All six then, and their mean counts."""
    own = np.maximum(of_noise + np.array([0.2, -0.2, 3.0, 3.0, 3.0, 3.0]), 0.0)
    (found,), numbers = asked([gain_of(nats)], [own])
    assert numbers == list(range(QUICK_REPLICATES if is_in_doubt else 2))
    assert found.mean_nats == pytest.approx(own[: len(numbers)].mean())


@pytest.mark.parametrize("nats", [(400.0, 20.0), (20.0, 400.0), (4.0, 400.0), (400.0, 4.0)])
def test_one_that_is_in_doubt_is_enough(asked, nats):
    """Of several features; and what noise hides beside one that stands is known as well."""
    gains = [gain_of(nats[0]), gain_of(nats[1], "crowding")]
    found, numbers = asked(gains, [np.full(6, 5.0), np.full(6, 5.0)])
    assert (len(found), len(numbers)) == (2, QUICK_REPLICATES)


def test_two_replicates_show_the_mean_less_well(asked):
    """So the same gain is likelier by chance."""
    own = np.full(6, 5.0)
    (of_two,), _ = asked([gain_of(400.0)], [own])
    (of_six,), _ = asked([gain_of(20.0)], [own])
    assert of_two.chance(20.0, 1) > 2 * of_six.chance(20.0, 1)


@pytest.mark.parametrize("look", [heading_look, speed_look])
def test_a_look_explains_a_name_by_what_gains_beside_it(look, monkeypatch):
    """Both do."""
    monkeypatch.setattr(look, "explained", lambda told, ask: (told, ask))
    assert look._Looks.explained(SimpleNamespace(_beside="beside"), "told") == ("told", "beside")
