"""Making a trial directory: its settings, its arena and its starting model."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from zfcal.arena import Arena
from zfcal.artifacts.arenas import (
    arena_of,
    circular_document,
    load_arena,
    rectangle_document,
    shipped_arenas,
)
from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.models import read_model_for, write_model
from zfcal.artifacts.reading.opening import read_limited
from zfcal.artifacts.reading.places import is_regular
from zfcal.artifacts.settings import read_trial, write_trial
from zfcal.errors import InputError, ZfcalError
from zfcal.parameters import Parameters, natural
from zfcal.stages.events import Made, Note, Planned, Tell, UpToDate
from zfcal.stages.trial_context import Task
from zfcal.trial import Trial
from zfcal.units import default_dt_s

_ARENA_FILE = "arena.geojson"

_MIN_FPS, _MAX_FPS = 1e-3, 1e6
"""Frame rates outside these, in hertz, are no camera's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NewTrial:
    """What a person says of a trial that is to be made.

    Parameters
    ----------
    n_fish, n_robots
        Agents in the tank.
    fps
        Frame rate of the tracks, in hertz.
    arena
        Name of an arena that comes with zfcal, or a GeoJSON file's path.
    radius_m
        Radius of a circular tank, in metres, instead of `arena`.
    side_m
        Side of a square tank, in metres, instead of `arena`.
    dt_s
        The model's step in seconds; None for the multiple of a frame nearest to 0.2 s.
    seed
        All random numbers of the trial derive from it.
    source
        Where the data come from, in words.
    """

    n_fish: int
    n_robots: int = 0
    fps: float
    arena: str | None = None
    radius_m: float | None = None
    side_m: float | None = None
    dt_s: float | None = None
    seed: int = 0
    source: str = ""


def create_trial(
    root: Path,
    new: NewTrial,
    tell: Tell,
    *,
    task: Task | None = None,
    model: Parameters | None = None,
) -> Trial:
    """Make a trial directory, or find that it is there as asked for.

    Parameters
    ----------
    root
        Its place; files that are there already stay.
    new
        What it is to be.
    tell
        Hears of the files.
    task
        A forced one writes the settings of an existing trial anew.
    model
        The starting model; None for one of natural-looking fish.

    Raises
    ------
    InputError
        There is a trial already and it differs, or the arena is wrong.
    """
    task = task or Task()
    arena, name, document = _arena(root, new)
    if not _MIN_FPS <= new.fps <= _MAX_FPS:
        raise InputError(
            f"{root}: fps must be {_MIN_FPS:g} to {_MAX_FPS:g} Hz, got {new.fps!r}.",
            hint="Give the frame rate of the tracks with --fps.",
        )
    dt_s = default_dt_s(new.fps) if new.dt_s is None else new.dt_s
    trial = Trial(
        root=root,
        arena=name,
        n_fish=new.n_fish,
        n_robots=new.n_robots,
        fps=new.fps,
        dt_s=dt_s,
        seed=new.seed,
        source=new.source,
    )
    reason = _reason(trial, document, task)
    if task.dry_run and reason:
        for path in (trial.config, root / trial.model):
            tell(Planned(path=path, reason=reason))
        return trial
    if reason and document is not None:
        write_text_whole(root / _ARENA_FILE, document)
    _write_model(trial, arena, model, tell)
    # Last, since a directory is a trial from here on.
    if reason:
        write_trial(trial)
    tell(Made(path=trial.config, reason=reason) if reason else UpToDate(path=trial.config))
    return trial


def _reason(trial: Trial, document: str | None, task: Task) -> str | None:
    if not trial.config.exists():
        return "missing"
    if task.force:
        return "forced"
    found = read_trial(trial.root)
    changed = [
        f"{field.name} = {getattr(found, field.name)!r}, "
        f"the command gives {getattr(trial, field.name)!r}"
        for field in dataclasses.fields(Trial)
        if field.name not in {"root", "cameras", "model"}
        and getattr(found, field.name) != getattr(trial, field.name)
    ]
    place = trial.root / _ARENA_FILE
    if document is not None and not (
        is_regular(place) and read_limited(place) == document.encode()
    ):
        changed.append(f"its {_ARENA_FILE} is another")
    if changed:
        raise InputError(
            f"{trial.root}: is a trial already, and differs: {'; '.join(changed)}.",
            hint=f"Edit {trial.config}, or write it again with --force (tracks, statistics, "
            "scores and models stay).",
        )
    return None


def _arena(root: Path, new: NewTrial) -> tuple[Arena, str, str | None]:
    """Return the arena, what trial.toml calls it, and the text of its file if it has one."""
    made: dict[str, Any] | None = None
    if new.radius_m is not None:
        _check_alone(new, "circular", "radius_m")
        made = circular_document(new.radius_m)
    if new.side_m is not None:
        _check_alone(new, "open-square", "side_m")
        made = rectangle_document(new.side_m, new.side_m)
    if made is not None:
        return arena_of(made), _ARENA_FILE, json.dumps(made, indent=1) + "\n"
    if new.arena is None:
        raise InputError(
            f"{root}: a trial needs an arena.",
            hint=f"Give --arena with one of {', '.join(shipped_arenas())}, or a GeoJSON file.",
        )
    arena = load_arena(new.arena, Path())
    if new.arena in shipped_arenas():
        return arena, new.arena, None
    return arena, _ARENA_FILE, Path(new.arena).read_text("utf-8")


def _check_alone(new: NewTrial, name: str, key: str) -> None:
    option = f"--{key.replace('_', '-')}"
    if new.arena not in {None, name}:
        raise InputError(
            f"{option} makes an arena {name!r}, --arena names {new.arena!r}.",
            hint=f"Give one of the two; {option} cannot resize another arena.",
        )
    if new.radius_m is not None and new.side_m is not None:
        raise InputError("--radius-m and --side-m describe two tanks: give one of them.")


def _write_model(trial: Trial, arena: Arena, model: Parameters | None, tell: Tell) -> None:
    """Write the starting model, unless there is one that serves: a person may have edited it."""
    path = trial.root / trial.model
    reason = "missing"
    if path.exists():
        try:
            read_model_for(path, arena, dt_s=trial.dt_s)
        except ZfcalError as error:
            reason = f"does not fit: {error}"
        else:
            tell(UpToDate(path=path))
            return
        tell(Note(text=f"{path}: is written anew, since it {reason}", warning=True))
    if model is None:
        zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
        model = natural(zones, dt_s=trial.dt_s)
    options: dict[str, JSON] = {"arena": trial.arena, "dt_s": trial.dt_s}
    write_model(path, model, Lineage(schema="zfcal.model/1", command="init", options=options))
    tell(Made(path=path, reason=reason))
