"""The environment of the programs, and a trial whose tracks they see."""

import os
from pathlib import Path

import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.tables import read_tracks, write_tracks

PYTHON = Path(__file__).resolve().parents[2] / ".venv-programs" / "bin" / "python"
BUILD = "the programs are not installed: make test-programs"


@pytest.fixture(scope="session")
def python():
    """Return the interpreter of the programs."""
    if not PYTHON.exists():
        if os.environ.get("ZFCAL_PROGRAMS"):
            pytest.fail(BUILD)
        pytest.skip(BUILD)
    return PYTHON


@pytest.fixture
def trial(make_trial):
    """Return 70 s of 3 fish and a robot; fish 1 is lost from 10 to 12 s, fish 2 until 20 s."""
    root = make_trial(seconds=70, n_robots=1)
    path = root / "tracks" / "000000.parquet"
    tracks = read_tracks(path)
    time_s, agent = tracks.time_s, tracks.agent
    lost = (agent == 1) & (time_s >= 10) & (time_s < 12) | (agent == 2) & (time_s < 20)
    write_tracks(path, tracks.take(~lost), read_lineage(path))
    return root
