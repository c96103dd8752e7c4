"""What a dry run says of a reproduction, whose steps stand on each other.

Where a step would make something, what the next ones find is not there yet: they are told in
words. What each step plans by itself is the business of its stage.
"""

from __future__ import annotations

from pathlib import Path
from typing import final

from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import Event, Note, Planned, Tell
from zfcal.stages.trial_context import Task


@final
class Planning:
    """Hands on what is told, and remembers what would be made.

    Parameters
    ----------
    tell
        Hears of everything.

    Attributes
    ----------
    planned
        The files that would be made, as they were told.
    """

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self.planned: list[Path] = []

    def __call__(self, event: Event) -> None:
        """Hear an event."""
        if isinstance(event, Planned):
            self.planned.append(event.path)
        self._tell(event)

    def is_planned(self, root: Path) -> bool:
        """Return whether a file of a trial would be made."""
        return any(path.is_relative_to(root) for path in self.planned)


def plan_calibrated(root: Path, options: CalibrateOptions, plan: Planning, *, task: Task) -> None:
    """Say what analysis and calibration of a trial would make.

    Parameters
    ----------
    root
        The trial, which need not be there yet.
    options
        How it is calibrated.
    plan
        Hears of it, and knows what would be made before.
    task
        The dry run.
    """
    if plan.is_planned(root):
        plan(Note(text=f"{root}: is analysed and calibrated after that."))
        return
    analyse(root, AnalyseOptions(), plan, task=task)
    if plan.is_planned(root):
        plan(Note(text=f"{root}: is calibrated after that."))
        return
    calibrate(root, options, plan, task=task)


def reason_before(place: Path, plan: Planning, *, task: Task) -> str | None:
    """Return why a result would be made, before its inputs are looked at; None for no reason."""
    if not place.exists():
        return "missing"
    if task.force:
        return "forced"
    return "what it is made from is made again" if plan.planned else None
