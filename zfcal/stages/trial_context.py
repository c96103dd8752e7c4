"""A trial with its arena, as every stage needs it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from zfcal.arena import Arena
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.freshness import stale_reason, version_change
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.settings import read_trial
from zfcal.stages.events import Note, Planned, Tell, UpToDate
from zfcal.trial import Trial


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """How a stage is to go about its work.

    Parameters
    ----------
    dry_run
        Say what would be made and why, and write nothing.
    force
        Make everything again.
    ends_s
        Only the windows that end at these seconds; None for all.
    """

    dry_run: bool = False
    force: bool = False
    ends_s: frozenset[int] | None = None

    def wants(self, end_s: int) -> bool:
        """Return whether the window that ends then is asked for."""
        return self.ends_s is None or end_s in self.ends_s


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenTrial:
    """A trial's settings and its arena.

    Parameters
    ----------
    trial
        What ``trial.toml`` says.
    arena
        The tank that it names.
    """

    trial: Trial
    arena: Arena

    @property
    def arena_files(self) -> list[Path]:
        """The arena's file where the trial has its own; empty for one that comes with zfcal."""
        place = self.trial.root / self.trial.arena
        return [place] if place.is_file() else []

    @property
    def clock_options(self) -> dict[str, JSON]:
        """The settings that bear on every count: arena, frame rate and step."""
        trial = self.trial
        return {"arena": trial.arena, "fps": trial.fps, "dt_s": trial.dt_s}


def open_trial(root: Path) -> OpenTrial:
    """Read a trial's settings and its arena.

    Raises
    ------
    ZfcalError
        One of the files is missing, damaged or wrong.
    """
    trial = read_trial(root)
    return OpenTrial(trial=trial, arena=load_arena(trial.arena, trial.root))


@contextmanager
def at_work(root: Path, command: str, task: Task) -> Iterator[None]:
    """Hold the trial's lock for a command, unless nothing will be written."""
    with nullcontext() if task.dry_run else lock(root, command):
        yield


def reason_to_make(path: Path, expected: Lineage, task: Task, tell: Tell) -> str | None:
    """Return why an artifact is to be made now; None if it is not, which is told.

    For what does not go through `zfcal.stages.making.run`.

    Parameters
    ----------
    path
        The artifact.
    expected
        The lineage that it would get now.
    task
        A forced task always has a reason, a dry run never.
    tell
        Hears of an artifact that is up to date, or that would be made.
    """
    reason = stale_reason([path], expected)
    if reason is None and task.force:
        reason = "forced"
    if reason is None:
        tell_version([path], expected, tell)
        tell(UpToDate(path=path))
    elif task.dry_run:
        tell(Planned(path=path, reason=reason))
        return None
    return reason


def tell_version(paths: list[Path], expected: Lineage, tell: Tell) -> None:
    """Warn of artifacts that another version of the package has made; they stay."""
    changed = version_change(paths, expected)
    if changed:
        where = paths[0].parent
        tell(Note(text=f"{where}: {changed}; --force makes them again.", warning=True))
