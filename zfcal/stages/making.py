"""Makes what stages say, each thing in the same way.

`run` does for all stages what has to be the same everywhere:

* One run of a command at a time on a trial, and no lock where nothing is written.
* A file that is there and whose lineage would be the same now is up to date.
* A dry run says what would be made and why.
* Each thing is made from one content of all that it stands on: the hashes in its lineage are
  those of the bytes that were read (`zfcal.artifacts.reading.contents`). Before a file appears
  all inputs are looked at again. If one has changed nothing is published, and the thing is made
  once more. If one changes again, a thing among many is left to the next run; of one thing alone
  that is an error.
* A damaged input, or a folder in the place of a file, keeps that thing away and no other.
* What happened is told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Generic, TypeVar, final

from zfcal.artifacts.agreement import check_agreement
from zfcal.artifacts.atomic import check_free
from zfcal.artifacts.freshness import stale_reason
from zfcal.artifacts.reading.contents import one_content
from zfcal.artifacts.settings import read_trial
from zfcal.errors import ChangedError, DamagedError
from zfcal.stages.events import Event, LeftOut, Made, Note, Planned, Progress, Tell, UpToDate
from zfcal.stages.stage import Draft, Item, OneThing, Output, Run, Stage
from zfcal.stages.taken import unless_taken
from zfcal.stages.trial_context import Task, at_work, tell_version

K = TypeVar("K")
S = TypeVar("S")
T = TypeVar("T")


def run(
    stage: Stage[S, K] | OneThing, root: Path, tell: Tell, *, task: Task | None = None
) -> list[Path]:
    """Make what is missing or stale of a trial.

    Parameters
    ----------
    stage
        What to make, with the options that bear on it.
    root
        The trial's directory.
    tell
        Hears of every file, of what is left out, and of progress.
    task
        How to go about it.

    Returns
    -------
    list of Path
        The files that are there now; none that a dry run would make.

    Raises
    ------
    ZfcalError
        The trial is wrong or its tracks are of other agents than it states, the disk is full, or
        the same command is at work on it.
    ChangedError
        Inputs of the only thing changed again and again.
    """
    task = task or Task()
    # First: where there is no trial no lock is to lie.
    trial = read_trial(root)
    if stage.scores_tracks:
        check_agreement(trial)
    started = Run(root=root, command=stage.name, tell=tell, task=task)
    with at_work(root, stage.name, task):
        if isinstance(stage, OneThing):
            return make_alone(stage, started)
        return _make_each(stage, started)


def make_alone(stage: OneThing, run: Run) -> list[Path]:
    """Make the one thing of a stage; as `run`, for whoever holds the lock, or needs none."""
    return settled(lambda: _Making(run, is_alone=True).make(stage.item(run)), run.tell)


def settled(work: Callable[[], T], tell: Tell) -> T:
    """Do a piece of work from one content of its inputs, and once more if one has changed.

    For what is no stage, such as the start of a drive.

    Parameters
    ----------
    work
        Reads its inputs and publishes what it makes.
    tell
        Hears that it is done again.

    Raises
    ------
    ChangedError
        An input has changed both times; nothing was published the second time.
    """
    try:
        with one_content():
            return work()
    except ChangedError as error:
        tell(_again(error))
    with one_content():
        return work()


def _again(error: ChangedError) -> Note:
    return Note(text=f"{error} What depends on it is made again.", warning=True)


def _make_each(stage: Stage[S, K], run: Run) -> list[Path]:
    things = _Things(stage, run)
    keys = stage.items(things.shared)
    there: list[Path] = []
    for number, key in enumerate(keys, start=1):
        found = things.make(key)
        if found is None and stage.is_chain:
            # What follows would start from another one than in the next run.
            break
        there += found or []
        run.tell(Progress(stage=stage.counted, done=number, total=len(keys)))
    return there


@final
class _Things(Generic[S, K]):
    """The things of a stage, each made from one content of all that it stands on."""

    def __init__(self, stage: Stage[S, K], run: Run) -> None:
        self._stage = stage
        self._run = run
        self.shared = self._opened()

    def make(self, key: K) -> list[Path] | None:
        """Make a thing, once more if an input has changed; None where one has changed again."""
        path, tell = self._stage.place(self.shared, key), self._run.tell
        try:
            return self._attempt(key)
        except ChangedError as error:
            tell(_again(error))
        try:
            self.shared = self._opened()
            return self._attempt(key)
        except ChangedError as error:
            problem = f"{path}: not made, {error}"
            tell(LeftOut(path=path, problem=problem, hint=error.hint))
            return None

    def _attempt(self, key: K) -> list[Path]:
        try:
            with one_content(self._seen):
                return _Making(self._run).make(self._stage.item(self.shared, key))
        except DamagedError as error:
            if self._stage.is_chain:
                raise
            path = self._stage.place(self.shared, key)
            problem = f"{path}: not made, {error}"
            self._run.tell(LeftOut(path=path, problem=problem, hint=error.hint))
            return []

    def _opened(self) -> S:
        with one_content() as self._seen:
            return settled(partial(self._stage.open, self._run), self._run.tell)


@final
class _Making:
    """Makes things, one attempt at a time."""

    def __init__(self, run: Run, *, is_alone: bool = False) -> None:
        self._run = run
        self._is_alone = is_alone

    def make(self, item: Item | None) -> list[Path]:
        """Make what is missing or stale of a thing, and return what is there of it."""
        if item is None:
            return []
        outputs = item.outputs
        reason = self._reason(outputs)
        if outputs and reason is None:
            self._tell_fresh(item, outputs)
            there = [output.path for output in outputs]
        elif item.apart:
            there = [draft.output.path for draft in item.compute() if self._publish(draft)]
        else:
            there = self._together(item, outputs, reason or "missing")
        if there:
            item.finish()
        return there

    def _reason(self, outputs: Sequence[Output]) -> str | None:
        """Return why files are to be made; None if all of them are up to date."""
        for output in outputs:
            if output.sidecar is not None:
                reason = None if output.path.is_file() else "missing"
            else:
                reason = stale_reason(
                    [output.path],
                    output.lineage,
                    ignore_options=output.ignore,
                    root=self._run.root,
                )
            if reason is not None:
                return reason
        if self._run.task.force:
            return "forced"
        return next((output.otherwise for output in outputs if output.otherwise), None)

    def _tell_fresh(self, item: Item, outputs: Sequence[Output]) -> None:
        """Tell of files that are up to date; of another version's once for those of a kind."""
        folders: dict[Path, list[Output]] = {}
        for output in outputs:
            folders.setdefault(output.path.parent if item.apart else Path(), []).append(output)
        for kind in folders.values():
            tell_version([output.path for output in kind], kind[0].lineage, self._run.tell)
            for output in kind:
                self._run.tell(UpToDate(path=output.path))

    def _publish(self, draft: Draft) -> bool:
        """Write one of the files that are made each by itself, if it is missing or stale."""
        run, output = self._run, draft.output
        reason = self._reason([output])
        if reason is None:
            tell_version([output.path], output.lineage, run.tell)
            run.tell(UpToDate(path=output.path))
            return True
        if run.task.dry_run:
            self._plan([output.path], reason)
            return False
        is_there = False
        with unless_taken(output.path, run.tell):
            said = draft.write(output.path, output.lineage)
            is_there = True
            run.tell(Made(path=output.path, reason=reason))
            self._tell_after(said, reason)
        return is_there

    def _together(self, item: Item, outputs: Sequence[Output], reason: str) -> list[Path]:
        """Make files of which all are made or none."""
        run = self._run
        if not self._is_alone and self._is_taken(outputs):
            return []
        if run.task.dry_run:
            self._plan([*item.expected, *(output.path for output in outputs)], reason)
            return []
        for output in outputs:
            check_free(output.path)
        made: list[tuple[Path, Iterable[Event] | None]] = []
        for draft in item.compute():
            path = draft.output.path
            made.append((path, draft.write(path, draft.output.lineage)))
        for path, _ in made:
            run.tell(Made(path=path, reason=reason))
        for _, said in made:
            self._tell_after(said, reason)
        return [path for path, _ in made]

    def _tell_after(self, said: Iterable[Event] | None, reason: str) -> None:
        for event in said or ():
            if isinstance(event, Made) and not event.reason:
                self._run.tell(replace(event, reason=reason))
            else:
                self._run.tell(event)

    def _plan(self, paths: Iterable[Path], reason: str) -> None:
        for path in dict.fromkeys(paths):
            self._run.tell(Planned(path=path, reason=reason))
            self._run.planned.append(path)

    def _is_taken(self, outputs: Sequence[Output]) -> bool:
        """Return whether a folder stands where one of the files is to go, which is told."""
        for output in outputs:
            is_free = False
            with unless_taken(output.path, self._run.tell):
                check_free(output.path)
                is_free = True
            if not is_free:
                return True
        return False
