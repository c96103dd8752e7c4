"""A virtual experiment in lock-step: who drives, what is written, the same again."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from shapely import MultiPoint

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model, write_model
from zfcal.artifacts.pose_files import read_poses
from zfcal.artifacts.tables import read_tracks
from zfcal.calibrate.task import Settings
from zfcal.errors import DamagedError, InputError
from zfcal.parameters import natural
from zfcal.stages.events import Note, UpToDate
from zfcal.stages.trial_context import Task, open_trial
from zfcal.tracks import FISH, ROBOT
from zfcal.virtual.closed_loop import closed_loop
from zfcal.virtual.eyes import VirtualEyes
from zfcal.virtual.fish import FishOptions
from zfcal.virtual.trial import LoopOptions, fish_of, prepare, starting_model

pytestmark = pytest.mark.slow

LITTLE = Settings(
    population=8, generations=1, steps=200, n_confirmed=2, long_runs=2, long_s=120.0, n_windows=10
)
SHORT = LoopOptions(duration_s=180.0, video=False, settings=LITTLE, seed=3)


@pytest.fixture(scope="module")
def loop(tmp_path_factory):
    """Return the folder of three minutes of a calibrated loop, and what was said."""
    folder, heard = tmp_path_factory.mktemp("loop"), []
    closed_loop(folder, SHORT, heard.append)
    return folder, heard


def rows_of(folder, name="trial"):
    """Return all tracks of the trial, or of the truth."""
    return [read_tracks(path) for path in sorted((folder / name / "tracks").glob("*.parquet"))]


def test_the_robot_is_driven_by_what_was_calibrated_meanwhile(loop):
    """The window of 120 s drives from 175 s on, as on a rig that takes 55 s; not before."""
    notes = [event.text for event in loop[1] if isinstance(event, Note) and "drives" in event.text]
    assert [note.split()[0] for note in notes] == ["0.0", "175.0"]
    assert "models/000120.toml" in notes[1]


def test_a_trial_and_its_truth_are_written(loop):
    """Both are trials; truth has no noise, and its parameters of each minute."""
    folder, _ = loop
    names = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    for expected in (
        *("trial/poses/000120.mcap", "trial/tracks/000120.parquet", "trial/scores/000180.parquet"),
        *("trial/models/000180.toml", "trial/drive/000120.mcap", "tank/tracks/000120.parquet"),
        *("tank/models/000060.toml", "tank/models/000120.toml"),
    ):
        assert expected in names
    truth = [read_model(folder / "tank" / "models" / f"{s:06d}.toml") for s in (60, 120)]
    assert truth[0] != truth[1], "parameters drift"


def test_tracks_have_the_trackers_noise(loop):
    """About four tenths of a millimetre off the truth, and a few positions are lost."""
    seen, truth = (rows_of(loop[0], name)[0] for name in ("trial", "tank"))
    assert 0 < len(truth) - len(seen) < 0.01 * len(truth)
    where = {
        (int(f), int(a)): x for f, a, x in zip(truth.frame, truth.agent, truth.x_m, strict=True)
    }
    off_m = [
        x - where[int(f), int(a)] for f, a, x in zip(seen.frame, seen.agent, seen.x_m, strict=True)
    ]
    assert np.std(off_m) == pytest.approx(0.0004, rel=0.05)


def test_the_robot_swims_and_stays_in_the_tank(loop):
    """It covers metres in three minutes, through its serial port alone."""
    truth = rows_of(loop[0], "tank")
    x, y = (np.concatenate([getattr(t, c)[t.kind == ROBOT] for t in truth]) for c in ("x_m", "y_m"))
    assert np.hypot(np.diff(x), np.diff(y)).sum() > 2.0
    outline = open_trial(loop[0] / "trial").arena.outline
    assert outline.buffer(1e-6).contains(MultiPoint(np.column_stack([x, y])))


def test_the_same_seed_gives_the_same_trial(loop, tmp_path):
    """Byte for byte, the log of the drive included; another seed gives another one."""
    short = dataclasses.replace(SHORT, duration_s=12.0, robot="fixed")
    for name in ("a", "b"):
        closed_loop(tmp_path / name, short, lambda _: None)
    for name in (
        "trial/tracks/000000.parquet",
        "trial/poses/000000.mcap",
        "trial/drive/000000.mcap",
    ):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    closed_loop(tmp_path / "c", dataclasses.replace(short, seed=4), lambda _: None)
    own, other = (rows_of(tmp_path / name)[0].x_m for name in ("a", "c"))
    assert not np.array_equal(own[:100], other[:100])


def test_what_is_whole_is_not_done_again(loop):
    """The second run finds all up to date."""
    folder, _ = loop
    before = {p: p.stat().st_mtime_ns for p in (folder / "trial").rglob("*.parquet")}
    heard = []
    closed_loop(folder, SHORT, heard.append)
    assert before == {p: p.stat().st_mtime_ns for p in (folder / "trial").rglob("*.parquet")}
    assert {type(event) for event in heard if hasattr(event, "path")} == {UpToDate}


def test_another_experiment_is_not_lost(loop):
    """Where one has ended another one is refused, by what differs; --force begins anew."""
    folder, _ = loop
    before = {p: p.read_bytes() for p in (folder / "trial").rglob("*.parquet")}
    other = dataclasses.replace(SHORT, fish=FishOptions(wariness=0.0))
    with pytest.raises(InputError, match=r"its fish_wariness is 0\.3, the command gives 0\.0"):
        closed_loop(folder, other, lambda _: None)
    assert {p: p.read_bytes() for p in (folder / "trial").rglob("*.parquet")} == before


def test_a_damaged_record_is_named(loop):
    """A loop that may be whole is not thrown away for it; ``--force`` would."""
    folder, _ = loop
    record = folder / "trial" / "closed-loop.json"
    said = record.read_bytes()
    record.write_bytes(said[:20])
    with pytest.raises(DamagedError, match=r"closed-loop\.json: is not valid JSON"):
        closed_loop(folder, SHORT, lambda _: None)
    record.write_bytes(said)
    assert list((folder / "trial" / "tracks").glob("*.parquet"))


def test_a_loop_that_was_cut_short_is_begun_anew(tmp_path):
    """A robot must not be driven by models of its future: what was made is removed first."""
    short = dataclasses.replace(SHORT, duration_s=12.0, robot="fixed")
    closed_loop(tmp_path, short, lambda _: None)
    trial = tmp_path / "trial"
    told = (trial / "tracks" / "000000.parquet").read_bytes()
    (trial / "closed-loop.json").unlink()
    (trial / "models" / "000600.toml").write_bytes((trial / "models" / "000000.toml").read_bytes())
    closed_loop(tmp_path, short, lambda _: None)
    assert (trial / "tracks" / "000000.parquet").read_bytes() == told
    assert not (trial / "models" / "000600.toml").exists()
    assert json.loads((trial / "closed-loop.json").read_text())["options"]["robot"] == "fixed"


def test_a_random_robot_goes_its_own_way(tmp_path):
    """It is not calibrated, and its model prefers nothing."""
    short = dataclasses.replace(SHORT, duration_s=5.0, robot="random")
    trial = closed_loop(tmp_path, short, lambda _: None, task=Task(force=True))
    model = read_model(trial / "models" / "000000.toml")
    assert all(zone.alpha == 0.0 and zone.kappa_0 == 0.0 for zone in model.zones)
    assert sorted(p.name for p in (trial / "models").glob("*")) == ["000000.toml"]


def test_the_starting_model_is_that_of_another_laboratory(loop):
    """Published constants, not those of the virtual fish."""
    opened = open_trial(loop[0] / "trial")
    model = starting_model(opened.arena, dt_s=0.2, robot="calibrated")
    assert read_model(opened.trial.root / "models" / "000000.toml") == model
    assert {zone.kappa_0 for zone in model.zones} == {6.3}
    assert {zone.name: zone.alpha for zone in model.zones}["centre"] == 55.0


def test_cameras_see_what_swims(tmp_path):
    """Drawn, compressed and tracked: all five within a millimetre or so, the robot told apart."""
    short = dataclasses.replace(SHORT, duration_s=16.0, video=True, robot="fixed")
    trial = closed_loop(tmp_path, short, lambda _: None)
    frames = list(read_poses(trial / "poses" / "000000.mcap"))
    truth = list(read_poses(tmp_path / "tank" / "poses" / "000000.mcap"))
    assert len(frames) == len(truth) == 240
    off_m, robots = [], 0
    for seen, real in zip(frames[30:], truth[30:], strict=True):
        robots += sum(agent.kind == ROBOT for agent in seen.agents)
        for kind in (FISH, ROBOT):
            own = [(a.x_m, a.y_m) for a in real.agents if a.kind == kind]
            off_m += [
                min(math.dist((a.x_m, a.y_m), place) for place in own)
                for a in seen.agents
                if a.kind == kind
            ]
    assert np.median(off_m) < 0.001
    assert robots > 0.95 * len(frames[30:])


def test_what_cannot_be_is_told_in_one_line():
    """Half a second is no experiment, and not all positions can be lost."""
    with pytest.raises(InputError, match="duration"):
        LoopOptions(duration_s=0.5)
    with pytest.raises(InputError, match="dropped"):
        LoopOptions(fish=FishOptions(dropped=1.0))


def test_eyes_need_no_background_of_their_own(loop):
    """The empty tank is drawn once: the first frame is tracked at once."""
    opened = open_trial(loop[0] / "trial")
    truth = next(iter(read_poses(loop[0] / "tank" / "poses" / "000000.mcap")))
    eyes = VirtualEyes(opened)
    assert len(eyes.see(truth).agents) >= 4
    eyes.close()


@pytest.fixture(scope="module")
def drifting(tmp_path_factory):
    """Return a model file of fish that are drawn to one side."""
    arena = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    effects = {"directional-drift": {"strength": 0.5, "direction_rad": 0.0, "by_slowness": 0.0}}
    model = dataclasses.replace(natural(zones, dt_s=0.2), effects=effects)
    path = tmp_path_factory.mktemp("models") / "fish.toml"
    write_model(path, model, Lineage(schema="zfcal.model/1", command="init", options={}))
    return path


def test_fish_and_robot_begin_with_the_models_that_are_given(tmp_path, drifting):
    """The robot of 5 s has the effect, and so have the fish; their truth says so."""
    asked = dataclasses.replace(
        SHORT, duration_s=5.0, robot="fixed", fish_model=drifting, model=drifting
    )
    trial = closed_loop(tmp_path, asked, lambda _: None)
    for place in (trial, tmp_path / "tank"):
        assert read_model(place / "models" / "000000.toml") == read_model(drifting)
    truth = fish_of(prepare(tmp_path, asked, lambda _: None, Task())).truth.parameters
    assert truth.effects["directional-drift"] == read_model(drifting).effects["directional-drift"]


def test_another_model_is_another_experiment(tmp_path, drifting):
    """It is refused where one has ended, and where one was begun; forced, it is made anew."""
    plain = dataclasses.replace(SHORT, duration_s=5.0, robot="fixed")
    trial = closed_loop(tmp_path, plain, lambda _: None)
    asked = dataclasses.replace(plain, model=drifting)
    with pytest.raises(InputError, match="another model than this experiment begins with"):
        closed_loop(tmp_path, asked, lambda _: None)
    closed_loop(tmp_path, asked, lambda _: None, task=Task(force=True))
    assert read_model(trial / "models" / "000000.toml") == read_model(drifting)
    moved = dataclasses.replace(asked, fish_model=trial / "models" / "000000.toml")
    with pytest.raises(InputError, match="another model"):
        closed_loop(tmp_path, moved, lambda _: None)


def test_a_random_robot_takes_no_model(drifting):
    """An option that cannot take effect is an error."""
    with pytest.raises(InputError, match="swims by no model"):
        LoopOptions(robot="random", model=drifting)
