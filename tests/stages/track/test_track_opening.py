"""What is done before a camera is opened."""

import subprocess
import sys

import cv2
import numpy as np
import pytest

from zfcal.stages.events import say_nothing
from zfcal.stages.init import NewTrial, create_trial

SCRIPT = """
import sys
from pathlib import Path
from zfcal.stages.track import following
from zfcal.stages.events import say_nothing
from zfcal.stages.camera.rig import CameraChoice, open_feed
from zfcal.stages.track.track import track
from zfcal.stages.track.plan import TrackOptions
from zfcal.tracking import _beliefs, _kernels, fitting

compiled = []

def opened(*words):
    some = _beliefs.learn, _kernels.shades, fitting._fit
    compiled.extend(len(each.signatures) for each in some)
    return open_feed(*words)

following.open_feed = opened
corners = ((-0.5, 99.5), (99.5, 99.5), (99.5, -0.5), (-0.5, -0.5))
choice = CameraChoice(source=sys.argv[2], corners_px=corners)
track(Path(sys.argv[1]), TrackOptions(overhead=choice), say_nothing)
print(compiled)
"""


@pytest.mark.slow
def test_all_is_compiled_before_a_source_is_opened(tmp_path):
    """A camera's images of the time that compiling takes would be lost."""
    film = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"FFV1"), 15.0, (100, 100))
    for _ in range(4):
        writer.write(np.full((100, 100, 3), 180, np.uint8))
    writer.release()
    create_trial(
        tmp_path / "trial", NewTrial(n_fish=1, fps=15.0, side_m=0.4, dt_s=0.2), say_nothing
    )
    words = [sys.executable, "-c", SCRIPT, str(tmp_path / "trial"), str(film)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines() == ["[1, 1, 1]"], done.stderr
