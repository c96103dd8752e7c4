"""A virtual experiment in lock-step: fish, a robot, a tracker, and the loop around them.

Time is that of the frames. A frame is what the fish and the robot make of it; the drive
hears of it as of any frame, and says to the robot's serial port what it would say on a
rig; the robot moves on to the next frame. Rounds of analysis and calibration run when a
rig would have ended them: a process beside the loop begins with a window when it has
ended, and the loop waits for it where its model is due. All is fed by files, so that the
trial can be done over.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, final

import numpy as np

from zfcal.drive.clock import PoseClock
from zfcal.drive.drive import lineage_of
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.log import DriveLog
from zfcal.drive.models import DriveModels
from zfcal.drive.options import DriveOptions
from zfcal.errors import InputError
from zfcal.robot.fishbot import FishBot
from zfcal.robot.port import SerialLine
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.events import Progress, Tell
from zfcal.stages.segments import STEP_S
from zfcal.stages.trial_context import OpenTrial, Task
from zfcal.tracks import FramePoses
from zfcal.virtual.eyes import VirtualEyes
from zfcal.virtual.fish import VirtualFish
from zfcal.virtual.rounds import RoundsBeside, Windows, do_rounds, rounds_beside
from zfcal.virtual.trial import (
    FPS,
    Experiment,
    Eyes,
    Files,
    LoopOptions,
    Noisy,
    clear,
    fish_of,
    is_whole,
    keep,
    prepare,
    robot_of,
)

_ROUND_S = 55.0
"""After so many seconds a rig has analysed and calibrated a window that has ended."""

_TOLD_EVERY = 150
_OPENING_S = 5.0


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
    experiment = prepare(folder, options, tell, task)
    if not task.force and is_whole(experiment):
        do_rounds(Windows.of(experiment), tell)
        return experiment.root
    clear(experiment)
    with rounds_beside(experiment, tell) as rounds:
        with robot_of(experiment, stepped=True) as robot:
            driver = _LockstepDriver(experiment.trial, robot.port, tell, after_s=_ROUND_S)
            try:
                _run(_Parts(experiment, robot, driver, rounds), tell)
            finally:
                driver.close()
        keep(experiment)
        rounds.finish()
    return experiment.root


@final
class _LockstepDriver:
    """Does at each frame what ``zfcal drive --clock poses`` does, and logs it likewise.

    It is handed each frame in turn: no waiting, no watchdog, the poses' clock.

    Parameters
    ----------
    opened
        The trial, whose newest model drives.
    port
        The robot's serial port.
    tell
        Hears of models and faults.
    after_s
        So many seconds after its window has ended a model drives.

    Raises
    ------
    InputError
        The port cannot be opened.
    """

    def __init__(self, opened: OpenTrial, port: Path, tell: Tell, *, after_s: float) -> None:
        options = DriveOptions(port=str(port), clock="poses")
        line = SerialLine(str(port), is_lossless=True)
        if not line.wait(_OPENING_S):
            line.close()
            raise InputError(f"{port}: the port cannot be opened ({line.problem or 'no answer'}).")
        self._robot = FishBot(options.manner.letter, line)
        self._log = DriveLog(opened.trial, lineage_of(opened, options), tell)
        crew = Crew(
            robot=self._robot,
            clock=PoseClock(opened.trial.fps),
            models=DriveModels(opened, after_s=after_s),
            log=self._log,
            tell=tell,
        )
        self._driver = Driver(opened, options.manner, crew)
        self._driver.warm_up()

    @property
    def n_sent(self) -> int:
        """Events that went to the robot until now."""
        return self._robot.n_sent

    def take(self, poses: FramePoses) -> None:
        """Do all that is due at a frame."""
        self._driver.listen()
        self._driver.take([poses])
        self._driver.tick()
        self._log.flush()

    def close(self) -> None:
        """Stop the robot and close the log."""
        self._robot.close()
        self._log.close()


class _Parts(NamedTuple):
    """What makes up a loop."""

    experiment: Experiment
    robot: VirtualProcess
    driver: _LockstepDriver
    rounds: RoundsBeside


def _run(parts: _Parts, tell: Tell) -> None:
    experiment, robot, driver, rounds = parts
    options, fish = experiment.options, fish_of(experiment)
    with _eyes_of(experiment, fish) as eyes:
        files = Files(experiment, fish, eyes)
        n_frames, ended_s, due_s = (
            round(options.duration_s * FPS),
            2 * STEP_S,
            2 * STEP_S + _ROUND_S,
        )
        for number in range(n_frames):
            at = robot.control.ask("advance", to_s=number / FPS, received=driver.n_sent)
            where = np.array([at["x_m"], at["y_m"], at["heading_rad"]])
            seen = files.add(fish.next_frame(where))
            if seen.time_s >= ended_s:
                rounds.begin()
                ended_s += STEP_S
            if seen.time_s >= due_s:
                rounds.wait()
                due_s += STEP_S
            driver.take(seen)
            if number % _TOLD_EVERY == 0:
                tell(Progress(stage="closed loop", done=number, total=n_frames))
        files.finish()


@contextlib.contextmanager
def _eyes_of(experiment: Experiment, fish: VirtualFish) -> Iterator[Eyes]:
    """Give who tracks: cameras and a tracker, or the truth with noise."""
    if not experiment.options.video:
        yield Noisy(fish)
        return
    eyes = VirtualEyes(experiment.trial)
    try:
        yield eyes
    finally:
        eyes.close()
