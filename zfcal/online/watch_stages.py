"""What the stages of a watch do with an order, and what its loop knows of each.

The functions are those of the commands.

Each loads what it needs when it begins: a process that analyses has no use for a compiler.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from zfcal.online.arrivals import Signature
from zfcal.online.scheduling import Overruns, budget_of, choose
from zfcal.online.watch_events import Skipped, StageStatus, Takes
from zfcal.online.worker import Job, Worker
from zfcal.stages.events import Event, LeftOut, Planned, Tell, UpToDate
from zfcal.stages.segments import Segments
from zfcal.stages.skipping import write_skipped
from zfcal.stages.trial_context import Task, open_trial

if TYPE_CHECKING:
    from zfcal.stages.analyse.analyse import AnalyseOptions
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.track.plan import TrackOptions

TRACK, ANALYSE, CALIBRATE = STAGES = ("track", "analyse", "calibrate")

MAKES = {TRACK: ("tracks",), ANALYSE: ("stats", "scores"), CALIBRATE: ("models",)}
"""The folders that a stage fills: what appears there is not news from elsewhere."""

NICENESS = {TRACK: 0, ANALYSE: 0, CALIBRATE: 10}
"""The processor serves the robot, the tracker and the statistics before the search."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """An order to analyse or to calibrate.

    Parameters
    ----------
    seen_s
        By the window's end, when its data were there, on the monotonic clock.
    due_after_s
        How long a window may wait; None for as long as it takes.
    """

    seen_s: Mapping[int, float]
    due_after_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of an order.

    Parameters
    ----------
    end_s
        End of the window that was made, after which there may be more to do; None
        for no more.
    left_out
        What had to be left out, by path.
    """

    end_s: int | None = None
    left_out: Mapping[str, LeftOut] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class _Ear:
    """Hands events on, and remembers what was left out."""

    tell: Tell
    left_out: dict[str, LeftOut] = field(default_factory=dict)

    def hear(self, event: object) -> None:
        if isinstance(event, LeftOut) and event.damaged:
            self.left_out[str(event.path)] = event
        self.tell(event)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackStage:
    """Tracks until the recording or the camera ends."""

    root: Path
    options: TrackOptions

    def __call__(self, _: object, tell: Tell) -> Outcome:
        """Track, or go on tracking."""
        from zfcal.stages.track.track import track

        ear = _Ear(tell=tell)
        track(self.root, self.options, ear.hear)
        return Outcome(left_out=ear.left_out)

    def plan(self, tell: Tell) -> None:
        """Say what would be made now."""
        from zfcal.stages.track.track import track

        track(self.root, self.options, tell, task=Task(dry_run=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalyseStage:
    """Analyses all windows that are there, oldest first: each takes a moment."""

    root: Path
    options: AnalyseOptions
    segments: Segments = field(default_factory=Segments)

    def __call__(self, turn: Turn, tell: Tell) -> Outcome:
        """Make what is missing or stale."""
        from zfcal.stages.analyse.analyse import analyse

        ear = _Ear(tell=tell)
        task = Task(ends_s=frozenset(turn.seen_s))
        analyse(self.root, self.options, ear.hear, task=task, segments=self.segments)
        return Outcome(left_out=ear.left_out)

    def plan(self, tell: Tell) -> None:
        """Say what would be made now."""
        from zfcal.stages.analyse.analyse import analyse

        analyse(self.root, self.options, tell, task=Task(dry_run=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateStage:
    """Calibrates one window at a time, since a round is long and the world goes on.

    Parameters
    ----------
    root
        The trial's directory.
    options
        How; its budget is that of a round which starts in time.
    clock
        The one of the orders.
    overruns
        What rounds took beyond their budgets.
    """

    root: Path
    options: CalibrateOptions
    clock: Callable[[], float] = time.monotonic
    overruns: Overruns = field(default_factory=Overruns)

    def __call__(self, turn: Turn, tell: Tell) -> Outcome:
        """Choose a window, write down which are passed over, and make its round.

        Without any window it gets ready for the first.
        """
        from zfcal.stages.calibrate.calibrate import calibrate

        ear = _Ear(tell=tell)
        if not turn.seen_s:
            self._get_ready()
            return Outcome()
        waiting = {end: turn.seen_s[end] for end in self._planned(turn, ear)}
        now_s = self.clock()
        choice = choose(waiting, now_s=now_s, due_after_s=turn.due_after_s)
        if choice.end_s is None:
            return Outcome(left_out=ear.left_out)
        for end in choice.passed_over:
            ear.hear(self._pass_over(end, choice.end_s, waited_s=now_s - waiting[end]))
        options = self.options
        if options.budget_s is not None and turn.due_after_s is not None:
            seen_s = waiting[choice.end_s]
            budget_s = budget_of(
                options.budget_s, seen_s=seen_s, now_s=now_s, reserve_s=self.overruns.reserve_s
            )
            options = dataclasses.replace(options, budget_s=budget_s)
        ear.hear(Takes(end_s=choice.end_s, budget_s=options.budget_s))
        task = Task(ends_s=frozenset({choice.end_s}))
        calibrate(self.root, options, ear.hear, task=task)
        if options.budget_s is not None:
            self.overruns.add(self.clock() - now_s, options.budget_s)
        return Outcome(end_s=choice.end_s, left_out=ear.left_out)

    def plan(self, tell: Tell) -> None:
        """Say which rounds would be made now."""
        from zfcal.stages.calibrate.calibrate import calibrate

        once = self.options.budget_s is not None

        def hear(event: Event) -> None:
            if once and isinstance(event, Planned) and not _is_first(event.reason):
                event = UpToDate(path=event.path)
            tell(event)

        calibrate(self.root, self.options, hear, task=Task(dry_run=True))

    def _get_ready(self) -> None:
        """Have the simulator compiled, or loaded."""
        from zfcal.calibrate.search import warm_up
        from zfcal.stages.calibrate.calibrate import make_group

        warm_up(make_group(open_trial(self.root), self.options))

    def _planned(self, turn: Turn, ear: _Ear) -> list[int]:
        """Return the windows whose rounds are to be made.

        A round with a budget is made once: made again it would differ, and it is
        the record of what the robot was driven by.
        """
        from zfcal.stages.calibrate.calibrate import calibrate

        planned: dict[int, str] = {}

        def hear(event: object) -> None:
            if isinstance(event, Planned) and event.path.suffix == ".toml":
                planned[int(event.path.stem)] = event.reason
            elif isinstance(event, LeftOut | UpToDate):
                ear.hear(event)

        task = Task(dry_run=True, ends_s=frozenset(turn.seen_s))
        calibrate(self.root, self.options, hear, task=task)
        once = self.options.budget_s is not None
        return [
            end
            for end, reason in planned.items()
            if end in turn.seen_s and not (once and not _is_first(reason))
        ]

    def _pass_over(self, end_s: int, instead_s: int, *, waited_s: float) -> Skipped:
        because = f"It waited for {waited_s:.0f} s while a round before it overran."
        path = None
        if not (self.root / "models" / f"{end_s:06d}.toml").exists():
            path = write_skipped(self.root, end_s, went_on_with_s=instead_s, because=because)
        return Skipped(end_s=end_s, went_on_with_s=instead_s, because=because, path=path)


def _is_first(reason: str) -> bool:
    """Return whether a round with this reason was not made before."""
    return reason.startswith(("missing", "damaged"))


StageJob: TypeAlias = TrackStage | AnalyseStage | CalibrateStage
"""What a stage does with an order; its `plan` says what it would do now, and writes nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchOptions:
    """What to run, and until when.

    Parameters
    ----------
    track, analyse, calibrate
        How to run these stages; None for one that does not run here.
    poll
        Whether to do without the file system's notifications.
    once
        Make all that can be made now, and leave.
    until_idle_s
        Leave when nothing has changed for so long; None for never.
    """

    track: TrackOptions | None = None
    analyse: AnalyseOptions | None = None
    calibrate: CalibrateOptions | None = None
    poll: bool = False
    once: bool = False
    until_idle_s: float | None = None

    def jobs(self, root: Path) -> dict[str, StageJob]:
        """Return what each of the stages does, in their order."""
        jobs: dict[str, StageJob] = {}
        if self.track is not None:
            jobs[TRACK] = TrackStage(root=root, options=self.track)
        if self.analyse is not None:
            jobs[ANALYSE] = AnalyseStage(root=root, options=self.analyse)
        if self.calibrate is not None:
            jobs[CALIBRATE] = CalibrateStage(root=root, options=self.calibrate)
        return jobs


@dataclass(slots=True, kw_only=True)
class Running:
    """A stage as the loop knows it.

    Parameters
    ----------
    name, job, worker
        Which stage, what it does, and its process.
    asked_for, done_for
        What the trial looked like at its last order, and when it had nothing more to do.
    failures, retry_s, said
        Failures in a row, when it is tried again, and what it said.
    is_over
        Whether a tracker has come to the end.
    taken_s
        When it began with a window.
    left_out
        What its last order had to leave out.
    status
        For the status line.
    """

    name: str
    job: Job
    worker: Worker
    asked_for: Signature = frozenset()
    done_for: Signature | None = None
    failures: int = 0
    retry_s: float = 0.0
    said: str = ""
    is_over: bool = False
    taken_s: float = 0.0
    left_out: Mapping[str, LeftOut] = field(default_factory=dict)
    status: StageStatus = field(default_factory=StageStatus)


def begin(name: str, job: Job) -> Running:
    """Start the process of a stage."""
    return Running(name=name, job=job, worker=Worker(name, job, niceness=NICENESS[name]))


def is_of_a_round(name: str) -> bool:
    """Return whether rounds make the file with a name in a trial: it is nothing to analyse."""
    return name.startswith("models/") or name.endswith(("-model.parquet", "-rules.parquet"))
