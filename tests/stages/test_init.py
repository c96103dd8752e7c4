"""Making a trial directory."""

import json
import math
from importlib.resources import files

import pytest

from zfcal.artifacts.arenas import read_arena
from zfcal.artifacts.models import read_model
from zfcal.artifacts.settings import read_trial
from zfcal.errors import InputError
from zfcal.stages.events import Made, Planned, UpToDate, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.trial_context import Task, open_trial

TWO_ROOMS = NewTrial(n_fish=4, n_robots=1, fps=15.0, arena="two-rooms", seed=3)


def test_a_new_trial_can_be_read_back(tmp_path, heard):
    """Settings as given, dt_s the multiple of a frame nearest to 0.2 s, a model for its zones."""
    root = tmp_path / "trial"
    create_trial(root, TWO_ROOMS, heard.append)
    trial = read_trial(root)
    assert (trial.n_fish, trial.n_robots, trial.fps, trial.dt_s, trial.seed) == (4, 1, 15, 0.2, 3)
    assert read_model(root / trial.model).zone_names == ("corridor", "walls", "centre")
    assert [event.path.name for event in heard] == ["000000.toml", "trial.toml"]


def test_the_second_time_nothing_is_made(tmp_path, heard, read_all):
    """The same words find the same trial."""
    root = tmp_path / "trial"
    create_trial(root, TWO_ROOMS, heard.append)
    before = read_all(root)
    heard.clear()
    create_trial(root, TWO_ROOMS, heard.append)
    assert {type(event) for event in heard} == {UpToDate}
    assert read_all(root) == before


def test_a_trial_that_differs_is_not_overwritten(tmp_path, heard, read_all):
    """The message names what differs, found and asked for."""
    root = tmp_path / "trial"
    create_trial(root, TWO_ROOMS, heard.append)
    before = read_all(root)
    other = NewTrial(n_fish=5, n_robots=1, fps=15.0, arena="two-rooms", seed=3)
    with pytest.raises(InputError, match="n_fish = 4, the command gives 5"):
        create_trial(root, other, heard.append)
    assert read_all(root) == before


def test_force_writes_the_settings_anew_and_loses_no_artifact(make_trial, heard, read_all):
    """Tracks and the model that a person may have edited stay, byte for byte."""
    root = make_trial()
    model = root / "models" / "000000.toml"
    model.write_text(model.read_text().replace("alpha = 42.0", "alpha = 41.0"))
    before = read_all(root)
    new = NewTrial(n_fish=2, fps=5.0, side_m=1.0, seed=1)
    create_trial(root, new, heard.append, task=Task(force=True))
    after = read_all(root)
    assert read_trial(root).n_fish == 2
    assert {name for name in before if before[name] != after[name]} == {"trial.toml"}


def test_a_model_that_fits_no_more_is_written_anew_and_told(make_trial, heard):
    """Of another arena it would only be in the way."""
    root = make_trial()
    create_trial(root, TWO_ROOMS, heard.append, task=Task(force=True))
    assert read_model(root / "models" / "000000.toml").zone_names == ("corridor", "walls", "centre")
    assert any("is written anew" in getattr(event, "text", "") for event in heard)


def test_an_arena_file_is_copied_into_the_trial(tmp_path, heard):
    """So that the trial can be moved without it."""
    source = tmp_path / "mine.geojson"
    source.write_bytes((files("zfcal") / "arenas" / "ring.geojson").read_bytes())
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=6, fps=15.0, arena=str(source)), heard.append)
    source.unlink()
    assert open_trial(root).arena.zone_names == ("inner", "middle", "outer")


def test_a_radius_makes_a_disc_of_that_size(tmp_path, heard):
    """The outline of a 0.25 m disc reaches from -0.25 to 0.25 m."""
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=6, fps=15.0, radius_m=0.25), heard.append)
    bounds = read_arena(root / "arena.geojson").outline.bounds
    assert bounds == pytest.approx((-0.25, -0.25, 0.25, 0.25), abs=1e-6)
    assert json.loads((root / "arena.geojson").read_text())["type"] == "FeatureCollection"


@pytest.mark.parametrize(
    "given",
    [
        {"arena": "two-rooms", "radius_m": 0.2},
        {"arena": "ring", "side_m": 0.2},
        {"radius_m": 0.2, "side_m": 0.2},
        {},
        {"arena": "two-roms"},
        {"radius_m": float("nan")},
    ],
)
def test_arenas_that_contradict_or_are_none_are_refused(tmp_path, heard, given):
    """And no directory is left behind that looks like a trial."""
    with pytest.raises(InputError):
        create_trial(tmp_path / "trial", NewTrial(n_fish=1, fps=15.0, **given), heard.append)
    assert not (tmp_path / "trial").exists()


def test_a_dry_run_writes_nothing(tmp_path, heard):
    """It says what would be made."""
    create_trial(tmp_path / "trial", TWO_ROOMS, heard.append, task=Task(dry_run=True))
    assert {type(event) for event in heard} == {Planned}
    assert not (tmp_path / "trial").exists()


def test_the_settings_appear_last(tmp_path):
    """A directory is a trial only when its model is there too."""
    root, order = tmp_path / "trial", []

    def tell(event):
        if isinstance(event, Made):
            order.append((event.path.name, (root / "trial.toml").exists()))

    create_trial(root, TWO_ROOMS, tell)
    assert order == [("000000.toml", False), ("trial.toml", True)]


@pytest.mark.parametrize("fps", [0.0, -15.0, math.nan, math.inf])
def test_a_frame_rate_of_no_camera_is_refused(tmp_path, fps):
    """Before the step is derived from it, and before anything is written."""
    with pytest.raises(InputError, match="fps must be"):
        create_trial(tmp_path / "trial", NewTrial(n_fish=2, fps=fps, arena="ring"), say_nothing)
    assert not (tmp_path / "trial").exists()
