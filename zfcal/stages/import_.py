"""From the tracks of another program to the segments of a trial."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.settings import read_trial
from zfcal.errors import InputError
from zfcal.readers import (
    Imported,
    ImportOptions,
    check_part,
    guess_format,
    import_part,
    refuse_idle,
)
from zfcal.stages.events import Note, Tell
from zfcal.stages.making import run
from zfcal.stages.recording import (
    TRACKS,
    Recording,
    check_same_source,
    hash_sources,
    named_sources,
    segmented,
    starts_of_recording,
)
from zfcal.stages.stage import Item, OneThing, Run
from zfcal.stages.trial_context import OpenTrial, Task, open_trial
from zfcal.tracks import FISH, ROBOT, Tracks, concatenate
from zfcal.trial import Trial

_LIMITS = {"n_fish", "n_robots"}
"""Options that come from trial.toml and change no number."""

_OUTSIDE_SHARE = 0.2
"""More positions than this outside the tank: units or axes are likely wrong."""

_AXES_HINT = (
    "Check the scale (--mm-per-px), the origin (--origin), and whether y counts down (--flip-y)."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What to import.

    Parameters
    ----------
    path
        A file, or a folder where the format has one.
    format
        A key of `zfcal.readers.FORMATS`; None to go by the file's looks.
    options
        What the file does not tell; its ``fps`` None for that of the trial.
    robot_tracks
        A file of the same format in which every agent is a robot.
    """

    path: Path
    format: str | None
    options: dict[str, object]
    robot_tracks: Path | None = None


def import_tracks(root: Path, source: Source, tell: Tell, *, task: Task | None = None) -> None:
    """Import the tracks of another program into a trial.

    Parameters
    ----------
    root
        The trial's directory.
    source
        What to import, and how to read it.
    tell
        Hears of every segment, and of what a person should know of the file.
    task
        A forced one replaces the tracks of another source.

    Raises
    ------
    InputError
        The trial does not exist, or the file is wrong or does not fit it.
    """
    read_trial(root)
    name = source.format or _guessed(source.path, tell)
    stage = OneThing(name="import", item=lambda run: _recording(run, source, name))
    run(stage, root, tell, task=task)


def _recording(run: Run, source: Source, name: str) -> Item:
    opened = open_trial(run.root)
    options = _options(opened, source.options)
    _check(run, opened.trial, _parts(source, options), name)

    def record() -> Recording:
        tracks = _read(_parts(source, options), name, run.tell)
        _tell_outside(opened, tracks, run.tell)
        _tell_missing(opened, tracks, run.tell)
        return Recording(
            tracks=tracks,
            end_s=float(tracks.time_s[-1]) + 1 / opened.trial.fps,
            extra={"noise_m": options.noise_m} if options.noise_m is not None else {},
        )

    lineage = _lineage(opened, source, name, options)
    return segmented(run, lineage, starts_of_recording(run.root), record)


def _parts(source: Source, options: ImportOptions) -> list[tuple[Path, ImportOptions]]:
    """Return the files that are imported together, and how each is read."""
    parts = [(source.path, options)]
    if source.robot_tracks is not None:
        # Everybody in that file is a robot, whatever the file calls it.
        alone = dataclasses.replace(options, n_fish=options.n_robots, robots=())
        parts.append((source.robot_tracks, alone))
    return parts


def _check(run: Run, trial: Trial, parts: list[tuple[Path, ImportOptions]], name: str) -> None:
    """Refuse what is seen to be wrong at once: hashing a recording may take minutes."""
    refuse_idle(*(check_part(path, name, options) for path, options in parts))
    sources = [each for path, _ in parts for each in named_sources(run.root, path)]
    check_same_source(trial, run.command, sources=sources, task=run.task)


def _guessed(path: Path, tell: Tell) -> str:
    if not path.exists():
        raise InputError(f"{path}: no such file.", hint="Check the path, and where you stand.")
    name = guess_format(path)
    if name is None:
        raise InputError(
            f"{path}: looks like no known format.", hint="Say what it is with --format."
        )
    tell(Note(text=f"{path}: read as --format {name}."))
    return name


def _options(opened: OpenTrial, given: dict[str, object]) -> ImportOptions:
    trial = opened.trial
    fps = given.get("fps")
    if fps is not None and not math.isclose(float(str(fps)), trial.fps, rel_tol=1e-6):
        raise InputError(
            f"{trial.config}: fps is {trial.fps:g} Hz, --fps says {fps} Hz.",
            hint=f"Both must be the rate of the recording: correct one of them (zfcal init "
            f"{trial.root} --force --fps {fps} ... writes the trial again).",
        )
    known = {key: value for key, value in given.items() if value is not None}
    limits = {"n_fish": trial.n_fish, "n_robots": trial.n_robots, "fps": trial.fps}
    return ImportOptions(**{**known, **limits})  # type: ignore[arg-type]


def _lineage(opened: OpenTrial, source: Source, name: str, options: ImportOptions) -> Lineage:
    given: dict[str, JSON] = {
        field.name: getattr(options, field.name)
        for field in dataclasses.fields(ImportOptions)
        if field.name not in _LIMITS and getattr(options, field.name) != field.default
    }
    root = opened.trial.root
    inputs = hash_sources(root, source.path)
    if source.robot_tracks is not None:
        inputs |= hash_sources(root, source.robot_tracks)
        given["robot_tracks"] = source.robot_tracks.name
    return Lineage(
        schema=TRACKS, command="import", options={"format": name, **given}, inputs=inputs
    )


def _read(parts: list[tuple[Path, ImportOptions]], name: str, tell: Tell) -> Tracks:
    found = [import_part(path, name, options) for path, options in parts]
    refuse_idle(*(each.idle for each in found))
    for note in found[0].notes:
        tell(Note(text=f"{parts[0][0]}: {note}"))
    for (path, _), each in zip(parts, found, strict=True):
        _tell_warnings(path, each, tell)
    first, *others = (each.tracks for each in found)
    return concatenate([first, *(_as_robots(tracks, beside=first) for tracks in others)])


def _as_robots(tracks: Tracks, *, beside: Tracks) -> Tracks:
    """Return tracks of robots alone, under ids that nobody else has."""
    shift = int(beside.agent.max()) + 1 - int(tracks.agent.min())
    return dataclasses.replace(
        tracks,
        agent=(tracks.agent + shift).astype(np.int32),
        kind=np.full(len(tracks), ROBOT, dtype=np.int8),
    )


def _tell_warnings(path: Path, found: Imported, tell: Tell) -> None:
    for warning in found.warnings:
        tell(Note(text=f"{path}: {warning}", warning=True))


def _tell_missing(opened: OpenTrial, tracks: Tracks, tell: Tell) -> None:
    """Warn of fish or robots that trial.toml states and no frame of the tracks shows."""
    trial = opened.trial
    for kind, word, stated in ((FISH, "fish", trial.n_fish), (ROBOT, "robots", trial.n_robots)):
        _, counts = np.unique(tracks.frame[tracks.kind == kind], return_counts=True)
        most = int(counts.max(initial=0))
        if most < stated:
            text = (
                f"{trial.root}: no frame holds more than {most} {word}, {trial.config} states "
                f"{stated}; models are simulated with those of trial.toml. Correct it, or name "
                "the robots with --robots."
            )
            tell(Note(text=text, warning=True))


def _tell_outside(opened: OpenTrial, tracks: Tracks, tell: Tell) -> None:
    """Say how many positions lie outside the arena.

    Raises
    ------
    InputError
        All of them do.
    """
    arena = opened.arena
    xy_m = np.stack([tracks.x_m, tracks.y_m], axis=-1)
    settled_m, n_settled = arena.settle(xy_m)
    n_void = int((arena.zone_of(settled_m) == 0).sum())
    n = len(tracks)
    if n_void > _OUTSIDE_SHARE * n:
        x0, y0, x1, y1 = arena.outline.bounds
        problem = (
            f"{opened.trial.root}: {n_void} of {n} positions lie outside the arena: the tracks "
            f"span x {tracks.x_m.min():.3f} to {tracks.x_m.max():.3f} m, "
            f"y {tracks.y_m.min():.3f} to {tracks.y_m.max():.3f} m, the arena {arena.name} "
            f"x {x0:.3f} to {x1:.3f} m, y {y0:.3f} to {y1:.3f} m."
        )
        if n_void == n:
            raise InputError(problem, hint=_AXES_HINT)
        tell(Note(text=f"{problem} {_AXES_HINT}", warning=True))
    elif n_void or n_settled:
        limit_mm = 1000 * arena.wall_tolerance_m
        text = (
            f"{n_settled} of {n} positions lie up to {limit_mm:g} mm outside the arena and count "
            f"as at the wall; {n_void} lie farther out and do not count."
        )
        tell(Note(text=text))
