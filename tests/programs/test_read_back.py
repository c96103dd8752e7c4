"""What sleap-io writes is read by the command, with sleap-io installed beside zfcal."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.tables import read_tracks
from zfcal.readers import ImportOptions, import_foreign
from zfcal.stages.events import say_nothing
from zfcal.stages.export.export import export
from zfcal.stages.export.options import ExportOptions
from zfcal.tracks import concatenate

WRITER = Path(__file__).resolve().parent / "written.py"
SCALE = ("--mm-per-px", "1")
HEAD = ("--keypoint", "head")


def run(*words, cwd):
    """Run a program, and return what it did."""
    words = [str(word) for word in words]
    return subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False, timeout=300)


@pytest.fixture(scope="module")
def files(python, tmp_path_factory):
    """Return the folder of what sleap-io wrote."""
    folder = tmp_path_factory.mktemp("written")
    done = run(python, WRITER, folder, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def imported(python, tmp_path):
    """Return what imports a file by the command of the programs' environment."""
    zfcal = python.parent / "zfcal"

    def importer(path, *words, fps=5, n_fish=1):
        tank = ("--side-m", 1, "--fish", n_fish, "--robot", "--fps", fps)
        assert run(zfcal, "init", "again", *tank, cwd=tmp_path).returncode == 0
        done = run(zfcal, "import", path, "again", *words, cwd=tmp_path)
        files = sorted((tmp_path / "again" / "tracks").glob("*.parquet"))
        return done, concatenate([read_tracks(file) for file in files]) if files else None

    return importer


def test_labels_of_sleap_io_are_imported(files, imported):
    """By frames of the video; a person's instance counts before the predicted one."""
    done, tracks = imported(files / "tank.slp", *SCALE, *HEAD, "--body-axis", "tail,head")

    assert done.returncode == 0, done.stderr
    assert "read as --format sleap." in done.stderr
    assert "1 instances without a track are left out." in done.stderr
    assert tracks.frame.tolist() == [2, 2, 3, 3, 4, 9, 9]
    assert tracks.agent.tolist() == [0, 3, 0, 3, 0, 0, 3]
    assert tracks.kind.tolist() == [0, 1, 0, 1, 0, 0, 1]
    by_hand = np.array([False, False, True, False, False, False, False])
    assert tracks.x_m == pytest.approx((100 + tracks.frame + 5 * by_hand) / 1000)
    assert tracks.y_m == pytest.approx(0.2 + tracks.agent / 60)
    # The person saw no tail, and gave no score.
    assert np.isnan(tracks.heading_rad).tolist() == by_hand.tolist()
    assert tracks.confidence == pytest.approx(np.where(by_hand, 1.0, 0.9))
    assert tracks.time_s == pytest.approx(tracks.frame / 5)


def test_one_animal_needs_no_track(files, imported):
    """A person's correction takes the place of what was predicted."""
    done, tracks = imported(files / "alone.slp", *SCALE, *HEAD)

    assert done.returncode == 0, done.stderr
    assert tracks.agent.tolist() == [0] * 4
    assert tracks.x_m == pytest.approx([0.102, 0.108, 0.104, 0.109])


REPLACED = "In 1 frames a person's instance stands for a prediction that the file does not say"


def test_a_prediction_that_gives_way_is_told_unless_it_was_corrected(files, imported):
    """Without tracks it may be another animal."""
    done, _ = imported(files / "alone.slp", *SCALE, *HEAD)
    assert f"warning: {files / 'alone.slp'}: {REPLACED}" in done.stderr


def test_a_correction_of_a_prediction_is_no_warning(files, imported):
    """The file says which one it corrects."""
    done, tracks = imported(files / "corrected.slp", *SCALE, *HEAD)

    assert done.returncode == 0, done.stderr
    assert "stands for a prediction" not in done.stderr
    assert tracks.x_m == pytest.approx([0.102, 0.108, 0.104, 0.109])


def test_the_rate_is_that_of_the_video_with_the_animals(files, imported):
    """Another video of the file may have another rate."""
    done, tracks = imported(files / "rates.slp", *SCALE, *HEAD)

    assert done.returncode == 0, done.stderr
    assert tracks.time_s == pytest.approx([0.4, 0.6])


def test_a_rate_that_is_text_is_told_and_not_used(files, imported):
    """No number, no comparison."""
    done, tracks = imported(files / "words.slp", *SCALE, *HEAD)

    assert done.returncode == 0, done.stderr
    assert "The file states no usable frame rate ('5')." in done.stderr
    assert tracks.time_s == pytest.approx([0.4])


def test_an_ending_in_capitals_is_known(files, imported):
    """The same tracks."""
    done, tracks = imported(files / "CAPITALS.SLP", *SCALE, *HEAD)

    assert done.returncode == 0, done.stderr
    assert tracks.frame.tolist() == [2, 2, 3, 3, 4, 9, 9]


def test_a_robot_is_not_named_by_what_two_tracks_are_called(files, imported):
    """One of them is a fish."""
    done, tracks = imported(files / "namesakes.slp", *SCALE, *HEAD, "--robots", "fish_0")

    assert done.returncode == 1
    assert "2 agents are called 'fish_0', expected the name of one robot" in done.stderr
    assert tracks is None


def test_an_export_comes_back_through_sleap_io(python, trial, imported, tmp_path):
    """Exported, opened and saved as labels by sleap-io, imported: the same tracks but headings."""
    export(trial, ExportOptions(formats=("sleap",)), say_nothing)
    exported = trial / "export" / "sleap" / "tracks.analysis.h5"
    done = run(python, WRITER, tmp_path, exported, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    back = ("--origin", "0,1000", "--flip-y")

    done, tracks = imported(tmp_path / "again.slp", *SCALE, *back, n_fish=3)

    assert done.returncode == 0, done.stderr
    segments = sorted((trial / "tracks").glob("*.parquet"))
    wanted = concatenate([read_tracks(segment) for segment in segments])
    for name in ("frame", "agent", "kind"):
        assert np.array_equal(getattr(tracks, name), getattr(wanted, name))
    np.testing.assert_allclose(tracks.x_m, wanted.x_m, rtol=0, atol=1e-10)
    np.testing.assert_allclose(tracks.y_m, wanted.y_m, rtol=0, atol=1e-10)
    np.testing.assert_allclose(tracks.confidence, wanted.confidence, rtol=0, atol=1e-6)
    np.testing.assert_allclose(tracks.time_s, wanted.time_s, rtol=0, atol=1e-9)


def test_nwb_of_sleap_io_is_read_without_it(files):
    """By zfcal's own environment, with the names and frames that sleap-io wrote."""
    options = ImportOptions(fps=5.0, m_per_px=0.001, keypoint="head")

    tracks = import_foreign(files / "tank.nwb", "nwb", options).tracks

    assert tracks.frame.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert tracks.agent.tolist() == [0, 3] * 4
    assert tracks.kind.tolist() == [0, 1] * 4
    assert tracks.x_m == pytest.approx((100 + tracks.frame) / 1000)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("crowd", "frame 3 has 2 instances and no track in the file shows which animal is which"),
        ("twice", "track 'fish_0' is twice in frame 2, expected once"),
        ("videos", "expected instances in frames of one video, got those of 2"),
        ("empty", "expected instances in frames of one video, got those of 0"),
        ("lost", "expected positions, got none: all 1 are missing"),
        ("cut", "expected a whole SLEAP file, got one that does not read"),
        ("other", "the file states 30 frames per second, expected fps = 5"),
        ("linked", "expected a file that holds its data itself, got /pred_points in points.h5"),
        ("external", "expected a file that holds its data itself, got pred_points in points.bin"),
        ("text", "expected a whole SLEAP file, got one that does not read"),
    ],
)
def test_what_is_wrong_with_labels_is_told_in_one_line(name, message, files, imported):
    """And nothing is written."""
    done, tracks = imported(files / f"{name}.slp", *SCALE, *HEAD)

    assert done.returncode == 1
    (line,) = [line for line in done.stderr.splitlines() if message in line]
    assert f"{name}.slp: " in line
    assert "Traceback" not in done.stderr
    assert tracks is None
