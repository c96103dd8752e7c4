"""Which windows a path speaks of."""

from pathlib import Path

import pytest

from zfcal.errors import InputError
from zfcal.stages.streams import Work, work_at, work_of


@pytest.fixture
def trial(tmp_path, monkeypatch):
    """Stand beside a folder with a trial.toml."""
    (tmp_path / "day" / "tracks").mkdir(parents=True)
    (tmp_path / "day" / "trial.toml").write_text("")
    monkeypatch.chdir(tmp_path)
    return Path("day")


def test_a_segment_bears_on_the_two_windows_that_hold_it(trial):
    """The minute from 120 s is in the windows to 180 and to 240 s."""
    work = work_of(trial / "tracks" / "000120.parquet")
    assert work == Work(root=Path("day"), ends_s=frozenset({180, 240}))


@pytest.mark.parametrize("folder", ["stats", "scores"])
def test_statistics_bear_on_their_own_window(trial, folder):
    """The number of the file is the end of the window."""
    assert work_of(trial / folder / "000180.parquet").ends_s == {180}


def test_what_a_robot_does_to_the_fish_bears_on_its_own_window(trial):
    """It stands beside the statistics."""
    assert work_of(trial / "stats" / "000180-following.parquet").ends_s == {180}


@pytest.mark.parametrize(
    "name", ["", "trial.toml", "models/000120.toml", "scores/000120-model.parquet"]
)
def test_any_other_path_bears_on_all_windows(trial, name):
    """A trial, its settings, a model."""
    assert work_of(trial / name) == Work(root=Path("day"))


@pytest.mark.parametrize("name", ["poses/000060.mcap", "frames/overhead/000060.mcap"])
def test_poses_and_images_bear_on_no_window(trial, name):
    """The segment of their minute does, whose path comes as well."""
    assert work_of(trial / name) == Work(root=Path("day"), ends_s=frozenset())


def test_a_relative_path_gives_a_relative_trial(trial):
    """So that the paths that come out of a pipe look like those that go in."""
    assert not work_of(trial / "tracks" / "000000.parquet").root.is_absolute()


def test_a_path_below_no_trial_is_refused(trial):
    """The hint says how to make one."""
    with pytest.raises(InputError, match="not in a trial") as error:
        work_of(Path("elsewhere/tracks/000000.parquet"))
    assert "zfcal init" in error.value.hint


def test_a_slip_of_the_pen_is_not_the_whole_trial(trial):
    """What is typed must be there; the hint names what is, and what is like it."""
    with pytest.raises(InputError, match=r"^day/trakcs: no such file") as error:
        work_at(trial / "trakcs")
    assert "Did you mean day/tracks?" in error.value.hint
    assert "day holds tracks, trial.toml." in error.value.hint


def test_a_segment_that_is_not_there_is_named(trial):
    """In a folder that holds nothing, or too much to name it all."""
    with pytest.raises(InputError, match="no such file") as error:
        work_at(trial / "tracks" / "000060.parquet")
    assert "day/tracks holds nothing." in error.value.hint
    for number in range(20):
        (trial / "tracks" / f"{number:03d}").touch()
    with pytest.raises(InputError) as error:
        work_at(trial / "tracks" / "xyz")
    assert "006, 007 and 12 more." in error.value.hint


def test_what_is_there_can_be_typed(trial):
    """A trial, a folder and a file of it."""
    assert work_at(trial) == work_at(trial / "tracks") == work_of(trial / "trial.toml")


def test_a_path_typed_below_no_trial_is_refused(trial):
    """As one from a pipe."""
    with pytest.raises(InputError, match="not in a trial"):
        work_at(Path("elsewhere"))
