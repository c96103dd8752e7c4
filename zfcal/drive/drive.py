"""From poses to wheel speeds: the stage behind ``zfcal drive``."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import sys
from pathlib import Path

from zfcal.artifacts.drive_files import DRIVE, drive_files
from zfcal.artifacts.freshness import hash_inputs, relative_to
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.pose_files import PoseFollower
from zfcal.drive.clock import DriveClock, PoseClock, WallClock
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.events import DriveTell
from zfcal.drive.log import DriveLog
from zfcal.drive.loop import Loop
from zfcal.drive.models import DriveModels
from zfcal.drive.options import VIRTUAL, DriveOptions
from zfcal.drive.plan import check_logs, check_port, tell_plan
from zfcal.errors import InputError
from zfcal.robot.fishbot import FishBot, Watchdog
from zfcal.robot.port import SerialLine
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.events import Note, Result, Tell
from zfcal.stages.making import settled
from zfcal.stages.realtime import ahead_of_others, garbage_left_alone
from zfcal.stages.trial_context import OpenTrial, Task, at_work, open_trial

NICENESS = -10
_SWITCH_S = 0.0005
_OPENING_S = 3.0


def drive(root: Path, options: DriveOptions, tell: DriveTell, *, task: Task | None = None) -> str:
    """Drive a robot by the model of a trial, until the poses end or somebody stops it.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What is asked.
    tell
        Hears of faults, of models, of every file when it is closed, and now and then how it goes.
    task
        Whether to remove what an earlier drive left. A dry run says what would be done.

    Returns
    -------
    str
        Why it ended.

    Raises
    ------
    InputError
        The trial has no robot, the port cannot be opened, logs of another drive are in the
        way, or the recording ended before the drive began: no poses will come.
    ChangedError
        The arena's file has changed twice while it was being read.
    """
    task = task or Task()
    opened, lineage = settled(lambda: _open(root, options), tell)
    if task.dry_run:
        tell_plan(opened, options, tell, task=task)
        return "nothing was opened"
    with at_work(root, "drive", task):
        _make_room(opened, options, tell, task)
        with contextlib.ExitStack() as stack:
            return _drive(opened, options, lineage, tell, stack)


def _open(root: Path, options: DriveOptions) -> tuple[OpenTrial, Lineage]:
    """Return the trial, and where the log comes from: its hashes are of what was read."""
    opened = open_trial(root)
    if opened.trial.n_robots < 1:
        raise InputError(
            f"{opened.trial.config}: n_robots is 0: there is no robot to drive.",
            hint="Set n_robots = 1 in trial.toml, and track the robot with --below.",
        )
    if options.clock not in {"wall", "poses"}:
        raise InputError(f"The clock must be 'wall' or 'poses', got {options.clock!r}.")
    return opened, lineage_of(opened, options)


def lineage_of(opened: OpenTrial, options: DriveOptions) -> Lineage:
    """Return where the log of a drive comes from, but for the models: the log adds them itself."""
    manner = dataclasses.asdict(options.manner)
    if options.model is not None:
        manner["model"] = relative_to(opened.trial.root, options.model)
    return Lineage(
        schema=DRIVE,
        command="drive",
        options={**opened.clock_options, "clock": options.clock, **manner},
        seed=opened.trial.seed,
        inputs=hash_inputs(opened.trial.root, opened.arena_files),
    )


def _make_room(opened: OpenTrial, options: DriveOptions, tell: Tell, task: Task) -> None:
    """Remove logs of an earlier drive if that is asked for; refuse to mix two."""
    known = drive_files(opened.trial.root)
    if task.force:
        for path in known.values():
            path.unlink()
        if known:
            tell(Note(text=f"{len(known)} files of an earlier drive were removed."))
    else:
        check_logs(opened, options)


def _drive(
    opened: OpenTrial,
    options: DriveOptions,
    lineage: Lineage,
    tell: DriveTell,
    stack: contextlib.ExitStack,
) -> str:
    is_live = options.clock == "wall"
    robot, virtual = _robot(opened, options, stack)
    clock: DriveClock = WallClock() if is_live else PoseClock(opened.trial.fps)
    log = DriveLog(opened.trial, lineage, tell, is_patient=is_live)
    watchdog = Watchdog(robot) if is_live else None
    crew = Crew(
        robot=robot,
        clock=clock,
        models=DriveModels(opened, only=options.model),
        log=log,
        tell=tell,
        watchdog=watchdog,
    )
    driver = Driver(opened, options.manner, crew)
    if is_live:
        _hurry(options, tell, stack)
    driver.warm_up()
    if is_live:
        stack.enter_context(garbage_left_alone())
        log.write_behind()
    follower = PoseFollower(opened.trial.root, newest=is_live)
    # The robot's own end comes first on the way out: whatever fails later, it stands.
    stack.callback(lambda: _conclude(driver, log, tell))
    stack.callback(robot.close)
    if watchdog is not None:
        stack.enter_context(watchdog)
    tell(_began(opened, options))
    return Loop(opened, options, driver, crew, follower, virtual, tell).run()


def _began(opened: OpenTrial, options: DriveOptions) -> Note:
    """Return what is told when all is ready."""
    manner = options.manner
    values = {
        "trial": str(opened.trial.root),
        "port": options.port,
        "robot": manner.letter,
        "pattern": manner.pattern,
        "free_running": manner.free_running,
        "clock": options.clock,
    }
    text = f"drive: FishBot {manner.letter} of {opened.trial.root} at {options.port}."
    return Note(text=text, kind="began", values=values)


def _robot(
    opened: OpenTrial, options: DriveOptions, stack: contextlib.ExitStack
) -> tuple[FishBot, VirtualProcess | None]:
    port, virtual = options.port, None
    if port == VIRTUAL:
        rings = json.dumps([ring.tolist() for ring in opened.arena.rings_m])
        x, y = opened.arena.outline.representative_point().coords[0]
        words = ["--robot", options.manner.letter, "--seed", str(opened.trial.seed)]
        words += ["--walls", rings, "--pose", f"{x},{y},0"]
        words += ["--stepped"] if options.clock == "poses" else []
        virtual = stack.enter_context(VirtualProcess(words))
        port = str(virtual.port)
    else:
        check_port(options)
    # On the poses' clock the robot waits for each byte, and silence means nothing.
    line = SerialLine(port, is_lossless=options.clock == "poses")
    robot = FishBot(options.manner.letter, line)
    if not line.wait(_OPENING_S):
        line.close()
        raise InputError(
            f"{port}: the port cannot be opened ({line.problem or 'no answer'}).",
            hint="Check that it exists (rfcomm bind), that no other process uses it, and that "
            "you may open it.",
        )
    return robot, virtual


def _hurry(options: DriveOptions, tell: Tell, stack: contextlib.ExitStack) -> None:
    """Ask for a high priority, for every thread: who holds the interpreter holds up the others."""
    # Other threads write and talk: when a tick is due they let go of the interpreter soon.
    stack.callback(sys.setswitchinterval, sys.getswitchinterval())
    sys.setswitchinterval(_SWITCH_S)
    problem = stack.enter_context(ahead_of_others(NICENESS))
    if problem is not None and options.verbose:
        tell(Note(text=f"No higher priority: {problem.strerror}; other work may delay ticks."))


def _conclude(driver: Driver, log: DriveLog, tell: Tell) -> None:
    """Close the log and say how it went."""
    log.close()
    found = log.latencies()
    result = {
        "targets": driver.n_targets,
        "commands": driver.n_commands,
        "models": driver.models_used,
        "latency": found,
    }
    tell(Result(value=result))
    words = [f"{driver.n_targets} targets, {driver.n_commands} commands"]
    words += [f"{found['steps_missed']} steps missed, {found['ticks_skipped']} ticks skipped"]
    names = {"pose_to_state_s": "pose to state", "tick_to_byte_s": "tick to last byte"}
    for name, says in names.items():
        if name in found:
            median, p95, most = (1e3 * found[name][key] for key in ("median", "p95", "max"))
            words.append(f"{says} {median:.1f} ms (95 %: {p95:.1f}, most: {most:.1f})")
    tell(Note(text="; ".join(words) + "."))
