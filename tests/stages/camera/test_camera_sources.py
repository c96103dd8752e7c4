"""The images of a live camera, minute by minute."""

import numpy as np

from zfcal.artifacts.frame_files import FRAMES, read_frames
from zfcal.artifacts.lineage import Lineage
from zfcal.cameras.stamps import Shot
from zfcal.stages.camera.sources import Recorder
from zfcal.stages.events import LeftOut


def test_a_minute_whose_place_is_taken_by_a_folder_is_left_out(tmp_path):
    """It is named once, its images come back all the same, and the next minute is kept."""
    heard = []
    lineage = Lineage(schema=FRAMES, command="track", options={}, inputs={})
    recorder = Recorder(tmp_path, "overhead", "png", lineage, heard.append)
    taken, free = (tmp_path / "frames" / "overhead" / f"{s:06d}.mcap" for s in (0, 60))
    taken.mkdir(parents=True)
    shots = [Shot(time_s=time_s, image=np.full((4, 5), 7, np.uint8)) for time_s in (58.0, 59.0, 60)]
    assert [np.unique(recorder.keep(shot).image) for shot in shots] == [7, 7, 7]
    recorder.close()
    (left,) = heard
    assert isinstance(left, LeftOut)
    assert left.path == taken
    assert left.damaged
    assert recorder.paths == [free]
    assert [time_s for time_s, _ in read_frames(free)] == [60]
    assert list(taken.iterdir()) == []
