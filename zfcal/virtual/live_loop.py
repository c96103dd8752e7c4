"""A virtual experiment in real time: each part a process of its own, as on a rig.

This process is the tank: fish, two cameras with an address, and where the robot is. The
others are started as commands: ``zfcal watch`` (track, analyse, calibrate) and ``zfcal
drive``. They know of each other what stands in the trial, and of the tank what the cameras show.
"""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.artifacts.cameras import SCHEMA as CAMERA
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.settings import name_camera
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.errors import InputError
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.camera.cameras import write_camera
from zfcal.stages.camera.rig import BELOW, OVERHEAD
from zfcal.stages.events import Note, Progress, Tell
from zfcal.stages.trial_context import OpenTrial, Task
from zfcal.virtual.camera_server import CameraServer
from zfcal.virtual.eyes import Drawn
from zfcal.virtual.trial import (
    FPS,
    Experiment,
    Files,
    LoopOptions,
    Noisy,
    clear,
    fish_of,
    keep,
    prepare,
    robot_of,
)

_START_S = 120.0
"""How long the stages may take to be ready: the first start compiles."""

_END_S = 90.0
"""How long the stages may take to finish what the end of the recording left them."""

_LATE_S = 0.5
"""A tank that is later than this with a frame says so."""


def live_loop(
    folder: Path, options: LoopOptions, budget_s: float, tell: Tell, *, task: Task | None = None
) -> Path:
    """Run a virtual experiment in real time.

    Parameters
    ----------
    folder
        Gets ``tank/`` and ``trial/`` as `closed_loop` makes them.
    options
        What happens; a round has a budget instead of generations.
    budget_s
        Wall-clock seconds of a round.
    tell
        Hears of what is slow, and of stages that fail.
    task
        What is there is begun anew only where that is forced.

    Raises
    ------
    InputError
        There is a trial already, or a stage does not start.
    """
    task = task or Task()
    experiment = prepare(folder, options, tell, task)
    root = experiment.root
    if any((root / "poses").glob("*.mcap")) and not task.force:
        raise InputError(
            f"{root}: has been recorded; what happened in real time does not happen again.",
            hint="Take another directory, or begin again with --force.",
        )
    clear(experiment)
    with contextlib.ExitStack() as stack:
        robot = stack.enter_context(robot_of(experiment, stepped=False))
        stage = stack.enter_context(_tank(experiment))
        watch = _watch_words(experiment, budget_s, stage)
        drive = ["drive", str(root), "--port", str(robot.port), "-q"]
        stages = [stack.enter_context(_running(*words)) for words in (watch, drive)]
        stage.run(robot, stages, tell)
        _finish(stages, tell)
    keep(experiment)
    return root


_PUBLISH = {"forward": "forward", "score": "score", "likely": "likelihood"}


def _watch_words(experiment: Experiment, budget_s: float, stage: _Tank) -> list[str]:
    options = experiment.options
    words = ["watch", str(experiment.root), "-q"]
    stages = ["track"] if stage.cameras else []
    stages += ["analyse"]
    stages += ["calibrate"] if options.robot == "calibrated" else []
    words += ["--stages", ",".join(stages), "--until-idle", f"{2 * _END_S / 3:g}s"]
    if options.robot == "calibrated":
        words += ["--budget", f"{budget_s:g}s", "--publish", _PUBLISH[options.settings.champion]]
    if stage.cameras:
        above, under = (camera.url for camera in stage.cameras)
        words += ["--overhead", above, "--below", under]
        words += ["--background", str(stage.empty), "--duration", f"{options.duration_s:g}s"]
    return words


@contextlib.contextmanager
def _running(*words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command of zfcal; it ends with the block."""
    line: Sequence[str] = [sys.executable, "-m", "zfcal_cli.main", *words]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL)  # noqa: S603 - this very Python
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _finish(stages: list[subprocess.Popen[bytes]], tell: Tell) -> None:
    """Let the watch finish its rounds; the driver ends by being told."""
    watch, drive = stages
    drive.send_signal(signal.SIGTERM)
    try:
        watch.wait(_END_S)
    except subprocess.TimeoutExpired:
        tell(Note(text=f"The watch was still at work {_END_S:g} s after the end.", warning=True))


@contextlib.contextmanager
def _tank(experiment: Experiment) -> Iterator[_Tank]:
    if not experiment.options.video:
        yield _Tank(experiment, None, ())
        return
    drawn = Drawn(experiment.tank)
    _write_cameras(experiment.trial)
    with CameraServer() as above, CameraServer() as under:
        made = _Tank(experiment, drawn, (above, under))
        write_bytes_whole(made.empty, cv2.imencode(".png", drawn.empty)[1].tobytes())
        yield made


def _write_cameras(trial: OpenTrial) -> None:
    """Write the files of both cameras, and name them in the trial."""
    for name, make in ((OVERHEAD, overhead_camera), (BELOW, below_camera)):
        path = trial.trial.root / "cameras" / f"{name}.toml"
        lineage = Lineage(schema=CAMERA, command="demo", options={"camera": name})
        write_camera(path, make(trial.arena), lineage, result={"method": "drawn, hence exact"})
        name_camera(trial.trial.root, name, path)


class _Tank:
    """Fish, what the cameras show of them, and the truth on disk."""

    def __init__(
        self, experiment: Experiment, drawn: Drawn | None, cameras: tuple[CameraServer, ...]
    ) -> None:
        self.cameras = cameras
        self.empty = experiment.tank.trial.root / "empty.png"
        self._drawn, self._options = drawn, experiment.options
        self._fish = fish_of(experiment)
        self._files = Files(experiment, self._fish, None if cameras else Noisy(self._fish))

    def run(self, robot: VirtualProcess, stages: list[subprocess.Popen[bytes]], tell: Tell) -> None:
        """Let the fish swim, frame by frame, until the time is over or a stage has gone."""
        self._await(robot, stages)
        began_s, worst_s = time.monotonic(), 0.0
        n_frames = round(self._options.duration_s * FPS)
        number = 0
        while number < n_frames or (self.cameras and stages[0].poll() is None):
            due_s = began_s + number / FPS
            time.sleep(max(0.0, due_s - time.monotonic()))
            worst_s = max(worst_s, time.monotonic() - due_s)
            at = robot.control.ask("pose")
            truth = self._fish.next_frame(np.array([at["x_m"], at["y_m"], at["heading_rad"]]))
            if self._drawn is not None:
                for camera, image in zip(self.cameras, self._drawn.images(truth), strict=True):
                    camera.show(image)
            if number < n_frames:
                self._files.add(truth)
            if number % 75 == 0:
                tell(Progress(stage="closed loop", done=min(number, n_frames), total=n_frames))
            _check(stages)
            number += 1
        self._files.finish()
        if worst_s > _LATE_S:
            says = f"The tank was up to {worst_s:.1f} s late: this computer is too busy for it."
            tell(Note(text=says, warning=True))

    def _await(self, robot: VirtualProcess, stages: list[subprocess.Popen[bytes]]) -> None:
        """Show the empty tank until the tracker looks at it and the driver greets the robot."""
        end_s = time.monotonic() + _START_S
        nobody = () if self._drawn is None else self._drawn.nobody
        while not (
            robot.control.ask("pose")["received"]
            and all(camera.wait_for_visitor(0.0) for camera in self.cameras)
        ):
            for camera, image in zip(self.cameras, nobody, strict=True):
                camera.show(image)
            time.sleep(1 / FPS)
            _check(stages)
            if time.monotonic() > end_s:
                raise InputError(f"The tracker or the driver was not ready within {_START_S:g} s.")


def _check(stages: list[subprocess.Popen[bytes]]) -> None:
    for stage, name in zip(stages, ("watch", "drive"), strict=True):
        code = stage.poll()
        if code not in (None, 0, 3):
            raise InputError(f"zfcal {name} ended with exit code {code}; see its words above.")
