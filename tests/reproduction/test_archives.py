"""Archives of every format that is imported become trials beside them."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_tracks
from zfcal.reproduction.archives import Archives, bring_in
from zfcal.stages.events import Note
from zfcal.stages.init import NewTrial
from zfcal.stages.trial_context import Task
from zfcal.tracks import ROBOT

PRINTED = Path(__file__).parents[1] / "readers" / "golden" / "fishmodel-printed.txt"


@pytest.fixture
def tank(tmp_path):
    """Return a RoboFish file of a world of 1 x 1 m: a fish and a robot, 20 samples."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "tank.hdf5"
    with h5py.File(path, "w") as file:
        file.attrs["format_version"] = [1, 0]
        file.attrs["world_size_cm"] = [100.0, 100.0]
        file.create_group("samplings/5 hz").attrs["frequency_hz"] = 5.0
        for k, category in enumerate(("organism", "robot")):
            entity = file.create_group(f"entities/{category}_{k}")
            entity.attrs["category"] = category
            entity["positions"] = np.stack([np.arange(20.0), np.full(20, 10.0 * k)], axis=1)
    return path


def brought(path, tmp_path, new, **options):
    """Return the tracks of the trial that an archive becomes, and what was told."""
    heard = []
    archives = Archives(paths=(path,), new=new, options=options)
    (root,) = bring_in(archives, tmp_path / "trials", heard.append, task=Task())
    (start,) = segment_starts(root)
    told = " ".join(event.text for event in heard if isinstance(event, Note))
    return read_tracks(segment_path(root, start)), told


def test_an_archive_of_robofish_becomes_a_trial(tank, tmp_path):
    """Guessed by its content, with the robot known, and the axes said."""
    new = NewTrial(side_m=1.0, n_fish=1, n_robots=1, fps=5.0)

    tracks, told = brought(tank, tmp_path, new, origin=(-50.0, -50.0))

    assert "read as --format robofish" in told
    assert "which way y counts" in told
    assert tracks.kind[:2].tolist() == [0, ROBOT]
    assert tracks.x_m[-1] == pytest.approx(0.69)


def test_an_archive_of_fishmodel_becomes_a_trial(tmp_path):
    """With the rate that is said, since the file has none."""
    new = NewTrial(side_m=1.0, n_fish=3, n_robots=0, fps=3.0)

    tracks, told = brought(PRINTED, tmp_path, new, flip_y=True, origin=(0.0, 1.0))

    assert "read as --format fishmodel" in told
    assert "3 steps a second are taken" in told
    assert tracks.time_s[-1] == pytest.approx(13.0)
