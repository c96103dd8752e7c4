"""Both cameras in one frame, from images of a robot that drives among fish."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.settings import read_trial
from zfcal.errors import InputError
from zfcal.stages.camera.align import Recording, align_cameras
from zfcal.stages.camera.cameras import read_camera
from zfcal.stages.camera.making import CameraTask
from zfcal.stages.events import Made, Result, UpToDate
from zfcal.stages.init import NewTrial, create_trial

ANGLE, SHIFT = 0.03, (0.03, -0.02)


def filmed_robot():
    """Return the module that films a robot."""
    path = Path(__file__).parent / "filmed_robot.py"
    spec = importlib.util.spec_from_file_location("filmed_robot", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Return a trial of 12 s whose camera below is off by 36 mm, and its true camera."""
    root = tmp_path_factory.mktemp("filmed") / "trial"
    create_trial(root, NewTrial(n_fish=2, n_robots=1, fps=15, arena="open-square"), [].append)
    module = filmed_robot()
    _, below = module.film(root, seconds=12, n_fish=2, angle_rad=ANGLE, shift_m=SHIFT, late_s=0.1)
    return root, below


@pytest.fixture
def trial(filmed, tmp_path):
    """Return a copy of it."""
    shutil.copytree(filmed[0], tmp_path / "trial")
    return tmp_path / "trial"


def aligned(root, recording=Recording(), **task):  # noqa: B008 - it is frozen
    """Align, and return what was told."""
    told = []
    align_cameras(root, recording, told.append, task=CameraTask(**task))
    return told


@pytest.mark.slow
def test_the_camera_below_sees_the_robot_where_overhead_does(filmed, trial):
    """Two millimetres all over the tank, where it was 36 mm off; the clocks to 30 ms."""
    (result,) = [event.value for event in aligned(trial) if isinstance(event, Result)]
    camera = read_camera(trial / "cameras" / "below-aligned.toml")
    places = np.array([[x, y] for x in (0.2, 0.5, 0.8) for y in (0.2, 0.5, 0.8)])
    errors_m = camera.to_metres(filmed[1].to_pixels(places)) - places
    assert np.hypot(*errors_m.T).max() < 0.002
    assert result["left_out_mm"]["median"] < 1.5
    assert result["before_mm"]["median"] > 10
    # Where the lure's middle lies before its LEDs, a steady drive takes it for time.
    assert result["offset_s"] == pytest.approx(0.1, abs=0.03)
    assert any("clocks differ" in note for note in result["notes"])


@pytest.mark.slow
def test_the_trial_uses_it_and_the_calibration_stays(trial):
    """Made again it starts from the same calibration: nothing to do."""
    before = (trial / "cameras" / "below.toml").read_bytes()
    made = [event.path.name for event in aligned(trial) if isinstance(event, Made)]
    assert "below-aligned.toml" in made
    assert read_trial(trial).cameras["below"]["file"] == "cameras/below-aligned.toml"
    assert (trial / "cameras" / "below.toml").read_bytes() == before
    assert any(isinstance(event, UpToDate) for event in aligned(trial))


@pytest.mark.slow
def test_a_dry_run_looks_at_no_image(trial):
    """And writes nothing."""
    aligned(trial, dry_run=True)
    assert not (trial / "cameras" / "below-aligned.toml").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "found"), [("overhead", "below"), ("below", "above")])
def test_a_camera_that_looks_from_the_wrong_side_is_refused(trial, name, found):
    """A mirrored calibration cannot be turned into place."""
    config = trial / "trial.toml"
    other = {"overhead": "below", "below": "overhead"}[name]
    text = config.read_text()
    config.write_text(text.replace(f'"cameras/{name}.toml"', f'"cameras/{other}.toml"'))
    with pytest.raises(InputError, match=rf"as the camera {name}: .* seen from {found}"):
        aligned(trial)


def test_a_trial_without_a_camera_says_what_to_do(trial):
    """Both have to be calibrated first."""
    config = trial / "trial.toml"
    config.write_text(config.read_text().replace('file = "cameras/below.toml"', ""))
    with pytest.raises(InputError, match="names no file for the below camera") as caught:
        aligned(trial)
    assert "--camera below" in caught.value.hint


def test_a_trial_without_images_says_what_to_do(trial):
    """They are recorded while it is tracked."""
    shutil.rmtree(trial / "frames" / "below")
    with pytest.raises(InputError, match="holds no images") as caught:
        aligned(trial)
    assert "--record" in caught.value.hint


def test_the_images_of_the_other_camera_are_refused(trial):
    """Their size is not that of the calibration."""
    swapped = Recording(
        overhead=str(trial / "frames" / "below"), below=str(trial / "frames" / "overhead")
    )
    with pytest.raises(InputError, match="500 x 500 images, these are 640 x 480"):
        aligned(trial, swapped)
    assert not (trial / "cameras" / "below-aligned.toml").exists()


def test_a_live_camera_is_no_recording(trial):
    """What is looked at twice has to be a file."""
    with pytest.raises(InputError, match="is a live camera"):
        aligned(trial, Recording(overhead="0"))
