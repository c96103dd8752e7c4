"""Trials that a page shows: with rounds, a robot that is driven, poses that grow."""

import math
import shutil

import pytest

from zfcal.artifacts.drive_files import DriveWriter
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model, write_model
from zfcal.artifacts.pose_files import PoseWriter
from zfcal.artifacts.tables import SCORES, make_table, write_table
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

FPS = 5.0


def poses_at(time_s):
    """Return a frame of two fish and a robot on a circle, once round in a minute."""
    angles = [2 * math.pi * (time_s / 60 + n / 3) for n in range(3)]
    agents = tuple(
        AgentPose(
            agent=n,
            kind=ROBOT if n == 2 else FISH,
            x_m=0.5 + 0.3 * math.cos(angle),
            y_m=0.5 + 0.3 * math.sin(angle),
            heading_rad=angle + math.pi / 2,
            confidence=1.0,
        )
        for n, angle in enumerate(angles)
    )
    return FramePoses(time_s=time_s, frame=round(time_s * FPS), agents=agents)


def pose_writer(root, start_s):
    """Return what writes the poses of a minute."""
    lineage = Lineage(schema="zfcal.poses/1", command="track")
    return PoseWriter(root / "poses" / f"{start_s:06d}.mcap", lineage)


def drive_writer(root, start_s):
    """Return what writes the log of a driver, a minute a file."""
    lineage = Lineage(schema="zfcal.drive/1", command="drive")
    return DriveWriter(root / "drive" / f"{start_s:06d}.mcap", lineage)


def target_item(time_s, x_m, y_m):
    """Return a target as the driver logs it."""
    return {"time_s": time_s, "what": "target", "x_m": x_m, "y_m": y_m, "heading_rad": 0.0}


def fault_item(time_s, *, ended=False):
    """Return a fault as the driver logs it."""
    item = {"time_s": time_s, "what": "fault", "fault": "port-lost", "says": "The line is cut."}
    return item | ({"ended": True} if ended else {})


def put_round(root, end_s, score, *, ceiling=0.9):
    """Write the model of a round, with an interval, and its S."""
    model = read_model(root / "models" / "000000.toml")
    row = {"low": 1.0, "high": 9.0, "identified": False}
    result = {
        "intervals": {"by": "likelihood", "parameters": {"walls.kappa_0": row}},
        "published": {"rule": "nearest", "because": "It is the only one."},
    }
    lineage = Lineage(schema="zfcal.model/1", command="calibrate")
    write_model(root / "models" / f"{end_s:06d}.toml", model, lineage, result)
    columns = {
        "window_end_s": [end_s],
        "compared": ["model-vs-control"],
        "feature": ["S"],
        "zone": [None],
        "value": [score],
        "low": [ceiling - 0.1],
        "high": [ceiling + 0.05],
        "ceiling": [ceiling],
        "n_windows": [10],
        "n_features": [4],
    }
    (root / "scores").mkdir(exist_ok=True)
    path = root / "scores" / f"{end_s:06d}-model.parquet"
    write_table(path, make_table(SCORES, columns), Lineage(schema=SCORES, command="calibrate"))


@pytest.fixture
def trial(make_trial):
    """Return a trial of 180 s with a robot and two rounds."""
    root = make_trial(seconds=180, n_fish=3, n_robots=1)
    put_round(root, 120, 0.7)
    put_round(root, 180, 0.8)
    return root


@pytest.fixture(scope="module")
def kept(made_once, tmp_path_factory):
    """Return such a trial that the tests of a module leave as it is."""
    root = tmp_path_factory.mktemp("kept") / "trial"
    shutil.copytree(made_once(180, 3, 1, 1), root)
    put_round(root, 120, 0.7)
    put_round(root, 180, 0.8)
    return root


@pytest.fixture
def empty(make_trial):
    """Return a trial of which nothing is recorded yet."""
    root = make_trial(seconds=60, n_fish=2, n_robots=1)
    (root / "tracks" / "000000.parquet").unlink()
    return root


@pytest.fixture(scope="session")
def made():
    """Return what writes the files of a trial, by names."""
    return {
        "poses_at": poses_at,
        "poses": pose_writer,
        "drive": drive_writer,
        "target": target_item,
        "fault": fault_item,
        "round": put_round,
    }
