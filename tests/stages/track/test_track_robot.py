"""Tracking with both cameras: the robot is told from the fish by its LEDs."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.frame_files import FrameWriter
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.pose_files import read_poses
from zfcal.artifacts.tables import read_extra, read_tracks
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.cameras.video import encoded
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import write_camera
from zfcal.stages.camera.rig import CameraChoice
from zfcal.stages.events import Note, Result, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.track.below import Below
from zfcal.stages.track.plan import TrackOptions
from zfcal.stages.track.track import track
from zfcal.stages.trial_context import Task
from zfcal.tracking.robot import LedOptions
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker
from zfcal.tracks import FISH, ROBOT, Tracks
from zfcal.virtual.images.look import PRESETS
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.render_below import BelowPainter
from zfcal.virtual.images.swimming import swimming

FPS = 15.0
N = 110


def truth():
    """Return two fish and a robot, each on a circle of its own in a square metre; 110 frames."""
    time_s = np.arange(N) / FPS
    circles = [(0.3, 0.3, 0.15, 0.8, 0.0), (0.7, 0.3, 0.12, -1.1, 1.0), (0.5, 0.7, 0.2, 0.7, 2.0)]
    rows = []
    for number, (x, y, radius, rate, start) in enumerate(circles):
        angle = start + rate * time_s
        heading = angle + math.copysign(math.pi / 2, rate)
        rows.append((np.full(N, number), x + radius * np.cos(angle), y + radius * np.sin(angle)))
        rows[-1] += (np.arctan2(np.sin(heading), np.cos(heading)),)
    agent, x_m, y_m, heading = (
        np.stack(column, axis=1).ravel() for column in zip(*rows, strict=True)
    )
    return Tracks(
        time_s=np.repeat(time_s, 3),
        frame=np.repeat(np.arange(N), 3),
        agent=agent.astype(np.int32),
        kind=np.where(agent == 2, ROBOT, FISH).astype(np.int8),
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading.astype(np.float32),
        confidence=np.ones(3 * N, np.float32),
    )


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Return a folder with the images of both cameras, of a dark one below, and both cameras."""
    folder = tmp_path_factory.mktemp("filmed")
    arena, look = load_arena("open-square", Path()), PRESETS["usual"]
    cameras = {"overhead": overhead_camera(arena), "below": below_camera(arena)}
    for name, camera in cameras.items():
        write_camera(folder / f"{name}.toml", camera, Lineage(schema="zfcal.camera/1", command="x"))
    moments = swimming(truth(), look, fps=FPS, seed=1)
    above = OverheadPainter(arena, cameras["overhead"], look, seed=1)
    under = BelowPainter(arena, cameras["below"], look, seed=1)
    names = ("overhead", "below", "dark")
    writers = [FrameWriter(folder / name / "000000.mcap", name) for name in names]
    dark = encoded(under.empty, "jpeg")
    for k in range(N):
        moment = moments.at(k)
        for writer, image in zip(writers, (above, under), strict=False):
            writer.add(moment.time_s, encoded(image.paint(moment), "jpeg"))
        writers[2].add(moment.time_s, dark)
    for writer in writers:
        writer.close()
    return folder


def options_of(filmed, **below):
    """Return options that track both cameras; ``below`` replaces the one below."""
    seen = {"source": str(filmed / "below"), "file": filmed / "below.toml", **below}
    return TrackOptions(
        overhead=CameraChoice(source=str(filmed / "overhead"), file=filmed / "overhead.toml"),
        below=CameraChoice(**seen),
        tracker=TrackerOptions(learn_frames=60),
    )


@pytest.fixture
def root(tmp_path):
    """Return a trial of two fish and a robot in a square metre."""
    create_trial(
        tmp_path / "trial",
        NewTrial(n_fish=2, n_robots=1, fps=FPS, arena="open-square"),
        say_nothing,
    )
    return tmp_path / "trial"


@pytest.mark.slow
def test_the_robot_is_told_from_the_fish_in_every_frame(root, filmed):
    """One id of its own, its place within 3 mm, its heading within 5 degrees, no flip."""
    track(root, options_of(filmed), say_nothing)
    tracks = read_tracks(root / "tracks" / "000000.parquet")
    robot, real = tracks.take(tracks.kind == ROBOT), truth()
    real = real.take(real.kind == ROBOT)
    assert robot.frame.tolist() == list(range(N))
    assert len(np.unique(robot.agent)) == 1
    assert np.hypot(robot.x_m - real.x_m, robot.y_m - real.y_m).max() < 0.003
    away = (robot.heading_rad - real.heading_rad + np.pi) % (2 * np.pi) - np.pi
    assert np.isfinite(away).sum() >= N - 4
    assert np.nanmax(np.abs(away)) < math.radians(5)
    fish = tracks.take(tracks.kind == FISH)
    assert len(fish) == 2 * N
    assert len(np.unique(fish.agent)) == 2


@pytest.fixture(scope="module")
def without_lure(filmed, tmp_path_factory):
    """Return images overhead of the fish alone, as where a robot drives beneath a dark floor."""
    folder = tmp_path_factory.mktemp("without") / "overhead"
    arena, look = load_arena("open-square", Path()), PRESETS["usual"]
    fish = truth()
    moments = swimming(fish.take(fish.kind == FISH), look, fps=FPS, seed=1)
    above = OverheadPainter(arena, overhead_camera(arena), look, seed=1)
    writer = FrameWriter(folder / "000000.mcap", "overhead")
    for k in range(N):
        writer.add(moments.at(k).time_s, encoded(above.paint(moments.at(k)), "jpeg"))
    writer.close()
    return folder


def counted(root, options):
    """Return the numbers of a run."""
    heard = []
    track(root, options, heard.append, task=Task(force=True))
    (result,) = [event.value for event in heard if isinstance(event, Result)]
    return result


@pytest.mark.slow
def test_exactly_as_many_animals_counts_the_robot_once(root, filmed, without_lure):
    """Seen by both cameras or by the one below alone; a robot that nobody sees is missing."""
    options = options_of(filmed)
    both = counted(root, options)
    assert (both["exact"], both["as_many_rows"]) == (N, N)
    unseen = CameraChoice(source=str(without_lure), file=filmed / "overhead.toml")
    alone = counted(root, dataclasses.replace(options, overhead=unseen))
    assert alone["as_many_rows"] >= N - 2
    assert alone["exact"] >= N - 5
    assert alone["bad_frames"].get("too few", 0) <= 2
    dark = options_of(filmed, source=str(filmed / "dark"))
    neither = counted(root, dataclasses.replace(dark, overhead=unseen))
    assert (neither["exact"], neither["bad_frames"]["too few"]) == (0, N)


@pytest.mark.slow
def test_a_robot_tracked_as_a_fish_is_one_animal_more(root, filmed):
    """Without the camera below it cannot be told which one it is, but it counts."""
    options = dataclasses.replace(options_of(filmed), below=CameraChoice(), robot_as_fish=True)
    result = counted(root, options)
    assert (result["exact"], result["as_many_rows"]) == (N, N)
    tracks = read_tracks(root / "tracks" / "000000.parquet")
    assert len(np.unique(tracks.agent)) == 3
    assert np.all(tracks.kind == FISH)


@pytest.mark.slow
def test_images_outside_the_trial_are_known_by_their_names(root, filmed):
    """`zfcal check` does not look for them in the trial."""
    track(root, options_of(filmed), say_nothing)
    lineage = read_lineage(root / "tracks" / "000000.parquet")
    assert {"overhead:000000.mcap", "below:000000.mcap"} < set(lineage.inputs)
    assert not [found for found in check_trial(root) if "overhead:" in found.says]


@pytest.mark.slow
def test_what_is_drawn_below_does_not_move_the_fish(root, filmed):
    """They are where they were, within a millimetre at the median."""
    track(root, options_of(filmed), say_nothing)
    tracks, real = read_tracks(root / "tracks" / "000000.parquet"), truth()
    real = real.take(real.kind == FISH)
    fish = tracks.take(tracks.kind == FISH)
    error_m = [
        np.hypot(real.x_m[real.frame == k] - x, real.y_m[real.frame == k] - y).min()
        for k, x, y in zip(fish.frame, fish.x_m, fish.y_m, strict=True)
    ]
    assert np.median(error_m) < 0.001


@pytest.mark.slow
def test_a_robot_without_leds_is_told_in_one_line(root, filmed, heard):
    """Nobody is the robot then; the frames are listed."""
    track(root, options_of(filmed, source=str(filmed / "dark")), heard.append)
    warned = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert len([text for text in warned if "LEDs have not been seen for five seconds" in text]) == 1
    (numbers,) = [event.value for event in heard if isinstance(event, Result)]
    assert numbers["leds"] == {"no LED": N}
    bad = read_extra(root / "tracks" / "000000.parquet")["bad_frames"]
    assert min(bad["no LED"]) == 76
    frames = list(read_poses(root / "poses" / "000000.mcap"))
    assert all(agent.kind == FISH for poses in frames for agent in poses.agents)


@pytest.mark.slow
def test_leds_of_another_colour_are_not_seen(root, filmed, heard):
    """They are green: blue is looked for in vain."""
    options = dataclasses.replace(options_of(filmed), leds=LedOptions(hue_deg=240.0))
    track(root, options, heard.append)
    (numbers,) = [event.value for event in heard if isinstance(event, Result)]
    assert numbers["leds"] == {"no LED": N}


@pytest.mark.slow
def test_the_calibration_of_the_other_camera_is_refused(root, filmed):
    """The camera below has 640 x 480 px; that file is of one with 500 x 500."""
    options = options_of(filmed, file=filmed / "overhead.toml")
    with pytest.raises(InputError, match=r"500 x 500 px, those of .* are 640 x 480 px") as error:
        track(root, options, say_nothing)
    assert "--below-camera" in error.value.hint


def test_both_cameras_are_live_or_none(root, filmed):
    """A recording has no arrival times to pair with."""
    with pytest.raises(InputError, match="One camera is live and the other a recording"):
        track(root, options_of(filmed, source="0"), say_nothing)


@pytest.mark.slow
def test_fish_are_found_before_the_image_below_is_asked_for(root, filmed, monkeypatch):
    """It arrives meanwhile; while the background is learnt no image below is let go by."""
    calls, at, step = [], Below.at, FishTracker.step

    def asked(self, time_s):
        calls.append(("below", round(time_s * FPS)))
        return at(self, time_s)

    def stepped(self, frame):
        calls.append(("fish", frame.number))
        return step(self, frame)

    monkeypatch.setattr(Below, "at", asked)
    monkeypatch.setattr(FishTracker, "step", stepped)
    track(root, options_of(filmed), say_nothing)

    assert calls[:60] == [("below", k) for k in range(60)]
    assert calls[60:120] == [("fish", k) for k in range(60)]
    later = [(who, k) for k in range(60, N) for who in ("fish", "below")]
    assert calls[120:] == later
