"""A virtual experiment in lock-step: fish, a robot, a tracker, and the loop around them.

Time is that of the frames. A frame is what the fish and the robot make of it; the drive
hears of it as of any frame, and says to the robot's serial port what it would say on a
rig; the robot moves on to the next frame. Rounds of analysis and calibration run when a
rig would have ended them. All is fed by files, so that the trial can be done over.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from zfcal.online.analyse import AnalyseOptions, analyse
from zfcal.online.calibrate import CalibrateOptions, calibrate
from zfcal.online.events import Progress, Tell
from zfcal.online.lockstep import LockstepDriver
from zfcal.online.opening import Task
from zfcal.online.segments import STEP_S, segment_starts
from zfcal.online.virtual_eyes import VirtualEyes
from zfcal.online.virtual_trial import (
    FPS,
    Experiment,
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
from zfcal.robot.virtual_process import VirtualProcess

ROUND_S = 55.0
"""After so many seconds a rig has analysed and calibrated a window that has ended."""

_TOLD_EVERY = 150


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
    if task.force or not is_whole(experiment):
        clear(experiment)
        with robot_of(experiment, stepped=True) as robot:
            driver = LockstepDriver(experiment.trial, robot.port, tell)
            try:
                _run(experiment, robot, driver, tell)
            finally:
                driver.close()
        keep(experiment)
    _rounds(experiment, tell)
    return experiment.root


def _run(experiment: Experiment, robot: VirtualProcess, driver: LockstepDriver, tell: Tell) -> None:
    options, fish = experiment.options, fish_of(experiment)
    eyes = VirtualEyes(experiment.trial) if options.video else Noisy(fish)
    files = Files(experiment, fish, eyes)
    n_frames, due_s = round(options.duration_s * FPS), 2 * STEP_S + ROUND_S
    for number in range(n_frames):
        at = robot.control.ask("advance", to_s=number / FPS, received=driver.n_sent)
        where = np.array([at["x_m"], at["y_m"], at["heading_rad"]])
        seen = files.add(fish.next_frame(where))
        if seen.time_s >= due_s and options.robot == "calibrated":
            _rounds(experiment, tell)
            due_s += STEP_S
        driver.take(seen)
        if number % _TOLD_EVERY == 0:
            tell(Progress(stage="closed loop", done=number, total=n_frames))
    files.finish()


def _rounds(experiment: Experiment, tell: Tell) -> None:
    """Analyse all windows that have ended; calibrate them, unless the robot does without."""
    root, options = experiment.root, experiment.options
    if not segment_starts(root):
        return
    analyse(root, AnalyseOptions(), tell)
    if options.robot == "calibrated":
        rounds = CalibrateOptions(settings=options.settings, n_workers=options.n_workers)
        calibrate(root, rounds, tell)
