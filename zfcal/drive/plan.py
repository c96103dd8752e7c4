"""What a drive would do, said without a port, a robot or a file; and what can be checked before."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.drive_files import drive_files
from zfcal.artifacts.pose_files import read_poses
from zfcal.drive.ending import can_no_tracker_come, is_recorded
from zfcal.drive.models import DriveModels
from zfcal.drive.options import VIRTUAL, DriveOptions
from zfcal.drive.pilot import Command, InForce, Pilot, Target
from zfcal.drive.replay import NoLine
from zfcal.errors import DamagedError, InputError
from zfcal.robot.fishbot import FishBot
from zfcal.robot.port import is_pseudo_terminal
from zfcal.stages.events import LeftOut, Note, Planned, Result, Tell
from zfcal.stages.track.minutes import pose_files
from zfcal.stages.trial_context import OpenTrial, Task
from zfcal.tracks import FramePoses
from zfcal.units import M_PER_CM, M_PER_MM, SEGMENT_S


def check_port(options: DriveOptions) -> None:
    """Refuse the poses' clock at a port behind which no robot waits for the driver.

    Raises
    ------
    InputError
        It is a robot's own port.
    """
    port = options.port
    if options.clock == "poses" and port != VIRTUAL and not is_pseudo_terminal(port):
        raise InputError(
            f"{port}: --clock poses is for a virtual robot that waits for the driver.",
            hint="A robot in the tank does not wait: drive it by --clock wall, the default.",
        )


def check_logs(opened: OpenTrial, options: DriveOptions) -> None:
    """Refuse to go through the poses again over the log of an earlier drive.

    Raises
    ------
    InputError
        There is one.
    """
    if options.clock == "poses" and drive_files(opened.trial.root):
        raise InputError(
            f"{opened.trial.root / 'drive'}: holds the log of an earlier drive.",
            hint="Check it with --replay, or drive again with --force.",
        )


def no_poses_hint(opened: OpenTrial) -> str:
    """Return what to do where a trial brings no new poses."""
    root = opened.trial.root
    words = f"To try a drive without a rig: zfcal demo {root}-loop --closed-loop"
    if pose_files(root):
        return f"Drive by the recorded poses with --port virtual --clock poses. {words}"
    return f"A drive follows the poses that zfcal track writes; an import has none. {words}"


@dataclass(frozen=True, slots=True, kw_only=True)
class _First:
    """The first decisions of a drive: at which frame, where to and how."""

    poses: FramePoses
    target: Target | None
    command: Command


def tell_plan(opened: OpenTrial, options: DriveOptions, tell: Tell, *, task: Task) -> None:
    """Say what a drive would open, by what it would drive, and what it would send first.

    Parameters
    ----------
    opened
        The trial.
    options
        What is asked of the driver.
    tell
        Hears of it.
    task
        Whether the log of an earlier drive would be removed.

    Raises
    ------
    InputError
        The drive itself would be refused.
    """
    check_port(options)
    root = opened.trial.root
    if not task.force:
        check_logs(opened, options)
    model = DriveModels(opened, only=options.model).first()
    tell(Note(text=_port_words(options)))
    tell(Note(text=f"It would drive by {model.name}, in the manner {options.manner.pattern}."))
    if task.force and (known := drive_files(root)):
        tell(Note(text=f"It would remove {len(known)} files of an earlier drive."))
    first = _first(opened, options, model, tell)
    tell(Note(text=_first_words(opened, options, first)))
    if first is not None:
        start_s = int(first.poses.time_s // SEGMENT_S * SEGMENT_S)
        path = opened.trial.path("drive", start_s, ".mcap")
        tell(Planned(path=path, reason="the robot is driven"))
    tell(Result(value=_values(options, model, first)))


def _port_words(options: DriveOptions) -> str:
    letter, port = options.manner.letter, options.port
    if port == VIRTUAL:
        return f"drive would start a virtual FishBot {letter} and open its port."
    there = "is there" if Path(port).exists() else "is not there now"
    return f"drive would open {port}, which {there}, and drive FishBot {letter}."


def _first(opened: OpenTrial, options: DriveOptions, model: InForce, tell: Tell) -> _First | None:
    """Return what would be decided at the first step that the recorded poses allow; None for none.

    The poses' clock begins with the first file, the wall's clock with the last.
    """
    pilot = Pilot(opened, options.manner, FishBot(options.manner.letter, NoLine()))
    found = None
    for poses in _poses_of(opened, options, tell):
        target = pilot.see(poses, model)
        found = _First(poses=poses, target=target, command=pilot.tick(poses.time_s))
        if target is not None:
            return found
    return found


def _poses_of(opened: OpenTrial, options: DriveOptions, tell: Tell) -> Iterator[FramePoses]:
    files = list(pose_files(opened.trial.root).values())
    for path in files if options.clock == "poses" else files[-1:]:
        problems: list[DamagedError] = []
        try:
            yield from read_poses(path, left_out=problems.append)
        except DamagedError as error:
            problems.append(error)
        for problem in problems[:1]:
            tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))


def _first_words(opened: OpenTrial, options: DriveOptions, first: _First | None) -> str:
    root, is_live = opened.trial.root, options.clock == "wall"
    if first is None:
        is_over = can_no_tracker_come(root) if is_live else is_recorded(root)
        ends = "it would end, since the recording has ended" if is_over else "it would wait"
        return f"{root / 'poses'}: no poses. It would send STOP, and {ends}."
    at_s = first.poses.time_s
    words = _target_words(first)
    if is_live:
        return (
            f"It would send STOP until new poses come. By the recorded poses at {at_s:.2f} s "
            f"{words}"
        )
    return f"At the first step, at {at_s:.2f} s, {words}"


def _target_words(first: _First) -> str:
    command, target = first.command, first.target
    left, right = (
        speed / M_PER_CM for speed in (command.wheels.left_m_s, command.wheels.right_m_s)
    )
    if target is None:
        return f"there is no target, and it would send STOP ({command.held})."
    goal = target.goal
    sends = f"wheels {left:.0f} and {right:.0f} cm/s" if not command.held else "STOP"
    return (
        f"the target would be ({goal.x_m / M_PER_MM:.0f}, {goal.y_m / M_PER_MM:.0f}) mm "
        f"at {goal.speed_m_s / M_PER_CM:.1f} cm/s, and the first command {sends}."
    )


def _values(options: DriveOptions, model: InForce, first: _First | None) -> dict[str, object]:
    """Return the same for whoever reads JSON."""
    found: dict[str, object] = {"port": options.port, "model": model.name, "clock": options.clock}
    if first is None or first.target is None:
        return found
    goal, wheels = first.target.goal, first.command.wheels
    numbers = {
        "time_s": first.poses.time_s,
        "x_m": goal.x_m,
        "y_m": goal.y_m,
        "speed_m_s": goal.speed_m_s,
        "left_m_s": wheels.left_m_s,
        "right_m_s": wheels.right_m_s,
    }
    return found | {"first": {k: v if math.isfinite(v) else None for k, v in numbers.items()}}
