"""The steps of a demonstration: what each makes, what a dry run says of it, and the drive."""

from __future__ import annotations

import dataclasses
import importlib.util
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.reading.contents import hash_of, numbered_of
from zfcal.artifacts.segments import segment_path
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import Event, Note, Planned, Tell, UpToDate
from zfcal.stages.recording import starts_between
from zfcal.stages.segments import STEP_S
from zfcal.stages.trial_context import Task, open_trial
from zfcal.stages.windows import LENGTH_S
from zfcal.trial import LOOP_NAME

DRIVE_S = 30.0
"""So much of the trial is driven, by the times of its poses, which are not waited for."""

ABOUT_S = 60.0
"""So long the demonstration takes on two cores with nothing else to do."""

_LOOP_SPEED = {True: 3.0, False: 10.0}
"""Closed loops in lock-step, with and without video: so many times as fast as real time."""

_REPORT_S = 15.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A part of the demonstration.

    Parameters
    ----------
    makes
        The files to look for.
    work
        Makes them, or says what it would make.
    """

    makes: Sequence[Path]
    work: Callable[[Task], object]


def tell_steps(steps: Iterable[Step], tell: Tell, task: Task) -> None:
    """Say what each step would make; after one that would make something all are to be made.

    Parameters
    ----------
    steps
        In order: each stands on those before it.
    tell
        Hears of each file.
    task
        The dry run.
    """
    planned: list[Path] = []

    def hear(event: Event) -> None:
        if isinstance(event, Planned):
            planned.append(event.path)
        tell(event)

    for step in steps:
        if not planned and all(path.exists() for path in step.makes):
            # The step looks by itself.
            step.work(task)
            continue
        for path in step.makes:
            why = "what it is made from is made again" if path.exists() else "missing"
            hear(Planned(path=path, reason=why))


def drive_demo(trial: Path, tell: Tell, *, task: Task) -> None:
    """Drive a virtual robot by the newest model, for a part of the recorded poses.

    Parameters
    ----------
    trial
        The trial, with poses and a model.
    tell
        Hears of the log.
    task
        How to go about it.
    """
    if importlib.util.find_spec("fcntl") is None:
        tell(Note(text="The drive needs Linux: it is left out.", warning=True))
        return
    from zfcal.drive.drive import drive, lineage_of
    from zfcal.drive.events import DriveStatus
    from zfcal.drive.options import VIRTUAL, DriveOptions

    options = DriveOptions(port=VIRTUAL, clock="poses", duration_s=DRIVE_S)
    log = trial / "drive" / "000000.mcap"
    known = lineage_of(open_trial(trial), options)
    models = numbered_of(trial / "models", ".toml")
    inputs = {**known.inputs, **hash_inputs(trial, [models[max(models)]])}
    is_current = (
        stale_reason([log], dataclasses.replace(known, inputs=inputs)) is None
        and _is_of_newest(trial)
        and not task.force
    )
    if is_current:
        tell(UpToDate(path=log))
        return
    if task.dry_run:
        tell(Planned(path=log, reason="missing" if not log.exists() else "of another model"))
        return

    doubts: list[Note] = []

    def hear(told: Event | DriveStatus) -> None:
        if isinstance(told, Note) and told.kind == "fault":
            doubts.append(told)
        elif not isinstance(told, DriveStatus):
            tell(told)

    drive(trial, options, hear, task=Task(force=True))
    n_doubts = sum(not note.values.get("ended", False) for note in doubts)
    if n_doubts:
        says = (
            f"{n_doubts} times a pose was in doubt or the robot was lost, and no pose of then was"
        )
        tell(Note(text=f"{says} driven by: {log} says when."))


def _is_of_newest(trial: Path) -> bool:
    """Return whether the log of a drive goes to its end, and the newest model drove."""
    try:
        items = [item for path in drive_files(trial).values() for item in read_drive(path)]
    except (DamagedError, InputError):
        return False
    models = numbered_of(trial / "models", ".toml")
    drove = {item["sha256"] for item in items if item["what"] == "model"}
    times_s = [item["time_s"] for item in items if item["what"] == "command"]
    whole = bool(times_s) and times_s[-1] - times_s[0] >= DRIVE_S - 1.0
    return whole and drove == {hash_of(models[max(models)])}


def tell_loop(folder: Path, duration_s: float, tell: Tell, *, task: Task) -> Path:
    """Say what a closed loop would write; return its trial.

    Parameters
    ----------
    folder
        Where it goes.
    duration_s
        How long it lasts.
    tell
        Hears of each file of tracks, models and drives.
    task
        Whether it would begin anew.
    """
    trial = folder / "trial"
    is_whole = (trial / LOOP_NAME).exists() and not task.force
    starts = starts_between(0.0, duration_s)
    paths = [segment_path(root, start) for root in (folder / "tank", trial) for start in starts]
    ends = range(LENGTH_S, int(duration_s) + 1, STEP_S)
    paths += [trial / "models" / f"{end:06d}.toml" for end in ends]
    paths += [trial / "drive" / f"{start:06d}.mcap" for start in starts]
    for path in paths:
        reason = "forced" if path.exists() else "missing"
        tell(UpToDate(path=path) if is_whole else Planned(path=path, reason=reason))
    return trial


def about_s(duration_s: float, *, video: bool, real_time: bool) -> float:
    """Return about how long a closed loop takes on two cores with nothing else to do, in seconds.

    Parameters
    ----------
    duration_s
        How long the experiment lasts.
    video
        Whether images are drawn and tracked.
    real_time
        Whether it runs as on a rig.
    """
    return duration_s / (1.0 if real_time else _LOOP_SPEED[video]) + _REPORT_S
