"""From camera images to tracks: the stage behind ``zfcal track``."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.pose_messages import POSES
from zfcal.artifacts.reading.contents import Contents, one_content
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_extra
from zfcal.cameras.live import ArrivalClock
from zfcal.stages.camera.sources import source_of
from zfcal.stages.events import Note, Planned, Tell, UpToDate
from zfcal.stages.making import settled
from zfcal.stages.recording import check_same_source, starts_between, stretch_of
from zfcal.stages.track.following import Following
from zfcal.stages.track.minutes import Origins, pose_files, poses_reason
from zfcal.stages.track.outcome import LACKS_KEY
from zfcal.stages.track.plan import Plan, TrackOptions, plan_of
from zfcal.stages.track.resuming import Resumed, begin_anew, resume
from zfcal.stages.trial_context import Task, at_work, open_trial, reason_to_make, tell_version


def track(root: Path, options: TrackOptions, tell: Tell, *, task: Task | None = None) -> None:
    """Track a recording or a live camera into a trial.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What to track, and how.
    tell
        Hears of every file as soon as it is closed, and of what is wrong.
    task
        How to go about it.

    Raises
    ------
    InputError
        The trial does not exist, or its cameras cannot be opened or do not fit it.
    DamagedError
        A video cannot be opened at all.
    """
    task = task or Task()
    with one_content() as seen:
        plan = plan_of(open_trial(root), options)
    with at_work(root, "track", task):
        if plan.is_live:
            # What drives a camera is read once, at its start: an image never comes again.
            with one_content(seen) as seen:
                tracks = plan.lineage()
            _check_same_source(plan, tracks, task)
            _follow_live(plan, (tracks, seen), tell, task=task)
            return
        settled(lambda: _track(root, options, tell, task=task), tell)


def _track(root: Path, options: TrackOptions, tell: Tell, *, task: Task) -> None:
    plan = plan_of(open_trial(root), options)
    tracks = plan.lineage()
    poses = dataclasses.replace(tracks, schema=POSES)
    _check_same_source(plan, tracks, task)
    origins = Origins(tracks=tracks, poses=poses, is_live=False)
    if _is_done(plan, origins, tell, task=task):
        return
    if task.dry_run:
        _tell_plan(plan, origins, tell, task=task)
        return
    Following(plan, origins, tell, task=task).run()


def _check_same_source(plan: Plan, tracks: Lineage, task: Task) -> None:
    check_same_source(plan.opened.trial, tracks.command, sources=tracks.inputs, task=task)


def _is_done(plan: Plan, origins: Origins, tell: Tell, *, task: Task) -> bool:
    """Return whether a recording has been tracked to its end; then all its files are told."""
    trial = plan.opened.trial
    starts = segment_starts(trial.root)
    if task.force or not starts or plan.options.pictures.missing:
        return False
    told: list[object] = []
    paths = [segment_path(trial.root, start) for start in starts]
    if any(reason_to_make(path, origins.tracks, Task(), told.append) for path in paths):
        return False
    stretch = stretch_of(paths[-1])
    known = pose_files(trial.root)
    if stretch is None or starts[-1] != starts_between(*stretch)[-1] or set(known) != set(starts):
        return False
    if any(poses_reason(path, origins.poses) for path in known.values()):
        return False
    tell_version(paths, origins.tracks, tell)
    for start, path in zip(starts, paths, strict=True):
        tell(UpToDate(path=path))
        tell(UpToDate(path=known[start]))
    _tell_lacks(paths[-1], tell)
    return True


def _tell_lacks(path: Path, tell: Tell) -> None:
    """Say again what the images lacked that a recording's last segment was made from."""
    lacks = read_extra(path).get(LACKS_KEY)
    for says in lacks if isinstance(lacks, list) else []:
        text = f"{path}: was tracked without what cannot be read. {says}"
        tell(Note(text=text, warning=True))


def _tell_plan(plan: Plan, origins: Origins, tell: Tell, *, task: Task) -> None:
    """Say which segments would be made; how many there are is the source's own word."""
    options, trial = plan.options, plan.opened.trial
    source = source_of(plan.overhead.source, fps=trial.fps, clock=ArrivalClock())
    first_s = options.start_s or 0.0
    end_s = source.length_s or first_s + 1.0
    if options.duration_s is not None:
        end_s = min(end_s, first_s + options.duration_s)
    for start in starts_between(first_s, max(end_s, first_s)):
        path = segment_path(trial.root, start)
        reason_to_make(path, origins.tracks, task, tell)


def _follow_live(plan: Plan, origin: tuple[Lineage, Contents], tell: Tell, *, task: Task) -> None:
    tracks, seen = origin
    root = plan.opened.trial.root
    if task.dry_run:
        tell(Planned(path=root / "tracks", reason=f"{plan.overhead.source} is live"))
        return
    if task.force:
        begin_anew(root, tell)
    resumed = Resumed() if task.force else resume(root, tell)
    clock = ArrivalClock(resumed.started_unix_s)
    poses = dataclasses.replace(tracks, schema=POSES)
    origins = Origins(tracks=tracks, poses=poses, is_live=True)
    Following(plan, origins, tell, task=task, clock=clock, resumed=resumed, seen=seen).run()
