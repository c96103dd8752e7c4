"""A virtual experiment in real time: every part a process of its own."""

import threading
import time

import cv2
import numpy as np
import pytest

from zfcal.artifacts.pose_files import read_poses
from zfcal.artifacts.tables import read_tracks
from zfcal.errors import InputError
from zfcal.tracks import ROBOT
from zfcal.virtual.camera_server import CameraServer
from zfcal.virtual.live_loop import live_loop
from zfcal.virtual.trial import LoopOptions

pytestmark = pytest.mark.slow

SHORT = LoopOptions(duration_s=6.0, video=False, robot="fixed", seed=5)


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """Return the folder of some seconds of a loop without images."""
    folder = tmp_path_factory.mktemp("live")
    live_loop(folder, SHORT, 10.0, lambda _: None)
    return folder


def test_the_driver_moves_the_robot_through_its_port(live):
    """What it said is logged, and the robot is not where it began."""
    assert (live / "trial" / "drive" / "000000.mcap").stat().st_size > 1000
    truth = read_tracks(live / "tank" / "tracks" / "000000.parquet")
    x, y = (getattr(truth, name)[truth.kind == ROBOT] for name in ("x_m", "y_m"))
    assert np.hypot(np.diff(x), np.diff(y)).sum() > 0.02


def test_all_frames_are_written(live):
    """Poses of each of them, by the clock of the tank."""
    frames = list(read_poses(live / "trial" / "poses" / "000000.mcap"))
    assert [poses.frame for poses in frames] == list(range(90))


def test_what_happened_in_real_time_does_not_happen_again(live):
    """A second run is refused, and touches nothing; --force begins anew."""
    before = (live / "trial" / "poses" / "000000.mcap").read_bytes()
    with pytest.raises(InputError, match="has been recorded"):
        live_loop(live, SHORT, 10.0, lambda _: None)
    assert (live / "trial" / "poses" / "000000.mcap").read_bytes() == before


def jpeg(level):
    """Return an even grey image as a file."""
    return cv2.imencode(".jpg", np.full((48, 64), level, np.uint8))[1].tobytes()


def test_a_virtual_camera_is_opened_like_any_other():
    """OpenCV reads the images in their order, at most the newest being skipped to."""
    with CameraServer() as camera:
        stop = threading.Event()

        def show():
            for level in range(0, 250, 2):
                camera.show(jpeg(level))
                if stop.wait(0.04):
                    return

        thread = threading.Thread(target=show)
        thread.start()
        capture = cv2.VideoCapture(camera.url)
        assert camera.wait_for_visitor(0.0)
        levels = [int(capture.read()[1].mean()) for _ in range(5)]
        capture.release()
        stop.set()
        thread.join()
    assert levels == sorted(levels)
    assert levels[-1] > levels[0]


def test_nobody_looks_at_a_camera_that_nobody_opened():
    """Waiting for a visitor ends when its time is over."""
    with CameraServer() as camera:
        began_s = time.monotonic()
        assert not camera.wait_for_visitor(0.1)
        assert time.monotonic() - began_s < 5.0
