"""Small files of every kind, and what they are made from."""

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import SCHEMA as MODEL
from zfcal.artifacts.models import write_model
from zfcal.artifacts.settings import write_trial
from zfcal.artifacts.tables import SCORES, TRACKS, make_table, write_table, write_tracks
from zfcal.parameters import natural
from zfcal.tracks import Tracks
from zfcal.trial import Trial


def _make_tracks(n_frames=45, n_agents=3, start_s=0.0, fps=15.0):
    """Return agents that stand in a room of two-rooms; the last one is the robot."""
    frame = np.repeat(np.arange(n_frames) + round(start_s * fps), n_agents).astype(np.int64)
    agent = np.tile(np.arange(n_agents), n_frames).astype(np.int32)
    heading_rad = np.linspace(-3, 3, len(frame)).astype(np.float32)
    heading_rad[::7] = np.nan
    return Tracks(
        time_s=frame / fps,
        frame=frame,
        agent=agent,
        kind=(agent == n_agents - 1).astype(np.int8),
        x_m=0.1 + 0.05 * agent + 1e-4 * frame,
        y_m=np.full(len(frame), 0.8),
        heading_rad=heading_rad,
        confidence=np.linspace(0, 1, len(frame)).astype(np.float32),
    )


def _assert_same_tracks(found, expected):
    """Fail unless every column agrees in type and value, NaN with NaN."""
    for name in Tracks.__slots__:
        here, there = getattr(found, name), getattr(expected, name)
        assert here.dtype == there.dtype, name
        np.testing.assert_array_equal(here, there, err_msg=name)


@pytest.fixture(scope="session")
def make_tracks():
    """Return what makes agents that stand in a room of two-rooms; the last one is the robot."""
    return _make_tracks


@pytest.fixture(scope="session")
def assert_same_tracks():
    """Return what fails unless two tracks agree in every type and value."""
    return _assert_same_tracks


@pytest.fixture
def scores():
    """Return a table of two rows of scores, one of them a mean over zones."""
    return _make_scores()


@pytest.fixture(scope="session")
def write_mcap():
    """Return what writes an MCAP file with a chunk per message, as a live one has."""
    return _write_mcap


@pytest.fixture
def tracks():
    """Return 3 s of two fish and a robot."""
    return _make_tracks()


@pytest.fixture
def lineage():
    """Return the lineage of an import."""
    return Lineage(
        schema=TRACKS,
        command="import",
        options={"fps": 15.0, "format": "csv", "flip_y": False},
        seed=None,
        inputs={"../raw/tracks.csv": "0" * 64},
    )


@pytest.fixture
def tracks_file(tmp_path, tracks, lineage):
    """Return the path of a whole tracks file."""
    path = tmp_path / "tracks" / "000000.parquet"
    write_tracks(path, tracks, lineage)
    return path


@pytest.fixture
def trial(tmp_path):
    """Return a sound trial with settings, a model, tracks and scores."""
    trial = Trial(
        root=tmp_path / "trial",
        arena="two-rooms",
        n_fish=2,
        n_robots=1,
        fps=15.0,
        dt_s=0.2,
        seed=7,
        source="made for a test",
    )
    write_trial(trial)
    write_tracks(trial.path("tracks", 0, ".parquet"), _make_tracks(), _imported())
    arena = load_arena(trial.arena, trial.root)
    model = natural(tuple((z.name, z.follows_walls) for z in arena.zones), dt_s=trial.dt_s)
    write_model(trial.root / trial.model, model, Lineage(schema=MODEL, command="init"))
    write_table(
        trial.path("scores", 120, ".parquet"),
        _make_scores(),
        Lineage(schema=SCORES, command="analyse", seed=7),
    )
    return trial


def _imported():
    """Return the lineage of tracks without inputs."""
    return Lineage(schema=TRACKS, command="import")


def _make_scores():
    """Return two rows of scores, one of them a mean over zones."""
    return make_table(
        SCORES,
        {
            "window_end_s": [120, 120],
            "compared": ["social-vs-control"] * 2,
            "feature": ["D", "S"],
            "zone": ["corridor", None],
            "value": [0.5, np.nan],
            "low": [None, 0.4],
            "high": [None, 0.6],
            "ceiling": [None, 0.9],
            "n_windows": [None, 200],
            "n_features": [None, 4],
        },
    )


def _write_mcap(path, *, messages=20, metadata=None, finish=True):
    """Write an MCAP file with a chunk per message, as a live one has; return its size."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        # A chunk size of one byte closes a chunk with each message.
        writer = Writer(file, chunk_size=1, compression=CompressionType.ZSTD)
        writer.start(profile="", library="zfcal test")
        for name, record in (metadata or {}).items():
            writer.add_metadata(name, record)
        schema = writer.register_schema("zfcal.poses/1", "jsonschema", b"{}")
        channel = writer.register_channel("/agents", "json", schema)
        for number in range(messages):
            time_ns = number * 10**9 // 15
            writer.add_message(channel, time_ns, b'{"agents": []}', time_ns)
        if finish:
            writer.finish()
    return path.stat().st_size
