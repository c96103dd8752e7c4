"""Runs the stages on each new segment until the trial ends: the loop behind ``zfcal watch``.

The loop looks, gives orders and listens; the work is done by the stages, each in a
process of its own, and all that they have to tell one another stands in the trial.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from contextlib import ExitStack
from multiprocessing import connection
from pathlib import Path
from typing import final

from zfcal.artifacts.lock import lock
from zfcal.artifacts.segments import segment_starts
from zfcal.errors import InputError, ZfcalError
from zfcal.online.arrivals import FOLDERS, Arrivals, Arrived, Signature, segment_ends
from zfcal.online.hints import Hints, reason_to_poll
from zfcal.online.watch_events import (
    Happened,
    Skipped,
    Status,
    Takes,
    WatchTell,
    told_by,
)
from zfcal.online.watch_stages import (
    ANALYSE,
    CALIBRATE,
    MAKES,
    NICENESS,
    TRACK,
    Outcome,
    Running,
    Turn,
    WatchOptions,
    begin,
    is_of_a_round,
)
from zfcal.online.worker import Done, Failure, Worker
from zfcal.stages import events as of
from zfcal.stages.recording import has_ended
from zfcal.stages.skipping import skipped_ends
from zfcal.stages.trial_context import open_trial
from zfcal.stages.windows import window_ends
from zfcal.units import SEGMENT_S

_TICK_S = 0.25
"""The loop turns over at least so often while something is on its way."""

_RETRY_S = (1.0, 2.0, 4.0, 8.0, 15.0)
"""After its first failure a stage waits so long, then longer, for the world to get better."""


def watch(root: Path, options: WatchOptions, tell: WatchTell) -> list[of.LeftOut]:
    """Run stages on a trial until it ends.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What to run, and until when.
    tell
        Hears of everything that happens, and of the state four times a second.

    Returns
    -------
    list of LeftOut
        What was still left out at the end.

    Raises
    ------
    InputError
        The trial is not there or its settings are wrong at the start, or a camera
        cannot be opened.
    LockedError
        Another watch runs one of the stages on this trial.
    ZfcalError
        With ``once``, whatever a stage cannot do.
    """
    open_trial(root)
    with ExitStack() as stack:
        for name in options.jobs(root):
            stack.enter_context(lock(root, f"watch-{name}"))
        polls = reason_to_poll(root, asked=options.poll)
        hints = Hints(root, polls=polls is not None)
        stack.callback(hints.close)
        loop = _Watch(root, options, tell, hints=hints)
        stack.callback(loop.close)
        loop.begin(polls)
        while not loop.is_over():
            loop.turn()
        return loop.finish()


@final
class _Watch:
    """One run of a watch.

    Parameters
    ----------
    root, options, tell
        As for `watch`.
    hints
        Wake the loop.
    clock
        Seconds, monotonic, the same in all processes.
    """

    def __init__(
        self,
        root: Path,
        options: WatchOptions,
        tell: WatchTell,
        *,
        hints: Hints,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._root = root
        self._options = options
        self._tell = tell
        self._hints = hints
        self._clock = clock
        self._arrivals = Arrivals(root, clock)
        self._began_s = self._busy_s = clock()
        self._look_s = 0.0
        self._told: set[str] = set()
        self._ended = False
        self._seen: Signature = frozenset()
        self._status = Status(stages={}, n_skipped=len(skipped_ends(root)))
        self._stages = {name: begin(name, job) for name, job in options.jobs(root).items()}

    def begin(self, polls: str | None) -> None:
        """Say what runs where; ``polls`` is why notifications are not used."""
        self._log("began", trial=str(self._root), stages=list(self._stages), polls=polls)
        for stage in self._stages.values():
            self._log("started", stage.name, process=stage.worker.process)
        if CALIBRATE in self._stages and not self._options.once:
            # What is to be compiled is, before the first window comes.
            self._stages[CALIBRATE].worker.order(Turn(seen_s={}))

    def turn(self) -> None:
        """Look, give orders, and wait for what comes."""
        if self._clock() >= self._look_s or self._arrivals.unsettled:
            self._look()
            self._look_s = self._clock() + self._hints.rescan_s
        for stage in self._stages.values():
            self._give(stage)
        self._tell(self._snapshot())
        pipes = [stage.worker.pipe for stage in self._stages.values()]
        pause_s = _TICK_S if self._is_restless() else self._hints.rescan_s
        connection.wait([*pipes, self._hints.pipe], timeout=pause_s)
        if self._hints.clear():
            self._look_s = 0.0
        for stage in self._stages.values():
            for told in stage.worker.take():
                self._take(stage, told)

    def is_over(self) -> bool:
        """Return whether there is nothing more to do, and nothing more to come."""
        if any(stage.worker.is_busy for stage in self._stages.values()):
            return False
        if self._has_been_idle():
            return True
        if not all(map(self._is_at_rest, self._stages.values())):
            return False
        if self._status.is_gone or self._arrivals.unsettled:
            return False
        if self._seen != self._arrivals.signature:
            return False
        return self._options.once or (self._ended and self._has_all())

    def finish(self) -> list[of.LeftOut]:
        """Say that it is over, and return what was left out.

        Raises
        ------
        ZfcalError
            A stage failed to the last.
        """
        left = {
            path: each for stage in self._stages.values() for path, each in stage.left_out.items()
        }
        for name, problem in self._arrivals.unfinished.items():
            path = self._root / name
            hint = "Copy it again from where it was made, or remove it."
            left[str(path)] = of.LeftOut(path=path, problem=f"{path}: {problem}.", hint=hint)
        self._log("ended", because=self._because(), left_out=sorted(left))
        for stage in self._stages.values():
            if stage.failures:
                raise ZfcalError(stage.said, hint="The same command again goes on.")
        return list(left.values())

    def close(self) -> None:
        """End all stages."""
        for stage in self._stages.values():
            stage.worker.stop()

    def _look(self) -> None:
        """Take in what the directory holds now."""
        try:
            news = self._arrivals.look()
        except OSError as error:
            self._note_gone(error)
            return
        if self._status.is_gone:
            self._status = dataclasses.replace(self._status, is_gone=False)
            self._log("back", path=str(self._root))
        for each in news:
            name = str(each.path)
            if isinstance(each, Arrived):
                if not any(each.path.parent.name in MAKES[stage] for stage in self._stages):
                    self._log("arrived", path=name)
            else:
                self._log("unfinished", path=name, problem=each.problem)
        if self._arrivals.signature != self._seen:
            self._seen = self._arrivals.signature
            self._busy_s = self._clock()
            self._ended = has_ended(self._root, self._arrivals.whole_s["tracks"])

    def _note_gone(self, error: OSError) -> None:
        if self._options.once:
            raise InputError(
                f"{self._root}: the trial is gone ({error.strerror or error}).",
                hint="Check the path, and whether the disk is still there.",
            ) from error
        if not self._status.is_gone:
            self._status = dataclasses.replace(self._status, is_gone=True)
            self._log("gone", path=str(self._root), problem=error.strerror or str(error))

    def _give(self, stage: Running) -> None:
        """Give a stage an order, if it is free and something has changed for it."""
        worker = stage.worker
        if worker.is_busy or self._status.is_gone or stage.is_over or self._clock() < stage.retry_s:
            return
        signature = self._seen_by(stage.name)
        if signature == stage.done_for:
            return
        order = None if stage.name == TRACK else self._order(stage.name)
        if isinstance(order, Turn) and not order.seen_s:
            stage.done_for = signature
            return
        stage.asked_for = signature
        worker.order(order)

    def _order(self, name: str) -> Turn:
        tracks, stats = self._arrivals.whole_s["tracks"], self._arrivals.whole_s["stats"]
        ends = segment_ends(tracks)
        if name == ANALYSE:
            return Turn(seen_s=ends)
        # A round's minute begins when its tracks were there; where statistics come from
        # another computer, when they did: a cut link is no overrun.
        is_fetched = ANALYSE not in self._stages
        seen_s = {
            end: max(here_s, ends.get(end, here_s)) if is_fetched else ends.get(end, here_s)
            for end, here_s in stats.items()
        }
        hurry = not (self._options.once or self._ended)
        return Turn(seen_s=seen_s, due_after_s=SEGMENT_S if hurry else None)

    def _seen_by(self, name: str) -> Signature:
        """Return the files that bear on a stage, as they look."""
        if name == TRACK:
            return frozenset()
        if name == CALIBRATE:
            return self._seen
        return frozenset(each for each in self._seen if not is_of_a_round(each[0]))

    def _take(self, stage: Running, told: of.Event | Done | Failure) -> None:
        """Take what a stage tells."""
        if isinstance(told, Done | Failure):
            self._look_s = 0.0
        if isinstance(told, Done):
            self._take_outcome(stage, told.result)
        elif isinstance(told, Failure):
            self._take_failure(stage, told)
        else:
            self._take_event(stage, told)

    def _take_event(self, stage: Running, told: object) -> None:
        if isinstance(told, of.Made | of.UpToDate) and told.path.parent.name in FOLDERS:
            self._arrivals.trust(told.path)
        if isinstance(told, of.UpToDate | of.LeftOut | of.Note):
            words = repr(told)
            if words in self._told:
                return
            self._told.add(words)
        self._note_status(stage, told)
        logged = told_by(stage.name, told, self._clock() - self._began_s)
        if logged is not None:
            self._tell(logged)

    def _note_status(self, stage: Running, told: object) -> None:
        match told:
            case Takes():
                stage.taken_s = self._clock()
                total = 0 if told.budget_s is None else round(told.budget_s)
                stage.status = dataclasses.replace(stage.status, now_s=told.end_s, total=total)
            case of.Progress() if told.stage != "rounds":
                stage.status = dataclasses.replace(
                    stage.status, done=told.done, total=told.total, problem=""
                )
            case of.Made() if told.path.stem.isdigit():
                stage.status = dataclasses.replace(stage.status, last_s=int(told.path.stem))
            case of.Result() if stage.name == CALIBRATE:
                score, ceiling = told.value.get("S"), told.value.get("ceiling")
                self._status = dataclasses.replace(
                    self._status, score=score, ceiling=ceiling, rule=told.value.get("rule", "")
                )
            case Skipped():
                n_skipped = self._status.n_skipped + 1
                self._status = dataclasses.replace(self._status, n_skipped=n_skipped)

    def _take_outcome(self, stage: Running, outcome: Outcome) -> None:
        stage.failures, stage.said, stage.left_out = 0, "", outcome.left_out
        stage.status = dataclasses.replace(stage.status, now_s=None, done=0, problem="")
        self._busy_s = self._clock()
        if stage.name == TRACK:
            # A camera that went away is asked again: its recording has no end yet.
            starts = dict.fromkeys(segment_starts(self._root), 0.0)
            stage.is_over = has_ended(self._root, starts)
            stage.retry_s = self._clock() + _RETRY_S[-1]
        elif outcome.end_s is None:
            stage.done_for = stage.asked_for
        else:
            self._log_round(stage, outcome.end_s)

    def _log_round(self, stage: Running, end_s: int) -> None:
        now_s = self._clock()
        seen_s = self._order(stage.name).seen_s.get(end_s, stage.taken_s)
        values = {"took_s": round(now_s - stage.taken_s, 3), "lag_s": round(now_s - seen_s, 3)}
        self._status = dataclasses.replace(self._status, lag_s=now_s - seen_s)
        self._log("finished", stage.name, window_end_s=end_s, **values)

    def _take_failure(self, stage: Running, failure: Failure) -> None:
        """Try again later; what a person must mend before anything can work ends the watch."""
        if failure.exit_code is None:
            stage.worker.stop()
            stage.worker = Worker(stage.name, stage.job, niceness=NICENESS[stage.name])
            self._log("started", stage.name, process=stage.worker.process)
        elif self._options.once or (
            stage.name == TRACK and stage.status.last_s is None and failure.exit_code == 1
        ):
            raise failure.error
        wait_s = _RETRY_S[min(stage.failures, len(_RETRY_S) - 1)]
        stage.failures += 1
        stage.retry_s = self._clock() + wait_s
        stage.status = dataclasses.replace(stage.status, now_s=None, problem=failure.message)
        if failure.message != stage.said:
            stage.said = failure.message
            values = {"problem": failure.message, "hint": failure.hint, "retry_s": wait_s}
            self._log("failed", stage.name, **values)

    def _is_at_rest(self, stage: Running) -> bool:
        if stage.name == TRACK:
            return stage.is_over
        idle = not stage.worker.is_busy and stage.failures == 0
        return idle and stage.done_for == self._seen_by(stage.name)

    def _is_restless(self) -> bool:
        """Return whether something is to be looked at soon, without a hint."""
        return self._arrivals.unsettled or any(
            stage.worker.is_busy or not self._is_at_rest(stage) for stage in self._stages.values()
        )

    def _has_all(self) -> bool:
        """Return whether the statistics of all windows are there, where others make them."""
        if ANALYSE in self._stages or CALIBRATE not in self._stages:
            return True
        ends = window_ends(open_trial(self._root).trial, of.say_nothing)
        return self._arrivals.whole_s["stats"].keys() >= set(ends)

    def _has_been_idle(self) -> bool:
        idle_s = self._options.until_idle_s
        return idle_s is not None and self._clock() - self._busy_s >= idle_s

    def _because(self) -> str:
        if self._options.once:
            return "all is made that could be"
        if self._ended and self._has_all():
            return "the recording has ended"
        return "nothing has changed for a while"

    def _snapshot(self) -> Status:
        stages = {name: stage.status for name, stage in self._stages.items()}
        return dataclasses.replace(self._status, stages=stages)

    def _log(self, kind: str, stage: str | None = None, **values: object) -> None:
        at_s = self._clock() - self._began_s
        self._tell(Happened(at_s=at_s, kind=kind, stage=stage, values=values))
