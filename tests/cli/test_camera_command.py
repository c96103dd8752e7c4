"""`zfcal camera`, as a person uses it."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from zfcal.stages.camera.cameras import read_camera

CORNERS = ("50,450", "450,450", "450,50", "50,50")


@pytest.fixture
def trial(zfcal, tmp_path):
    """Return a trial in two rooms."""
    assert zfcal("init", "trial", "--arena", "two-rooms", "--fish", "4", "--robot").code == 0
    return tmp_path / "trial"


def test_corners_make_a_camera_that_the_trial_names(zfcal, trial):
    """The file appears, trial.toml names it, and the trial is sound."""
    done = zfcal(
        "camera",
        "corners",
        *CORNERS,
        "--size",
        "500x500",
        "--trial",
        "trial",
        "--camera",
        "overhead",
    )
    assert done.code == 0
    assert done.lines == ["trial/cameras/overhead.toml"]
    assert 'file = "cameras/overhead.toml"' in (trial / "trial.toml").read_text()
    assert zfcal("check", "trial").code == 0
    camera = read_camera(trial / "cameras" / "overhead.toml")
    # The shipped arena starts 51 mm from its origin.
    there = camera.to_metres(np.array([50.0, 450.0]))
    np.testing.assert_allclose(there, [0.051, 0.051], atol=1e-6)


def test_the_second_time_nothing_is_done(zfcal, trial):
    """The same corners: up to date; others: made again, and why is told."""
    words = ["--size", "500x500", "--trial", "trial", "--camera", "overhead", "-v"]
    zfcal("camera", "corners", *CORNERS, *words)
    before = (trial / "cameras" / "overhead.toml").read_bytes()
    again = zfcal("camera", "corners", *CORNERS, *words)
    assert "up to date" in again.err
    assert (trial / "cameras" / "overhead.toml").read_bytes() == before
    moved = zfcal("camera", "corners", "52,450", *CORNERS[1:], *words)
    assert "option corners_px" in moved.err


@pytest.mark.parametrize(("k", "name"), [*enumerate(["LL", "LR", "UR", "UL"])])
@pytest.mark.parametrize(("text", "expected"), [
    ("28,nan", "finite numbers"),
    ("inf,30", "finite numbers"),
    ("28,-inf", "finite numbers"),
    ("28", "2 numbers with commas between"),
    ("a,b", "2 numbers with commas between"),
])  # fmt: skip
def test_a_corner_that_is_no_pair_of_finite_numbers_is_named(zfcal, trial, k, name, text, expected):
    """Wrong usage; the corner has the name that help gives it."""
    corners = [*CORNERS[:k], text, *CORNERS[k + 1 :]]
    words = ["--size", "500x500", "--trial", "trial", "--camera", "overhead"]
    done = zfcal("camera", "corners", *corners, *words)
    assert done.code == 2
    assert f"Invalid value for {name}: expected {expected}, got {text!r}." in done.err
    assert not (trial / "cameras").exists()


def test_bounds_are_finite_numbers(zfcal):
    """As corners are."""
    words = ["--bounds-m", "0,0,nan,1", "--size", "500x500", "-o", "camera.toml"]
    done = zfcal("camera", "corners", *CORNERS, *words)
    assert done.code == 2
    assert "'--bounds-m': expected finite numbers, got '0,0,nan,1'." in done.err


def test_what_a_person_wrote_in_the_settings_stays(zfcal, trial):
    """Comments, and the camera's source."""
    path = trial / "trial.toml"
    text = path.read_text() + '\n# My rig.\n[cameras.overhead]\nsource = "0" # on the ceiling\n'
    path.write_text(text)
    words = ["--size", "500x500", "--trial", "trial", "--camera", "overhead"]
    assert zfcal("camera", "corners", *CORNERS, *words).code == 0
    assert '# My rig.\n[cameras.overhead]\nsource = "0" # on the ceiling\nfile' in path.read_text()


def test_an_image_gives_the_size(zfcal, tmp_path):
    """And must have the one that is given as well."""
    cv2.imwrite(str(tmp_path / "tank.png"), np.zeros((480, 500, 3), np.uint8))
    words = ["camera", "corners", *CORNERS, "--bounds-m", "0,0,1,1", "-o", "c.toml"]
    assert zfcal(*words, "--image", "tank.png").code == 0
    assert read_camera(tmp_path / "c.toml").size_px == (500, 480)
    wrong = zfcal(*words, "--image", "tank.png", "--size", "500x500")
    assert wrong.code == 1
    assert "tank.png: is 500 x 480 px, --size says 500 x 500" in wrong.err


def test_json_holds_the_file_and_how_it_went(zfcal):
    """One document."""
    words = ["--size", "500x500", "--bounds-m", "0,0,1,1", "-o", "c.toml", "--json"]
    document = json.loads(zfcal("camera", "corners", *CORNERS, *words).out)
    assert [artifact["path"] for artifact in document["artifacts"]] == ["c.toml"]
    assert document["results"][0]["n_points"] == 4


def test_a_dry_run_writes_nothing(zfcal, trial):
    """Neither the camera nor the settings."""
    before = (trial / "trial.toml").read_bytes()
    words = ["--size", "500x500", "--trial", "trial", "--camera", "below", "--dry-run"]
    done = zfcal("camera", "corners", *CORNERS, *words)
    assert "would make trial/cameras/below.toml: missing" in done.err
    assert not (trial / "cameras").exists()
    assert (trial / "trial.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["-o", "c.toml", "--bounds-m", "0,0,1,1"], 1, "How large are the camera's images?"),
        (["-o", "c.toml", "--size", "500x500"], 1, "Corners of which arena?"),
        (["--size", "500x500", "--bounds-m", "0,0,1,1"], 2, "Give -o FILE, or --trial"),
        (["-o", "c.toml", "--size", "500", "--bounds-m", "0,0,1,1"], 2, "expected WIDTHxHEIGHT"),
        (["-o", "c.toml", "--size", "500x500", "--bounds-m", "0,1"], 2, "expected 4 numbers"),
        (["-o", "c.json", "--size", "500x500", "--bounds-m", "0,0,1,1"], 1, "is TOML"),
        (["--trial", "t", "--size", "500x500"], 2, "--trial and --camera go together"),
        (["--trial", "t", "--camera", "below", "--size", "9x9"], 1, "is not a trial"),
        (["-o", "c.toml", "--size", "200x200", "--bounds-m", "0,0,1,1"], 1, "outside the image"),
    ],
)
def test_wrong_use_is_one_line_with_a_hint(zfcal, tmp_path, words, code, says):
    """And leaves nothing behind."""
    done = zfcal("camera", "corners", *CORNERS, *words)
    assert done.code == code
    assert says in done.err
    assert "Traceback" not in done.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["sheet", "board", "points", "corners", "import", "align"])
def test_every_camera_command_has_help_with_an_example(zfcal, name):
    """And the group too."""
    assert "Example:" in zfcal("camera", "--help").out
    assert "Example:\n      zfcal camera " + name in zfcal("camera", name, "--help").out


MARKS = """x_px,y_px,x_cm,y_cm
50,450,0,0
250,450,50,0
450,450,100,0
50,250,0,50
250,250,50,50
450,250,100,50
50,50,0,100
250,50,50,100
450,50,100,100
"""

OLD = """<?xml version="1.0"?>
<opencv_storage>
<worldUnits>cm</worldUnits>
<imageSize><width>500</width><height>500</height></imageSize>
<calibrationPoints><numberOfPoints>9</numberOfPoints>
{points}
</calibrationPoints>
</opencv_storage>
"""


def test_points_make_a_camera_with_its_errors(zfcal, tmp_path):
    """In centimetres here; where it lies is right, and the file says how well."""
    (tmp_path / "marks.csv").write_text(MARKS)
    done = zfcal("camera", "points", "marks.csv", "--size", "500x500", "-o", "c.toml", "--json")
    assert done.code == 0
    (result,) = json.loads(done.out)["results"]
    assert result["n_points"] == 9
    assert result["left_out_mm"]["max"] < 0.1
    camera = read_camera(tmp_path / "c.toml")
    np.testing.assert_allclose(camera.to_metres(np.array([150.0, 350.0])), 0.25, atol=1e-4)
    assert "error_mm" in zfcal("inspect", "c.toml").out


def test_points_with_a_known_lens_give_the_pose(zfcal, tmp_path):
    """The lens of the first file, the size of its images."""
    (tmp_path / "marks.csv").write_text(MARKS)
    words = ["camera", "points", "marks.csv", "--model", "pinhole", "--size", "500x500"]
    assert zfcal(*words, "-o", "lens.toml").code == 0
    assert zfcal("camera", "points", "marks.csv", "--lens", "lens.toml", "-o", "c.toml").code == 0
    camera = read_camera(tmp_path / "c.toml")
    assert camera.size_px == (500, 500)
    np.testing.assert_allclose(camera.to_metres(np.array([250.0, 250.0])), 0.5, atol=1e-4)
    marks = tmp_path / "marks.csv"
    marks.write_text(MARKS.replace("50,450,0,0", "51,450,0,0"))
    again = zfcal(
        "camera", "points", "marks.csv", "--lens", "lens.toml", "-o", "c.toml", "--dry-run"
    )
    assert "input marks.csv changed" in again.err


def test_a_camera_of_the_older_rig_is_read(zfcal, tmp_path):
    """A file with points alone."""
    rows = [line.split(",") for line in MARKS.splitlines()[1:]]
    points = "\n".join(
        f"<point_{i}><xWorld>{X}</xWorld><yWorld>{Y}</yWorld>"
        f"<xImage>{x}</xImage><yImage>{y}</yImage></point_{i}>"
        for i, (x, y, X, Y) in enumerate(rows)
    )
    (tmp_path / "old.xml").write_text(OLD.format(points=points))
    assert zfcal("camera", "import", "old.xml", "-o", "c.toml").code == 0
    camera = read_camera(tmp_path / "c.toml")
    np.testing.assert_allclose(camera.to_metres(np.array([450.0, 50.0])), 1.0, atol=1e-3)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (MARKS.replace("50,450,0,0", "50,850,0,0"), "Point 1 lies outside the image: 50, 850 px"),
        ("\n".join(MARKS.splitlines()[:4]), "needs 4 points or more, got 3"),
        (MARKS.replace("x_cm,y_cm", "x_m,y_m"), "span 100 m, expected 0.01 to 20 m"),
        (MARKS.replace("250,250,50", "250,?,50"), "line 6, column y_px"),
    ],
)
def test_points_that_cannot_be_are_one_line(zfcal, tmp_path, text, says):
    """With the file's name, a hint, and no camera."""
    (tmp_path / "marks.csv").write_text(text)
    done = zfcal("camera", "points", "marks.csv", "--size", "500x500", "-o", "c.toml")
    assert done.code == 1
    assert "marks.csv" in done.err
    assert says in done.err
    assert "hint:" in done.err
    assert not (tmp_path / "c.toml").exists()


def test_a_figure_shows_the_errors(zfcal, tmp_path):
    """A PNG, whose path is told; with the picture of the tank behind it."""
    (tmp_path / "marks.csv").write_text(MARKS)
    cv2.imwrite(str(tmp_path / "tank.png"), np.full((500, 500, 3), 90, np.uint8))
    words = ["--image", "tank.png", "-o", "c.toml", "--figure", "errors.png"]
    done = zfcal("camera", "points", "marks.csv", *words)
    assert done.lines == ["c.toml", "errors.png"]
    picture = cv2.imread(str(tmp_path / "errors.png"))
    assert picture.shape[1] > 900
    assert picture.std() > 5


def test_a_sheet_is_drawn_to_scale(zfcal, tmp_path):
    """Ten pixels a millimetre, a margin of one square."""
    words = ["--board", "4x3", "--square-mm", "20", "-o", "board.png"]
    assert zfcal("camera", "sheet", *words).lines == ["board.png"]
    image = cv2.imread(str(tmp_path / "board.png"), cv2.IMREAD_GRAYSCALE)
    assert image.shape == (200 * 6, 200 * 7)
    assert image[300, 300] == 0
    assert image[300, 500] == 255


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["a.png", "--board", "9", "--square-mm", "25"], 2, "expected COLUMNSxROWS"),
        (["a.png", "--board", "9x6", "--square-mm", "25"], 1, "was found in 0 of 1 images"),
        (["a.png", "b.png", "--board", "9x6", "--square-mm", "25"], 1, "The images differ in size"),
        (
            ["a.png", "--board", "9x6", "--square-mm", "2500"],
            1,
            "too small or too large for a board",
        ),
        (["a.png", "--board", "2x6", "--square-mm", "25"], 1, "3 by 3 inner corners or more"),
        (["a.png", "--board", "9x6", "--square-mm", "25", "--lies", "a.png"], 2, "go together"),
        (["empty", "--board", "9x6", "--square-mm", "25"], 1, "empty: holds no images"),
    ],
)
def test_board_images_that_will_not_do_are_one_line(zfcal, tmp_path, words, code, says):
    """With what to do, and no lens."""
    cv2.imwrite(str(tmp_path / "a.png"), np.full((480, 640), 90, np.uint8))
    cv2.imwrite(str(tmp_path / "b.png"), np.full((500, 500), 90, np.uint8))
    (tmp_path / "empty").mkdir()
    done = zfcal("camera", "board", *words, "-o", "lens.toml")
    assert done.code == code
    assert says in done.err
    assert not (tmp_path / "lens.toml").exists()


def test_a_lens_alone_is_no_camera_of_a_trial(zfcal, trial, tmp_path):
    """It does not say where it stands."""
    cv2.imwrite(str(tmp_path / "a.png"), np.full((480, 640), 90, np.uint8))
    words = ["--board", "9x6", "--square-mm", "25", "--trial", "trial", "--camera", "below"]
    done = zfcal("camera", "board", "a.png", *words)
    assert done.code == 1
    assert "not where the camera stands" in done.err


MIRRORED = tuple(reversed(CORNERS))
"""Upper left first, as images are read."""


def mirrored_marks():
    """Return marks whose metres count y down, as pixels do."""
    rows = [line.split(",") for line in MARKS.splitlines()]
    return "\n".join(
        [",".join(rows[0]), *(f"{x},{y},{X},{100 - int(Y)}" for x, y, X, Y in rows[1:])]
    )


def test_corners_in_image_order_are_an_error_that_shows_the_right_one(zfcal, tmp_path):
    """The numbers of its hint make the camera."""
    words = ["--size", "500x500", "--bounds-m", "0,0,1,1", "-o", "c.toml"]
    done = zfcal("camera", "corners", *MIRRORED, *words)
    assert done.code == 1
    assert "the arena is seen from below (mirrored), expected from above" in done.err
    assert not (tmp_path / "c.toml").exists()
    ready = done.err.partition("upright: '")[2].partition("'")[0].split()
    assert tuple(ready) == CORNERS
    assert zfcal("camera", "corners", *ready, *words).code == 0
    there = read_camera(tmp_path / "c.toml").to_metres(np.array([50.0, 450.0]))
    np.testing.assert_allclose(there, 0.0, atol=1e-6)


def test_a_camera_below_mirrors_the_tank(zfcal, trial):
    """By its name, or by what a person says; from above it would be wrong."""
    words = ["--size", "500x500", "--trial", "trial", "--camera", "below"]
    assert zfcal("camera", "corners", *MIRRORED, *words).code == 0
    done = zfcal("camera", "corners", *CORNERS, *words)
    assert done.code == 1
    assert "seen from above (not mirrored), expected from below" in done.err
    assert zfcal("camera", "corners", *CORNERS, *words, "--seen-from", "above").code == 0
    words = ["--size", "500x500", "--bounds-m", "0,0,1,1", "-o", "c.toml"]
    assert zfcal("camera", "corners", *MIRRORED, *words, "--seen-from", "below").code == 0


@pytest.mark.parametrize("command", ["points", "import"])
def test_points_that_count_y_down_are_an_error(zfcal, tmp_path, command):
    """Unless the camera looks up through the floor."""
    (tmp_path / "marks.csv").write_text(mirrored_marks())
    rows = [line.split(",") for line in mirrored_marks().splitlines()[1:]]
    points = "\n".join(
        f"<point_{i}><xWorld>{X}</xWorld><yWorld>{Y}</yWorld>"
        f"<xImage>{x}</xImage><yImage>{y}</yImage></point_{i}>"
        for i, (x, y, X, Y) in enumerate(rows)
    )
    (tmp_path / "old.xml").write_text(OLD.format(points=points))
    words = {"points": ["marks.csv", "--size", "500x500"], "import": ["old.xml"]}[command]
    done = zfcal("camera", command, *words, "-o", "c.toml")
    assert done.code == 1
    assert "c.toml, by these points: the arena is seen from below (mirrored)" in done.err
    assert "hint: Metres count y up" in done.err
    assert not (tmp_path / "c.toml").exists()
    assert zfcal("camera", command, *words, "-o", "c.toml", "--seen-from", "below").code == 0


def test_a_lens_alone_looks_from_nowhere(zfcal):
    """An option that cannot take effect is an error."""
    words = ["--board", "9x6", "--square-mm", "25", "-o", "lens.toml", "--seen-from", "below"]
    done = zfcal("camera", "board", "cli", *words)
    assert done.code == 2
