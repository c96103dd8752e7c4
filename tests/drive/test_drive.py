"""The driver in step with its poses: what it decides, logs and decides again."""

import dataclasses
import functools
import hashlib
import importlib.util
import itertools
import json
import math
import shutil
import threading
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from zfcal.artifacts import pose_files, pose_messages
from zfcal.artifacts.drive_files import LATENCY_KEY, drive_files, read_drive
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.mcap_files import overview
from zfcal.artifacts.models import read_model, write_model
from zfcal.drive import drive as driving
from zfcal.drive.drive import DriveOptions, drive
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner, Pilot, Seats
from zfcal.drive.replay import replay
from zfcal.errors import ChangedError, InputError, LockedError
from zfcal.parameters import Parameters
from zfcal.robot.confines import Confines
from zfcal.robot.fishbot import FishBot
from zfcal.robot.motion import Goal
from zfcal.stages.events import LeftOut, Made, Note, Result, say_nothing
from zfcal.stages.trial_context import Task, at_work, open_trial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

SECONDS = 8


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return a trial with some seconds of poses, and the frames themselves."""
    root = driven.make_trial(tmp_path_factory.mktemp("driven") / "trial")
    frames = driven.frames_of(root, SECONDS)
    driven.write_poses(root, frames)
    return root, frames


@pytest.fixture
def root(recorded, tmp_path):
    """Return a copy of that trial, which a test may change."""
    return Path(shutil.copytree(recorded[0], tmp_path / "trial"))


def run(root, *, tell=say_nothing, force=False, seconds=SECONDS, **manner):
    """Drive over the recorded poses; return all items of the log."""
    # Not waiting for what may follow the last frame.
    first_s = min(int(path.stem) for path in (root / "poses").glob("*.mcap"))
    options = DriveOptions(
        port="virtual",
        clock="poses",
        manner=Manner(**manner),
        duration_s=None if seconds is None else seconds - first_s - 1 / 15,
    )
    drive(root, options, tell, task=Task(force=force))
    return items_of(root)


def items_of(root):
    """Return all items of a trial's log."""
    return [item for path in drive_files(root).values() for item in read_drive(path)]


def only(items, what):
    """Return the items of a kind."""
    return [item for item in items if item["what"] == what]


def test_each_step_has_a_target_and_each_tenth_a_command(root):
    """8 s: 40 steps of 0.2 s, 80 ticks, 120 frames; targets a step's way from the robot."""
    items = run(root)
    targets, commands, poses = (only(items, w) for w in ("target", "command", "pose"))
    assert [t["step"] for t in targets] == list(range(40))
    assert [t["frame"] for t in targets] == list(range(0, 120, 3))
    assert [c["time_s"] for c in commands] == pytest.approx([k / 10 for k in range(80)])
    assert [p["frame"] for p in poses] == list(range(120))
    where = {p["frame"]: p for p in poses}
    ways = []
    for target in targets:
        at = where[target["frame"]]
        way = math.hypot(target["x_m"] - at["x_m"], target["y_m"] - at["y_m"])
        if not target["clamped"]:
            assert way == pytest.approx(0.2 * target["speed_m_s"], abs=1e-9)
        ways.append(way)
    assert 0.005 < np.mean(ways) < 0.04
    assert {c["held"] for c in commands} == {""}
    assert all(c["sent"] for c in commands)


def test_a_duration_counts_from_the_first_frame(root):
    """However many frames are read at once: 4 s are 60 frames, 20 steps and 40 ticks."""
    options = DriveOptions(port="virtual", clock="poses", duration_s=4 - 1 / 15)
    assert drive(root, options, say_nothing) == "the duration is over"
    items = items_of(root)
    assert [pose["frame"] for pose in only(items, "pose")] == list(range(60))
    assert (len(only(items, "target")), len(only(items, "command"))) == (20, 40)


@pytest.mark.slow
def test_it_is_said_that_no_poses_have_come(root):
    """Once, as a warning, and the drive goes on when they come: its duration begins then."""
    poses, later, heard = root / "poses", root / "later", []
    poses.rename(later)
    timer = threading.Timer(6, lambda: later.rename(poses))
    timer.start()
    options = DriveOptions(port="virtual", clock="poses", duration_s=2)
    assert drive(root, options, heard.append) == "the duration is over"
    timer.join()
    waits = [note for note in heard if isinstance(note, Note) and "no poses yet" in note.text]
    assert [(str(poses) in note.text, note.warning) for note in waits] == [(True, True)]
    assert only(items_of(root), "command")


def test_nobody_waits_where_poses_are(root):
    """Recorded ones are gone through without a word of waiting."""
    heard = []
    run(root, tell=heard.append, seconds=4)
    assert not [note for note in heard if isinstance(note, Note) and "no poses" in note.text]


def test_targets_keep_the_robots_radius_from_the_walls(root):
    """All of them, and some had to be moved: five centimetres are a step beside the walls."""
    targets = only(run(root, radius_m=0.05), "target")
    confines = Confines(open_trial(root).arena.outline, 0.05 - 1e-9)
    assert not any(confines.clamp(t["x_m"], t["y_m"])[2] for t in targets)
    assert any(t["clamped"] for t in targets)


@pytest.mark.parametrize("free_running", [False, True])
@pytest.mark.parametrize("pattern", ["fish", "pid"])
def test_a_replay_decides_the_same(root, pattern, free_running):
    """Every target and every command, to the last bit."""
    items = run(root, pattern=pattern, free_running=free_running)
    tally = replay(root, say_nothing)
    assert (tally.targets, tally.same_targets) == (40, 40)
    assert (tally.commands, tally.same_commands) == (80, 80)
    assert len(only(items, "command")) == 80


@pytest.fixture
def meddled(tmp_path, monkeypatch):
    """Return a trial whose arena gets other zones right after each of the first readings."""
    root = driven.make_trial(
        tmp_path / "own", "--side-m", "1", "--fish", "4", "--robot", "--fps", str(driven.FPS)
    )
    driven.write_poses(root, driven.frames_of(root, 2))
    arena, known, digits, opened = root / "arena.geojson", '"wall_zone_m": 0.07', iter("12"), []

    def opens(trial, *, times):
        found = open_trial(trial)
        opened.append((found.arena, hashlib.sha256(arena.read_bytes()).hexdigest()))
        if len(opened) <= times:
            part = arena.with_name(".part")
            part.write_text(arena.read_text("utf-8").replace(known, f"{known}{next(digits)}"))
            part.replace(arena)
        return found

    def meddle(times):
        monkeypatch.setattr(driving, "open_trial", functools.partial(opens, times=times))
        return root, opened

    return meddle


def test_the_log_bears_the_hash_of_the_arena_that_was_read(meddled):
    """Where another one lies there before it is hashed, it is read again, and that is told."""
    root, opened = meddled(times=1)
    heard = []
    run(root, tell=heard.append, seconds=1)
    stated = read_lineage(root / "drive" / "000000.mcap").inputs["arena.geojson"]
    (before, old), (after, new) = opened
    assert before != after
    assert old != new
    assert stated == new == hashlib.sha256((root / "arena.geojson").read_bytes()).hexdigest()
    (again,) = [note.text for note in heard if isinstance(note, Note) and "changed" in note.text]
    assert str(root / "arena.geojson") in again


def test_an_arena_that_never_rests_is_not_driven_in(meddled):
    """Twice another one is there when it is hashed: nobody knows which one was read."""
    root, _ = meddled(times=2)
    with pytest.raises(ChangedError, match=r"arena\.geojson: has changed"):
        run(root, seconds=1)
    assert not drive_files(root)


@pytest.mark.slow
def test_driving_anew_makes_the_same_bytes(root):
    """The same poses, model and seed: the same file."""
    run(root)
    first = (root / "drive" / "000000.mcap").read_bytes()
    run(root, force=True)
    assert (root / "drive" / "000000.mcap").read_bytes() == first


def test_a_free_running_agent_goes_its_own_way(root):
    """Each target is a step from the last one, wherever the robot is."""
    targets = only(run(root, free_running=True), "target")
    for before, after in itertools.pairwise(targets):
        way = math.hypot(after["x_m"] - before["x_m"], after["y_m"] - before["y_m"])
        if not after["clamped"]:
            assert way == pytest.approx(0.2 * after["speed_m_s"], abs=1e-9)


def test_random_numbers_belong_to_their_step(root, recorded):
    """A driver that comes later sets the same targets from then on."""
    whole = {t["step"]: t for t in only(run(root), "target")}
    for path in (root / "poses").iterdir():
        path.unlink()
    driven.write_poses(root, recorded[1][50:])
    late = only(run(root, force=True, seconds=SECONDS - 50 / 15), "target")
    assert late[0]["step"] == 17
    assert [whole[t["step"]]["x_m"] for t in late] == [t["x_m"] for t in late]


@pytest.mark.slow
def test_another_seed_leads_elsewhere(root):
    """The trial's."""
    first = only(run(root), "target")
    config = root / "trial.toml"
    config.write_text(config.read_text().replace("seed = 0", "seed = 1"))
    assert [t["x_m"] for t in only(run(root, force=True), "target")] != [t["x_m"] for t in first]


def test_the_newest_model_drives_and_broken_ones_do_not(root):
    """The highest number that can be read; of the others it is said why not."""
    driven.add_model(root, 120)
    (root / "models" / "000180.toml").write_text('schema = "zfcal.model/1"\nbase = ')
    model = read_model(root / "models" / "000000.toml")
    foreign = Parameters(dt_s=0.1, zones=model.zones)
    origin = Lineage(schema="zfcal.model/1", command="calibrate")
    write_model(root / "models" / "000240.toml", foreign, origin)
    write_model(root / "models" / "extended.toml", model, origin)
    told = []
    items = run(root, tell=told.append)
    assert {t["model"] for t in only(items, "target")} == {"models/000120.toml"}
    warned = [event.text for event in told if isinstance(event, Note) and event.warning]
    assert replay(root, say_nothing).is_same
    assert not warned or any("dt_s" in text or "TOML" in text for text in warned)


def test_an_extended_model_drives(root):
    """Its effects take part, and a replay knows them."""
    plain = only(run(root), "target")
    model = read_model(root / "models" / "000000.toml")
    effects = {"alignment": {"weight": 40.0, "kappa": 10.0}, "boldness": {}}
    extended = Parameters(dt_s=0.2, zones=model.zones, effects=effects)
    origin = Lineage(schema="zfcal.model/1", command="extend")
    write_model(root / "models" / "000120.toml", extended, origin)
    items = run(root, force=True)
    assert [t["x_m"] for t in only(items, "target")] != [t["x_m"] for t in plain]
    assert replay(root, say_nothing).is_same


def test_a_log_that_was_tampered_with_is_found(root):
    """Another pose than the driver had: other targets, and the first one is named."""
    run(root)
    frames = driven.frames_of(root, SECONDS, seed=9)
    for path in (root / "poses").iterdir():
        path.unlink()
    driven.write_poses(root, frames)
    with pytest.raises(InputError, match=r"the first that did not: the target at 0\.00 s"):
        replay(root, say_nothing)


def test_messages_are_of_their_schema_and_the_doctor_finds_nothing(root, repository, examine):
    """What stands in `schemas/drive.schema.json`; lineage and latency are in the file."""
    items = run(root)
    schema = json.loads((repository / "schemas" / "drive.schema.json").read_text())
    validator = Draft202012Validator(schema)
    for item in items:
        validator.validate(item)
    path = root / "drive" / "000000.mcap"
    assert examine(path) == []
    found = overview(path)
    assert found.schemas["/scene"] == "foxglove.SceneUpdate"
    assert found.schemas["/log"] == "foxglove.Log"
    assert LATENCY_KEY in found.metadata
    lineage = read_lineage(path)
    assert (lineage.schema, lineage.command) == ("zfcal.drive/1", "drive")
    assert lineage.options["pattern"] == "fish"


def test_lost_fish_and_a_lost_robot(root, recorded):
    """Without a fish the steps go on; without the robot for over half a second it is stopped."""
    frames = []
    for poses in recorded[1]:
        gone = set()
        if 2.0 <= poses.time_s < 3.0:
            gone = {0, 1}
        if 4.0 <= poses.time_s < 5.5:
            gone = {4}
        kept = tuple(agent for agent in poses.agents if agent.agent not in gone)
        frames.append(FramePoses(time_s=poses.time_s, frame=poses.frame, agents=kept))
    for path in (root / "poses").iterdir():
        path.unlink()
    driven.write_poses(root, frames)
    items = run(root)
    steps = {t["step"] for t in only(items, "target")}
    assert steps == set(range(40)) - set(range(20, 28))
    held = {round(c["time_s"], 1): c for c in only(items, "command") if c["held"]}
    assert set(held) == {round(k / 10, 1) for k in range(45, 56)}
    assert {c["bytes"] for c in held.values()} == {"000000000100"}
    faults = only(items, "fault")
    assert [(f["fault"], f["ended"]) for f in faults] == [
        ("stale-pose", False),
        ("stale-pose", True),
    ]
    assert replay(root, say_nothing).is_same


def test_missed_steps_are_counted(root, recorded):
    """A second without frames: its steps are not made up for."""
    for path in (root / "poses").iterdir():
        path.unlink()
    driven.write_poses(root, [f for f in recorded[1] if not 3.0 <= f.time_s < 4.0])
    told = []
    items = run(root, tell=told.append)
    (result,) = [event.value for event in told if isinstance(event, Result)]
    assert result["latency"]["steps_missed"] == 5
    assert len(only(items, "target")) == 35


def test_a_log_is_not_mixed_with_another(root):
    """On the poses' clock a second drive says so; with --force it begins anew."""
    run(root)
    with pytest.raises(InputError, match="earlier drive"):
        run(root)


def test_what_cannot_be_driven_is_told(root, tmp_path):
    """A trial without a robot, a port that is not there, two drivers, nothing to replay."""
    options = DriveOptions(port="virtual", clock="poses")
    with at_work(root, "drive", Task()), pytest.raises(LockedError):
        drive(root, options, say_nothing)
    with pytest.raises(InputError, match="no log of a drive"):
        replay(root, say_nothing)
    config = root / "trial.toml"
    config.write_text(config.read_text().replace("n_robots = 1", "n_robots = 0"))
    with pytest.raises(InputError, match="no robot to drive"):
        drive(root, options, say_nothing)


@pytest.mark.slow
def test_damaged_poses_are_left_out_and_told(root, recorded):
    """The driver goes on; what it had before the damage was driven by."""
    path = root / "poses" / "000000.mcap"
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 2000] = bytes(2000)
    path.write_bytes(data)
    driven.write_poses(root, [f for f in driven.frames_of(root, 62) if f.time_s >= 60])
    told = []
    path.write_bytes(data)
    items = run(root, tell=told.append, seconds=None)
    assert [event.path for event in told if isinstance(event, LeftOut)]
    assert any(isinstance(event, Made) for event in told)
    assert only(items, "target")[-1]["time_s"] >= 61


def test_seats_are_kept_while_an_id_is_seen():
    """And go to somebody else when it is not; more agents than seats are left out."""

    def agent(number, kind=FISH):
        return AgentPose(
            agent=number, kind=kind, x_m=number, y_m=0.0, heading_rad=0.0, confidence=1.0
        )

    seats = Seats(2, 1)
    first = seats.take([agent(7), agent(9), agent(3, ROBOT)])
    assert first[:, 0].tolist()[:2] == [7.0, 9.0]
    assert first[-1, 0] == 3.0
    second = seats.take([agent(9), agent(11)])
    assert second[:2, 0].tolist() == [11.0, 9.0]
    assert np.isnan(second[2:]).all()
    crowded = seats.take([agent(n) for n in range(20, 40)])
    assert np.isfinite(crowded[:-1]).all()
    assert np.isnan(crowded[-1]).all()


def changed(poses, *, agent=4, **changes):
    """Return a frame in which one agent's pose is another."""
    agents = tuple(
        dataclasses.replace(a, **changes) if a.agent == agent else a for a in poses.agents
    )
    return dataclasses.replace(poses, agents=agents)


BAD = {
    "outside": {"x_m": 5.6},
    "unsure": {"confidence": 0.0},
    "far": {"x_m": 900.0, "y_m": -900.0},
}
NO_NUMBERS = {
    "nan": {"x_m": math.nan},
    "infinite": {"y_m": -math.inf},
    "huge": {"x_m": 1e308, "y_m": 1e308},
}


def redrive(root, frames, **options):
    """Drive over other poses, maybe such as zfcal would not write; return all items of the log."""
    for path in (root / "poses").iterdir():
        path.unlink()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pose_messages, "to_json", json.dumps)
        driven.write_poses(root, frames)
    return run(root, **options)


@pytest.mark.parametrize("bad", BAD)
def test_an_implausible_pose_of_the_robot_is_none(root, recorded, bad):
    """Not driven by, told as a fault: STOP after half a second, as if it were not seen."""
    frames = [changed(f, **BAD[bad]) if 4.0 <= f.time_s < 5.5 else f for f in recorded[1]]
    items = redrive(root, frames)
    held = {round(c["time_s"], 1): c for c in only(items, "command") if c["held"]}
    assert set(held) == {round(k / 10, 1) for k in range(45, 56)}
    assert {c["bytes"] for c in held.values()} == {"000000000100"}
    assert {t["step"] for t in only(items, "target")} == set(range(40)) - set(range(20, 28))
    faults = [(f["fault"], f["ended"]) for f in only(items, "fault")]
    assert sorted(faults) == [
        ("implausible-pose", False),
        ("implausible-pose", True),
        ("stale-pose", False),
        ("stale-pose", True),
    ]
    assert replay(root, say_nothing).is_same


@pytest.mark.parametrize("bad", NO_NUMBERS)
def test_a_robot_whose_place_is_no_number_is_not_seen(root, recorded, bad):
    """STOP after half a second, and the file is named once; the fish stay."""
    heard = []
    frames = [changed(f, **NO_NUMBERS[bad]) if 4.0 <= f.time_s < 5.5 else f for f in recorded[1]]
    items = redrive(root, frames, tell=heard.append)
    assert [p["frame"] for p in only(items, "pose")] == list(range(120))
    assert {p["agents"] for p in only(items, "pose")} == {4}
    held = {round(c["time_s"], 1): c for c in only(items, "command") if c["held"]}
    assert set(held) == {round(k / 10, 1) for k in range(45, 56)}
    assert {c["bytes"] for c in held.values()} == {"000000000100"}
    assert [f["fault"] for f in only(items, "fault")] == ["stale-pose"] * 2
    (left_out,) = [event for event in heard if isinstance(event, LeftOut)]
    assert "in frame 60 agent 4 has no pose" in left_out.problem
    assert replay(root, say_nothing).is_same


@pytest.mark.slow
@pytest.mark.parametrize("bad", NO_NUMBERS)
def test_a_fish_whose_place_is_no_number_is_absent(root, recorded, bad):
    """The same targets and commands as if it were not there, and the file is named once."""
    frames, heard = recorded[1], []
    without = [
        dataclasses.replace(f, agents=tuple(a for a in f.agents if a.agent != 1)) for f in frames
    ]
    wanted = redrive(root, without)
    bad_ones = [changed(f, agent=1, **NO_NUMBERS[bad]) for f in frames]
    items = redrive(root, bad_ones, force=True, tell=heard.append)
    for what in ("pose", "target", "command"):
        assert only(items, what) == only(wanted, what)
    assert not only(items, "fault")
    (left_out,) = [event for event in heard if isinstance(event, LeftOut)]
    assert "in frame 0 agent 1 has no pose" in left_out.problem
    assert replay(root, say_nothing).is_same


def test_a_frame_whose_number_is_not_of_its_time_is_left_out(root, recorded):
    """No target is kept because a higher number was seen: all steps are swum by, and it is told."""
    heard = []
    frames = [dataclasses.replace(f, frame=10**9) if f.frame == 61 else f for f in recorded[1]]
    items = redrive(root, frames, tell=heard.append)
    assert {t["step"] for t in only(items, "target")} == set(range(40))
    (left_out,) = [event.problem for event in heard if isinstance(event, LeftOut)]
    assert "frame 1000000000 is said to be of 4.0" in left_out
    assert replay(root, say_nothing).is_same


def test_steps_go_on_where_numbers_are_set_back(root, recorded):
    """By less than what shows: the first frame with a lower number has a step of its own."""
    frames = [dataclasses.replace(f, frame=f.frame - 12 * (f.frame >= 60)) for f in recorded[1]]
    items = redrive(root, frames)
    assert [t["step"] for t in only(items, "target")] == [*range(20), *range(16, 36)]


def test_the_robot_stands_where_the_model_leads_nowhere(root, monkeypatch):
    """A target holds for its step and half a second; then the robot is stopped, and it is told."""
    aim = Pilot._aim
    monkeypatch.setattr(Pilot, "_aim", lambda *a: None if 20 <= a[2] < 30 else aim(*a))
    items = run(root)
    held = {round(c["time_s"], 1): c["held"] for c in only(items, "command") if c["held"]}
    assert set(held.values()) == {"stale-target"}
    # The last one was that of 3.8 s.
    assert min(held) == pytest.approx(4.6)
    assert max(held) == pytest.approx(5.9)
    assert [(f["fault"], f["ended"]) for f in only(items, "fault")] == [
        ("stale-target", False),
        ("stale-target", True),
    ]


def test_a_robot_in_the_tank_is_not_driven_by_the_poses_clock(root):
    """It does not wait for the driver: nothing would stop it when the poses end."""
    with pytest.raises(InputError, match="virtual robot that waits") as found:
        drive(root, DriveOptions(port="/dev/ttyUSB7", clock="poses"), say_nothing)
    assert "--clock wall" in found.value.hint


def test_a_robot_that_was_lifted_is_found_after_five_frames(root, recorded):
    """Put down half a metre away: four frames are left out, then it is driven from there."""
    first = recorded[1][0].agents[4]
    frames = [
        changed(f, x_m=first.x_m, y_m=first.y_m + (0.0 if f.time_s < 4.0 else 0.2))
        for f in recorded[1]
    ]
    items = redrive(root, frames)
    seen = {p["frame"]: p["y_m"] for p in only(items, "pose")}
    assert [seen[n] for n in range(60, 64)] == [None] * 4
    assert seen[64] == pytest.approx(first.y_m + 0.2)
    assert not [c for c in only(items, "command") if c["held"]]
    says = [f["says"] for f in only(items, "fault")]
    assert len(says) == 2
    assert "too far to have driven" in says[0]
    assert replay(root, say_nothing).is_same


@pytest.mark.parametrize("bad", BAD)
def test_implausible_fish_are_absent(root, recorded, bad):
    """The same targets as if they were not there, and one warning."""
    frames = recorded[1]
    without = [
        dataclasses.replace(f, agents=tuple(a for a in f.agents if a.agent != 1)) for f in frames
    ]
    wanted = only(redrive(root, without), "target")
    heard = []
    bad_ones = [changed(f, agent=1, **BAD[bad]) for f in frames]
    items = redrive(root, bad_ones, force=True, tell=heard.append)
    assert only(items, "target") == wanted
    assert {p["agents"] for p in only(items, "pose")} == {3}
    said = [
        note.text for note in heard if isinstance(note, Note) and "counts as absent" in note.text
    ]
    assert len(said) == 1


def test_frames_of_no_time_are_left_out_and_told(root, recorded):
    """NaN, infinite, of another age, before the start: the others are driven by, all is told."""
    times = {3: math.nan, 7: math.inf, 9: 1e308, 11: -1.0}
    heard, as_json = [], pose_files.as_json
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            pose_files,
            "as_json",
            lambda f: as_json(dataclasses.replace(f, time_s=times.get(f.frame, f.time_s))),
        )
        items = redrive(root, recorded[1], tell=heard.append)
    frames = [p["frame"] for p in only(items, "pose")]
    assert frames == [n for n in range(120) if n not in times]
    problems = sorted(event.problem for event in heard if isinstance(event, LeftOut))
    assert len(problems) == 2
    assert "a message of /agents" in problems[0]
    assert "frame 11 is said to be of -1.0 s" in problems[1]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("pattern", ["fish", "pid"])
def test_a_goal_that_is_none_is_refused(root, recorded, pattern, value):
    """The robot is stopped and told why; the next goal is driven to as if nothing had been."""
    opened = open_trial(root)
    model = DriveModels(opened).first()
    pilots = [Pilot(opened, Manner(pattern=pattern), FishBot("F", None)) for _ in range(2)]
    for pilot in pilots:
        pilot.see(recorded[1][0], model)
    sound = pilots[0]._target
    pilots[0]._target = dataclasses.replace(sound, goal=Goal(x_m=value, y_m=0.1, speed_m_s=0.1))
    command = pilots[0].tick(0.0)
    assert (command.held, command.message.encode().hex()) == ("refused", "000000000100")
    pilots[0]._target = dataclasses.replace(sound, goal=Goal(x_m=0.1, y_m=0.1, speed_m_s=value))
    assert pilots[0].tick(0.1).held == "refused"
    pilots[0]._target = sound
    assert pilots[0].tick(0.2).wheels == pilots[1].tick(0.2).wheels
