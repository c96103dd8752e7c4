"""From a model to tracks, as if the fish had swum in the tank."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.models import read_model, read_model_for
from zfcal.artifacts.segments import segment_path
from zfcal.artifacts.settings import find_trial, read_trial
from zfcal.errors import InputError
from zfcal.model.effects.genome import check_effects
from zfcal.model.simulate import simulate_tracks
from zfcal.stages.events import Planned, Tell
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.making import run
from zfcal.stages.recording import (
    TRACKS,
    Recording,
    check_same_source,
    hash_sources,
    segmented,
    starts_between,
)
from zfcal.stages.stage import Item, OneThing, Run
from zfcal.stages.trial_context import OpenTrial, Task, open_trial
from zfcal.tracks import FISH, ROBOT, Tracks


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateOptions:
    """What to simulate.

    Parameters
    ----------
    model
        A model file.
    duration_s
        How long, after 60 s that are dropped.
    seed
        None for the trial's.
    arena, n_fish, n_robots
        Of a trial that does not exist yet; None for those of the trial in which
        the model lies.
    fps
        Frame rate of a trial that does not exist yet, in hertz; None for the
        model's steps.
    """

    model: Path
    duration_s: float
    seed: int | None = None
    arena: str | None = None
    n_fish: int | None = None
    n_robots: int | None = None
    fps: float | None = None

    def __post_init__(self) -> None:
        if not 0 < self.duration_s < math.inf:
            raise InputError(f"A simulation needs a positive duration, got {self.duration_s!r} s.")


def simulate(root: Path, options: SimulateOptions, tell: Tell, *, task: Task | None = None) -> None:
    """Simulate a trial and write its tracks.

    Parameters
    ----------
    root
        The trial's directory; it is made where there is none.
    options
        What to simulate.
    tell
        Hears of every file.
    task
        How to go about it.

    Raises
    ------
    InputError
        The model is not one for the trial's arena and step, or the trial holds
        tracks from elsewhere.
    """
    task = task or Task()
    new = not (root / "trial.toml").exists()
    if new:
        asked = new_trial(root, options)
        # A model that does not fit must not leave half a trial behind.
        read_model_for(options.model, load_arena(str(asked.arena), Path()), dt_s=asked.dt_s or 0.0)
        made = create_trial(root, asked, tell, task=task)
        if task.dry_run:
            for start in starts_between(0.0, options.duration_s):
                tell(Planned(path=segment_path(root, start), reason="missing"))
            return
        root = made.root
    stage = OneThing(name="simulate", item=lambda run: _simulation(run, options, is_new=new))
    run(stage, root, tell, task=task)


def _simulation(run: Run, options: SimulateOptions, *, is_new: bool) -> Item:
    opened = open_trial(run.root)
    if not is_new:
        _check_existing(opened, options)

    def record() -> Recording:
        return Recording(tracks=swim(opened, options), end_s=options.duration_s)

    starts, lineage = starts_between(0.0, options.duration_s), _lineage(opened, options)
    check_same_source(opened.trial, lineage.command, sources=lineage.inputs, task=run.task)
    return segmented(run, lineage, starts, record)


def new_trial(root: Path, options: SimulateOptions) -> NewTrial:
    """Return the settings of a trial that is made for a simulation, at the model's own step.

    Raises
    ------
    InputError
        Neither the options nor the trial of the model say who swims where.
    """
    model = read_model(options.model)
    check_effects(model, of=options.model)
    arena, n_fish, n_robots = options.arena, options.n_fish, options.n_robots
    try:
        home = read_trial(find_trial(options.model))
    except InputError as error:
        if arena is None or n_fish is None:
            raise InputError(
                f"{root}: is no trial yet, and the model {options.model} lies in none that says "
                "which arena and how many fish.",
                hint="Give --arena and --fish, and --robot if there is one.",
            ) from error
    else:
        own = home.root / home.arena
        arena = arena or (str(own) if own.is_file() else home.arena)
        n_robots = home.n_robots if n_robots is None and n_fish is None else n_robots
        n_fish = home.n_fish if n_fish is None else n_fish
    return NewTrial(
        n_fish=n_fish,
        n_robots=n_robots or 0,
        fps=1 / model.dt_s if options.fps is None else options.fps,
        dt_s=model.dt_s,
        arena=arena,
        seed=options.seed or 0,
        source=f"simulated from {options.model.name}",
    )


def _check_existing(opened: OpenTrial, options: SimulateOptions) -> None:
    trial = opened.trial
    for name in ("arena", "n_fish", "n_robots", "fps"):
        asked, found = getattr(options, name), getattr(trial, name)
        if asked is not None and asked != found:
            raise InputError(
                f"{trial.config}: {name} is {found!r}, the command gives {asked!r}.",
                hint="Simulate into a new directory, or leave the option out.",
            )


def _lineage(opened: OpenTrial, options: SimulateOptions) -> Lineage:
    trial = opened.trial
    said: dict[str, JSON] = {
        **opened.clock_options,
        "n_fish": trial.n_fish,
        "n_robots": trial.n_robots,
        "duration_s": options.duration_s,
    }
    return Lineage(
        schema=TRACKS,
        command="simulate",
        options=said,
        seed=trial.seed if options.seed is None else options.seed,
        inputs=hash_sources(trial.root, options.model)
        | hash_inputs(trial.root, opened.arena_files),
    )


def swim(opened: OpenTrial, options: SimulateOptions) -> Tracks:
    """Return the tracks of a simulation at the trial's frame rate.

    Between two of the model's steps agents swim straight, as the model defines.
    """
    trial = opened.trial
    model = read_model_for(options.model, opened.arena, dt_s=trial.dt_s)
    check_effects(model, of=options.model)
    n_frames = max(1, round(options.duration_s * trial.fps))
    per_step = round(trial.dt_s * trial.fps)
    n_steps = -(-(n_frames - 1) // per_step) + 1
    xy_m, heading_rad = simulate_tracks(
        model,
        opened.arena,
        n_agents=trial.n_agents,
        n_steps=n_steps,
        seed=trial.seed if options.seed is None else options.seed,
        n_robots=trial.n_robots,
    )
    xy_m, heading_rad = between_steps(xy_m, heading_rad, per_step)
    return _as_tracks(opened, xy_m[:n_frames], heading_rad[:n_frames])


def between_steps(xy_m: Floats, heading_rad: Floats, per_step: int) -> tuple[Floats, Floats]:
    """Fill in the frames between the model's steps.

    Parameters
    ----------
    xy_m : ndarray, shape (step, agent, 2)
    heading_rad : ndarray, shape (step, agent)
        Of the step that led there.
    per_step
        Frames a step.

    Returns
    -------
    xy_m : ndarray, shape ((step - 1) * per_step + 1, agent, 2)
        Every ``per_step``-th frame is a step, exactly.
    heading_rad : ndarray, shape ((step - 1) * per_step + 1, agent)
    """
    share = (np.arange(per_step) / per_step)[None, :, None, None]
    start, end = xy_m[:-1, None], xy_m[1:, None]
    filled = (start + share * (end - start)).reshape(-1, *xy_m.shape[1:])
    ahead = np.repeat(heading_rad[1:], per_step, axis=0)
    ahead[::per_step] = heading_rad[:-1]
    return np.concatenate([filled, xy_m[-1:]]), np.concatenate([ahead, heading_rad[-1:]])


def _as_tracks(opened: OpenTrial, xy_m: Floats, heading_rad: Floats) -> Tracks:
    trial = opened.trial
    n_frames, n_agents = heading_rad.shape
    frame = np.arange(n_frames, dtype=np.int64)
    # A frame's time is a multiple of the step where it is a step: no rounding on top of it.
    per_step = round(trial.dt_s * trial.fps)
    time_s = (frame // per_step) * trial.dt_s + (frame % per_step) / trial.fps
    kind = np.where(np.arange(n_agents) < trial.n_fish, FISH, ROBOT).astype(np.int8)
    return Tracks(
        time_s=np.repeat(time_s, n_agents),
        frame=np.repeat(frame, n_agents),
        agent=np.tile(np.arange(n_agents, dtype=np.int32), n_frames),
        kind=np.tile(kind, n_frames),
        x_m=xy_m[..., 0].ravel(),
        y_m=xy_m[..., 1].ravel(),
        heading_rad=heading_rad.ravel().astype(np.float32),
        confidence=np.ones(n_frames * n_agents, dtype=np.float32),
    )
