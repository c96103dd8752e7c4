"""Recordings that can say little or nothing, asked in earnest: an answer or one clear error."""

import dataclasses

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import InputError
from zfcal.stages.diagnose.diagnose import DiagnoseOptions, diagnose
from zfcal.stages.events import say_nothing

QUICK = DiagnoseOptions(quick=True, n_workers=1)


def change_tracks(root, change):
    """Rewrite every segment of a trial."""
    for path in (root / "tracks").iterdir():
        lineage = Lineage(schema="zfcal.tracks/1", command="track")
        write_tracks(path, change(read_tracks(path)), lineage)


def asked(root):
    """Return the findings of a trial as a document that passes its schema."""
    path = diagnose(root, QUICK, say_nothing)
    document = read_json(path)
    check(document, "findings", path)
    return document


def test_a_trial_too_short_is_one_clear_error(make_trial):
    """Four seconds: it says how many steps there are and how many it takes."""
    root = make_trial(seconds=4)
    with pytest.raises(InputError, match=r"trial: .* needs 200 steps") as error:
        diagnose(root, QUICK, say_nothing)
    assert "Record for longer" in error.value.hint


def test_a_recording_in_which_all_are_lost_is_one_clear_error(make_trial):
    """Every position is a guess of the tracker."""
    root = make_trial(seconds=130)
    change_tracks(
        root, lambda t: dataclasses.replace(t, confidence=np.full_like(t.confidence, 0.1))
    )
    with pytest.raises(InputError, match="got 0 in 650 samples"):
        diagnose(root, QUICK, say_nothing)


def test_a_robot_alone_is_one_clear_error(make_trial):
    """There is nobody whose behaviour could be missing."""
    root = make_trial(seconds=130, n_fish=0, n_robots=1)
    with pytest.raises(InputError, match="0 fish and 1 robots") as error:
        diagnose(root, QUICK, say_nothing)
    assert error.value.hint


@pytest.mark.slow
def test_one_fish_is_asked_for_what_needs_no_neighbour(make_trial):
    """The others lack a neighbour, and say so."""
    document = asked(make_trial(seconds=200, n_fish=1))
    lacks = {each["name"]: each["lacks"] for each in document["details"]["screened"]}
    assert lacks["alignment"] == "a neighbour"
    assert lacks["turning-bias"] is None
    assert not {"alignment", "crowding"} & {each["name"] for each in document["effects"]}


@pytest.mark.slow
def test_constant_speed_ends_in_an_answer(make_trial):
    """No speed effect is found where all speeds are alike, and no number is infinite."""
    root = make_trial(seconds=130)

    def even(tracks):
        n = len(tracks) // 3
        turn = np.random.default_rng(1).normal(0, 0.2, (n, 3)).cumsum(axis=0)
        path = 0.5 + 0.02 * np.stack([np.cos(turn), np.sin(turn)], axis=-1).cumsum(axis=0)
        # A triangle wave keeps a path inside, its steps as long as they are.
        phase = path % 1.6
        xy = 0.1 + np.where(phase > 0.8, 1.6 - phase, phase)
        return dataclasses.replace(tracks, x_m=xy[..., 0].ravel(), y_m=xy[..., 1].ravel())

    change_tracks(root, even)
    on_speed = {"fatigue", "crowding", "speed-matching", "burst-and-coast", "freezing"}
    assert not on_speed & {each["name"] for each in asked(root)["effects"]}
