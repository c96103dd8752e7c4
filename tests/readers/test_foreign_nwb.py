"""NWB: animals and body parts of ndx-pose, and the ways in which times are told."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.readers import guess_format

h5py = pytest.importorskip("h5py")

PX = 0.001
LINE_PX = np.stack([100.0 + np.arange(5), np.full(5, 200.0)], axis=1)


@pytest.fixture
def make(tmp_path, nwb):
    """Return what writes a file: by default a fish that swims right at 1 px a frame."""
    animal, series = nwb

    def writer(fill=None):
        path = tmp_path / "tank.nwb"
        with h5py.File(path, "w") as file:
            file["file_create_date"] = [b"2026-01-01T00:00:00+00:00"]
            if fill is None:
                series(animal(file, "fish_0"), LINE_PX, rate_hz=15.0)
            else:
                fill(file, animal, series)
        return path

    return writer


def test_what_sleap_io_writes_is_read_with_names_frames_and_parts(golden, read):
    """fish_0 in frames 2 to 6, robot_3 not in 4; heads at 100 + frame px, tails 10 px behind."""
    path = golden("sleap-io.nwb")
    assert guess_format(path) == "nwb"

    found = read(path, "nwb", m_per_px=PX, keypoint="head", body_axis=("tail", "head"))

    tracks = found.tracks
    assert tracks.frame.tolist() == [2, 2, 3, 3, 4, 5, 5, 6, 6]
    assert tracks.agent.tolist() == [0, 3, 0, 3, 0, 0, 3, 0, 3]
    assert tracks.kind.tolist() == [0, 1, 0, 1, 0, 0, 1, 0, 1]
    assert tracks.x_m == pytest.approx((100 + tracks.frame) / 1000)
    assert tracks.y_m == pytest.approx(0.2 + tracks.agent / 60)
    assert tracks.heading_rad == pytest.approx(np.zeros(9))
    assert tracks.confidence == pytest.approx(np.full(9, 0.9))
    (warning,) = found.warnings
    assert "taken as the number of a frame, at 15 frames per second" in warning


def test_a_rate_numbers_frames_from_the_first_sample(make, read):
    """The one that begins later begins later; a session's start is told."""

    def fill(file, animal, series):
        series(animal(file, "a"), LINE_PX, rate_hz=15.0, time_s=100.0)
        series(animal(file, "b"), LINE_PX[:2], rate_hz=15.0, time_s=100.2)

    found = read(make(fill), "nwb", m_per_px=PX)

    assert found.tracks.frame[found.tracks.agent == 0].tolist() == [0, 1, 2, 3, 4]
    assert found.tracks.frame[found.tracks.agent == 1].tolist() == [3, 4]
    assert "Times are counted from the first sample, 100 s in the file." in found.notes


def test_a_rate_cut_to_whole_hertz_does_not_drift_from_times(make, read):
    """28.07 Hz that sleap-io wrote as 28, beside an animal with the true times."""
    n, fps = 900, 28.07
    swim_px = np.stack([np.arange(n) * 1.0, np.zeros(n)], axis=1)

    def fill(file, animal, series):
        series(animal(file, "a"), swim_px, rate_hz=28.0)
        times_s = np.delete(np.arange(n), 450) / fps
        series(animal(file, "b"), np.delete(swim_px, 450, axis=0), time_s=times_s)

    found = read(make(fill), "nwb", m_per_px=PX, fps=fps)

    assert found.tracks.x_m == pytest.approx(found.tracks.frame / 1000)
    assert any("states 28 frames per second, 28.07 is taken" in note for note in found.notes)


def test_lengths_in_metres_need_no_scale_and_a_conversion_is_applied(make, read):
    """As NWB defines it: data times conversion, plus offset, in the unit."""

    def fill(file, animal, series):
        series(animal(file, "a"), LINE_PX, rate_hz=15.0)
        file["processing/SLEAP_VIDEO_000_tank/track=a/body/data"].attrs.update(
            {"unit": "meters", "conversion": 0.01, "offset": 1.0}
        )

    tracks = read(make(fill), "nwb").tracks

    assert tracks.x_m[0] == pytest.approx(2.0)
    assert tracks.y_m[0] == pytest.approx(3.0)


def _foreign(file, animal):
    """Make the group of an animal that sleap-io did not write."""
    group = animal(file, "a")
    file.move(group.name, "processing/behavior/a")
    return file["processing/behavior/a"]


def test_times_that_waver_are_counted_from_one_to_the_next(make, read):
    """A clock that is 1.3 % fast passes its rate, and drifts past the middle of a frame."""
    n = 300
    swim_px = np.stack([np.arange(n) * 1.0, np.zeros(n)], axis=1)

    def fill(file, animal, series):
        times_s = np.arange(n) / 15.2
        series(animal(file, "a"), swim_px, time_s=times_s)
        series(
            animal(file, "b"), np.delete(swim_px, [7, 8], axis=0), time_s=np.delete(times_s, [7, 8])
        )

    found = read(make(fill), "nwb", m_per_px=PX)

    assert found.tracks.x_m == pytest.approx(found.tracks.frame / 1000)
    assert found.tracks.frame.max() == n - 1


def test_times_that_differ_by_less_than_a_video_shows_are_of_one_frame(make, read):
    """Half a millisecond between two animals."""

    def fill(file, animal, series):
        series(animal(file, "a"), LINE_PX, time_s=np.arange(5) / 15)
        series(animal(file, "b"), LINE_PX, time_s=np.arange(5) / 15 + 0.0005)

    assert read(make(fill), "nwb", m_per_px=PX).tracks.frame.tolist() == [
        *(0, 0, 1, 1, 2, 2, 3, 3, 4, 4)
    ]


def test_a_note_for_every_series_is_kept(make, read):
    """Of the rate and of the start; the same one once."""

    def fill(file, animal, series):
        for name in ("a", "b"):
            series(animal(file, name), LINE_PX, rate_hz=15.0, time_s=3.0)

    notes = read(make(fill), "nwb", m_per_px=PX, fps=15.1).notes

    assert notes[0] == "The file states 15 frames per second, 15.1 is taken."
    assert notes[1] == "Times are counted from the first sample, 3 s in the file."


def test_a_track_that_was_hardly_seen_does_not_spoil_the_file(make, read):
    """Seen twice, sleap-io states a rate of its own for it; a part that was not, has no samples."""

    def fill(file, animal, series):
        series(animal(file, "a"), LINE_PX, rate_hz=15.0)
        series(animal(file, "twice"), LINE_PX[:2], rate_hz=2.0, time_s=0.2)
        series(animal(file, "never"), LINE_PX[:0], time_s=np.empty(0))
        series(animal(file, "once"), LINE_PX[:1], time_s=np.array([0.2]))
        series(animal(file, "thrice"), LINE_PX[:3], time_s=np.array([0, 3, 5]) / 15)

    found = read(make(fill), "nwb", m_per_px=PX)

    numbered = {"a": [0, 1, 2, 3, 4], "once": [3], "thrice": [0, 3, 5]}
    assert "Agents are numbered: a = 0, never = 1, once = 2, thrice = 3, twice = 4." in found.notes
    for agent, frames in zip((0, 2, 3), numbered.values(), strict=True):
        assert found.tracks.frame[found.tracks.agent == agent].tolist() == frames
    assert set(found.tracks.agent.tolist()) == {0, 2, 3}
    assert "Without samples: never/body." in found.notes
    assert any("passed over: twice/body (2 samples)." in note for note in found.notes)


def test_without_a_rate_a_step_of_several_frames_is_cut_to_nothing(make, read):
    """sleap-io states 0 Hz for frames 3 and 7: the others are counted, these passed over."""

    def fill(file, animal, series):
        series(animal(file, "a"), LINE_PX, rate_hz=1.0, time_s=2.0)
        series(animal(file, "b"), LINE_PX[:2], rate_hz=0.0, time_s=3.0)

    found = read(make(fill), "nwb", m_per_px=PX)

    assert found.tracks.frame.tolist() == [2, 3, 4, 5, 6]
    assert any("passed over: b/body (2 samples)." in note for note in found.notes)
    assert found.warnings


def test_whole_seconds_are_seconds_where_the_rate_fits_or_there_is_one_sample(make, read):
    """At 1 Hz, frames count from the first; a single time tells no step."""

    def slow(file, animal, series):
        series(animal(file, "a"), LINE_PX, rate_hz=1.0, time_s=100.0)

    def single(file, animal, series):
        series(animal(file, "a"), LINE_PX[:1], time_s=np.array([7.0]))

    for fill, fps, frames in ((slow, 1.0, [0, 1, 2, 3, 4]), (single, 15.0, [0])):
        found = read(make(fill), "nwb", m_per_px=PX, fps=fps)
        assert found.tracks.frame.tolist() == frames
        assert found.warnings == ()
        assert not any("taken as the number" in note for note in found.notes)


def test_modules_of_one_video_are_read_and_what_is_no_group_is_skipped(make, read):
    """Data sets among the modules and among the animals, and links to elsewhere, do not matter."""

    def fill(file, animal, series):
        for k in (0, 1):
            series(animal(file, f"a{k}", module=f"module{k}"), LINE_PX, rate_hz=15.0)
        file["processing/module0/about"] = 1.0
        file["processing/about"] = 2.0
        file["acquisition/raw"] = h5py.ExternalLink("raw.h5", "/")

    assert len(read(make(fill), "nwb", m_per_px=PX).tracks) == 10


def _other_rate(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=30.0)


def _other_times(file, animal, series):
    series(animal(file, "a"), LINE_PX, time_s=np.arange(5) / 30)


def _every_fifteenth_second(file, animal, series):
    series(animal(file, "a"), LINE_PX, time_s=15.0 * np.array([0, 1, 2, 4, 5]))


def _seconds_beside_no_rate(file, animal, series):
    series(animal(file, "a"), LINE_PX[:3], time_s=15.0 * np.arange(3))
    series(animal(file, "b"), LINE_PX[:2], rate_hz=0.0, time_s=30.0)


def _no_rate(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=0.0)


def _no_times(file, animal, series):
    series(animal(file, "a"), LINE_PX)


def _backwards(file, animal, series):
    series(animal(file, "a"), LINE_PX, time_s=np.array([0.0, 0.1, 0.05, 0.2, 0.3]))


def _few_times(file, animal, series):
    series(animal(file, "a"), LINE_PX, time_s=np.arange(4) / 15)


def _three_dimensions(file, animal, series):
    series(animal(file, "a"), np.zeros((5, 3)), rate_hz=15.0)


def _words(file, animal, series):
    series(animal(file, "a"), np.full((5, 2), b"x"), rate_hz=15.0)


def _infinite_rate(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=np.inf)


def _every_second_frame(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=7.0)


def _seconds_of_another_program(file, animal, series):
    series(_foreign(file, animal), LINE_PX, time_s=np.arange(5.0))


def _a_rate_of_one_of_another_program(file, animal, series):
    series(_foreign(file, animal), LINE_PX, rate_hz=1.0)


def _no_rate_of_another_program(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=15.0)
    group = file.create_group("processing/behavior/b")
    group.attrs["neurodata_type"] = "PoseEstimation"
    group["original_videos"] = [b"tank.mp4"]
    series(group, LINE_PX, rate_hz=0.0)


def _two_rates(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=15.0)
    series(animal(file, "b"), LINE_PX, rate_hz=15.25)


def _two_clocks(file, animal, series):
    series(animal(file, "a"), LINE_PX, time_s=np.arange(5) / 15)
    series(animal(file, "b"), LINE_PX, time_s=(np.arange(5) + 0.5) / 15)


def _two_cameras(file, animal, series):
    for k in (0, 1):
        group = animal(file, f"a{k}", module=f"camera{k}")
        del group["original_videos"]
        series(group, LINE_PX, rate_hz=15.0)


def _two_sources(file, animal, series):
    for k in (0, 1):
        group = animal(file, f"a{k}")
        del group["original_videos"]
        group["source_video"] = file.create_group(f"acquisition/video{k}")
        series(group, LINE_PX, rate_hz=15.0)


def _scaled(**attributes):
    def fill(file, animal, series):
        series(animal(file, "a"), LINE_PX, rate_hz=15.0)
        file["processing/SLEAP_VIDEO_000_tank/track=a/body/data"].attrs.update(attributes)

    return fill


def _away(file, animal, series):
    """A part that is in a group of another file, by two links."""
    raw = Path(file.filename).with_name("raw.h5")
    with h5py.File(raw, "w") as other:
        series(animal(other, "a"), LINE_PX, rate_hz=15.0)
    there = "/processing/SLEAP_VIDEO_000_tank/track=a"
    file["acquisition/raw"] = h5py.ExternalLink(raw.name, there)
    file["processing/tank"] = h5py.SoftLink("/acquisition")


def _two_videos(file, animal, series):
    for k in (0, 1):
        group = animal(file, "a", module=f"SLEAP_VIDEO_{k}", video=f"{k}.mp4")
        series(group, LINE_PX, rate_hz=15.0)


def _twice(file, animal, series):
    for k in (0, 1):
        series(animal(file, "a", module=f"module{k}"), LINE_PX, rate_hz=15.0)


def _no_parts(file, animal, series):
    animal(file, "a")


def _training(file, animal, series):
    file.create_group("processing/behavior/PoseTraining").attrs["neurodata_type"] = "PoseTraining"


def _nothing(file, animal, series):
    file.create_group("acquisition")


def _furlongs(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=15.0)
    file["processing/SLEAP_VIDEO_000_tank/track=a/body/data"].attrs["unit"] = "furlongs"


def _lost(file, animal, series):
    series(animal(file, "a"), LINE_PX * np.nan, rate_hz=15.0)


def _little_confidence(file, animal, series):
    series(animal(file, "a"), LINE_PX, rate_hz=15.0)
    node = file["processing/SLEAP_VIDEO_000_tank/track=a/body"]
    del node["confidence"]
    node["confidence"] = [0.5]


@pytest.mark.parametrize(
    ("fill", "message"),
    [
        (_other_rate, "the file states 30 frames per second, expected fps = 15"),
        (_other_times, "the times advance at 30 Hz, expected fps = 15 Hz"),
        (_every_fifteenth_second, "the times advance at 0.06667 Hz, expected fps = 15 Hz"),
        (_seconds_beside_no_rate, "the times advance at 0.06667 Hz, expected fps = 15 Hz"),
        (_no_rate, "a/body: expected a starting_time with a positive rate, got 0 and 0"),
        (_infinite_rate, "a/body: expected a number as rate, got inf"),
        (_every_second_frame, "the file states 7 frames per second, expected fps = 15"),
        (_seconds_of_another_program, "the times advance at 1 Hz, expected fps = 15 Hz"),
        (_a_rate_of_one_of_another_program, "the file states 1 frames per second, expected fps"),
        (_no_rate_of_another_program, "b/body: expected a starting_time with a positive rate"),
        (_two_rates, "one rate for all series, got 15 Hz (a/body), 15.25 Hz (b/body)"),
        (_two_clocks, "the times advance at 30 Hz, expected fps = 15 Hz"),
        (_two_cameras, "one video, got those of camera0, camera1, and not for all of them"),
        (_two_sources, "PoseEstimation of one video, got poses in 2 videos"),
        (_scaled(conversion=0.0), "a/body: expected a positive conversion, got 0"),
        (_scaled(conversion=-1.0), "a/body: expected a positive conversion, got -1"),
        (_scaled(conversion=np.nan), "a/body: expected a number as conversion, got nan"),
        (_scaled(conversion=[2.0, 3.0]), "a/body: expected a number as conversion, got [2. 3.]"),
        (_scaled(offset=np.inf), "a/body: expected a number as offset, got inf"),
        (_no_times, "expected a data set 'starting_time'"),
        (_backwards, "a/body: expected 5 timestamps that advance"),
        (_few_times, "a/body: expected 5 timestamps that advance"),
        (
            _three_dimensions,
            "a/body: expected positions of shape (samples, 2), got float64 of (5, 3)",
        ),
        (_words, "a/body: expected positions of shape (samples, 2), got |S1 of (5, 2)"),
        (_two_videos, "PoseEstimation of one video, got poses in 2 videos"),
        (_twice, "expected each animal once, got two of the same name"),
        (_no_parts, "track=a holds no PoseEstimationSeries"),
        (_training, "got PoseTraining. Training data (PoseTraining) are no tracks"),
        (_nothing, "PoseEstimation of one video, got nothing in 'processing'"),
        (_furlongs, "a/body: positions are in 'furlongs', expected one of px"),
        (_lost, "expected positions, got none: all 5 are missing"),
        (_little_confidence, "a/body: expected 5 numbers of confidence, got float64 of (1,)"),
    ],
)
def test_a_damaged_file_is_told_in_one_line(fill, message, make, refused):
    """Where, what was expected, and what is there."""
    assert message in refused(make(fill), "nwb", m_per_px=PX)


def test_poses_in_another_file_are_refused(make, refused):
    """Also where a link of the file leads to one that leads out of it."""
    assert "expected a file that holds its data itself" in refused(make(_away), "nwb", m_per_px=PX)


def test_what_is_no_hdf5_is_refused(write, refused):
    """A text that is called .nwb."""
    assert "expected a whole HDF5 file" in refused(write("a.nwb", "x,y\n"), "nwb", m_per_px=PX)
