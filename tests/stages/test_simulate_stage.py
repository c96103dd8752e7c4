"""From a model to the tracks of a trial."""

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.models import read_model
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import read_tracks
from zfcal.errors import InputError
from zfcal.model.simulate import simulate_tracks
from zfcal.sampling import sample
from zfcal.stages.events import Made, UpToDate, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.simulate import SimulateOptions, between_steps, new_trial, simulate
from zfcal.stages.trial_context import Task, open_trial
from zfcal.tracks import ROBOT, concatenate


@pytest.fixture
def home(tmp_path):
    """Return a trial whose model is simulated: 2 fish and a robot in two rooms, 15 Hz."""
    root = tmp_path / "home"
    new = NewTrial(n_fish=2, n_robots=1, fps=15.0, arena="two-rooms", seed=4)
    create_trial(root, new, say_nothing)
    return root


def options_of(home, **changes):
    """Return what to simulate: 70 s with seed 2."""
    given = {"model": home / "models" / "000000.toml", "duration_s": 70.0, "seed": 2}
    return SimulateOptions(**(given | changes))


def all_tracks(root):
    """Return the tracks of all segments."""
    return concatenate([read_tracks(path) for path in sorted((root / "tracks").glob("*.parquet"))])


def test_frames_between_two_steps_lie_on_the_straight_line():
    """From 0 to 3 m in three frames: 0, 1, 2, and then the step itself."""
    xy_m = np.array([[[0.0, 0.0]], [[3.0, 0.0]], [[3.0, 6.0]]])
    heading_rad = np.array([[0.1], [0.0], [np.pi / 2]])
    filled, heading = between_steps(xy_m, heading_rad, 3)
    assert filled[:, 0].tolist() == [[0, 0], [1, 0], [2, 0], [3, 0], [3, 2], [3, 4], [3, 6]]
    half = np.pi / 2
    assert heading[:, 0].tolist() == [0.1, 0.0, 0.0, 0.0, half, half, half]


def test_one_frame_a_step_changes_nothing():
    """The tracks are then the model's steps."""
    xy_m = np.arange(12.0).reshape(3, 2, 2)
    filled, heading = between_steps(xy_m, xy_m[..., 0], 1)
    assert np.array_equal(filled, xy_m)
    assert np.array_equal(heading, xy_m[..., 0])


def test_a_new_trial_takes_after_the_one_of_the_model(home, tmp_path, heard):
    """At the model's own step, with its arena and agents, and the seed that was asked for."""
    simulate(tmp_path / "new", options_of(home), heard.append)
    trial = read_trial(tmp_path / "new")
    assert (trial.arena, trial.n_fish, trial.n_robots) == ("two-rooms", 2, 1)
    assert (trial.fps, trial.dt_s, trial.seed) == (5.0, 0.2, 2)
    assert len(all_tracks(tmp_path / "new")) == 70 * 5 * 3


def test_samples_of_the_tracks_are_the_model_s_steps(home, heard):
    """At 15 Hz every third frame is a step, bit by bit; the robot is the last agent."""
    simulate(home, options_of(home), heard.append)
    opened = open_trial(home)
    xy_m, _ = simulate_tracks(
        read_model(home / "models" / "000000.toml"), opened.arena, n_agents=3, n_steps=350, seed=2
    )
    tracks = all_tracks(home)
    samples = sample(tracks, fps=15.0, dt_s=0.2, start_s=0.0, end_s=70.0)
    assert np.array_equal(samples.xy_m, xy_m)
    assert samples.kind.tolist() == [0, 0, ROBOT]


def test_the_second_run_simulates_nothing(home, heard, read_all, monkeypatch):
    """Whatever takes the time is not even called."""
    simulate(home, options_of(home), heard.append)
    before = read_all(home)
    heard.clear()
    monkeypatch.setattr("zfcal.stages.simulate.swim", None)
    simulate(home, options_of(home), heard.append)
    assert {type(event) for event in heard} == {UpToDate}
    assert read_all(home) == before


def test_a_missing_segment_comes_back_with_the_same_bytes(home, heard, read_all):
    """The others are left as they are."""
    simulate(home, options_of(home), heard.append)
    before = read_all(home)
    (home / "tracks" / "000060.parquet").unlink()
    heard.clear()
    simulate(home, options_of(home), heard.append)
    made = [event.path.name for event in heard if isinstance(event, Made)]
    assert made == ["000060.parquet"]
    assert read_all(home) == before


def test_another_seed_or_duration_makes_another_simulation(home, heard):
    """And what lies beyond a shorter one goes."""
    simulate(home, options_of(home), heard.append)
    first = all_tracks(home)
    simulate(home, options_of(home, seed=3, duration_s=50.0), heard.append)
    second = all_tracks(home)
    assert second.time_s[-1] < 50
    assert not np.array_equal(first.x_m[:100], second.x_m[:100])
    assert read_lineage(home / "tracks" / "000000.parquet").seed == 3


def test_a_model_without_a_home_needs_an_arena_and_fish(home, tmp_path):
    """The message says what to give; given, they are used."""
    alone = tmp_path / "alone.toml"
    alone.write_bytes((home / "models" / "000000.toml").read_bytes())
    with pytest.raises(InputError, match="lies in none") as error:
        new_trial(tmp_path / "new", options_of(home, model=alone))
    assert "--arena" in error.value.hint
    new = new_trial(tmp_path / "new", options_of(home, model=alone, arena="two-rooms", n_fish=7))
    assert (new.n_fish, new.n_robots, new.arena) == (7, 0, "two-rooms")


def test_options_that_contradict_an_existing_trial_are_refused(home, heard):
    """An option that cannot take effect is an error."""
    with pytest.raises(InputError, match="n_fish is 2, the command gives 3"):
        simulate(home, options_of(home, n_fish=3), heard.append)


def test_a_model_of_another_arena_is_refused(home, make_trial, heard):
    """A zone that is missing is named."""
    root = make_trial()
    for path in (root / "tracks").iterdir():
        path.unlink()
    with pytest.raises(InputError, match="corridor"):
        simulate(root, options_of(home), heard.append)


def test_measured_tracks_are_not_replaced_by_a_simulation(make_trial, heard):
    """Only by force."""
    root = make_trial()
    options = SimulateOptions(model=root / "models" / "000000.toml", duration_s=10.0)
    with pytest.raises(InputError, match="comes from track"):
        simulate(root, options, heard.append)
    simulate(root, options, heard.append, task=Task(force=True))
    assert read_lineage(root / "tracks" / "000000.parquet").command == "simulate"


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf")])
def test_a_duration_is_a_positive_time(home, duration):
    """Nothing else can be simulated."""
    with pytest.raises(InputError, match="positive duration"):
        options_of(home, duration_s=duration)


def test_a_model_of_other_zones_leaves_no_trial_behind(home, tmp_path, heard):
    """A model of two rooms in a ring is refused before anything is written."""
    root = tmp_path / "new"
    with pytest.raises(InputError, match="'inner' of arena 'ring' is missing"):
        simulate(root, options_of(home, arena="ring", n_fish=2), heard.append)
    assert not root.exists()
