"""Poses: a message per frame, there at once, read back to the last digit."""

import dataclasses
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from zfcal.artifacts import pose_files, pose_messages
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.mcap_files import overview
from zfcal.artifacts.pose_files import PoseFollower, PoseWriter, read_clock, read_poses
from zfcal.artifacts.pose_messages import POSES
from zfcal.artifacts.validation import read_json
from zfcal.errors import DamagedError, InputError, StorageError
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses, tracks_of

LINEAGE = Lineage(schema=POSES, command="track", options={"method": "shi-tomasi"})


def frame(number, *, n=3, seed=0):
    """Return a frame of n agents at random places; the last is a robot without heading."""
    rng = np.random.default_rng([seed, number])
    agents = tuple(
        AgentPose(
            agent=k,
            kind=ROBOT if k == n - 1 else FISH,
            x_m=float(rng.uniform(0, 1)),
            y_m=float(rng.uniform(0, 1)),
            heading_rad=math.nan if k == n - 1 else float(rng.uniform(-3, 3)),
            confidence=float(rng.uniform(0, 1)),
        )
        for k in range(n)
    )
    return FramePoses(time_s=number / 15, frame=number, agents=agents)


def write(path, numbers=range(20), **how):
    """Write frames of these numbers, and return them."""
    frames = [frame(number) for number in numbers]
    with PoseWriter(path, LINEAGE, **how) as writer:
        for poses in frames:
            writer.add(poses)
    return frames


@pytest.fixture
def path(tmp_path):
    """Return where poses of the first minute go."""
    return tmp_path / "poses" / "000000.mcap"


def test_what_was_written_is_read_back(path):
    """Every digit of every number; NaN has no word in JSON and comes back."""
    frames = write(path)
    assert repr(list(read_poses(path))) == repr(frames)


def test_the_same_poses_make_the_same_bytes(path, tmp_path):
    """Whenever they are written."""
    write(path)
    write(tmp_path / "again.mcap")
    assert path.read_bytes() == (tmp_path / "again.mcap").read_bytes()


def test_the_doctor_finds_nothing(path, examine):
    """Library, profile, times, chunks, indexes, statistics; with the arena or without."""
    write(path, arena=load_arena("two-rooms", Path()), clock={"started_unix_s": "1.5"})
    assert examine(path) == []


def test_viewers_know_every_channel_by_its_schema(path):
    """Foxglove's well-known names; what is said in one is said in the others."""
    (poses,) = write(path, [3], arena=load_arena("two-rooms", Path()))
    found = overview(path)
    assert found.schemas == {
        "/poses": "foxglove.PosesInFrame",
        "/agents": "zfcal.poses/1",
        "/scene": "foxglove.SceneUpdate",
    }
    assert (found.profile, found.library) == ("", "zfcal")
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        protobuf = [topic for topic in found.schemas if topic != "/agents"]
        said = {c.topic: m for _, c, _, m in reader.iter_decoded_messages(topics=protobuf)}
    places = [(pose.position.x, pose.position.y) for pose in said["/poses"].poses]
    assert places == [(agent.x_m, agent.y_m) for agent in poses.agents]
    turned = said["/poses"].poses[0].orientation
    assert 2 * math.atan2(turned.z, turned.w) == pytest.approx(poses.agents[0].heading_rad)
    assert said["/poses"].timestamp.ToNanoseconds() == 200_000_000
    walls, agents = said["/scene"].entities
    assert walls.id == "arena"
    assert len(walls.lines[0].points) > 4
    assert len(agents.arrows) == 3


def test_messages_of_agents_are_of_their_schema(path, repository):
    """As `schemas/poses.schema.json` has it, which the file carries."""
    write(path)
    schema = read_json(repository / "schemas" / "poses.schema.json")
    with path.open("rb") as file:
        for carried, _, message in make_reader(file).iter_messages(topics=["/agents"]):
            Draft202012Validator(schema).validate(json.loads(message.data))
            assert json.loads(carried.data) == schema


def test_lineage_and_clock_stand_at_the_head(path):
    """Also in a file that still grows."""
    writer = PoseWriter(path, LINEAGE, clock={"started_unix_s": "1700000000.5"})
    assert read_lineage(path) == LINEAGE
    assert read_clock(path) == {"started_unix_s": "1700000000.5"}
    writer.close()
    write(path)
    assert read_clock(path) is None


def test_every_frame_can_be_read_as_soon_as_it_is_written(path, tmp_path):
    """By one who follows the trial, from minute to minute; nothing comes twice."""
    follower = PoseFollower(tmp_path)
    assert follower.poll() == []
    for minute in (0, 60, 180):
        writer = PoseWriter(path.with_name(f"{minute:06d}.mcap"), LINEAGE)
        for number in range(15 * minute, 15 * minute + 5):
            writer.add(frame(number))
            assert repr(follower.poll()) == repr([frame(number)])
        writer.close()
    assert follower.poll() == []


def test_a_follower_that_sleeps_misses_nothing(path, tmp_path):
    """Three minutes later it gets all of them, in order."""
    follower = PoseFollower(tmp_path)
    for minute in (0, 60, 120):
        write(path.with_name(f"{minute:06d}.mcap"), range(15 * minute, 15 * minute + 3))
    assert [poses.frame for poses in follower.poll()] == [0, 1, 2, 900, 901, 902, 1800, 1801, 1802]


def test_a_follower_goes_on_behind_a_file_that_was_never_closed(path, tmp_path):
    """Whoever wrote it was killed."""
    abandoned = PoseWriter(path, LINEAGE)
    abandoned.add(frame(0))
    abandoned.abandon()
    follower = PoseFollower(tmp_path)
    assert [poses.frame for poses in follower.poll()] == [0]
    write(path.with_name("000060.mcap"), [900])
    assert [poses.frame for poses in follower.poll()] == [900]


@pytest.mark.parametrize("newest", [False, True])
def test_a_follower_says_what_is_lost_of_a_file_that_was_cut(path, tmp_path, newest):
    """Not of one that is closed once the next has begun, nor of one that may grow."""
    follower = PoseFollower(tmp_path, newest=newest)
    cut, late, last = [PoseWriter(path.with_name(f"{k:06d}.mcap"), LINEAGE) for k in (0, 60, 120)]
    for writer, number in zip((cut, late, last), (0, 900, 1800), strict=True):
        writer.add(frame(number))
    cut.abandon()
    with cut.path.open("ab") as file:
        file.write(b"\x06\x20" + bytes(15))
    follower.poll()
    late.close()

    assert follower.cuts(is_over=False) == {}  # It was written to just now.
    os.utime(cut.path, (0, 0))
    found = follower.cuts(is_over=False)
    if newest:
        assert found == {}
        return
    assert list(found) == [cut.path]
    assert "17 bytes behind the last whole record are lost" in str(found[cut.path])
    assert list(follower.cuts(is_over=True)) == [cut.path, last.path]
    last.close()
    assert list(follower.cuts(is_over=True)) == [cut.path]


def test_a_file_that_is_written_anew_is_read_anew(path, tmp_path):
    """A second run of the tracker begins at the start."""
    follower = PoseFollower(tmp_path)
    writer = PoseWriter(path, LINEAGE)
    for number in range(9):
        writer.add(frame(number))
    writer.abandon()
    assert len(follower.poll()) == 9
    writer = PoseWriter(path, LINEAGE)
    writer.add(frame(0))
    assert [poses.frame for poses in follower.poll()] == [0]
    writer.close()


def test_every_cut_loses_only_what_lies_behind_it(path):
    """At each place: a file that was cut gives the frames before, to the last whole one."""
    frames = write(path)
    content = path.read_bytes()
    counts = []
    for size in range(8, len(content), 211):
        path.write_bytes(content[:size])
        found = list(read_poses(path))
        assert repr(found) == repr(frames[: len(found)])
        counts.append(len(found))
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, 20)


def test_no_flipped_byte_makes_a_traceback(path):
    """Frames are lost, and none is wrong."""
    known = {repr(poses) for poses in write(path, range(4))}
    content = path.read_bytes()
    for place in range(0, len(content), 17):
        broken = bytearray(content)
        broken[place] ^= 0xFF
        path.write_bytes(broken)
        found = []
        try:
            for poses in read_poses(path):
                found.append(poses)  # noqa: PERF402 - those before the damage count
        except DamagedError:
            pass
        assert {repr(poses) for poses in found} <= known


def test_a_killed_writer_leaves_all_that_it_had_written(tmp_path):
    """The process ends by a signal that nobody can catch."""
    script = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "from zfcal.artifacts.lineage import Lineage\n"
        "from zfcal.artifacts.pose_files import PoseWriter\n"
        "from zfcal.artifacts.pose_messages import POSES\n"
        "from zfcal.tracks import FramePoses\n"
        "w = PoseWriter(Path(sys.argv[1]), Lineage(schema=POSES, command='track'))\n"
        "for k in range(50):\n"
        "    w.add(FramePoses(time_s=k / 15, frame=k, agents=()))\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    path = tmp_path / "000000.mcap"
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], check=False, env=os.environ, timeout=60
    )
    assert done.returncode == -9
    assert [poses.frame for poses in read_poses(path)] == list(range(50))


def test_what_is_no_file_of_poses_is_named(tmp_path):
    """A missing one, one of another kind, and one whose messages are of another form."""
    with pytest.raises(InputError, match="no such file"):
        list(read_poses(tmp_path / "x.mcap"))
    (tmp_path / "x.mcap").write_bytes(b"\x89PNG\r\n\x1a\n and more")
    with pytest.raises(DamagedError, match="is not an MCAP file"):
        list(read_poses(tmp_path / "x.mcap"))


def test_messages_of_another_form_are_named(path, write_mcap):
    """Its time is missing."""
    write_mcap(path)
    with pytest.raises(DamagedError, match=r"a message of /agents is not of zfcal.poses/1"):
        list(read_poses(path))


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    """A file stands where the folder is to be."""
    (tmp_path / "poses").write_text("")
    with pytest.raises(StorageError, match="cannot be written"):
        PoseWriter(tmp_path / "poses" / "000000.mcap", LINEAGE)


def test_rows_of_tracks_are_those_of_the_poses():
    """In order of frame and agent; a frame without agents has none."""
    empty = FramePoses(time_s=0.1, frame=1, agents=())
    tracks = tracks_of([frame(0), empty, frame(2)])
    assert tracks.frame.tolist() == [0, 0, 0, 2, 2, 2]
    assert tracks.kind.tolist() == [0, 0, 1, 0, 0, 1]
    assert tracks.x_m[0] == frame(0).agents[0].x_m
    assert math.isnan(tracks.heading_rad[2])
    assert len(tracks_of([])) == 0


def _special(path, kind):
    """Put something that is no file of poses where one is to be."""
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "noise":
        path.write_bytes(b"\x89PNG\r\n\x1a\n and more")
    else:
        path.symlink_to("nowhere")


def _drained(follower):
    """Return the frames and the problems of a follower until nothing more comes."""
    frames, problems = [], []
    for _ in range(8):
        try:
            frames += [poses.frame for poses in follower.poll()]
        except DamagedError as error:
            problems.append(str(error))
    return frames, problems


@pytest.mark.parametrize("newest", [False, True])
@pytest.mark.parametrize("kind", ["folder", "pipe", "loop", "noise", "dangling"])
def test_a_follower_goes_on_behind_a_bad_file_and_names_it_once(
    path, tmp_path, monkeypatch, kind, newest
):
    """What grows before it is read on, and the next good file comes next."""
    monkeypatch.setattr(pose_files, "_AHEAD_S", math.inf)
    follower = PoseFollower(tmp_path, newest=newest)
    growing = PoseWriter(path, LINEAGE)
    growing.add(frame(0))
    bad = path.with_name("000060.mcap")
    _special(bad, kind)
    frames, problems = _drained(follower)
    if kind == "dangling":
        assert problems == []
    else:
        assert len(problems) == 1
        assert "000060.mcap" in problems[0]
    growing.add(frame(1))
    frames += _drained(follower)[0]
    write(path.with_name("000120.mcap"), [1800, 1801])
    more, problems = _drained(follower)
    assert (frames + more, problems) == ([0, 1, 1800, 1801], [])


def test_a_bad_file_that_was_mended_is_read(path, tmp_path):
    """A folder stood in its place."""
    write(path, [0])
    bad = path.with_name("000060.mcap")
    bad.mkdir()
    follower = PoseFollower(tmp_path)
    assert _drained(follower)[0] == [0]
    bad.rmdir()
    write(bad, [900])
    assert _drained(follower) == ([900], [])


def _wrong(**changes):
    known = frame(1)
    agent = dataclasses.replace(known.agents[0], **changes)
    return dataclasses.replace(known, agents=(agent, *known.agents[1:]))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"x_m": 1e308}, "x_m is 1e\\+308"),
        ({"x_m": math.nan}, "x_m is nan"),
        ({"y_m": -math.inf}, "y_m is -inf"),
        ({"y_m": -1001.0}, "y_m is -1001"),
        ({"agent": 2**40}, "agent is 1099511627776"),
        ({"agent": 1}, "agent 1 stands 2 times"),
        ({"confidence": 2.0}, "confidence is 2.0"),
        ({"heading_rad": 1e9}, "heading_rad is 1000000000.0"),
    ],
)
def test_whoever_has_a_number_out_of_range_is_absent(path, tmp_path, monkeypatch, changes, says):
    """Alone, or with whom its id is shared; the others stay, and the file is named once."""
    # A tracker of others writes what zfcal's own refuses to write.
    monkeypatch.setattr(pose_messages, "to_json", json.dumps)
    with PoseWriter(path, LINEAGE) as writer:
        for poses in (frame(0), _wrong(**changes), _wrong(**changes), frame(2)):
            writer.add(poses)
    left = frame(1).agents[2 if changes == {"agent": 1} else 1 :]
    wrong = dataclasses.replace(frame(1), agents=left)
    wanted = repr([frame(0), wrong, wrong, frame(2)])

    follower = PoseFollower(tmp_path)
    assert repr(follower.poll()) == wanted
    (problem,) = follower.take_problems()
    assert re.search(f"in frame 1 .*{says}", str(problem))

    told = []
    assert repr(list(read_poses(path, left_out=told.append))) == wanted
    assert [str(error) for error in told] == [str(problem)] * 2
    with pytest.raises(DamagedError, match=says):
        list(read_poses(path))


def test_a_frame_that_is_none_is_told_beside_an_agent_that_is_none(path, tmp_path):
    """Each once, however many there are."""
    bad_frame = dataclasses.replace(frame(1), time_s=500.0)
    with PoseWriter(path, LINEAGE) as writer:
        for poses in (_wrong(x_m=1e308), bad_frame, _wrong(x_m=1e308), bad_frame, frame(2)):
            writer.add(poses)
    follower = PoseFollower(tmp_path)
    assert [len(poses.agents) for poses in follower.poll()] == [2, 2, 3]
    first, second = follower.take_problems()
    assert "agent 0 has no pose" in str(first)
    assert "time_s is 500.0" in str(second)


@pytest.mark.parametrize(
    "data",
    [
        b'{"agents":' * 50_000,
        b'{"time_s": 1, "frame": 1, "agents": [5]}',
        b'{"time_s": 1, "frame": 1, "agents": {"agent": 5}}',
        b'{"time_s": 1, "frame": 1e400, "agents": []}',
        b'{"time_s": NaN, "frame": 1, "agents": []}',
        b'{"time_s": 1, "frame": ' + b"9" * 5001 + b', "agents": []}',
        b'{"time_s": 1e6, "frame": 1, "agents": []}',
        b"[]",
        b"\xff",
    ],
)
def test_no_message_of_another_form_is_more_than_damage(path, data):
    """Deep, long, not finite, of another minute, or no JSON."""
    with pytest.raises(DamagedError, match="message of /agents is not of"):
        pose_messages.from_json(path, data)


def test_a_live_follower_leaves_frames_of_the_future_out(path, tmp_path, monkeypatch):
    """It goes on with those of now; where none but such come, the tracker has a new clock."""
    now_s = 100.0
    monkeypatch.setattr(pose_files.time, "monotonic", lambda: now_s)
    follower = PoseFollower(tmp_path, newest=True)
    write(path, [0])
    assert _drained(follower) == ([0], [])
    write(path.with_name("1000020.mcap"), [15_000_300])
    frames, problems = _drained(follower)
    assert (frames, len(problems)) == ([], 1)
    assert "a frame of 1000020.000 s runs ahead of the clock" in problems[0]
    now_s = 105.1
    with PoseWriter(path.with_name("1000080.mcap"), LINEAGE) as writer:
        writer.add(frame(15_001_200))
    assert _drained(follower) == ([15_001_200], [])
