"""Rounds of analysis and calibration beside a virtual experiment, on the other cores."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import final

from zfcal.artifacts.segments import segment_starts
from zfcal.calibrate.task import Settings
from zfcal.online.worker import Worker
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import Tell
from zfcal.virtual.trial import Experiment

_NICENESS = 5
"""The loop goes first: it is what the rounds are waited for by, and it has one core at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Windows:
    """An order to analyse all windows that have ended.

    Parameters
    ----------
    root
        The trial's directory.
    settings
        How much a round of calibration does; None for no calibration.
    n_workers
        Its threads; None for one a core.
    """

    root: Path
    settings: Settings | None
    n_workers: int | None

    @classmethod
    def of(cls, experiment: Experiment) -> Windows:
        """Return those of an experiment; they are calibrated if its robot is."""
        options = experiment.options
        settings = options.settings if options.robot == "calibrated" else None
        return cls(root=experiment.root, settings=settings, n_workers=options.n_workers)


def do_rounds(windows: Windows, tell: Tell) -> None:
    """Analyse all windows that have ended, and calibrate them where that is asked for."""
    if not segment_starts(windows.root):
        return
    analyse(windows.root, AnalyseOptions(), tell)
    if windows.settings is not None:
        rounds = CalibrateOptions(settings=windows.settings, n_workers=windows.n_workers)
        calibrate(windows.root, rounds, tell)


@final
class RoundsBeside:
    """Does rounds while the loop goes on.

    Parameters
    ----------
    windows
        What is done in each.
    worker
        Does it; it is the caller's to stop. None for doing all where it is waited for.
    tell
        Hears of every file.
    """

    def __init__(self, windows: Windows, worker: Worker | None, tell: Tell) -> None:
        self._windows, self._worker, self._tell = windows, worker, tell

    def begin(self) -> None:
        """Begin with the windows that have ended by now; what was begun is waited for."""
        if self._worker is not None:
            self._worker.answer(self._tell)
            self._worker.order(self._windows)

    def wait(self) -> None:
        """Wait until all that was begun is done."""
        if self._worker is not None:
            self._worker.answer(self._tell)

    def finish(self) -> None:
        """Do all that is left."""
        if self._worker is None:
            do_rounds(self._windows, self._tell)
        else:
            self.begin()
            self.wait()


@contextlib.contextmanager
def rounds_beside(experiment: Experiment, tell: Tell) -> Iterator[RoundsBeside]:
    """Give rounds of an experiment, in a process of their own where they calibrate."""
    windows = Windows.of(experiment)
    if windows.settings is None:
        yield RoundsBeside(windows, None, tell)
        return
    worker = Worker("rounds", do_rounds, niceness=_NICENESS)
    try:
        yield RoundsBeside(windows, worker, tell)
    finally:
        worker.stop()
