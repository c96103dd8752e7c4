"""Trials with poses that grow, for tests of the driver.

`LivePoses.changes` is what is wrong with the robot's pose, `ahead_s` by how much the frames' stamps
are, `behind_s` how late they are written, and `fresh_s` says when a pose last was right.
"""

import dataclasses
import math
import threading
import time

import numpy as np

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model, write_model
from zfcal.artifacts.pose_files import PoseWriter
from zfcal.artifacts.pose_messages import POSES
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import from_genes, to_genes
from zfcal.stages.trial_context import open_trial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses
from zfcal_cli.main import run

FPS = 15


def make_trial(root, *words):
    """Make a trial of 4 fish and a robot in two rooms at 15 Hz, with its starting model."""
    given = words or ("--arena", "two-rooms", "--fish", "4", "--robot", "--fps", str(FPS))
    assert run(["init", str(root), *given, "-q"]) == 0
    return root


def frames_of(root, seconds, *, seed=1, first=0):
    """Return frames in which 4 fish and a robot swim by the starting model."""
    opened = open_trial(root)
    model = read_model(root / "models" / "000000.toml")
    n = math.ceil(seconds / opened.trial.dt_s) + 2
    xy, heading = simulate_tracks(model, opened.arena, n_agents=5, n_steps=n, seed=seed)
    stride = round(opened.trial.dt_s * FPS)
    frames = []
    for number in range(first, first + round(seconds * FPS)):
        k, share = divmod(number - first, stride)
        at = xy[k] + (xy[k + 1] - xy[k]) * share / stride
        agents = tuple(
            AgentPose(
                agent=i,
                kind=ROBOT if i == 4 else FISH,
                x_m=float(at[i, 0]),
                y_m=float(at[i, 1]),
                heading_rad=float(heading[k, i]),
                confidence=1.0,
            )
            for i in range(5)
        )
        frames.append(FramePoses(time_s=number / FPS, frame=number, agents=agents))
    return frames


def write_poses(root, frames):
    """Write frames into closed files, a minute each."""
    minutes = {}
    for poses in frames:
        minutes.setdefault(int((poses.time_s + 1e-6) // 60) * 60, []).append(poses)
    for start_s, part in minutes.items():
        with PoseWriter(root / "poses" / f"{start_s:06d}.mcap", LINEAGE) as writer:
            for poses in part:
                writer.add(poses)


LINEAGE = Lineage(schema=POSES, command="track")


class LivePoses:
    """Writes frames as a tracker does, each at its time; a thread of its own."""

    def __init__(self, root, frames):
        self._root, self._frames = root, frames
        self._frozen = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._write, daemon=True)
        self.without = set()
        self.changes = {}
        self.ahead_s = self.behind_s = 0.0
        self.fresh_s = 0.0

    def freeze(self):
        """Let no more frames come."""
        self._frozen.set()

    def thaw(self):
        """Go on with the frames of now."""
        self._frozen.clear()

    def _write(self):
        began_s, zero_s, writer, start_s = time.monotonic(), self._frames[0].time_s, None, None
        for poses in self._frames:
            due_s = began_s + poses.time_s - zero_s
            while (wait_s := due_s + self.behind_s - time.monotonic()) > 0:
                if self._ended.wait(min(wait_s, 0.05)):
                    return
            if self._frozen.is_set():
                continue
            minute = int((poses.time_s + 1e-6) // 60) * 60
            if minute != start_s:
                if writer is not None:
                    writer.close()
                start_s = minute
                writer = PoseWriter(self._root / "poses" / f"{minute:06d}.mcap", LINEAGE)
            agents = tuple(
                dataclasses.replace(a, **self.changes) if a.kind == ROBOT else a
                for a in poses.agents
                if a.agent not in self.without
            )
            is_fresh = not (self.changes or self.ahead_s) and 4 not in self.without
            time_s = poses.time_s + self.ahead_s
            writer.add(FramePoses(time_s=time_s, frame=poses.frame, agents=agents))
            if is_fresh:
                self.fresh_s = time.monotonic()

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()


def add_model(root, second, *, seed=5, **changes):
    """Write a model of a round: other parameters than the starting one's."""
    model = read_model(root / "models" / "000000.toml")
    genes = np.clip(to_genes(model) + np.random.default_rng(seed).normal(0, 0.1, 18), 0.05, 1)
    made = from_genes(genes, model)
    path = root / "models" / f"{second:06d}.toml"
    write_model(path, made, Lineage(schema="zfcal.model/1", command="calibrate"))
    return path
