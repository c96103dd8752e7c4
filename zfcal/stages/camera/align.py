"""Overhead and below in one frame, by a recording in which the robot drives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.frame_files import frame_segments
from zfcal.artifacts.reading.contents import hold_steady
from zfcal.artifacts.settings import read_trial
from zfcal.cameras.alignment import Alignment, Spots, align_spots
from zfcal.cameras.calibration import Calibration, summary
from zfcal.cameras.camera import Projection, check_fits
from zfcal.cameras.frames import Frame
from zfcal.cameras.live import ArrivalClock
from zfcal.cameras.registering import register
from zfcal.cameras.video import is_live
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import read_camera, stated_side
from zfcal.stages.camera.making import CameraTask, Place, Recipe, make_camera
from zfcal.stages.camera.rig import BELOW, OVERHEAD, check_view
from zfcal.stages.camera.sources import source_of
from zfcal.stages.events import Tell
from zfcal.tracking.robot import LedOptions, RobotFinder
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker, follow
from zfcal.trial import Trial

_ALIGNED = "below-aligned.toml"
_SURE = 0.5
_LATE_S = 0.02
_MM = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """What shows the robot driving.

    Parameters
    ----------
    overhead, below
        Sources of images, as `zfcal track` takes them; None for the trial's ``frames/``.
    start_s, seconds
        The stretch that is looked at.
    """

    overhead: str | None = None
    below: str | None = None
    start_s: float = 0.0
    seconds: float = 120.0


def align_cameras(root: Path, recording: Recording, tell: Tell, *, task: CameraTask) -> None:
    """Correct the camera below so that it sees the robot where overhead does.

    The corrected camera is a file of its own, which the trial names from then on; it is
    always made from the calibration that it corrects.

    Parameters
    ----------
    root
        The trial, with both cameras calibrated.
    recording
        What shows the robot driving.
    tell
        Hears of the file, of the errors before and after, and of the clocks.
    task
        Whether to write, and whether to do it again.

    Raises
    ------
    InputError
        A camera is not calibrated, there are no images, or the robot is not to be found.
    """
    place = Place(path=root / "cameras" / _ALIGNED, root=root, name=BELOW)
    make_camera(place, lambda: _align(place, root, recording), tell, task=task)


def _align(place: Place, root: Path, recording: Recording) -> Recipe:
    trial = read_trial(root)
    overhead_file, below_file = _camera_file(trial, "overhead"), _camera_file(trial, "below")
    sources = {
        "overhead": recording.overhead or _recorded(root, "overhead"),
        "below": recording.below or _recorded(root, "below"),
    }

    def work() -> Calibration:
        overhead, below = read_camera(overhead_file), read_camera(below_file)
        arena = load_arena(trial.arena, root)
        check_view(overhead, overhead_file, OVERHEAD, arena)
        check_view(below, below_file, BELOW, arena)
        blobs = _overhead_spots(trial, sources["overhead"], overhead, recording)
        leds = _below_spots(trial, sources["below"], below, recording)
        alignment = align_spots(blobs, leds)
        return _calibration(below, alignment)

    return Recipe(
        place=replace(place, stated_side=stated_side(below_file)),
        command="camera align",
        work=work,
        options={"start_s": recording.start_s, "seconds": recording.seconds, "sources": sources},
        inputs=(overhead_file, below_file, *_files(sources.values())),
    )


def _overhead_spots(
    trial: Trial, source: str, projection: Projection, recording: Recording
) -> Spots:
    """Return where the camera overhead sees somebody.

    Raises
    ------
    InputError
        There are no such images, or they are of another camera.
    """
    tracker = FishTracker(TrackerOptions(n_agents=trial.n_fish + trial.n_robots), projection)
    rows = [
        (frame.time_s, animal.x_m, animal.y_m)
        for frame, seen in follow(tracker, _frames(trial, source, projection, recording))
        for animal in seen
        if animal.confidence >= _SURE
    ]
    return _spots(rows)


def _below_spots(trial: Trial, source: str, projection: Projection, recording: Recording) -> Spots:
    """Return where the camera below sees both LEDs of the robot.

    Raises
    ------
    InputError
        There are no such images, or they are of another camera.
    """
    finder = RobotFinder(LedOptions(), projection)
    rows = []
    for frame in _frames(trial, source, projection, recording):
        seen = finder.step(frame)
        # One LED alone lies beside the robot's middle.
        if len(seen.leds_px) == 2:
            rows.append((seen.time_s, seen.x_m, seen.y_m))
    return _spots(rows)


def _frames(
    trial: Trial, source: str, projection: Projection, recording: Recording
) -> Iterator[Frame]:
    """Yield the images of a stretch whose time advances."""
    last_s = -math.inf
    opened = source_of(source, fps=trial.fps, clock=ArrivalClock())
    for number, shot in enumerate(opened.shots()):
        if shot.time_s >= recording.start_s + recording.seconds:
            return
        if recording.start_s <= shot.time_s and shot.time_s > last_s:
            frame = Frame(number=number, time_s=shot.time_s, image=shot.image)
            check_fits(projection, frame.size_px, camera=f"{source}: its camera file")
            last_s = shot.time_s
            yield frame


def _spots(rows: list[tuple[float, float, float]]) -> Spots:
    found = np.array(rows, np.float64).reshape(-1, 3)
    return Spots(time_s=found[:, 0], xy_m=found[:, 1:])


def _calibration(camera: Any, alignment: Alignment) -> Calibration:
    found = register(camera, alignment)
    details = {
        "offset_s": alignment.offset_s,
        "turned_deg": math.degrees(alignment.angle_rad),
        "shifted_mm": [value * _MM for value in alignment.shift_m],
        "share": alignment.share,
        "before_mm": summary(alignment.before_m * _MM),
        "turn_and_shift_mm": summary(alignment.held_out_m * _MM),
    }
    return Calibration(
        camera=found.camera,
        pairs=found.pairs,
        method=f"robot overhead and below, {found.method}",
        n_parameters=3 if found.method != "pose" else 6,
        left_out_m=found.held_out_m,
        notes=_notes(alignment),
        details=details,
    )


def _notes(alignment: Alignment) -> tuple[str, ...]:
    notes = []
    if abs(alignment.offset_s) > _LATE_S:
        notes.append(
            f"The clocks differ: {alignment.offset_s * _MM:+.0f} ms are to be added to the times "
            "below. More than 50 ms prevent that the robot is recognised by its LEDs."
        )
    return tuple(notes)


def _camera_file(trial: Trial, name: str) -> Path:
    file = (trial.cameras or {}).get(name, {}).get("file")
    if not file:
        raise InputError(
            f"{trial.config}: names no file for the {name} camera.",
            hint=f"Calibrate it first: zfcal camera points MARKS.csv --trial {trial.root} "
            f"--camera {name}",
        )
    path = trial.root / file
    # What was aligned before is aligned anew from the calibration that it corrects.
    return path.with_name("below.toml") if path.name == _ALIGNED else path


def _recorded(root: Path, name: str) -> str:
    folder = root / "frames" / name
    if not frame_segments(folder):
        raise InputError(
            f"{folder}: holds no images.",
            hint=f"Record some with zfcal track --record, or give --{name} VIDEO.",
        )
    return str(folder)


def _files(sources: Iterable[str]) -> list[Path]:
    """Return the files that hold the images, to tell when they change."""
    found: list[Path] = []
    for source in sources:
        path = Path(source)
        if is_live(source):
            raise InputError(
                f"{source}: is a live camera, an alignment needs a recording.",
                hint="Record a minute with zfcal track --record while the robot drives.",
            )
        found += frame_segments(path) if path.is_dir() else [path] if path.is_file() else []
    for path in found:
        # What decodes a film opens it by its name.
        hold_steady(path)
    return found
