"""What the README and the samples promise."""

import re
import shlex
import shutil

import cv2
import numpy as np
import pytest

from zfcal.artifacts.tables import read_tracks
from zfcal.stages.camera.cameras import read_camera
from zfcal.tracks import ROBOT


@pytest.fixture(scope="module")
def readme(repository):
    """Return the README."""
    return (repository / "README.md").read_text(encoding="utf-8")


def commands_of(text, heading):
    """Return the first block of commands under a heading."""
    section = text.partition(f"\n## {heading}")[2].partition("\n## ")[0]
    block = re.search(r"\n\n((?:    \S.*\n)+)", section).group(1)
    return [line.strip() for line in block.splitlines()]


@pytest.mark.slow
def test_the_five_commands_run_on_the_samples(zfcal, readme, repository, tmp_path):
    """As they stand, but for the budget, which is shortened, and each in turn ends with 0."""
    lines = commands_of(readme, "Five commands on the sample")
    assert [line.split()[1] for line in lines] == [
        "init",
        "import",
        "analyse",
        "calibrate",
        "report",
    ]
    shutil.copytree(repository / "data-samples", tmp_path / "data-samples")
    for line in lines:
        done = zfcal(*line.replace("--budget 20s", "--budget 1s").split()[1:], "-q")
        assert done.code == 0, (line, done.err)
    assert (tmp_path / "trial" / "report" / "index.html").exists()


@pytest.fixture
def filmed(zfcal, tmp_path):
    """Return a folder with what the README's cameras are asked about, and the truth of it."""
    words = ["tank", "--arena", "two-rooms", "--fish", 4, "--robot", "--fps", 15]
    assert zfcal("init", *words, "-q").code == 0
    words = ["--model", "tank/models/000000.toml", "--duration", "15s", "--video-file", "day3.mp4"]
    assert zfcal("simulate", "tank", *words, "-q").code == 0
    x, y = np.meshgrid(np.linspace(0.06, 1.04, 5), np.linspace(0.06, 1.04, 5))
    places = np.column_stack([x.ravel(), y.ravel()])
    px = read_camera(tmp_path / "tank" / "cameras" / "below.toml").to_pixels(places)
    rows = [f"{u:.1f},{v:.1f},{x:.3f},{y:.3f}" for (u, v), (x, y) in zip(px, places, strict=True)]
    (tmp_path / "below-marks.csv").write_text("\n".join(["x_px,y_px,x_m,y_m", *rows]))
    return tmp_path


@pytest.mark.slow
def test_the_camera_commands_run_on_a_film_of_both_cameras(zfcal, readme, filmed):
    """As they stand; the robot is told, and everybody is where the truth says, not mirrored."""
    lines = commands_of(readme, "Camera images")
    assert [line.split()[1] for line in lines] == ["init", "camera", "camera", "track"]
    for line in lines:
        done = zfcal(*shlex.split(line)[1:], "-q")
        assert done.code == 0, (line, done.err)
    assert cv2.imread(str(filmed / "worst.png")).shape[0] > 100
    truth, found = (
        read_tracks(filmed / name / "tracks" / "000000.parquet") for name in ("tank", "filmed")
    )
    away_m = [
        np.hypot(*(np.array([truth.x_m[same], truth.y_m[same]]) - [[x], [y]])).min()
        for x, y, same in zip(
            found.x_m, found.y_m, found.frame[:, None] == truth.frame[None], strict=True
        )
    ]
    assert np.quantile(away_m, 0.9) < 0.008
    assert np.mean(found.kind == ROBOT) == pytest.approx(0.2, abs=0.03)


def test_the_corners_in_the_documents_are_in_order(zfcal, repository):
    """Every example makes a camera, of the one overhead and of the one below."""
    assert zfcal("init", "trial", "--arena", "two-rooms", "--fish", 4, "--robot", "-q").code == 0
    text = (repository / "docs" / "commands.md").read_text(encoding="utf-8")
    lines = re.findall(r"^    zfcal (camera corners .*--trial trial .*)$", text, re.MULTILINE)
    assert len(lines) == 2
    for line in lines:
        assert zfcal(*line.split()).code == 0, line


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "ring"])
def test_the_samples_are_sound_trials(zfcal, repository, tmp_path, name):
    """Whole, valid, and they can be analysed."""
    shutil.copytree(repository / "data-samples" / name, tmp_path / name)
    assert zfcal("check", name).code == 0
    done = zfcal("analyse", name)
    assert done.code == 0
    assert len(done.lines) >= 8


def test_links_lead_somewhere(readme, repository):
    """Every file that the README names in a link or as a picture is there."""
    targets = re.findall(r"\]\(([^)#:]+)\)", readme) + re.findall(r'src="([^"]+)"', readme)
    for target in targets:
        assert (repository / target).exists(), target


def test_files_of_a_trial_that_the_documents_name_have_the_right_names(repository):
    """Six digits, so that they sort as numbers."""
    for name in ("README.md", "docs/commands.md"):
        text = (repository / name).read_text(encoding="utf-8")
        for number in re.findall(r"(?:tracks|stats|scores|models)/(\d+)", text):
            assert len(number) == 6, (name, number)
