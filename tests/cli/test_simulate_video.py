"""`zfcal simulate --video`, as a person uses it."""

import json

import cv2
import pytest

WORDS = ("simulate", "film", "--model", "trial/models/000000.toml", "--duration", "1")


@pytest.fixture(autouse=True)
def trial(zfcal):
    """Make a trial whose model is simulated."""
    made = zfcal("init", "trial", "--arena", "open-square", "--fish", "2", "--robot")
    assert made.code == 0


def test_images_appear_with_the_tracks(zfcal, tmp_path):
    """Paths on standard output, in the order in which they are made; the trial is sound."""
    done = zfcal(*WORDS, "--video", "--look", "hard", "--video-file", "film.mp4")
    assert done.code == 0
    assert done.lines == [
        "film/models/000000.toml",
        "film/trial.toml",
        "film/tracks/000000.parquet",
        "film/cameras/overhead.toml",
        "film/frames/overhead/000000.mcap",
        "film/cameras/below.toml",
        "film/frames/below/000000.mcap",
        "film.mp4",
        "film-below.mp4",
    ]
    assert cv2.VideoCapture(str(tmp_path / "film.mp4")).get(cv2.CAP_PROP_FRAME_COUNT) == 15
    assert zfcal("check", "film").code == 0
    again = zfcal(*WORDS, "--video", "--look", "hard", "--video-file", "film.mp4", "--json")
    artifacts = json.loads(again.out)["artifacts"]
    assert {artifact["state"] for artifact in artifacts} == {"up to date"}


def inspected(zfcal):
    """Return what `zfcal inspect` says of the overhead images."""
    out = zfcal("inspect", "film/frames/overhead/000000.mcap", "--json").out
    return json.loads(out)["results"][0]


def test_a_file_of_images_can_be_inspected(zfcal):
    """Topics with well-known schemas, and every value of the look."""
    zfcal(*WORDS, "--video", "--draw", "noise_grey=7.5", "--draw", "shadow_offset_m=0.01,0.0")
    found = inspected(zfcal)
    topics = {row["topic"]: row for row in found["contents"]["topics"]}
    assert topics["/overhead/image"]["messages"] == 15
    assert topics["/overhead/calibration"]["schema"] == "foxglove.CameraCalibration"
    look = found["lineage"]["options"]["look"]
    assert look["noise_grey"] == 7.5
    assert look["shadow_offset_m"] == [0.01, 0.0]
    assert look["jpeg_quality"] == 92


@pytest.mark.slow
def test_lossless_images_are_asked_for_by_none(zfcal):
    """A quality of none is no quality at all."""
    zfcal(*WORDS, "--video", "--draw", "jpeg_quality=none")
    found = inspected(zfcal)
    assert "jpeg_quality" not in found["lineage"]["options"]["look"]


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--look", "hard"], 2, "--look is about images: add --video"),
        (["--draw", "noise_grey=3"], 2, "--draw is about images: add --video"),
        (["--video", "--draw", "noise_grey"], 2, "takes NAME=VALUE with a number"),
        (["--video", "--draw", "noise_grey=much"], 2, "takes NAME=VALUE with a number"),
        (["--video", "--draw", "nose_grey=3"], 1, "no 'nose_grey'"),
        (["--video", "--draw", "noise_grey=-3"], 1, "noise_grey must be from 0 to 255"),
        (["--video", "--look", "ugly"], 2, "is not one of"),
        (["--video-file", "film.gif"], 1, "no video file that can be written"),
        (["--video", "--fps", "7"], 1, "dt_s must be a whole number of frames"),
        (["--video", "--photograph", "trial/trial.toml"], 1, "is no image that can be read"),
    ],
)
def test_wrong_options_are_named(zfcal, words, code, says):
    """In a line, without a traceback."""
    done = zfcal(*WORDS, *words)
    assert done.code == code
    assert says in done.err
    assert "Traceback" not in done.err


def test_an_existing_trial_has_its_own_frame_rate(zfcal):
    """Asking for another is an error, not ignored."""
    done = zfcal("simulate", "trial", *WORDS[2:], "--video", "--fps", "30")
    assert done.code == 1
    assert "fps is 15.0, the command gives 30.0" in done.err
