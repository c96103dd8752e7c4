"""A virtual experiment in lock-step: fish, a robot, a tracker, and the loop around them.

Time is that of the frames. A frame is what the fish and the robot make of it; the drive
hears of it as of any frame, and says to the robot's serial port what it would say on a
rig; the robot moves on to the next frame. Rounds of analysis and calibration run when a
rig would have ended them. All is fed by files, so that the trial can be done over.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from shapely import get_coordinates

from zfcal.arena import Arena
from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.lineage import JSON, Lineage, to_json
from zfcal.artifacts.models import write_model
from zfcal.calibrate.task import Settings
from zfcal.errors import InputError
from zfcal.online.analyse import AnalyseOptions, analyse
from zfcal.online.calibrate import CalibrateOptions, calibrate
from zfcal.online.events import Progress, Tell, say_nothing
from zfcal.online.lockstep import LockstepDriver
from zfcal.online.minutes import Minutes, Origins
from zfcal.online.opening import OpenTrial, Task, open_trial
from zfcal.online.outcome import measured
from zfcal.online.recording import TRACKS
from zfcal.online.segments import STEP_S, segment_starts
from zfcal.online.setup import NewTrial, create_trial
from zfcal.online.virtual_eyes import VirtualEyes
from zfcal.online.virtual_fish import FishOptions, VirtualFish
from zfcal.parameters import Parameters, ZoneParameters, natural
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.tracks import FramePoses

FPS = 15.0
ARENA = "two-rooms"
N_FISH = 4

ROUND_S = 55.0
"""After so many seconds a rig has analysed and calibrated a window that has ended."""

_KAPPA_0, _KAPPA_F, _KAPPA_W = 6.3, 20.0, 20.0
_ALPHA = {False: 55.0, True: 20.0}
"""Of zones that do not follow walls, and of those that do (Collignon et al. 2016)."""

_LONGEST_S = 1e6

RobotKind = Literal["calibrated", "fixed", "random"]


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
    n_workers
        Threads of the calibration; None for one a core.
    """

    duration_s: float = 600.0
    robot: RobotKind = "calibrated"
    fish: FishOptions = field(default_factory=FishOptions)
    settings: Settings = field(default_factory=lambda: Settings(generations=30))
    video: bool = True
    seed: int = 1
    n_workers: int | None = None

    def __post_init__(self) -> None:
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


def closed_loop(
    folder: Path,
    options: LoopOptions,
    tell: Tell,
    *,
    task: Task | None = None,
) -> Path:
    """Run a virtual experiment.

    Parameters
    ----------
    folder
        Gets ``tank/``, the truth: a trial with exact tracks, and the true parameters of
        each minute in ``models/``; and ``trial/``, what a rig would have recorded and made.
    options
        What happens.
    tell
        Hears of every file.
    task
        A forced one begins anew; one that is whole is done over only by the stages.

    Returns
    -------
    Path
        The trial.
    """
    task = task or Task()
    tank, trial = _create(folder, options, tell, task)
    if task.force or not _is_whole(trial, options):
        _clear(tank, trial)
        with _robot(trial, options) as robot:
            driver = LockstepDriver(trial, robot.port, tell)
            try:
                _run(_Loop(tank, trial, options, tell), robot, driver)
            finally:
                driver.close()
        _keep(trial, options)
    _rounds(trial, options, tell)
    return trial.trial.root


def _create(
    folder: Path, options: LoopOptions, tell: Tell, task: Task
) -> tuple[OpenTrial, OpenTrial]:
    source = f"zfcal demo --closed-loop: virtual fish, a {options.robot} robot"
    new = NewTrial(
        n_fish=N_FISH, n_robots=1, fps=FPS, arena=ARENA, seed=options.seed, source=source
    )
    made = create_trial(folder / "tank", new, tell, task=task)
    arena = open_trial(made.root).arena
    start = starting_model(arena, dt_s=made.dt_s, robot=options.robot)
    trial = create_trial(folder / "trial", new, tell, task=task, model=start)
    return open_trial(made.root), open_trial(trial.root)


def _lineage(schema: str, options: LoopOptions) -> Lineage:
    said: dict[str, JSON] = {
        "robot": options.robot,
        "duration_s": options.duration_s,
        "video": options.video,
        **{f"fish_{key}": value for key, value in dataclasses.asdict(options.fish).items()},
        "generations": options.settings.generations,
        "population": options.settings.population,
        "steps": options.settings.steps,
    }
    return Lineage(schema=schema, command="demo", options=said, seed=options.seed)


_LAST = "closed-loop.json"
"""In the trial: what was asked for, written when the loop has ended."""


def _is_whole(trial: OpenTrial, options: LoopOptions) -> bool:
    place = trial.trial.root / _LAST
    if not place.is_file():
        return False
    found = json.loads(place.read_text(encoding="utf-8"))
    return bool(found == _lineage(_LAST, options).as_dict())


def _keep(trial: OpenTrial, options: LoopOptions) -> None:
    text = to_json(_lineage(_LAST, options).as_dict())
    write_text_whole(trial.trial.root / _LAST, text + "\n")


_MADE = ("poses", "tracks", "stats", "scores", "drive")


def _clear(tank: OpenTrial, trial: OpenTrial) -> None:
    """Remove what an earlier run left: a robot must not be driven by models of its future."""
    (trial.trial.root / _LAST).unlink(missing_ok=True)
    for opened in (tank, trial):
        root = opened.trial.root
        files = [path for name in _MADE for path in (root / name).glob("*")]
        files += [path for path in (root / "models").glob("*") if path.stem != "000000"]
        for path in files:
            path.unlink()


@contextmanager
def _robot(trial: OpenTrial, options: LoopOptions) -> Iterator[VirtualProcess]:
    """Start a robot that moves when it is told the time, in the middle of the first zone."""
    outline = trial.arena.outline
    rings = [outline.exterior, *outline.interiors]
    walls = json.dumps([get_coordinates(ring).round(6).tolist() for ring in rings])
    place = outline.representative_point()
    words = ["--stepped", "--walls", walls, "--seed", str(options.seed)]
    with VirtualProcess([*words, "--pose", f"{place.x},{place.y},0"]) as robot:
        yield robot


class _Noisy:
    """Tracks with the tracker's noise, in place of cameras."""

    next_agent = N_FISH + 1

    def __init__(self, fish: VirtualFish) -> None:
        self.see = fish.tracked

    def take_bad(self) -> tuple[str, ...]:
        return ()


class _Loop:
    """The files of an experiment, and its rounds."""

    def __init__(self, tank: OpenTrial, trial: OpenTrial, options: LoopOptions, tell: Tell) -> None:
        base = natural(
            tuple((z.name, z.follows_walls) for z in tank.arena.zones), dt_s=tank.trial.dt_s
        )
        self.fish = VirtualFish(base, tank, options.fish)
        self.n_frames = round(options.duration_s * FPS)
        self.tell = tell
        self._tank, self._trial, self._options = tank, trial, options
        self._eyes = VirtualEyes(trial) if options.video else _Noisy(self.fish)
        self._exact, self._tracked = self._minutes(tank), self._minutes(trial)
        self._due_s = 2 * STEP_S + ROUND_S

    def _minutes(self, opened: OpenTrial) -> Minutes:
        tracks = _lineage(TRACKS, self._options)
        origins = Origins(
            tracks=tracks, poses=dataclasses.replace(tracks, schema="zfcal.poses/1"), is_live=True
        )
        return Minutes(
            opened,
            origins,
            lambda seen: measured(opened.trial, seen),
            say_nothing,
            task=Task(force=True),
        )

    def add(self, truth: FramePoses) -> FramePoses:
        """Write a frame, and return what the tracker makes of it."""
        if truth.frame % round(STEP_S * FPS) == 0:
            path = self._tank.trial.path("models", round(truth.time_s), ".toml")
            if truth.frame:
                write_model(
                    path, self.fish.truth.parameters, _lineage("zfcal.model/1", self._options)
                )
        seen = self._eyes.see(truth)
        self._exact.add(truth, next_agent=N_FISH + 1)
        self._tracked.add(seen, next_agent=self._eyes.next_agent, bad=self._eyes.take_bad())
        return seen

    def make_rounds(self, time_s: float) -> None:
        """Analyse and calibrate what a rig would have done by now."""
        if time_s >= self._due_s and self._options.robot == "calibrated":
            _rounds(self._trial, self._options, self.tell)
            self._due_s += STEP_S

    def finish(self) -> None:
        """Close the files."""
        for minutes in (self._exact, self._tracked):
            minutes.finish(self._options.duration_s)


def _run(loop: _Loop, robot: VirtualProcess, driver: LockstepDriver) -> None:
    for number in range(loop.n_frames):
        at = robot.control.ask("advance", to_s=number / FPS, received=driver.n_sent)
        where = np.array([at["x_m"], at["y_m"], at["heading_rad"]])
        seen = loop.add(loop.fish.next_frame(where))
        loop.make_rounds(seen.time_s)
        driver.take(seen)
        if number % 150 == 0:
            loop.tell(Progress(stage="closed loop", done=number, total=loop.n_frames))
    loop.finish()


def _rounds(trial: OpenTrial, options: LoopOptions, tell: Tell) -> None:
    """Analyse all windows that have ended; calibrate them, unless the robot does without."""
    root = trial.trial.root
    if not segment_starts(root):
        return
    analyse(root, AnalyseOptions(), tell)
    if options.robot == "calibrated":
        rounds = CalibrateOptions(settings=options.settings, n_workers=options.n_workers)
        calibrate(root, rounds, tell)
