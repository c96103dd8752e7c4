"""`zfcal track` as a command: paths, exit codes and pipes."""

import contextlib
import json
import shutil

import cv2
import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage, read_lineage
from zfcal.artifacts.tables import read_tracks
from zfcal.cameras.camera import Homography
from zfcal.stages.camera.cameras import read_camera, write_camera
from zfcal.tracking.seen import METHODS
from zfcal_cli import tracking
from zfcal_cli.main import run

CORNERS = "-0.5,199.5 199.5,199.5 199.5,-0.5 -0.5,-0.5"


@pytest.fixture(scope="module")
def film(tmp_path_factory, write_film):
    """Return a video of 125 s, whose bodies keep apart."""
    return write_film(tmp_path_factory.mktemp("film") / "day3.avi", seconds=125)


@pytest.fixture
def tank(zfcal, tmp_path):
    """Return a trial of three fish in a square of 0.4 m, 5 Hz."""
    assert zfcal("init", "trial", "--side-m", 0.4, "--fish", 3, "--fps", 5, "-q").code == 0
    return tmp_path / "trial"


def negative(film, path):
    """Write the negative of a video."""
    reader = cv2.VideoCapture(str(film))
    code = cv2.VideoWriter.fourcc(*"FFV1")
    writer = cv2.VideoWriter(str(path), code, 5.0, (200, 200), isColor=False)
    while (read := reader.read())[0]:
        writer.write(255 - read[1][..., 0])
    writer.release()
    return path


def words(film):
    """Return the command's words."""
    return ["track", "trial", "--overhead", str(film), "--corners", CORNERS]


@pytest.fixture(scope="module")
def tracked(film, tmp_path_factory):
    """Return the folder of such a trial that was tracked from the video, undisturbed."""
    place = tmp_path_factory.mktemp("tracked")
    with contextlib.chdir(place):
        assert run(["init", "trial", "--side-m", "0.4", "--fish", "3", "--fps", "5", "-q"]) == 0
        assert run([*words(film), "-q"]) == 0
    return place


@pytest.mark.slow
def test_paths_go_out_and_talk_goes_to_the_other_stream(zfcal, tank, film):
    """Tracks and poses of each minute; the second time they are up to date."""
    names = [
        f"trial/{folder}/{second:06d}.{ending}"
        for second in (0, 60, 120)
        for folder, ending in (("tracks", "parquet"), ("poses", "mcap"))
    ]
    first = zfcal(*words(film))
    assert (first.code, first.lines) == (0, names)
    assert "625 frames; 100.0% of them with exactly 3 animals" in first.err
    second = zfcal(*words(film))
    assert (second.code, second.lines) == (0, names)
    assert "nothing to do, 6 up to date" in second.err


def test_numbers_go_out_as_json(zfcal, tank, film):
    """Frames, gaps, bad frames and latency, beside the artifacts."""
    document = json.loads(zfcal(*words(film), "--duration", "30s", "--json").out)
    (numbers,) = document["results"]
    assert numbers["frames"] == 150
    assert numbers["gaps"] == 0
    assert numbers["latency_ms"]["p95"] > 0
    assert [a["state"] for a in document["artifacts"]] == ["made", "made"]


@pytest.mark.slow
def test_paths_go_through_a_pipe(zfcal, film, tracked, process, tmp_path):
    """`zfcal track trial ... | zfcal analyse -`."""
    shutil.copytree(tracked / "trial", tmp_path / "trial")
    paths = zfcal(*words(film)).out
    analysed = process("analyse", "-", stdin=paths)
    assert analysed.code == 0
    assert analysed.lines[:1] == ["trial/stats/000120.parquet"]


def test_a_video_that_was_cut_ends_with_three(zfcal, tank, film, tmp_path):
    """What could be read is tracked."""
    content = film.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: len(content) // 4])
    done = zfcal(*words("cut.avi"))
    assert done.code == 3
    assert done.lines[0] == "trial/tracks/000000.parquet"
    assert "cut.avi: was cut short or is damaged" in done.err
    assert len(read_tracks(tank / "tracks" / "000000.parquet")) > 300


@pytest.mark.parametrize(
    ("source", "code", "says"),
    [
        ("nowhere.mp4", 1, "nowhere.mp4: no such file"),
        ("trial/trial.toml", 3, "no video that can be opened"),
        ("trial", 1, "is a folder without images"),
        ("*.png", 1, "no file answers to this pattern"),
        ("http://127.0.0.1:9/x.mjpg", 1, "no camera answers there"),
        ("/dev/video99", 1, "no camera answers there"),
    ],
)
def test_a_source_that_is_none_is_named_in_one_line(zfcal, tank, source, code, says):
    """With a hint, without a traceback, and nothing is written."""
    done = zfcal(*words(source))
    assert done.code == code
    assert says in done.err
    assert "hint:" in done.err
    assert "Traceback" not in done.err
    assert not (tank / "poses").exists()


@pytest.mark.parametrize("corners", ["1,2,3", "a,b,c,d,e,f,g,h", "1,2 3,4 5,6 7,8 9,9"])
def test_corners_are_eight_numbers(zfcal, tank, film, corners):
    """Anything else is wrong usage."""
    done = zfcal("track", "trial", "--overhead", film, "--corners", corners)
    assert done.code == 2
    assert "eight numbers" in done.err


def test_fish_are_said_to_be_one_thing(zfcal, tank, film):
    """Of two words one could not take effect."""
    done = zfcal(*words(film), "--light", "--dark")
    assert done.code == 2
    assert "--light and --dark: give one of them" in done.err


def test_a_word_against_the_film_is_told(zfcal, tank, film):
    """In a warning, and in the numbers; the word wins."""
    document = json.loads(zfcal(*words(film), "--duration", "30s", "--light", "--json").out)
    (numbers,) = document["results"]
    assert numbers["learnt"]["polarity"] == "light"
    assert numbers["learnt"]["film_polarity"] == "dark"
    assert numbers["exact"] == 0
    warned = " ".join(note["text"] for note in document["messages"] if note["level"] == "warning")
    assert "--light was given, but the film shows animals that are darker" in warned


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "right"), [("--light", "--dark"), ("--dark", "--light")])
def test_a_film_in_which_no_fish_is_found_is_told(zfcal, tank, film, tmp_path, wrong, right):
    """In one warning, of how many frames, with what to try; the files are there, without a fish."""
    if wrong == "--dark":
        film = negative(film, tmp_path / "negative.avi")
    done = zfcal(*words(film), "--duration", "30s", wrong, "--json")
    document = json.loads(done.out)
    (numbers,) = document["results"]
    assert done.code == 0
    assert numbers["fish"] == 0
    assert numbers["without_fish"] == numbers["frames"] > 0
    (warned,) = [note["text"] for note in document["messages"] if "no fish found" in note["text"]]
    assert f"no fish found in any of {numbers['frames']} frames" in warned
    assert f"Try {right} (with --force)" in warned
    assert (tank / "tracks" / "000000.parquet").exists()


def test_a_film_in_which_the_fish_are_found_gives_no_such_warning(zfcal, tank, film):
    """With the right word."""
    done = zfcal(*words(film), "--duration", "30s", "--dark")
    assert done.code == 0
    assert "fish found" not in done.err


def test_the_methods_are_those_of_the_tracker():
    """The command line knows them without loading it."""
    assert tracking.METHODS == METHODS


@pytest.mark.slow
def test_a_watch_tracks_analyses_and_calibrates_to_the_end(zfcal, tank, film, watching):
    """It ends with the recording, in the files of one command after the other."""
    source = words(film)[2:]
    done = zfcal("watch", "trial", *source, *watching.quick)
    assert done.code == 0, done.err
    assert "watch: track, analyse, calibrate of trial." in done.err
    assert "watch: ends, the recording has ended." in done.err
    watched = watching.contents(tank)
    assert "models/000120.toml" in watched
    tank.rename(tank.with_name("watched"))
    zfcal("init", "trial", "--side-m", 0.4, "--fish", 3, "--fps", 5, "-q")
    for line in (words(film), ["analyse", "trial"], ["calibrate", "trial", *watching.quick]):
        assert zfcal(*line, "-q").code == 0
    assert watching.contents(tank) == watched


@pytest.mark.slow
def test_a_watch_without_a_camera_says_so_and_ends(zfcal, tank):
    """A slip of the pen is not waited for."""
    done = zfcal("watch", "trial", "--overhead", "no-such.avi", "--corners", CORNERS)
    assert done.code == 1
    assert "no-such.avi" in done.err


IMAGE_ORDER = "-0.5,-0.5 199.5,-0.5 199.5,199.5 -0.5,199.5"


def test_corners_in_image_order_are_an_error_that_shows_the_right_one(zfcal, tank, film):
    """The numbers of its hint are tracked; the order as it was, with the side that it means."""
    start = ["track", "trial", "--overhead", str(film), "--duration", "2s"]
    done = zfcal(*start, "--corners", IMAGE_ORDER)
    assert done.code == 1
    assert "the arena is seen from below (mirrored), expected from above" in done.err
    ready = done.err.partition("upright: '")[2].partition("'")[0]
    assert ready == CORNERS
    assert not (tank / "tracks").exists()
    assert zfcal(*start, "--corners", ready).code == 0
    done = zfcal(*start, "--corners", IMAGE_ORDER, "--seen-from", "below", "--force")
    assert done.code == 0


@pytest.fixture
def robot_film(zfcal, tmp_path):
    """Return a trial of two fish and a robot with the images of both cameras, of 4 s."""
    words = ["--arena", "open-square", "--fish", 2, "--robot", "--seed", 3, "-q"]
    assert zfcal("init", "t", *words).code == 0
    words = ["--model", "t/models/000000.toml", "--duration", "4s", "--video", "-q"]
    assert zfcal("simulate", "film", *words).code == 0
    shutil.rmtree(tmp_path / "film" / "tracks")
    return tmp_path / "film"


def turned(film, name):
    """Replace a camera's file by that of one that sees the tank from the other side."""
    path = film / "cameras" / f"{name}.toml"
    camera = read_camera(path)
    pixels = np.array([[50, 50], [400, 60], [420, 400], [60, 390]], float)
    flipped = pixels.copy()
    flipped[:, 1] = camera.size_px[1] - 1 - pixels[:, 1]
    matrix, _ = cv2.findHomography(flipped, camera.to_metres(pixels))
    rows = tuple(tuple(float(value) for value in row) for row in matrix)
    lineage = Lineage(schema="zfcal.camera/1", command="by hand")
    write_camera(path, Homography(size_px=camera.size_px, matrix=rows), lineage)


@pytest.mark.slow
def test_seen_from_below_may_be_said_of_the_camera_below(zfcal, robot_film):
    """Who has two cameras says it of the one of which it is true, and tracks as without a word."""
    start = ["track", "film", "--below", "film/frames/below"]
    assert zfcal(*start).code == 0
    plain = read_tracks(robot_film / "tracks" / "000000.parquet")
    assert zfcal(*start, "--seen-from", "below").code == 0
    said = read_tracks(robot_film / "tracks" / "000000.parquet")
    assert np.array_equal(plain.x_m, said.x_m)
    turned(robot_film, "overhead")
    assert zfcal(*start).code == 1
    assert zfcal(*start, "--seen-from", "below").code == 0


@pytest.mark.slow
def test_a_camera_below_that_sees_the_leds_from_above_has_to_be_stated(zfcal, robot_film):
    """By an option that the error names; said of one that looks from below it is an error too."""
    done = zfcal("track", "film", "--below-seen-from", "above")
    assert done.code == 1
    assert "leave --below-seen-from out" in done.err
    turned(robot_film, "below")
    done = zfcal("track", "film")
    assert done.code == 1
    assert "as the camera below: the arena is seen from above (not mirrored)" in done.err
    assert "say --below-seen-from above" in done.err
    assert zfcal("track", "film", "--below-seen-from", "above").code == 0
    lineage = read_lineage(robot_film / "tracks" / "000000.parquet")
    assert lineage.options["below_seen_from"] == "above"
