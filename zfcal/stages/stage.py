"""What a stage says: what there is to make, where each thing would come from, and how it is made.

`Stage` is for many things of a trial, `OneThing` for one. `zfcal.stages.making` does for all of
them what has to be the same everywhere. What a trial is and what bears on a run is in
`trial_context`, what is told in `events`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar, Generic, TypeAlias, TypeVar

from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.stages.events import Event, Tell
from zfcal.stages.trial_context import Task

K = TypeVar("K")
S = TypeVar("S")

Write: TypeAlias = Callable[[Path, Lineage], Iterable[Event] | None]
"""Writes a file whole, with its lineage; returns what is to be told after it has appeared.

A file beside it, such as a picture, is a `Made` without a reason: it has that of the file.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run of a stage on a trial.

    Parameters
    ----------
    root
        The folder to which the paths in lineage are relative: the trial's directory.
    command
        The stage's name.
    tell
        Hears of everything.
    task
        How to go about it.
    planned
        What a dry run has planned so far.
    """

    root: Path
    command: str
    tell: Tell
    task: Task
    planned: list[Path] = field(default_factory=list)

    def lineage(
        self,
        schema: str,
        inputs: Iterable[Path],
        *,
        options: Mapping[str, JSON] | None = None,
        seed: int | None = None,
    ) -> Lineage:
        """Return where a file comes from that is made of these inputs now; each is hashed.

        Parameters
        ----------
        schema
            Of the file.
        inputs
            All files that bear on it.
        options
            All that was asked for and bears on it.
        seed
            Of its random numbers; None where there are none.
        """
        return Lineage(
            schema=schema,
            command=self.command,
            options=options or {},
            seed=seed,
            inputs=hash_inputs(self.root, inputs),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """A file that a stage makes.

    Parameters
    ----------
    path
        Where it goes.
    lineage
        The lineage that it would get now.
    ignore
        Options in it that do not bear on the result of this run.
    otherwise
        Why it is to be made although its lineage is the same; None for no reason.
    sidecar
        The output that has its lineage, for a file of a form that has no place for one.
    """

    path: Path
    lineage: Lineage
    ignore: tuple[str, ...] = ()
    otherwise: str | None = None
    sidecar: Path | None = None

    def with_options(self, **options: JSON) -> Output:
        """Return it with options in its lineage that came to be known on the way."""
        lineage = replace(self.lineage, options={**self.lineage.options, **options})
        return replace(self, lineage=lineage)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A file whose content is known, or can be computed.

    Parameters
    ----------
    output
        Which file, with a lineage that may have come to be known on the way.
    write
        Writes it.
    """

    output: Output
    write: Write


def _nothing() -> None:
    """Do nothing: for things that are finished when their files are there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """One thing that a stage makes: files that stand on the same inputs.

    Parameters
    ----------
    outputs
        The files, in the order in which they appear; empty where only `compute` knows them.
    compute
        Yields the files; each is written before the next one is asked for. Of files that are
        made together it is called only if they are made. Where each is made by itself a dry run
        calls it too: so it says what is damaged. What takes long then belongs into `Draft.write`.
    finish
        Does what is to be done where the files are there, made now or before.
    apart
        Whether each file is up to date or made by itself; otherwise all of them or none.
    expected
        For a dry run: further files, as far as they are known before.
    """

    outputs: Sequence[Output]
    compute: Callable[[], Iterable[Draft]]
    finish: Callable[[], None] = _nothing
    apart: bool = False
    expected: Sequence[Path] = ()


class Stage(ABC, Generic[S, K]):
    """Makes many things of a trial, one after the other."""

    name: ClassVar[str]
    """The command: of the lock and in lineage."""

    counted: ClassVar[str]
    """What progress calls the things."""

    is_chain: ClassVar[bool] = False
    """Whether each thing starts from the one before: then none is made after one left out."""

    scores_tracks: ClassVar[bool] = False
    """Whether tracks are scored, or a model held against them: settings must agree with these."""

    @abstractmethod
    def open(self, run: Run) -> S:
        """Read what the things share. It is read again where it has changed."""

    @abstractmethod
    def items(self, shared: S) -> Sequence[K]:
        """Return what there is to make, by its keys, such as the ends of windows."""

    @abstractmethod
    def place(self, shared: S, key: K) -> Path:
        """Return the file by which a thing that is left out is named."""

    @abstractmethod
    def item(self, shared: S, key: K) -> Item | None:
        """Return a thing; None where it cannot be made, or is not asked for. That was told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OneThing:
    """Makes one thing; what goes wrong ends the command.

    Parameters
    ----------
    name
        The command: of the lock and in lineage.
    item
        Returns the thing; None where there is nothing to make, which was told.
    scores_tracks
        As of a `Stage`.
    """

    name: str
    item: Callable[[Run], Item | None]
    scores_tracks: bool = False
