"""What is exported is opened by the very programs that it is for, which see the same positions.

They are in an environment of their own: ``make test-programs`` builds it, from
``requirements-programs.lock``. Without it these tests are skipped.
"""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.tables import read_tracks
from zfcal.stages.events import say_nothing
from zfcal.stages.export.export import export
from zfcal.stages.export.options import ExportOptions

FPS = 5.0
HERE = Path(__file__).resolve()
OPENER = HERE.parent / "opened.py"

CASES = {
    "movement": ("movement", "tracks.nc"),
    "movement-deeplabcut": ("deeplabcut", "tracksDLC_zfcal.h5"),
    "movement-deeplabcut-csv": ("deeplabcut", "tracksDLC_zfcal.csv"),
    "movement-sleap": ("sleap", "tracks.analysis.h5"),
    "pandas": ("deeplabcut", "tracksDLC_zfcal.h5"),
    "sleap-io": ("sleap", "tracks.analysis.h5"),
    "trajectorytools": ("idtracker", "trajectories.npy"),
}
"""By program: the format, and the file that it opens."""

ORIGIN_PX = (0.0, 1000.0)
"""Where (0, 0) m lies in an image of a square metre at 1 mm a pixel."""


def expected(root):
    """Return the positions of a trial in metres, shape (frame, agent, 2)."""
    xy_m = np.full((350, 4, 2), np.nan)
    for segment in sorted((root / "tracks").glob("*.parquet")):
        tracks = read_tracks(segment)
        xy_m[tracks.frame, tracks.agent] = np.stack([tracks.x_m, tracks.y_m], axis=-1)
    return xy_m


@pytest.mark.parametrize("case", CASES)
def test_a_program_sees_the_positions_that_were_exported(case, python, trial, tmp_path):
    """Of the same animals in the same frames; nothing where nobody was seen."""
    name, file = CASES[case]
    export(trial, ExportOptions(formats=(name,)), say_nothing)
    path, out = trial / "export" / name / file, tmp_path / "seen.npz"
    program = case.removesuffix("-csv")
    words = [str(python), str(OPENER), program, str(path), str(FPS), str(out)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    seen = np.load(out)
    assert seen["names"].tolist() == ["fish_0", "fish_1", "fish_2", "robot_3"]
    xy = seen["xy"].astype(np.float64)
    if name != "movement":
        xy = np.array([1, -1]) * (xy - ORIGIN_PX) / 1000
    wanted = expected(trial)
    assert np.isnan(wanted[60, 2]).all()
    if program == "trajectorytools":
        # It drops the first and the last frame.
        xy, wanted = xy[1:-1], wanted[1:-1]
    # movement has the positions of SLEAP in single precision: a ten thousandth of a pixel.
    limit_m = 1e-7 if program == "movement-sleap" else 1e-10
    np.testing.assert_allclose(xy, wanted, rtol=0, atol=limit_m)
