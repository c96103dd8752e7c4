"""A robot filmed among fish by two cameras, one of which is calibrated a little wrong."""

from __future__ import annotations

import math

import cv2
import numpy as np

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.cameras import SCHEMA
from zfcal.artifacts.frame_files import FrameWriter
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.settings import name_camera
from zfcal.cameras.registering import move
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.stages.camera.cameras import write_camera
from zfcal.tracks import FISH, ROBOT, Tracks
from zfcal.virtual.images.look import USUAL, look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.render_below import BelowPainter
from zfcal.virtual.images.swimming import swimming

ORIGIN = Lineage(schema=SCHEMA, command="camera points")


def drive(rng, bounds, *, n, fps, speed_m_s):
    """Return positions and headings of somebody who wanders about in a rectangle."""
    x0, y0, x1, y1 = bounds
    middle, reach = np.array([(x0 + x1) / 2, (y0 + y1) / 2]), 0.32 * (x1 - x0)
    place = middle + rng.uniform(-0.5, 0.5, 2) * reach
    heading = rng.uniform(-math.pi, math.pi)
    rows = np.empty((n, 3))
    for row in rows:
        to_middle = middle - place
        if np.hypot(*to_middle) > reach:
            aim = math.atan2(to_middle[1], to_middle[0])
            heading += 0.25 * math.sin(aim - heading)
        heading += rng.normal(0, 0.12)
        place = place + speed_m_s / fps * np.array([math.cos(heading), math.sin(heading)])
        row[:] = (*place, heading)
    return rows


def wander(bounds, *, seconds, fps, n_fish, seed):
    """Return the tracks of fish and one robot."""
    rng = np.random.default_rng(seed)
    n, n_agents = round(seconds * fps), n_fish + 1
    paths = [
        drive(rng, bounds, n=n, fps=fps, speed_m_s=0.15 if agent == n_fish else 0.1)
        for agent in range(n_agents)
    ]
    x, y, heading = np.stack(paths, axis=1).reshape(-1, 3).T
    frame = np.repeat(np.arange(n), n_agents)
    agent = np.tile(np.arange(n_agents), n).astype(np.int32)
    return Tracks(
        time_s=frame / fps,
        frame=frame.astype(np.int64),
        agent=agent,
        kind=np.where(agent == n_fish, ROBOT, FISH).astype(np.int8),
        x_m=x,
        y_m=y,
        heading_rad=((heading + math.pi) % (2 * math.pi) - math.pi).astype(np.float32),
        confidence=np.ones(n * n_agents, np.float32),
    )


def film(
    root,
    *,
    seconds=20.0,
    fps=15.0,
    n_fish=3,
    seed=1,
    late_s=0.0,
    angle_rad=0.03,
    shift_m=(0.03, -0.02),
):
    """Write images and cameras into a trial; return both true cameras.

    ``late_s``: what the times below lack. The camera file below is off by a turn and a shift.
    """
    arena = load_arena("open-square", root)
    overhead, below = overhead_camera(arena), below_camera(arena)
    tracks = wander(arena.outline.bounds, seconds=seconds, fps=fps, n_fish=n_fish, seed=seed)
    scene = swimming(tracks, look_of(USUAL), fps=fps, seed=seed)
    painters = {
        "overhead": (OverheadPainter(arena, overhead, look_of(USUAL), seed=seed), 0.0),
        "below": (BelowPainter(arena, below, look_of(USUAL), seed=seed), late_s),
    }
    for name, (painter, lacks_s) in painters.items():
        with FrameWriter(root / "frames" / name / "000000.mcap", name) as writer:
            for row in range(len(scene.time_s)):
                moment = scene.at(row)
                if moment.time_s - lacks_s >= 0:
                    data = cv2.imencode(".jpg", painter.paint(moment))[1].tobytes()
                    writer.add(moment.time_s - lacks_s, data)
    off = move(below, angle_rad, np.array(shift_m))
    for name, camera in (("overhead", overhead), ("below", off)):
        path = root / "cameras" / f"{name}.toml"
        write_camera(path, camera, ORIGIN)
        name_camera(root, name, path)
    return overhead, below
