"""Measure both tracking methods on drawn film and on real video, against what is known of them.

Makes ``tracking.json`` and ``benchmarks-tracking.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``. Real video from ``../shared/data``
(``ZFCAL_SHARED_DATA``) is left out where it is not there.

    .venv/bin/python benchmarks/tracking/bench_tracking.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, groupby
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import ROOT, load, machine, table
from benchmarks.shared.regressions import Ratio, conclude, parser
from benchmarks.tracking.measures import Row, measures
from benchmarks.tracking.scores import as_tracks, differences, statistics_of, summary
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.tables import read_tracks
from zfcal.behaviour.statistics import Statistics
from zfcal.cameras.camera import Homography, Projection
from zfcal.cameras.frames import Frame
from zfcal.cameras.rig import overhead_camera
from zfcal.tracking.fusing import Fuser
from zfcal.tracking.identity_revision import IdentityRevision
from zfcal.tracking.region import region_of
from zfcal.tracking.seen import METHODS, TrackerOptions
from zfcal.tracking.tracker import FishTracker, follow
from zfcal.tracks import FramePoses, Tracks, concatenate
from zfcal.virtual.images.look import look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.swimming import swimming

FPS = 15.0
ARENA = "two-rooms"
DRAWINGS = (("usual", 101), ("usual", 102), ("hard", 101))
"""Looks and seeds; the tracker was made on seeds 1 and 2."""

OTHERS = (111, 112, 113, 114, 115, 116)
"""Seeds of other runs of the model, for the noise of scores."""

_LONGEST = 100_000
"""Frames of a video of unknown length, at most."""

DATA = Path(os.environ.get("ZFCAL_SHARED_DATA", ROOT.parent / "shared" / "data"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Film:
    """Frames and the truth about them.

    Parameters
    ----------
    name
        What the table calls it.
    unit
        Of the truth.
    gate
        What is farther away is somebody else.
    fps
        Frames per second.
    truth : ndarray, shape (frame, agent, 2)
        NaN where it is not known.
    frames
        All in memory, so that the tracker alone is timed.
    projection
        Of the camera.
    region
        Where animals can be; None for anywhere.
    tracks
        The truth as tracks, where scores can be made of it.
    others
        What other runs of the same model look like.
    """

    name: str
    unit: str
    gate: float
    fps: float
    truth: np.ndarray
    frames: list[Frame]
    projection: Projection
    region: np.ndarray | None = None
    tracks: Tracks | None = None
    others: tuple[Statistics, ...] = ()


def drawn(seed: int, preset: str, duration: str, folder: Path) -> Film:
    """Return film of four fish and a robot that the base model swims."""
    arena, look = load_arena(ARENA, Path()), look_of(preset)
    camera = overhead_camera(arena)
    tracks = _swum(seed, duration, folder)
    swum = swimming(tracks, look, fps=FPS, seed=seed)
    painter = OverheadPainter(arena, camera, look, seed=seed)
    frames = []
    for row in range(len(swum)):
        image = painter.paint(swum.at(row))
        if look.jpeg_quality is not None:
            quality = [cv2.IMWRITE_JPEG_QUALITY, look.jpeg_quality]
            data = cv2.imencode(".jpg", image, quality)[1]
            image = np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)
        frames.append(Frame(number=row, time_s=row / FPS, image=image))
    return Film(
        name=f"drawn, {preset}, seed {seed}",
        unit="mm",
        gate=20.0,
        fps=FPS,
        truth=1e3 * swum.xy_m,
        frames=frames,
        projection=camera,
        region=region_of(arena, camera),
        tracks=tracks,
        others=tuple(_statistics(_swum(other, duration, folder)) for other in OTHERS),
    )


def _statistics(tracks: Tracks) -> Statistics:
    arena = load_arena(ARENA, Path())
    return statistics_of(tracks, arena, fps=FPS, end_s=float(tracks.time_s.max()) + 0.5 / FPS)


def scores(film: Film, rows: list[list[Row]]) -> dict[str, Any]:
    """Return how far the scores of a method's tracks are from those of the truth."""
    if film.tracks is None:
        return {}
    tracked = as_tracks(rows, film.tracks, fps=film.fps)
    found = differences(_statistics(tracked), _statistics(film.tracks), film.others)
    return {"scores": found}


def _swum(seed: int, duration: str, folder: Path) -> Tracks:
    root = folder / f"swum-{seed}-{duration}"
    if not root.exists():
        _run("init", root, "--arena", ARENA, "--fish", 4, "--robot", "--seed", seed)
        model = root / "models" / "000000.toml"
        _run("simulate", root, "--model", model, "--duration", duration)
    return concatenate([read_tracks(path) for path in sorted((root / "tracks").glob("*.parquet"))])


def _run(*words: object) -> None:
    line = [sys.executable, "-m", "zfcal_cli.main", *map(str, words), "-q"]
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL)


def real() -> Iterator[Film]:
    """Yield the real videos that are there."""
    folder = DATA / "zebrafish8-video"
    if folder.exists():
        told = pd.read_csv(folder / "reference_test_B.csv")
        columns = [told[c].to_numpy().reshape(-1, told["id"].nunique()) for c in ("x_px", "y_px")]
        yield _filmed(
            "8 zebrafish (test_B)", folder / "test_B.avi", np.stack(columns, -1), 28.07, 25.0
        )
    folder = DATA / "mouse-disc"
    if folder.exists():
        told = pd.read_csv(folder / "mouse_tracked.csv.gz", index_col=0)
        places = told[["pos_x", "pos_y"]].to_numpy()[:2000, None]
        yield _filmed("a mouse, first 2,000 frames", folder / "mouse_video.mp4", places, 30.0, 25.0)


def counts() -> list[dict[str, Any]]:
    """Return how many animals each method tells in the real video of which nobody made tracks."""
    path = DATA / "zebrafish8-video" / "test_A.avi"
    if not path.exists():
        return []
    film = _filmed("8 zebrafish (test_A)", path, np.full((_LONGEST, 8, 2), np.nan), 28.07, 25.0)
    found = []
    for method in METHODS:
        _, rows, _ = tracked(film, method)
        exact = np.mean([len(row) == film.truth.shape[1] for row in rows])
        found.append({"film": film.name, "method": method, "frames": len(rows), "exact": exact})
    return found


def _filmed(name: str, path: Path, truth: np.ndarray, fps: float, gate: float) -> Film:
    capture, frames = cv2.VideoCapture(str(path)), []
    while len(frames) < len(truth):
        whole, image = capture.read()
        if not whole:
            break
        frames.append(Frame(number=len(frames), time_s=len(frames) / fps, image=image))
    height, width = frames[0].image.shape[:2]
    # Metres stand for pixels here.
    plain = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return Film(
        name=name,
        unit="px",
        gate=gate,
        fps=fps,
        truth=truth[: len(frames)],
        frames=frames,
        projection=Homography(size_px=(width, height), matrix=plain),
    )


Places = list[list[Row]]


def tracked(film: Film, method: str) -> tuple[Places, Places, float]:
    """Return poses as they are told, tracks as they are written, and the seconds that it took."""
    options = TrackerOptions(method=method, n_agents=film.truth.shape[1])
    tracker = FishTracker(options, film.projection, region=film.region)
    # A break is longer than a step; metres that are pixels have none, so that ids stay as told.
    break_s = 3 / FPS + 1 / FPS if film.unit == "mm" else 0.0
    fuser, revision = Fuser(keeps=True, break_s=break_s), IdentityRevision(break_s)
    begin = time.process_time()
    told = []
    for frame, seen in follow(tracker, film.frames):
        revision.exchange(fuser.named(tracker.take_exchanges()), frame.time_s)
        agents = fuser.step(seen, None, frame.time_s)
        revision.note(frame.number, frame.time_s, fuser.agents)
        told.append(FramePoses(time_s=frame.time_s, frame=frame.number, agents=agents))
    tracks = list(chain.from_iterable(map(revision.revise, _minutes(told))))
    took_s = time.process_time() - begin
    return _places(told), _places(tracks), took_s


def _places(frames: list[FramePoses]) -> Places:
    return [[(a.agent, a.x_m, a.y_m) for a in poses.agents] for poses in frames]


def measure(film: Film, method: str) -> dict[str, Any]:
    """Return what a method makes of a film."""
    told, places, took_s = tracked(film, method)
    scale = 1e3 if film.unit == "mm" else 1.0
    live, rows = (
        [[(agent, scale * x, scale * y) for agent, x, y in row] for row in frames]
        for frames in (told, places)
    )
    return {
        "film": film.name,
        "unit": film.unit,
        "method": method,
        "frames": len(film.frames),
        "lacking": [int(np.isnan(film.truth[..., 0]).sum()), int(film.truth[..., 0].size)],
        **measures(film.truth, rows, gate=film.gate, fps=film.fps),
        "live": measures(film.truth, live, gate=film.gate, fps=film.fps),
        **scores(film, places),
        "times_real_time": len(film.frames) / film.fps / took_s,
    }


def _minutes(told: list[FramePoses]) -> list[list[FramePoses]]:
    """Return frames minute by minute, as `zfcal track` closes its segments."""
    minutes = groupby(told, key=lambda poses: int(poses.time_s + 1e-6) // 60)
    return [list(frames) for _, frames in minutes]


def measure_all(*, tiny: bool) -> dict[str, Any]:
    """Measure every film by every method, on one core."""
    cv2.setNumThreads(1)
    found: dict[str, Any] = {"machine": machine(), "load_before": load(), "rows": []}
    # A background takes 100 frames, at 15 a second.
    duration, drawings = ("8s", DRAWINGS[:1]) if tiny else ("120s", DRAWINGS)
    with tempfile.TemporaryDirectory() as folder:
        films = (drawn(seed, look, duration, Path(folder)) for look, seed in drawings)
        # One at a time: a film takes half a gigabyte.
        for film in films if tiny else chain(films, real()):
            found["rows"] += [measure(film, method) for method in METHODS]
            print(found["rows"][-1], file=sys.stderr)
    found["counts"] = [] if tiny else counts()
    found["load_after"] = load()
    return found


def markdown(found: dict[str, Any]) -> str:
    """Return the table of what was measured."""
    busy = f"{found['load_before']:.1f} before, {found['load_after']:.1f} after"
    said = f"""Made by `benchmarks/tracking/bench_tracking.py`; numbers in
        `benchmarks/results/tracking.json`. Machine: {found["machine"]}; load
        {busy}; one core, frames in memory. Drawn: four fish and a robot
        of the base model for 120 s at 15 Hz, 500 x 500 px, with seeds on which nothing was
        tuned; matched within 20 mm. Real: against the tracks of idtracker.ai and Tracktor, which
        are not truth; matched within 25 px. *Exact*: frames with exactly as many animals as
        there are. *Of whole frames*: precision in the frames in which the truth knows everybody.
        The reference of the eight zebrafish lacks {_lacking(found)}; tracks of
        animals that it lacks are false positives. The tracker is given the number of animals.
        What counts are `tracks/`, written as each minute ends; *live* are the same measures of
        `poses/`, written frame by frame."""
    head = ("film", "method", "MOTA", "live", "IDF1", "live", "switches per fish-minute",
            "precision", "of whole frames", "recall", "median error", "95 % error", "exact",
            "times real time")  # fmt: skip
    rows = [
        [
            row["film"],
            row["method"],
            *(each[name] for name in ("mota", "idf1") for each in (row, row["live"])),
            *(
                row[name]
                for name in (
                    "switches_per_fish_minute",
                    "precision",
                    "precision_of_whole",
                    "recall",
                )
            ),
            f"{row['median_error']:.2f} {row['unit']}",
            f"{row['error_95']:.2f} {row['unit']}",
            row["exact"],
            row["times_real_time"],
        ]
        for row in found["rows"]
    ]
    text = textwrap.fill(" ".join(said.split()), 120)
    lines = [
        f"- {row['film']}, {row['method']}: {summary(row['scores'])}"
        for row in found["rows"]
        if "scores" in row
    ]
    tells = textwrap.fill(" ".join(_SCORES.split()), 120)
    listed = "\n".join(["", tells, "", *lines, ""]) if lines else ""
    counted = [
        f"- {row['film']}, {row['method']}: {row['exact']:.1%} of {row['frames']} frames"
        for row in found["counts"]
    ]
    alone = ["", "Frames with exactly eight animals, where nobody made tracks:", "", *counted, ""]
    listed += "\n".join(alone) if counted else ""
    return f"# Tracking\n\n{text}\n\n{table(head, rows)}{listed}"


def _lacking(found: dict[str, Any]) -> str:
    """Return how many positions the reference of the published film does not have."""
    lacking = next((row["lacking"] for row in found["rows"] if "zebrafish" in row["film"]), None)
    return "some positions" if lacking is None else f"{lacking[0]} of {lacking[1]:,} positions"


_SCORES = """Scores of the tracks and of the truth against six other runs of the same model: the
    largest difference, and in brackets half the range that holds 95 % of the scores of those runs
    among themselves, the ceiling's noise. The robot is the track nearest to its true place, as by
the camera below."""


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return what is compared with the committed results."""
    return {
        f"{name}, {row['film']}, {row['method']}": Ratio(value=row[key], better=better)
        for row in found["rows"]
        for name, key, better in (
            ("recall", "recall", "more"),
            ("median error", "median_error", "less"),
        )
    }


def main() -> None:
    """Measure, write, compare."""
    options = parser(__doc__).parse_args()
    found = measure_all(tiny=options.tiny)
    conclude("tracking", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()
