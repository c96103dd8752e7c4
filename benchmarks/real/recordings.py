"""The real recordings on which the main job is shown, and how each is imported.

None of them is part of zfcal: they lie in a folder of their own, and each names its
source there. Here stands what has to be said of each before zfcal takes it: scale,
axes, arena, ranges of the bins, and what was assumed where nobody has measured it.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.real.ring import (
    FPS,
    M_PER_PX,
    RingFit,
    RingRun,
    fit_ring,
    read_ring,
    ring_arena,
    write_csv,
)
from zfcal.artifacts.arenas import rectangle_document
from zfcal.errors import InputError

RINGS = {
    "fish_only_six": "ring, 6 fish (run six)",
    "fish_only_three": "ring, 6 fish (run three)",
    "Feedback_Initiative_model_1": "ring, 5 fish, Feedback-Initiative robot (run 1)",
    "Despotic_model_1": "ring, 5 fish, Despotic robot (run 1)",
    "Follower_model_1": "ring, 5 fish, Follower robot (run 1)",
    "Follower_model_5": "ring, 5 fish, Follower robot (run 5)",
}
"""Files of the ring and what they show."""

ROBOTS = {"Follower_model_5": 0}
"""Columns taken as the robot's although the file names another, see `_robot_said`."""

FIVE_FPS = 32.0
FIVE_MM_PER_PX = 0.35
ROOMS_TOLERANCE_M = 0.02

_ROOMS_CORNERS = 16
_CORRIDOR = (4, 5, 12, 13)
"""Corners of the corridor among those of the two rooms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A recording that is ready for import.

    Parameters
    ----------
    name
        Of its trial directory.
    title
        What people call it.
    source
        The file that is imported.
    arena
        GeoJSON document of its arena.
    init, import_
        Options of ``zfcal init`` and ``zfcal import``.
    halves_s
        From, middle and to, in whole seconds.
    said
        What was assumed or fitted, in sentences.
    facts
        Numbers about the source that bear on this.
    """

    name: str
    title: str
    source: Path
    arena: dict[str, Any]
    init: tuple[str, ...]
    import_: tuple[str, ...]
    halves_s: tuple[int, int, int]
    said: tuple[str, ...] = ()
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def train_s(self) -> tuple[int, int]:
        """The half that is learnt from."""
        return self.halves_s[0], self.halves_s[1]

    @property
    def held_out_s(self) -> tuple[int, int]:
        """The half that is judged on."""
        return self.halves_s[1], self.halves_s[2]

    @property
    def has_robot(self) -> bool:
        """Whether a robot swims with the fish."""
        return "--robot" in self.init


def ring_recording(data: Path, file: str, work: Path) -> Recording:
    """Convert a run in the ring to CSV and say how to import it.

    Parameters
    ----------
    data
        The folder of all recordings.
    file
        A key of `RINGS`.
    work
        Where the CSV goes.
    """
    run = read_ring(data / "zebrafish-robot-ring" / f"{file}.npz")
    named, run = run.robot, replace(run, robot=ROBOTS.get(file, run.robot))
    fit = fit_ring(run)
    name = "ring-" + file.lower().replace("_", "-").replace("-model", "")
    source = work / f"{name}.csv"
    write_csv(run, source)
    robot = () if run.robot is None else ("--robot",)
    x, y = (f"{value:.1f}" for value in fit.centre_px)
    return Recording(
        name=name,
        title=RINGS[file],
        source=source,
        arena=ring_arena(),
        init=("--fish", str(run.n_fish), *robot, "--fps", f"{FPS:g}"),
        import_=(
            "--format", "csv", "--mm-per-px", f"{1000 * M_PER_PX:.6f}",
            "--origin", f"{x},{y}", "--flip-y",
        ),
        halves_s=_halves(run.duration_s),
        said=(_fit_said(fit), *_robot_said(run, named)),
        facts={
            "robot_column": run.robot,
            "robot_column_in_file": named,
            "guessed_share": run.guessed_share.tolist(),
            "middle_share": run.middle_share(fit).tolist(),
        },
    )  # fmt: skip


def _fit_said(fit: RingFit) -> str:
    x, y = fit.centre_px
    return (
        f"Centre fitted at ({x:.1f}, {y:.1f}) px; bodies stay between {fit.inner_m:.3f} and "
        f"{fit.outer_m:.3f} m from it (edges of 72 sectors, median misfit "
        f"{1000 * fit.residual_m:.1f} mm)."
    )


def _robot_said(run: RingRun, named: int | None) -> tuple[str, ...]:
    """Say why another column than the one that the file names is the robot's."""
    if run.robot == named or run.robot is None or named is None:
        return ()
    share = run.guessed_share
    return (
        (
            f"The file names column {named} as the robot's; column {run.robot} is taken. Of column "
            f"{named} {share[named]:.0%} of the positions are guessed, the most of all, of column "
            f"{run.robot} {share[run.robot]:.1%}, as of the robots in the other runs."
        ),
    )


def five_recording(data: Path, _work: Path) -> Recording:
    """Say how to import five zebrafish with hand-made tracks.

    Neither scale nor tank are published: 0.35 mm per px makes the bodies 30 mm long,
    and the tank is taken to be the bounding rectangle of all positions.
    """
    source = data / "zebrafish5-tracks" / "gt_2020-02-17.csv.gz"
    table = pd.read_csv(source)
    seen = table[(table.x != -1) | (table.y != -1)]
    left, right = float(seen.x.min()), float(seen.x.max())
    top, bottom = float(seen.y.min()), float(seen.y.max())
    width_m, height_m = (px * FIVE_MM_PER_PX / 1000 + 1e-4 for px in (right - left, bottom - top))
    arena = rectangle_document(round(width_m, 4), round(height_m, 4))
    arena["bins"].update(D=[0.0, 0.45], V=[0.0, 0.30])
    return Recording(
        name="five-zebrafish",
        title="tank, 5 fish, tracked by hand",
        source=source,
        arena=arena,
        init=("--fish", "5", "--fps", f"{FIVE_FPS:g}"),
        import_=(
            "--format", "mot", "--mm-per-px", f"{FIVE_MM_PER_PX:g}",
            "--origin", f"{left:.1f},{bottom:.1f}", "--flip-y",
        ),
        halves_s=_halves(float(table.frame.max()) / FIVE_FPS),
        said=(
            f"Scale assumed: {FIVE_MM_PER_PX:g} mm per px (a body of 86 px is then 30 mm long).",
            (f"Arena assumed: the bounding rectangle of all positions, {width_m:.3f} by "
            f"{height_m:.3f} m; so a fish was at each wall at least once."),
        ),
    )  # fmt: skip


def rooms_recording(data: Path, _work: Path) -> Recording:
    """Say how to import one agent in two rooms, in the arena that its authors drew."""
    folder = data / "two-rooms"
    source = folder / "epfl-fish-two-rooms.xml"
    corners = read_polygon(folder / "epfl-two-rooms.xml")
    n_frames = len(read_polygon(source))
    return Recording(
        name="two-rooms-one-fish",
        title="two rooms, 1 fish",
        source=source,
        arena=rooms_arena(corners),
        init=("--fish", "1", "--fps", f"{FPS:g}"),
        import_=("--format", "cats"),
        halves_s=_halves(n_frames / FPS),
        said=(
            (
                "Arena: the polygon that the authors drew over their tank; positions up to "
                f"{1000 * ROOMS_TOLERANCE_M:g} mm outside it count as at the wall."
            ),
            "That the track is a fish's is inferred from its name, and 15 Hz from its length.",
        ),
    )


SOURCES: dict[str, Callable[[Path, Path], Recording]] = {
    **{
        file: lambda data, work, file=file: ring_recording(data, file, work)  # type: ignore[misc]
        for file in RINGS
    },
    "five-zebrafish": five_recording,
    "two-rooms-one-fish": rooms_recording,
}
"""What prepares each recording, given the folder of all and one for files of its own."""


def read_polygon(path: Path) -> NDArray[np.float64]:
    """Return the corners or points of an OpenCV XML file, shape (point, 2), in metres."""
    node = ET.parse(path).getroot().find("polygon")  # noqa: S314 - a file of one's own
    if node is None:
        raise InputError(f"{path}: expected <polygon> with x y pairs.")
    return np.array(" ".join(node.itertext()).split(), dtype=np.float64).reshape(-1, 2)


def rooms_arena(corners_m: NDArray[np.float64]) -> dict[str, Any]:
    """Return the arena of two rooms with bevelled corners and the corridor between them.

    Parameters
    ----------
    corners_m : ndarray, shape (16, 2)
        Six corners of a room beside the corridor's two, and the same of the other,
        in order: the corridor's are numbers 4, 5, 12 and 13.

    Raises
    ------
    InputError
        There are not 16 corners.
    """
    if corners_m.shape != (_ROOMS_CORNERS, 2):
        raise InputError(f"Two rooms need 16 corners, got an array of shape {corners_m.shape}.")
    outline = _ring(corners_m)
    corridor = _ring(corners_m[list(_CORRIDOR)])
    features = [
        ({"role": "outline"}, outline),
        ({"role": "zone", "zone": "corridor", "follows_walls": True}, corridor),
    ]
    return {
        "type": "FeatureCollection",
        "name": "two rooms, as drawn",
        "wall_zone_m": 0.07,
        "wall_tolerance_m": ROOMS_TOLERANCE_M,
        "bins": {"D": [0.0, 0.22], "W": [0.0, 0.18], "V": [0.0, 0.20]},
        "features": [
            {
                "type": "Feature",
                "properties": properties,
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            }
            for properties, ring in features
        ],
    }


def write_arena(recording: Recording, folder: Path) -> Path:
    """Write a recording's arena and return its path."""
    path = folder / f"{recording.name}.geojson"
    path.write_text(json.dumps(recording.arena, indent=1) + "\n", encoding="utf-8")
    return path


def _ring(corners_m: NDArray[np.float64]) -> list[list[float]]:
    return np.vstack([corners_m, corners_m[:1]]).tolist()


def _halves(duration_s: float) -> tuple[int, int, int]:
    end_s = int(duration_s)
    return 0, end_s // 2, end_s
