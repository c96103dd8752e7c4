"""A look by features: names forms that are not ours, and nothing where nothing is."""

from pathlib import Path

import numpy as np
import pytest

from hidden.scenario import Scenario, make_trial
from zfcal.artifacts.arenas import load_arena
from zfcal.diagnose.diagnose import diagnose
from zfcal.diagnose.features.asking import gains_of
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.naming import best_by_name
from zfcal.diagnose.findings import Verdict
from zfcal.diagnose.question import Question
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise
from zfcal.model.scene import make_scene
from zfcal.parameters import natural
from zfcal.tracks import Samples

pytestmark = pytest.mark.slow


def said(*_words):
    """Take no notice."""


@pytest.fixture(scope="module")
def tank():
    """Return the default arena."""
    return load_arena("two-rooms", Path())


@pytest.fixture(scope="module")
def fish(tank):
    """Return natural fish for it."""
    return natural(tuple((zone.name, zone.follows_walls) for zone in tank.zones), dt_s=0.2)


def recorded(effect, strength, seed, minutes):
    """Return samples of fish of the second simulator."""
    asked = Scenario(effect=effect, strength=strength, seed=seed, minutes=minutes)
    trial = make_trial(asked, oracle=False)
    xy = trial.samples_m
    return Samples(
        dt_s=0.2,
        k=np.arange(len(xy), dtype=np.int64),
        agent=trial.track_ids.astype(np.int32),
        kind=trial.robot_tracks.astype(np.int8),
        xy_m=xy,
        confidence=np.ones(xy.shape[:2], dtype=np.float32),
    )


@pytest.fixture(scope="module")
def found(tank, fish):
    """Return what is said of a quarter of an hour, or less."""

    def of(effect, strength, seed, minutes=15.0):
        samples = recorded(effect, strength, seed, minutes)
        question = Question(
            samples=samples, arena=tank, model=fish, seed=1, n_workers=1, noise_m=0.0,
            noise_source="known", n_null=5, quick=True,
        )  # fmt: skip
        return diagnose(question, said)

    return of


@pytest.mark.parametrize(
    ("form", "strength", "minutes"),
    [
        ("speed-turn-coupling/after-turn", 0.12, 10.0),
        ("burst-and-coast/rhythm", 0.13, 10.0),
        ("speed-matching/nearest", 0.13, 10.0),
        ("fatigue/uneven", 0.2, 15.0),
    ],
)
def test_a_form_that_is_not_ours_is_named_once(found, form, strength, minutes):
    """Slower after wide turns, swinging speeds, the pace of the nearest, two fish that tire."""
    told = found(form, strength, 3, minutes)
    assert told.verdict is Verdict.NAMED
    assert [each.name for each in told.effects] == [form.split("/")[0]]
    assert find_effect(form.split("/")[0]).paces


def test_a_strong_current_is_no_place(tank, fish):
    """It leans headings across walls by more than along them: 198 nats; the best place has 151."""
    scene = make_scene(recorded("directional-drift", "strong", 4, 10.0), tank)
    law = Law(scene=scene, fitted=maximise(scene, fish))
    names = ("directional-drift", "place-preference")
    nats = {
        each.name: each.nats for each in best_by_name(gains_of(law, list(map(find_effect, names))))
    }
    assert nats["directional-drift"] > 1.1 * nats["place-preference"]


@pytest.mark.parametrize("form", ["startle", "lit-room"])
def test_darts_and_lamps_are_no_effect_on_speeds_in_company(found, form):
    """What comes at times, and what one room does, is called by none of the names."""
    told = found(form, "clear", 3)
    names = {each.name for each in told.effects}
    assert not names & {"burst-and-coast", "speed-matching", "crowding", "fatigue"}


def test_slow_turns_are_no_crowding(found):
    """Fish that are near another turn, and are slow in turns: that has one name."""
    told = found("speed-turn-coupling", "strong", 12)
    assert [each.name for each in told.effects] == ["speed-turn-coupling"]


def test_a_sharp_range_has_the_listed_name(found):
    """Also where another form of what is beyond the list is nearer to it."""
    told = found("interaction-range", "clear", 12, 10.0)
    assert [each.name for each in told.effects] == ["interaction-range"]


def test_nothing_is_named_where_nothing_is_missing(found):
    """Fish of the base law alone."""
    assert found(None, "clear", 4).verdict is Verdict.NO_EFFECT
