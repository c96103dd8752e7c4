"""A trial's settings, and where its files lie."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.errors import InputError
from zfcal.trial import LARGEST_SEED, Trial, second_of

GOOD = {
    "root": Path("trial"),
    "arena": "two-rooms",
    "n_fish": 4,
    "n_robots": 1,
    "fps": 15.0,
    "dt_s": 0.2,
    "seed": 1,
}


def test_places_by_hand():
    """The settings file, a segment, a window's scores of the model, a starting model."""
    trial = Trial(**GOOD)

    assert trial.config == Path("trial/trial.toml")
    assert trial.path("tracks", 60, ".parquet") == Path("trial/tracks/000060.parquet")
    assert trial.path("scores", 120, "-model.parquet") == Path("trial/scores/000120-model.parquet")
    assert trial.path("models", 0, ".toml") == Path("trial") / trial.model
    assert trial.n_agents == 5


def test_names_have_at_least_six_digits():
    """Twelve days need a seventh, which is not cut off."""
    trial = Trial(**GOOD)

    assert trial.path("tracks", 7, ".parquet").name == "000007.parquet"
    assert trial.path("tracks", 999_999, ".parquet").name == "999999.parquet"
    assert trial.path("tracks", 1_036_800, ".parquet").name == "1036800.parquet"


@given(
    second=st.integers(0, 10**8), ending=st.sampled_from([".parquet", "-model.parquet", ".toml"])
)
def test_the_second_of_a_name_is_the_one_it_was_made_with(second, ending):
    """There and back, for each ending; another ending does not fit."""
    path = Trial(**GOOD).path("scores", second, ending)

    assert second_of(path, ending) == second
    assert second_of(path, ".geojson") is None


@pytest.mark.parametrize(
    "name",
    [
        "extended.toml",
        "00060.parquet",  # five digits
        "000060.parquet.gz",
        ".000060.parquet.part-x1",
        "000060-model.parquet",
        "000060parquet",  # the dot is a dot
        "a000060.parquet",
        "-00060.parquet",
        "000060.5.parquet",
    ],
)
def test_other_names_have_no_second(name):
    """Files that are named otherwise are no artifacts of a second."""
    assert second_of(Path("tracks") / name) is None


@pytest.mark.parametrize(("fps", "dt_s"), [(15.0, 0.2), (3.0, 1 / 3), (28.07, 6 / 28.07), (25, 1)])
def test_a_step_of_whole_frames_is_accepted(fps, dt_s):
    """Three frames, one, six, twenty-five."""
    assert Trial(**GOOD | {"fps": fps, "dt_s": dt_s}).dt_s == dt_s


def test_a_step_with_four_digits_in_the_file_is_whole_enough():
    """People write 0.3333 for a third of a second at 3 Hz: 0.9999 frames."""
    assert Trial(**GOOD | {"fps": 3.0, "dt_s": 0.3333}).dt_s == 0.3333


@pytest.mark.parametrize(
    ("fps", "dt_s", "longest_s"), [(15.0, 0.2, 4 / 15), (3.0, 1 / 3, 2 / 3), (25.0, 1.0, 26 / 25)]
)
def test_two_samples_may_lie_a_frame_more_than_a_step_apart(fps, dt_s, longest_s):
    """Each is the frame nearest to its time, half a frame before or after."""
    trial = Trial(**GOOD | {"fps": fps, "dt_s": dt_s})
    assert trial.longest_step_s == pytest.approx(longest_s, rel=1e-12)


@pytest.mark.parametrize("dt_s", [0.21, 0.01, 0.0, -0.2, math.nan, math.inf, 0.0667 / 2])
def test_a_step_that_is_no_whole_number_of_frames_is_refused(dt_s):
    """3.15 frames, a fraction, none, backwards, unknown, for ever; the hint gives a frame."""
    with pytest.raises(InputError, match="whole number of frames") as caught:
        Trial(**GOOD | {"dt_s": dt_s})

    assert "trial.toml" in str(caught.value)
    assert "0.0666667 s" in caught.value.hint


@pytest.mark.parametrize("fps", [0.0, -15.0, math.nan, math.inf])
def test_a_rate_that_is_none_is_refused(fps):
    """Before anything is divided by it."""
    with pytest.raises(InputError, match="fps must be a positive rate"):
        Trial(**GOOD | {"fps": fps})


@pytest.mark.parametrize(("n_fish", "n_robots"), [(0, 0), (-1, 2), (4, -1)])
def test_an_empty_tank_is_refused(n_fish, n_robots):
    """At least one agent, and none fewer than none."""
    with pytest.raises(InputError, match="at least one agent"):
        Trial(**GOOD | {"n_fish": n_fish, "n_robots": n_robots})


def test_a_robot_alone_is_a_trial():
    """Robots are agents."""
    assert Trial(**GOOD | {"n_fish": 0}).n_agents == 1


@pytest.mark.parametrize(("fps", "dt_s"), [(15.0, 2.2), (5.0, 400.0), (0.4, 2.5)])
def test_a_step_of_more_than_two_seconds_is_refused(fps, dt_s):
    """No lag at which fish could follow a robot is left then."""
    assert Trial(**GOOD | {"fps": 5.0, "dt_s": 2.0}).dt_s == 2.0
    with pytest.raises(InputError, match=f"dt_s must be at most 2 s, got {dt_s} s"):
        Trial(**GOOD | {"fps": fps, "dt_s": dt_s})


def test_a_negative_seed_is_refused():
    """Random numbers derive from whole numbers from 0 on."""
    with pytest.raises(InputError, match="seed must be a whole number from 0 on, got -1"):
        Trial(**GOOD | {"seed": -1})


def test_a_seed_that_toml_cannot_hold_is_refused():
    """Its file could not be read again."""
    assert Trial(**GOOD | {"seed": 2**63 - 1}).seed == LARGEST_SEED
    with pytest.raises(InputError, match="at most 9223372036854775807, got 9223372036854775808"):
        Trial(**GOOD | {"seed": 2**63})


def test_settings_do_not_change():
    """A trial is what its file says; another one is made with replace."""
    trial = Trial(**GOOD)

    with pytest.raises(dataclasses.FrozenInstanceError):
        trial.fps = 30.0
    assert dataclasses.replace(trial, fps=30.0).fps == 30.0
