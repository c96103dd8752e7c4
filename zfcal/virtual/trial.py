"""What a virtual experiment is made of: the truth, the trial that a rig would have, a robot."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol, final

from shapely import get_coordinates

from zfcal.arena import Arena
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.lineage import JSON, Lineage, to_json
from zfcal.artifacts.models import SCHEMA as MODEL
from zfcal.artifacts.models import read_model_for, write_model
from zfcal.artifacts.pose_messages import POSES
from zfcal.artifacts.reading.contents import hash_of
from zfcal.artifacts.validation import read_json
from zfcal.calibrate.task import Settings
from zfcal.errors import InputError
from zfcal.model.effects.genome import check_effects
from zfcal.parameters import Parameters, ZoneParameters, natural
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.events import Tell, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.recording import TRACKS
from zfcal.stages.segments import STEP_S
from zfcal.stages.track.minutes import Minutes, Origins, Revise
from zfcal.stages.track.outcome import measured
from zfcal.stages.trial_context import OpenTrial, Task, open_trial
from zfcal.tracks import FramePoses
from zfcal.trial import FIRST_MODEL, LOOP_NAME
from zfcal.units import default_dt_s
from zfcal.virtual.fish import FishOptions, VirtualFish

FPS = 15.0
_ARENA = "two-rooms"
_N_FISH = 4

_KAPPA_0, _KAPPA_F, _KAPPA_W = 6.3, 20.0, 20.0
_ALPHA = {False: 55.0, True: 20.0}
"""Of zones that do not follow walls, and of those that do (Collignon et al. 2016)."""

_LONGEST_S = 1e6

RobotKind = Literal["calibrated", "fixed", "random"]


LOOP_SETTINGS = Settings(generations=30, champion="likely")
"""Of rounds whose models drive a robot: the best of many scores on 120 s is luck in parts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopOptions:
    """A virtual experiment.

    Parameters
    ----------
    duration_s
        How long it lasts.
    robot
        ``calibrated``: by the newest model; ``fixed``: by the starting model throughout,
        which is that of another laboratory; ``random``: swims anywhere.
    fish
        How the fish differ, drift and react.
    settings
        How much a round of calibration does.
    video
        Whether both cameras' images are drawn and tracked; else the tracks are the truth
        with the tracker's noise.
    seed
        Of the fish, the robot, the images and the rounds.
    fish_model
        The species: what the fish swim by before they differ and drift, effects and all; None
        for natural fish.
    model
        The robot's starting model, effects and all; None for that of another laboratory.
    n_workers
        Threads of the calibration; None for one a core.
    """

    duration_s: float = 600.0
    robot: RobotKind = "calibrated"
    fish: FishOptions = field(default_factory=FishOptions)
    settings: Settings = field(default_factory=lambda: LOOP_SETTINGS)
    video: bool = True
    seed: int = 1
    fish_model: Path | None = None
    model: Path | None = None
    n_workers: int | None = None

    def __post_init__(self) -> None:
        if self.model is not None and self.robot == "random":
            raise InputError(
                f"{self.model}: a random robot swims by no model.",
                hint="Take --swims calibrated or --swims fixed, or leave --model out.",
            )
        if not 1.0 <= self.duration_s < _LONGEST_S:
            raise InputError(
                f"A closed loop needs a duration from 1 s on, got {self.duration_s!r} s.",
                hint="The first window is analysed after two minutes.",
            )


def starting_model(arena: Arena, *, dt_s: float, robot: RobotKind) -> Parameters:
    """Return what the robot swims by before the first round.

    Constants that were published of other fish in another tank (Collignon et al. 2016);
    for a random robot a model that prefers no direction, no zone and nobody.
    """
    base = natural(tuple((z.name, z.follows_walls) for z in arena.zones), dt_s=dt_s)
    change = _aimless if robot == "random" else _older
    follows = {zone.name: zone.follows_walls for zone in arena.zones}
    return dataclasses.replace(
        base, zones=tuple(change(zone, follows[zone.name]) for zone in base.zones)
    )


def _older(zone: ZoneParameters, follows_walls: bool) -> ZoneParameters:  # noqa: FBT001
    return dataclasses.replace(
        zone,
        kappa_0=_KAPPA_0,
        kappa_f=_KAPPA_F,
        kappa_w=_KAPPA_W,
        alpha=_ALPHA[follows_walls],
        gamma=dict.fromkeys(zone.gamma, 1.0),
    )


def _aimless(zone: ZoneParameters, follows_walls: bool) -> ZoneParameters:  # noqa: ARG001, FBT001
    flat = dict.fromkeys(zone.gamma, 1.0)
    return dataclasses.replace(zone, kappa_0=0.0, kappa_w=0.0, alpha=0.0, gamma=flat)


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """A virtual experiment and its places.

    Parameters
    ----------
    tank
        The truth.
    trial
        What a rig would have of it.
    options
        What happens.
    """

    tank: OpenTrial
    trial: OpenTrial
    options: LoopOptions

    @property
    def root(self) -> Path:
        """The trial's directory."""
        return self.trial.trial.root


def prepare(folder: Path, options: LoopOptions, tell: Tell, task: Task) -> Experiment:
    """Return an experiment whose trials are made where they are missing."""
    source = f"zfcal demo --closed-loop: virtual fish, a {options.robot} robot"
    new = NewTrial(
        n_fish=_N_FISH, n_robots=1, fps=FPS, arena=_ARENA, seed=options.seed, source=source
    )
    arena, dt_s = load_arena(_ARENA, Path()), default_dt_s(FPS)
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    species = _asked(options.fish_model, arena, dt_s) or natural(zones, dt_s=dt_s)
    start = _asked(options.model, arena, dt_s)
    start = start or starting_model(arena, dt_s=dt_s, robot=options.robot)
    tank, rig = (
        _begun(folder / name, new, model, tell, task)
        for name, model in (("tank", species), ("trial", start))
    )
    return Experiment(tank=tank, trial=rig, options=options)


def _begun(root: Path, new: NewTrial, model: Parameters, tell: Tell, task: Task) -> OpenTrial:
    """Return a trial that begins with a model; one that begins with another is not touched.

    Raises
    ------
    InputError
        There is one with another model, and it is not forced.
    """
    if task.force:
        (root / FIRST_MODEL).unlink(missing_ok=True)
    trial = create_trial(root, new, tell, task=task, model=model)
    opened, path = open_trial(trial.root), trial.root / trial.model
    if read_model_for(path, opened.arena, dt_s=trial.dt_s) != model:
        raise InputError(
            f"{path}: is another model than this experiment begins with.",
            hint="Take another directory, or begin again with --force; the robot begins with "
            "--model, the fish with --fish-model.",
        )
    return opened


def _asked(path: Path | None, arena: Arena, dt_s: float) -> Parameters | None:
    if path is None:
        return None
    model = read_model_for(path, arena, dt_s=dt_s)
    check_effects(model, of=path)
    return model


def _lineage_of_loop(schema: str, options: LoopOptions) -> Lineage:
    """Return where the files of a virtual experiment come from."""
    said: dict[str, JSON] = {
        "robot": options.robot,
        "duration_s": options.duration_s,
        "video": options.video,
        **{f"fish_{key}": value for key, value in dataclasses.asdict(options.fish).items()},
        "generations": options.settings.generations,
        "population": options.settings.population,
        "steps": options.settings.steps,
        "champion": options.settings.champion,
    }
    models = {"fish_model": options.fish_model, "model": options.model}
    said |= {name: None if path is None else hash_of(path) for name, path in models.items()}
    return Lineage(schema=schema, command="demo", options=said, seed=options.seed)


def is_whole(experiment: Experiment) -> bool:
    """Return whether this very experiment has ended here.

    Raises
    ------
    InputError
        Another one has, which is not to be lost.
    DamagedError
        What says so is damaged.
    """
    place = experiment.root / LOOP_NAME
    if not place.is_file():
        return False
    said = read_json(place).get("options")
    asked = _lineage_of_loop(LOOP_NAME, experiment.options).options
    there: dict[str, JSON] = said if isinstance(said, dict) else {}
    other = [name for name, value in asked.items() if there.get(name) != value]
    if other:
        name = other[0]
        raise InputError(
            f"{experiment.root}: holds another experiment: its {name} is "
            f"{there.get(name, 'not known')}, the command gives {asked[name]}.",
            hint="Take another directory, or begin again with --force.",
        )
    return True


def keep(experiment: Experiment) -> None:
    """Write down that the experiment has ended."""
    text = to_json(_lineage_of_loop(LOOP_NAME, experiment.options).as_dict())
    write_text_whole(experiment.root / LOOP_NAME, text + "\n")


_MADE = ("poses", "tracks", "stats", "scores", "drive")


def clear(experiment: Experiment) -> None:
    """Remove what an earlier run left: a robot must not be driven by models of its future."""
    (experiment.root / LOOP_NAME).unlink(missing_ok=True)
    for opened in (experiment.tank, experiment.trial):
        root = opened.trial.root
        files = [path for name in _MADE for path in (root / name).glob("*")]
        files += [path for path in (root / "models").glob("*") if path.stem != "000000"]
        for path in files:
            path.unlink()


@contextmanager
def robot_of(experiment: Experiment, *, stepped: bool) -> Iterator[VirtualProcess]:
    """Start a robot in the tank; a stepped one moves when it is told the time."""
    outline, seed = experiment.trial.arena.outline, experiment.options.seed
    rings = [outline.exterior, *outline.interiors]
    walls = json.dumps([get_coordinates(ring).round(6).tolist() for ring in rings])
    place = outline.representative_point()
    words = ["--walls", walls, "--seed", str(seed), "--pose", f"{place.x},{place.y},0"]
    with VirtualProcess([*words, *(["--stepped"] if stepped else [])]) as robot:
        yield robot


class Eyes(Protocol):
    """Makes poses of a frame, as a tracker does."""

    @property
    def next_agent(self) -> int:
        """The first id that is free."""
        ...

    def see(self, truth: FramePoses) -> FramePoses:
        """Return what is seen of a frame."""
        ...

    def revise(self, frames: list[FramePoses]) -> list[FramePoses]:
        """Return a minute's frames as they are known at its end."""
        ...

    def take_bad(self) -> tuple[str, ...]:
        """Return what was wrong with it."""
        ...


@final
class Noisy:
    """Tracks with the tracker's noise, in place of cameras.

    Parameters
    ----------
    fish
        Whose options say how much.
    """

    next_agent = _N_FISH + 1

    def __init__(self, fish: VirtualFish) -> None:
        self._fish = fish

    def see(self, truth: FramePoses) -> FramePoses:
        """Return a frame with noise, and without those that are lost."""
        return self._fish.tracked(truth)

    def revise(self, frames: list[FramePoses]) -> list[FramePoses]:
        """Return them as they are: ids are those of the truth."""
        return frames

    def take_bad(self) -> tuple[str, ...]:
        """Return nothing: no frame is bad."""
        return ()


@final
class Files:
    """The fish of an experiment, and the files of the truth and of what is seen of it.

    Parameters
    ----------
    experiment
        What happens, and where.
    fish
        Whose parameters are written down.
    eyes
        Who tracks; None where another process does, which writes the trial's files.
    """

    def __init__(self, experiment: Experiment, fish: VirtualFish, eyes: Eyes | None) -> None:
        self._experiment, self._fish, self._eyes = experiment, fish, eyes
        self._exact = self._minutes(experiment.tank)
        self._tracked = None if eyes is None else self._minutes(experiment.trial, eyes.revise)

    def _minutes(self, opened: OpenTrial, revise: Revise = list) -> Minutes:
        tracks = _lineage_of_loop(TRACKS, self._experiment.options)
        origins = Origins(
            tracks=tracks, poses=dataclasses.replace(tracks, schema=POSES), is_live=True
        )
        return Minutes(
            opened,
            origins,
            lambda seen: measured(opened.trial, seen),
            say_nothing,
            task=Task(force=True),
            revise=revise,
        )

    def add(self, truth: FramePoses) -> FramePoses:
        """Write a frame, and return what the tracker makes of it; nothing for one elsewhere."""
        if truth.frame and truth.frame % round(STEP_S * FPS) == 0:
            path = self._experiment.tank.trial.path("models", round(truth.time_s), ".toml")
            lineage = _lineage_of_loop(MODEL, self._experiment.options)
            write_model(path, self._fish.truth.parameters, lineage)
        self._exact.add(truth, next_agent=_N_FISH + 1)
        if self._eyes is None or self._tracked is None:
            return truth
        seen = self._eyes.see(truth)
        self._tracked.add(seen, next_agent=self._eyes.next_agent, bad=self._eyes.take_bad())
        return seen

    def finish(self) -> None:
        """Close the files."""
        for minutes in (self._exact, self._tracked):
            if minutes is not None:
                minutes.finish(self._experiment.options.duration_s)


def fish_of(experiment: Experiment) -> VirtualFish:
    """Return the fish of an experiment: the tank's model, but for what the options say."""
    tank = experiment.tank
    path = tank.trial.root / tank.trial.model
    species = read_model_for(path, tank.arena, dt_s=tank.trial.dt_s)
    return VirtualFish(species, tank, experiment.options.fish)
