"""From camera images to the tracks of a trial."""

import itertools
import math
import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.findings import ERROR, WARNING
from zfcal.artifacts.frame_files import read_frames
from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.pose_files import PoseFollower, read_poses
from zfcal.artifacts.tables import read_extra, read_tracks
from zfcal.cameras.camera import Homography
from zfcal.cameras.video import decoded
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import write_camera
from zfcal.stages.camera.rig import CameraChoice
from zfcal.stages.events import LeftOut, Made, Note, Planned, Result, UpToDate, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.track.plan import Pictures, TrackOptions
from zfcal.stages.track.track import track
from zfcal.stages.trial_context import Task
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracks import concatenate, tracks_of

FPS = 5.0
SIZE = 200
CORNERS = ((-0.5, 199.5), (199.5, 199.5), (199.5, -0.5), (-0.5, -0.5))
SECONDS = 62
ROUND = 120


@pytest.fixture(scope="session")
def paths(drawn_tank):
    """Return three bodies that follow each other round a circle for 62 s, 24 s a round."""
    once = drawn_tank.circling(ROUND, turn=2 * math.pi / ROUND)
    return [once[k % ROUND] for k in range(round(SECONDS * FPS))]


@pytest.fixture(scope="session")
def images(drawn_tank, paths):
    """Return the images of them; those of one round are drawn."""
    drawn = [frame.image for frame in drawn_tank.frames(paths[:ROUND])]
    return [drawn[k % ROUND] for k in range(len(paths))]


@pytest.fixture(scope="session")
def film(tmp_path_factory, images):
    """Return them as a video without loss."""
    path = tmp_path_factory.mktemp("film") / "day3.avi"
    write_video(path, images)
    return path


def write_video(path, images, *, fps=FPS):
    """Write images as a video without loss."""
    height, width = images[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), fps, (width, height))
    for image in images:
        writer.write(image if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


@pytest.fixture
def new(tmp_path):
    """Return what makes a trial of three fish in a square of 0.4 m."""

    def make(name="trial", **changes):
        settings = {"n_fish": 3, "fps": FPS, "side_m": 0.4, **changes}
        settings["dt_s"] = 2 / settings["fps"]
        create_trial(tmp_path / name, NewTrial(**settings), say_nothing)
        return tmp_path / name

    return make


def asked(source, **changes):
    """Return options that track a source by the corners of its images."""
    overhead = CameraChoice(source=str(source), corners_px=CORNERS)
    return replace(TrackOptions(overhead=overhead), **changes)


def all_tracks(root):
    """Return the tracks of all segments."""
    return concatenate([read_tracks(path) for path in sorted((root / "tracks").glob("*.parquet"))])


@pytest.fixture(scope="session")
def tracked(tmp_path_factory, film):
    """Return a trial that was tracked from the video, not to be written into."""
    root = tmp_path_factory.mktemp("tracked") / "trial"
    create_trial(root, NewTrial(n_fish=3, fps=FPS, side_m=0.4, dt_s=0.4), say_nothing)
    track(root, asked(film), say_nothing)
    return root


@pytest.mark.slow
def test_the_tracks_are_where_the_bodies_were(tracked, paths):
    """A millimetre beside them or less, three of them in every frame, each under one id."""
    tracks = all_tracks(tracked)
    assert len(tracks) == 3 * len(paths)
    assert len(np.unique(tracks.agent)) == 3
    truth = {
        number: 0.002 * np.array([(x + 0.5, SIZE - (y + 0.5)) for x, y, _ in bodies])
        for number, bodies in enumerate(paths)
    }
    error_m = [
        np.hypot(*(truth[frame] - (x, y)).T).min()
        for frame, x, y in zip(tracks.frame, tracks.x_m, tracks.y_m, strict=True)
    ]
    assert np.median(error_m) < 0.001
    assert np.max(error_m) < 0.003


def test_times_are_those_of_the_video(tracked):
    """Frame k is of k / 5 s, to the nanosecond; segments hold their own minute."""
    tracks = all_tracks(tracked)
    np.testing.assert_allclose(tracks.time_s, tracks.frame / FPS, atol=1e-8)
    assert read_tracks(tracked / "tracks" / "000000.parquet").frame[-1] == 299
    assert read_tracks(tracked / "tracks" / "000060.parquet").frame[0] == 300


def test_poses_say_the_same_as_tracks(tracked, examine):
    """Minute by minute; and the doctor has nothing to say."""
    for minute in ("000000", "000060"):
        path = tracked / "poses" / f"{minute}.mcap"
        said = tracks_of(read_poses(path))
        tracks = read_tracks(tracked / "tracks" / f"{minute}.parquet")
        assert np.array_equal(said.x_m, tracks.x_m)
        assert np.array_equal(said.agent, tracks.agent)
        assert examine(path) == []


def test_every_file_says_where_it_comes_from(tracked, film):
    """The video by its hash and bare name, the method, and how the pixels were told."""
    for path in (tracked / "tracks" / "000060.parquet", tracked / "poses" / "000060.mcap"):
        lineage = read_lineage(path)
        assert lineage.command == "track"
        assert film.name in lineage.inputs
        assert lineage.options["method"] == "shi-tomasi"
        assert lineage.options["corners_px"][1] == [199.5, 199.5]


def test_a_segment_states_its_bad_frames_its_end_and_its_noise(tracked):
    """So that `analyse` knows a part, and `diagnose` finds the noise."""
    first = read_extra(tracked / "tracks" / "000000.parquet")
    last = read_extra(tracked / "tracks" / "000060.parquet")
    assert (first["end_s"], last["end_s"]) == (60.0, pytest.approx(62.0))
    assert first["bad_frames"] == {}
    assert 0 < first["noise_m"] < 0.0005
    assert "recording_s" not in first
    assert last["recording_s"] == [0.0, pytest.approx(62.0)]


def test_the_trial_is_sound(tracked):
    """`zfcal check` has nothing against it."""
    found = [f for f in check_trial(tracked) if f.level in {ERROR, WARNING}]
    assert [f for f in found if f.where not in {"disk", "file system", "clock"}] == []


@pytest.mark.slow
def test_a_minute_is_there_as_soon_as_it_has_passed(new, film):
    """Its tracks are told before the first frame of the minute after is written."""
    root = new()
    follower = PoseFollower(root)
    known = []

    def hear(event):
        if isinstance(event, Made):
            frames = [poses.frame for poses in follower.poll()]
            known.append((event.path.relative_to(root).as_posix(), frames[-1:]))

    track(root, asked(film), hear)
    assert known == [
        ("tracks/000000.parquet", [299]),
        ("poses/000000.mcap", []),
        ("tracks/000060.parquet", [309]),
        ("poses/000060.mcap", []),
    ]


def test_the_second_run_opens_no_image(tracked, film, heard, read_all, monkeypatch):
    """Everything is up to date."""
    before = read_all(tracked)
    monkeypatch.setattr("zfcal.stages.track.track.Following", None)
    track(tracked, asked(film), heard.append)
    assert {type(event) for event in heard} == {UpToDate}
    assert len(heard) == 4
    assert read_all(tracked) == before


@pytest.mark.slow
@pytest.mark.parametrize("gone", ["tracks/000000.parquet", "poses/000060.mcap"])
def test_what_is_missing_comes_back_with_the_same_bytes(
    tracked, film, gone, heard, read_all, tmp_path
):
    """And nothing else is written."""
    root = shutil.copytree(tracked, tmp_path / "copy")
    before = read_all(root)
    (root / gone).unlink()
    track(root, asked(film), heard.append)
    made = [event.path.relative_to(root).as_posix() for event in heard if isinstance(event, Made)]
    assert made == [gone]
    assert read_all(root) == before


@pytest.mark.slow
@pytest.mark.parametrize("when", [1, 2, 3])
def test_an_interrupted_run_goes_on_and_ends_in_the_same_bytes(new, film, tracked, read_all, when):
    """Wherever it was: after the first segment, after its poses, after the second segment."""
    root = new()
    count = itertools.count(1)

    def stop(event):
        if isinstance(event, Made) and next(count) == when:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        track(root, asked(film), stop)
    track(root, asked(film), say_nothing)
    names = ("tracks/", "poses/")
    made, known = (
        {name: data for name, data in read_all(r).items() if name.startswith(names)}
        for r in (root, tracked)
    )
    assert made == known


def test_a_dry_run_says_what_would_be_made(new, film, heard, tracked):
    """And writes nothing; nothing is planned where all is there."""
    root = new()
    track(root, asked(film), heard.append, task=Task(dry_run=True))
    assert [event.path.name for event in heard] == ["000000.parquet", "000060.parquet"]
    assert {type(event) for event in heard} == {Planned}
    assert not (root / "tracks").exists()
    assert not (root / "poses").exists()
    heard.clear()
    track(tracked, asked(film), heard.append, task=Task(dry_run=True))
    assert {type(event) for event in heard} == {UpToDate}


def test_another_option_makes_it_again(tracked, film, heard, tmp_path):
    """The reason is named."""
    root = shutil.copytree(tracked, tmp_path / "copy")
    options = asked(film)
    options = replace(options, tracker=replace(options.tracker, min_blob_px=30.0))
    track(root, options, heard.append, task=Task(dry_run=True))
    assert heard[0].reason == "option min_blob_px: none -> 30.0"


def test_a_stretch_keeps_its_times(new, film, heard):
    """Six seconds from second 55 on: two parts, at their own places."""
    root = new()
    track(root, asked(film, start_s=55.0, duration_s=6.0), heard.append)
    tracks = all_tracks(root)
    assert (tracks.time_s[0], tracks.frame[0]) == (55.0, 275)
    assert tracks.frame[-1] == 304
    assert read_extra(root / "tracks" / "000060.parquet")["end_s"] == pytest.approx(61.0)


@pytest.mark.slow
def test_images_and_mcap_give_the_tracks_of_the_video(new, film, images, tmp_path):
    """The same frames, whatever they come from: bit by bit, times apart by rounding alone."""
    folder = tmp_path / "images"
    folder.mkdir()
    for k, image in enumerate(images[:150]):
        cv2.imwrite(str(folder / f"{k}.png"), image)
    one, other = new("one"), new("other")
    track(one, asked(film, duration_s=30.0), say_nothing)
    track(other, asked(folder), say_nothing)
    video, sequence = all_tracks(one), all_tracks(other)
    assert np.array_equal(video.x_m, sequence.x_m)
    assert np.array_equal(video.heading_rad, sequence.heading_rad)
    assert np.array_equal(video.frame, sequence.frame)


@pytest.mark.slow
def test_a_camera_its_recording_and_a_video_give_the_same_tracks(new, images, streaming, tmp_path):
    """Live over HTTP, then from the images that were recorded: every row, times and all.

    And from a video of these images: the same places.
    """
    data = [cv2.imencode(".jpg", image)[1].tobytes() for image in images[:90]]
    again, video = new("again", fps=20.0), new("video", fps=20.0)
    options = TrackOptions(tracker=TrackerOptions(learn_frames=30))
    for attempt in range(3):
        live = new(f"live-{attempt}", fps=20.0)
        with streaming.Camera(data, fps=20.0) as camera:
            overhead = asked(camera.url).overhead
            given = replace(options, overhead=overhead, record="png", duration_s=3.0)
            track(live, given, say_nothing)
        # A busy computer takes some images too late to be in their turn, which no video shows.
        if (np.diff(np.unique(all_tracks(live).frame)) == 1).all():
            break
    recorded = live / "frames" / "overhead"
    track(again, replace(options, overhead=asked(recorded).overhead), say_nothing)
    of_live, of_recording = all_tracks(live), all_tracks(again)
    assert len(of_live) > 3 * 50
    for name in ("time_s", "frame", "agent", "x_m", "y_m", "heading_rad", "confidence"):
        assert np.array_equal(getattr(of_live, name), getattr(of_recording, name)), name
    seen = [decoded(image) for _, image in read_frames(recorded)]
    film = write_video(tmp_path / "v.avi", seen, fps=20.0)
    track(video, replace(options, overhead=asked(film).overhead), say_nothing)
    # Who is who may depend on when images arrived; where somebody is does not.
    assert np.array_equal(np.sort(all_tracks(video).x_m), np.sort(of_live.x_m))


@pytest.mark.slow
def test_a_live_recording_that_was_killed_goes_on(new, images, streaming, heard):
    """On its own clock, with ids of its own, and with the frames of the minute that it was in."""
    root = new(fps=30.0)
    data = [cv2.imencode(".jpg", i)[1].tobytes() for i in images[:400]]
    count = itertools.count()
    with streaming.Camera(data, fps=30.0) as camera:
        options = asked(camera.url)
        options = replace(options, tracker=replace(options.tracker, learn_frames=20))
        with pytest.MonkeyPatch.context() as patch:
            from zfcal.artifacts.pose_files import PoseWriter

            add = PoseWriter.add

            def until(writer, poses):
                add(writer, poses)
                if next(count) == 40:
                    # As a signal that nobody can catch: nothing is closed.
                    patch.setattr("zfcal.stages.track.minutes.Minutes.interrupt", lambda *_: None)
                    raise SystemExit

            patch.setattr(PoseWriter, "add", until)
            with pytest.raises(SystemExit):
                track(root, options, say_nothing)
        assert not (root / "tracks").exists()
        time.sleep(0.5)
        track(root, replace(options, duration_s=2.0), heard.append)
    tracks = all_tracks(root)
    frames = np.unique(tracks.frame)
    assert frames[0] == 0
    assert 60 < len(frames) < 110
    assert np.diff(frames).max() > 5
    assert any("goes on with the recording" in e.text for e in heard if isinstance(e, Note))
    before, after = (set(tracks.agent[rows]) for rows in _around_the_gap(tracks))
    assert before.isdisjoint(after)
    posed = [poses.frame for poses in read_poses(root / "poses" / "000000.mcap")]
    assert sorted(set(posed)) == posed
    assert set(posed) >= set(frames)


def _around_the_gap(tracks):
    """Return the rows before the longest gap, and those after it."""
    place = int(np.argmax(np.diff(tracks.frame)))
    return np.arange(len(tracks)) <= place, np.arange(len(tracks)) > place


@pytest.mark.slow
def test_a_camera_that_goes_away_is_waited_for(new, images, streaming, heard):
    """Its gap is counted, and told in one line."""
    root = new(fps=30.0)
    data = [cv2.imencode(".jpg", image)[1].tobytes() for image in images[:300]]
    with streaming.Camera(data, fps=30.0) as camera:
        threading.Timer(1.5, camera.gone.set).start()
        threading.Timer(2.2, camera.gone.clear).start()
        options = asked(camera.url, duration_s=4.0)
        options = replace(options, tracker=replace(options.tracker, learn_frames=20))
        track(root, options, heard.append)
    notes = [event.text for event in heard if isinstance(event, Note)]
    assert sum("came back after" in note for note in notes) == 1
    (numbers,) = [event.value for event in heard if isinstance(event, Result)]
    assert numbers["gaps"] >= 1
    assert numbers["missing"] > 15
    assert any("missing in" in note for note in notes)


@pytest.mark.slow
def test_a_live_recording_tells_how_long_a_frame_takes(new, images, streaming, heard):
    """From its arrival to its poses being written: a tenth of a period, or so."""
    root = new(fps=15.0)
    data = [cv2.imencode(".jpg", image)[1].tobytes() for image in images[:60]]
    with streaming.Camera(data) as camera:
        options = asked(camera.url, duration_s=3.0)
        options = replace(options, tracker=replace(options.tracker, learn_frames=10))
        track(root, options, heard.append)
    (numbers,) = [event.value for event in heard if isinstance(event, Result)]
    assert 0 < numbers["latency_ms"]["median"] < 50


@pytest.mark.slow
def test_a_folder_in_the_place_of_recorded_images_ends_no_tracking(new, images, streaming, heard):
    """It is named, and the minute has its poses and tracks."""
    root = new(fps=15.0)
    taken = root / "frames" / "overhead" / "000000.mcap"
    taken.mkdir(parents=True)
    data = [cv2.imencode(".jpg", image)[1].tobytes() for image in images[:60]]
    with streaming.Camera(data) as camera:
        options = asked(camera.url, duration_s=3.0, record="png")
        options = replace(options, tracker=replace(options.tracker, learn_frames=10))
        track(root, options, heard.append)
    assert [event.path for event in heard if isinstance(event, LeftOut)] == [taken]
    made = [event.path for event in heard if isinstance(event, Made)]
    assert made == [root / "tracks" / "000000.parquet", root / "poses" / "000000.mcap"]


@pytest.mark.slow
def test_pictures_are_drawn_where_they_are_asked_for(new, film, tmp_path, heard):
    """A video as long as the tracks; a sheet of the worst frames, if there were any."""
    root = new(n_fish=4)
    pictures = Pictures(overlay=tmp_path / "o.mp4", contact_sheet=tmp_path / "sheet.png")
    options = asked(film, duration_s=24.0, pictures=pictures)
    track(root, options, heard.append)
    capture = cv2.VideoCapture(str(tmp_path / "o.mp4"))
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == 120
    sheet = cv2.imread(str(tmp_path / "sheet.png"))
    assert sheet.shape[1] == 4 * 320
    assert not list(tmp_path.glob(".*part*"))
    heard.clear()
    (tmp_path / "o.mp4").unlink()
    track(root, options, heard.append)
    assert (tmp_path / "o.mp4").exists()
    assert not [event for event in heard if isinstance(event, Made)]


def test_a_video_that_was_cut_short_is_tracked_as_far_as_it_goes(new, film, tmp_path, heard):
    """And named, which makes exit code 3."""
    path = tmp_path / "cut.avi"
    content = film.read_bytes()
    path.write_bytes(content[: len(content) // 3])
    root = new()
    track(root, asked(path), heard.append)
    (left,) = [event for event in heard if isinstance(event, LeftOut)]
    assert "frames can be read" in left.problem
    assert left.damaged
    assert 60 < len(np.unique(all_tracks(root).frame)) < 150


@pytest.mark.slow
def test_black_frames_are_told_once_and_listed(new, images, tmp_path, heard):
    """The fish are found again behind them."""
    shown = [image.copy() for image in images[:140]]
    for k in range(120, 125):
        shown[k][:] = 0
    root = new()
    track(root, asked(write_video(tmp_path / "x.avi", shown)), heard.append)
    warned = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert len(warned) == 1
    assert "frame 120 (24.00 s): the image shows nothing" in warned[0]
    extra = read_extra(root / "tracks" / "000000.parquet")
    assert extra["bad_frames"]["black"] == [120, 121, 122, 123, 124]
    assert extra["bad_frames"]["repeated"] == [121, 122, 123, 124]
    assert len(np.unique(all_tracks(root).frame)) == 135


def test_a_video_of_nothing_but_black_has_no_tracks_and_no_traceback(new, tmp_path, heard):
    """No background was ever learnt."""
    black = [np.zeros((SIZE, SIZE), np.uint8)] * 30
    root = new()
    track(root, asked(write_video(tmp_path / "x.avi", black)), heard.append)
    assert len(all_tracks(root)) == 0
    assert any("no background was learnt" in e.text for e in heard if isinstance(e, Note))


@pytest.mark.slow
def test_images_of_another_size_are_left_out(new, images, tmp_path, heard):
    """Told once, listed, and the others are tracked."""
    folder = tmp_path / "images"
    folder.mkdir()
    for k, image in enumerate(images[:130]):
        cv2.imwrite(str(folder / f"{k}.png"), image[:150] if k >= 120 else image)
    root = new()
    track(root, asked(folder), heard.append)
    warned = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert len([text for text in warned if "another size" in text]) == 1
    bad = read_extra(root / "tracks" / "000000.parquet")["bad_frames"]
    assert bad["size"] == list(range(120, 130))


def test_a_calibration_of_another_camera_is_refused(new, film, tmp_path):
    """Its images have another size; nothing is written."""
    path = tmp_path / "camera.toml"
    camera = Homography(size_px=(640, 480), matrix=((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    write_camera(path, camera, Lineage(schema="zfcal.camera/1", command="camera"))
    root = new()
    options = TrackOptions(overhead=CameraChoice(source=str(film), file=path))
    with pytest.raises(InputError, match=r"640 x 480 px, those of .* are 200 x 200 px"):
        track(root, options, say_nothing)
    assert not (root / "tracks").exists()


MIRRORED = CORNERS[::-1]


def test_corners_in_image_order_are_refused(new, film, paths):
    """The tracks would be mirror images; with the side stated they are meant to be."""
    root = new()
    choice = CameraChoice(source=str(film), corners_px=MIRRORED)
    with pytest.raises(InputError, match="seen from below") as caught:
        track(root, TrackOptions(overhead=choice), say_nothing)
    assert "'-0.5,199.5 199.5,199.5 199.5,-0.5 -0.5,-0.5'" in caught.value.hint
    assert not (root / "tracks").exists()
    stated = TrackOptions(overhead=replace(choice, side="below"), duration_s=6.0)
    track(root, stated, say_nothing)
    first = all_tracks(root)
    x, y, _ = paths[0][0]
    away_m = np.hypot(first.x_m[:3] - 0.002 * (x + 0.5), first.y_m[:3] - 0.002 * (y + 0.5))
    assert away_m.min() < 0.002
    assert read_lineage(root / "tracks" / "000000.parquet").options["seen_from"] == "below"


@pytest.mark.parametrize(("said", "refused"), [(None, True), ("below", False)])
def test_a_camera_file_that_mirrors_the_tank_is_refused(new, film, tmp_path, said, refused):
    """Unless its lineage says that it looks up through the floor."""
    path = tmp_path / "camera.toml"
    camera = Homography(size_px=(200, 200), matrix=((0.002, 0, 0), (0, 0.002, 0), (0, 0, 1)))
    lineage = Lineage(schema="zfcal.camera/1", command="camera", options={"seen_from": said})
    write_camera(path, camera, lineage)
    options = TrackOptions(overhead=CameraChoice(source=str(film), file=path), duration_s=6.0)
    root = new()
    if refused:
        with pytest.raises(InputError, match=r"camera.toml, as the camera overhead: .*mirrored"):
            track(root, options, say_nothing)
    else:
        track(root, options, say_nothing)
    assert (root / "tracks").exists() != refused


def test_more_blobs_than_fish_are_told_once(new, film, heard):
    """Two fish in trial.toml, three in the tank."""
    root = new(n_fish=2)
    track(root, asked(film, duration_s=24.0), heard.append)
    warned = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert len(warned) == 1
    assert "more blobs than animals" in warned[0]
    assert max(np.unique(all_tracks(root).frame, return_counts=True)[1]) == 2


@pytest.mark.parametrize(
    ("changes", "options", "says"),
    [
        ({}, {"overhead": CameraChoice()}, "names no source of overhead images"),
        ({}, {"overhead": CameraChoice(source="FILM")}, "names no calibration of the overhead"),
        ({"n_robots": 1}, {}, "cannot be distinguished from the fish"),
        ({"n_robots": 2}, {}, "states 2 robots"),
        ({}, {"below": CameraChoice(source="0", corners_px=CORNERS)}, "states no robot"),
        ({}, {"robot_as_fish": True}, "--robot-as-fish is for a trial with a robot"),
        ({}, {"record": "png"}, "--record keeps the images of a live camera"),
        ({"fps": 25.0}, {}, r"has 5 frames a second, trial.toml says fps = 25"),
        ({}, {"background": Path("nowhere.png")}, "nowhere.png: no such file"),
    ],
)
def test_what_cannot_be_done_is_said_before_anything_is_written(new, film, changes, options, says):
    """In one line; the trial stays as it was."""
    root = new(**changes)
    given = asked(film, **options)
    if given.overhead.source == "FILM":
        given = replace(given, overhead=CameraChoice(source=str(film)))
    with pytest.raises(InputError, match=says):
        track(root, given, say_nothing)
    assert not (root / "tracks").exists()
    assert not (root / "poses").exists()


def test_a_robot_without_a_camera_below_may_count_as_a_fish(new, film):
    """If that is asked for: three animals, all of them fish."""
    root = new(n_fish=2, n_robots=1)
    track(root, asked(film, robot_as_fish=True, duration_s=24.0), say_nothing)
    tracks = all_tracks(root)
    assert set(tracks.kind) == {0}
    assert len(np.unique(tracks.agent)) == 3


def test_a_background_of_another_size_is_refused(new, film, tmp_path):
    """And one that fits is used from the first frame on."""
    cv2.imwrite(str(tmp_path / "small.png"), np.full((100, 100), 180, np.uint8))
    cv2.imwrite(str(tmp_path / "empty.png"), np.full((SIZE, SIZE), 180, np.uint8))
    root = new()
    with pytest.raises(InputError, match="has 100 x 100 px"):
        track(root, asked(film, background=tmp_path / "small.png"), say_nothing)
    track(root, asked(film, background=tmp_path / "empty.png", duration_s=6.0), say_nothing)
    assert len(all_tracks(root)) == 90


def test_other_footage_does_not_replace_tracks(tracked, film, tmp_path):
    """One trial holds one recording."""
    other = shutil.copy(film, tmp_path / "other.avi")
    with pytest.raises(InputError, match=r"comes from track of .*expected none or"):
        track(tracked, asked(other), say_nothing)


def test_the_source_of_trial_toml_is_used(new, film, heard):
    """Relative to the trial."""
    root = new()
    shutil.copy(film, root / "film.avi")
    text = (root / "trial.toml").read_text()
    (root / "trial.toml").write_text(f'{text}\n[cameras.overhead]\nsource = "film.avi"\n')
    options = TrackOptions(overhead=CameraChoice(corners_px=CORNERS), duration_s=24.0)
    track(root, options, heard.append)
    assert "film.avi" in read_lineage(root / "tracks" / "000000.parquet").inputs
    assert math.isclose(all_tracks(root).time_s[-1], 119 / 5, rel_tol=1e-6)


@pytest.mark.slow
def test_a_file_of_poses_that_is_still_empty_is_made_anew(new, images, tmp_path):
    """A command was killed after it had made the file, and before its first byte."""
    film = write_video(tmp_path / "v.avi", images[:60], fps=30.0)
    whole, begun = new("whole", fps=30.0), new("begun", fps=30.0)
    track(whole, asked(film), say_nothing)
    (begun / "poses").mkdir()
    (begun / "poses" / "000000.mcap").touch()
    track(begun, asked(film), say_nothing)
    first, second = (list(read_poses(root / "poses" / "000000.mcap")) for root in (whole, begun))
    assert len(first) == 60
    assert first == second
