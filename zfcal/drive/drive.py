"""From poses to wheel speeds: the stage behind ``zfcal drive``."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from zfcal.artifacts.drive_files import DRIVE, drive_files
from zfcal.artifacts.freshness import hash_inputs, relative_to
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.pose_files import PoseFollower
from zfcal.drive.clock import DriveClock, PoseClock, WallClock
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.events import DriveTell
from zfcal.drive.log import DriveLog
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner
from zfcal.errors import DamagedError, InputError
from zfcal.robot.fishbot import FishBot, Watchdog
from zfcal.robot.plausible import is_frame
from zfcal.robot.port import SerialLine, is_pseudo_terminal
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.events import LeftOut, Note, Result, Tell
from zfcal.stages.realtime import ahead_of_others, garbage_left_alone
from zfcal.stages.stage import settled
from zfcal.stages.trial_context import OpenTrial, Task, at_work, open_trial
from zfcal.tracks import FramePoses
from zfcal.units import SEGMENT_S

_VIRTUAL = "virtual"
"""The port behind which a virtual robot is started."""

NICENESS = -10
_LOOK_S = 0.003
_FOLDER_S = 0.02
"""How often the folder is searched for the next minute; a file that grows is seen at once."""

_STATUS_S = 0.5
_SWITCH_S = 0.0005
_OPENING_S = 3.0
_ANSWER_S = 2.0
_WAIT_S = 3.0
"""Until it is said that no poses have come; a tracker that is started by the same hand is there."""

_END_S = 2.0
"""On the poses' clock: when so long after the last file's end none follows, that was it."""

_CUT_S = 60.0
"""The same for a last file that was cut short, or whose writer is busy compiling."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveOptions:
    """What is asked of the driver.

    Parameters
    ----------
    port
        A serial port, or ``virtual``.
    manner
        How to drive.
    clock
        ``wall`` or ``poses``.
    duration_s
        Seconds of the trial after which to end; None for no end.
    verbose
        Whether to say what only bears on how quick it is.
    model
        The model file that drives throughout; None for the newest numbered one.
    """

    port: str
    manner: Manner = field(default_factory=Manner)
    clock: str = "wall"
    duration_s: float | None = None
    verbose: bool = False
    model: Path | None = None


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
        Whether to remove what an earlier drive left.

    Returns
    -------
    str
        Why it ended.

    Raises
    ------
    InputError
        The trial has no robot, the port cannot be opened, or logs of another drive are in
        the way.
    ChangedError
        The arena's file has changed twice while it was being read.
    """
    task = task or Task()
    opened, lineage = settled(lambda: _open(root, options), tell)
    if opened.trial.n_robots < 1:
        raise InputError(
            f"{opened.trial.config}: n_robots is 0: there is nobody to drive.",
            hint="Set n_robots = 1 in trial.toml, and track the robot with --below.",
        )
    if options.clock not in {"wall", "poses"}:
        raise InputError(f"The clock must be 'wall' or 'poses', got {options.clock!r}.")
    with at_work(root, "drive", task):
        _make_room(opened, options, tell, task)
        with contextlib.ExitStack() as stack:
            return _drive(opened, options, lineage, tell, stack)


def _open(root: Path, options: DriveOptions) -> tuple[OpenTrial, Lineage]:
    """Return the trial, and where the log comes from: its hashes are of what was read."""
    opened = open_trial(root)
    return opened, lineage_of(opened, options)


def lineage_of(opened: OpenTrial, options: DriveOptions) -> Lineage:
    """Return where the log of a drive comes from; which models drove, it says itself."""
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
    elif known and options.clock == "poses":
        raise InputError(
            f"{opened.trial.root / 'drive'}: holds the log of an earlier drive.",
            hint="Check it with --replay, or drive anew with --force.",
        )


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
    return _Loop(opened, options, driver, crew, follower, virtual, tell).run()


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
    if port == _VIRTUAL:
        rings = json.dumps([ring.tolist() for ring in opened.arena.rings_m])
        x, y = opened.arena.outline.representative_point().coords[0]
        words = ["--robot", options.manner.letter, "--seed", str(opened.trial.seed)]
        words += ["--walls", rings, "--pose", f"{x},{y},0"]
        words += ["--stepped"] if options.clock == "poses" else []
        virtual = stack.enter_context(VirtualProcess(words))
        port = str(virtual.port)
    elif options.clock == "poses" and not is_pseudo_terminal(port):
        raise InputError(
            f"{port}: --clock poses is for a virtual robot that waits for the driver.",
            hint="A robot in the tank does not wait: drive it by --clock wall, the default.",
        )
    # On the poses' clock the robot waits for each byte, and silence means nothing.
    line = SerialLine(port, is_lossless=options.clock == "poses")
    robot = FishBot(options.manner.letter, line)
    if not line.wait(_OPENING_S):
        line.close()
        raise InputError(
            f"{port}: the port cannot be opened ({line.problem or 'no answer'}).",
            hint="Check that it exists (rfcomm bind), that nobody else uses it, and your rights.",
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


class _Loop:
    """Waits for frames and for ticks, whichever comes first."""

    def __init__(  # noqa: PLR0913, PLR0917 - everything that a run consists of
        self,
        opened: OpenTrial,
        options: DriveOptions,
        driver: Driver,
        crew: Crew,
        follower: PoseFollower,
        virtual: VirtualProcess | None,
        tell: DriveTell,
    ) -> None:
        self._opened, self._options = opened, options
        self._driver, self._crew = driver, crew
        self._follower, self._virtual = follower, virtual
        # A wait by the monotonic clock, as all that is timed here.
        self._nothing = threading.Event()
        self._size = (-1, -1)
        self._searched_s = 0.0
        self._looked_s = self._before_s = time.monotonic()
        self._first_s: float | None = None
        self._tell, self._told_s = tell, 0.0
        self._quiet_since_s = time.monotonic()
        self._asked_s = time.monotonic()
        self._is_waited_for = False
        self._is_unsound = False

    def run(self) -> str:
        """Go on until it is over, and return why it is."""
        for batch in self._batches():
            self._driver.listen()
            self._greet()
            self._wait()
            if batch and self._first_s is None:
                self._check_logs(batch[-1].time_s)
            # On the poses' clock each frame has its own ticks; a live one has the newest frame's.
            for frames in [batch] if self._crew.clock.is_live else [[f] for f in batch]:
                age_s = self._age_s() if frames else None
                since_s = self._before_s if self._crew.clock.is_live else None
                self._driver.take(frames, age_s=age_s, since_s=since_s)
                self._driver.tick()
                self._crew.log.flush()
                self._step_virtual()
                if frames and self._is_over(frames[-1].time_s):
                    return "the duration is over"
            self._show()
        return "the poses have ended"

    def _show(self) -> None:
        """Tell how it goes, now and then."""
        if time.monotonic() - self._told_s >= _STATUS_S:
            self._tell(self._driver.status(self._options.duration_s))
            self._told_s = time.monotonic()

    def _batches(self) -> Iterator[list[FramePoses]]:
        """Yield what has come, again and again; often nothing."""
        while True:
            frames = self._poll()
            if frames:
                self._quiet_since_s = time.monotonic()
            elif self._is_finished():
                return
            yield frames
            if not frames:
                self._nothing.wait(min(_LOOK_S, self._crew.clock.rest_s()))

    def _poll(self) -> list[FramePoses]:
        """Read on where the file has grown; the folder is searched now and then."""
        now_s = time.monotonic()
        self._before_s, self._looked_s = self._looked_s, now_s
        size = self._stat()
        if size == self._size and now_s - self._searched_s < _FOLDER_S:
            return []
        self._size, self._searched_s = size, now_s
        frames: list[FramePoses] = []
        problems: list[DamagedError] = []
        try:
            frames = self._sound(self._follower.poll())
        except DamagedError as error:
            problems.append(error)
        path = self._follower.path or self._opened.trial.root / "poses"
        for problem in problems + self._follower.take_problems():
            self._crew.tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))
        return frames

    def _sound(self, frames: list[FramePoses]) -> list[FramePoses]:
        """Return the frames that can be of a trial; of the others the first is told."""
        fps = self._opened.trial.fps
        found = [poses for poses in frames if is_frame(poses.time_s, poses.frame, fps)]
        if len(found) < len(frames) and not self._is_unsound:
            self._is_unsound = True
            path = self._follower.path or self._opened.trial.root / "poses"
            bad = next(p for p in frames if not is_frame(p.time_s, p.frame, fps))
            problem = (
                f"{path}: frame {bad.frame} is said to be of {bad.time_s} s, at {fps:g} frames/s."
            )
            hint = "Frames and seconds count from the start of the trial; such are left out."
            self._crew.tell(LeftOut(path=path, problem=problem, hint=hint))
        return found

    def _stat(self) -> tuple[int, int]:
        try:
            found = None if self._follower.path is None else self._follower.path.stat()
        except OSError:
            found = None
        return (-1, -1) if found is None else (found.st_ino, found.st_size)

    def _age_s(self) -> float | None:
        """Return how long ago the file of poses was written, by the same clock; None if unknown."""
        if not self._crew.clock.is_live or self._follower.path is None:
            return None
        with contextlib.suppress(OSError):
            age_s = time.time() - self._follower.path.stat().st_mtime
            # A clock that was set, or another computer's, says nothing.
            return max(0.0, age_s) if -0.1 < age_s < 5.0 else None
        return None

    def _step_virtual(self) -> None:
        if self._virtual is not None and not self._crew.clock.is_live:
            to_s = self._crew.clock.now_s()
            self._virtual.control.ask("advance", to_s=to_s, received=self._crew.robot.n_sent)

    def _is_over(self, time_s: float) -> bool:
        duration_s = self._options.duration_s
        self._first_s = time_s if self._first_s is None else self._first_s
        if duration_s is None:
            return False
        return time_s - self._first_s >= duration_s - 1e-6

    def _check_logs(self, now_s: float) -> None:
        """Refuse to write before what an earlier drive has written."""
        later = [s for s in drive_files(self._opened.trial.root) if s > now_s + SEGMENT_S]
        if later:
            raise InputError(
                f"{self._opened.trial.path('drive', max(later), '.mcap')}: an earlier drive got "
                f"to {max(later)} s, the poses are at {now_s:.0f} s.",
                hint="Remove what it left with --force, or drive another trial.",
            )

    def _is_finished(self) -> bool:
        if self._crew.clock.is_live:
            return False
        quiet_s = time.monotonic() - self._quiet_since_s
        if self._follower.is_closed:
            return quiet_s > _END_S
        return quiet_s > _CUT_S

    def _greet(self) -> None:
        """Say once if nobody answers by the robot's name."""
        if self._asked_s and time.monotonic() - self._asked_s > _ANSWER_S:
            if not self._driver.is_answered:
                letter = self._options.manner.letter
                says = f"No FishBot {letter} answers; what is sent may be heard by nobody."
                self._crew.tell(Note(text=says, warning=True))
            self._asked_s = 0.0

    def _wait(self) -> None:
        """Say once that no poses have come: a duration counts from the first of them."""
        if self._is_waited_for or self._first_s is not None:
            return
        if time.monotonic() - self._quiet_since_s > _WAIT_S:
            folder = self._opened.trial.root / "poses"
            says = f"{folder}: no poses yet; waits until zfcal track writes them."
            self._crew.tell(Note(text=says, warning=True))
            self._is_waited_for = True
