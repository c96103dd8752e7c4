"""The files of an export, and the sidecar that says where they come from and what is lost."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeAlias

from zfcal.artifacts.atomic import discard, storage_error, write_text_whole, write_whole
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.reading.contents import sha256_of
from zfcal.artifacts.tables import EXPORT
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import LeftOut, Note, Tell
from zfcal.stages.stage import Draft, Item, Output, Run

SCHEMA = EXPORT

WriteWhole: TypeAlias = Callable[[Path, Lineage], None]
"""Writes a file to a path whose ending says nothing about the format."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Content:
    """What an export consists of.

    Parameters
    ----------
    files
        How each file is written, by its name.
    lost
        What the format has no place for, a sentence each.
    read_back
        The options by which `zfcal import` reads it again; empty where it does not.
    left_out
        Inputs that are damaged, and how, a sentence each.
    """

    files: Mapping[str, WriteWhole]
    lost: tuple[str, ...] = ()
    read_back: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where an export goes.

    Parameters
    ----------
    root
        The trial's directory.
    name
        The format.
    folder
        None for ``export/NAME`` in the trial.
    reads
        The file that `zfcal import` is given; empty for the folder.
    """

    root: Path
    name: str
    folder: Path | None = None
    reads: str = ""

    @property
    def where(self) -> Path:
        """The folder of the files."""
        return self.folder or self.root / "export" / self.name

    @property
    def sidecar(self) -> Path:
        """The file that says where the others come from."""
        return self.where / f"export-{self.name}.json"

    def make(self) -> None:
        """Make the folder; in a trial nothing above it, since that may just have been moved.

        Raises
        ------
        StorageError
            It cannot be made.
        """
        try:
            if self.folder is None:
                self.where.parent.mkdir(exist_ok=True)
            self.where.mkdir(parents=self.folder is not None, exist_ok=True)
        except OSError as error:
            raise storage_error(self.where, error) from error


@dataclass(frozen=True, slots=True, kw_only=True)
class _Manifest:
    """What a sidecar says: see `Content`; files by their SHA-256."""

    files: Mapping[str, str] = field(default_factory=dict)
    lost: tuple[str, ...] = ()
    read_back: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()


def exported(
    run: Run,
    place: Place,
    lineage: Lineage,
    make: Callable[[], Content],
    names: Iterable[str] = (),
) -> Item:
    """Return the files of an export as what a stage makes.

    Parameters
    ----------
    run, place
        On which trial, and where they go.
    lineage
        Of all of them.
    make
        Reads the trial and returns what the files are; called only where they are made.
    names
        Those of its files that are known before, for a dry run.
    """
    known = _read(place.sidecar).files
    outputs = [_output(place, lineage, name, digest) for name, digest in known.items()]
    return Item(
        outputs=[*outputs, Output(path=place.sidecar, lineage=lineage)],
        compute=lambda: _drafts(run, place, lineage, make),
        finish=lambda: _tell(place, run.tell),
        expected=[place.where / name for name in names],
    )


def _output(place: Place, lineage: Lineage, name: str, digest: str = "") -> Output:
    path = place.where / name
    is_other = bool(digest) and path.is_file() and sha256_of(path) != digest
    why = f"{name} was changed" if is_other else None
    return Output(path=path, lineage=lineage, otherwise=why, sidecar=place.sidecar)


def _drafts(
    run: Run, place: Place, lineage: Lineage, make: Callable[[], Content]
) -> Iterator[Draft]:
    content = make()
    before = _read(place.sidecar).files
    place.make()
    for name, write in content.files.items():
        yield Draft(output=_output(place, lineage, name), write=partial(_write, write))
    hashes = {name: sha256_of(place.where / name) for name in content.files}
    sidecar = Output(path=place.sidecar, lineage=lineage)
    yield Draft(output=sidecar, write=partial(_write_sidecar, place.name, content, hashes))
    for name in before.keys() - hashes.keys():
        discard(place.where / name)
        run.tell(Note(text=f"{place.where / name}: removed, the trial has it no more."))


def _write(write: WriteWhole, path: Path, lineage: Lineage) -> None:
    write_whole(path, lambda part: write(part, lineage), parents=False)


def _write_sidecar(
    name: str, content: Content, hashes: Mapping[str, str], path: Path, lineage: Lineage
) -> None:
    said = lineage.as_dict()
    document = {
        "schema": said.pop("schema"),
        "format": name,
        "files": dict(hashes),
        "lost": list(content.lost),
        "read_back": list(content.read_back),
        "left_out": list(content.left_out),
        "lineage": said,
    }
    check(document, "export", path)
    text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    write_text_whole(path, text, parents=False)


def _read(path: Path) -> _Manifest:
    """Return what a sidecar says; nothing where there is none that is whole."""
    try:
        found = read_json(path)
        check(found, "export", path)
    except (InputError, DamagedError):
        return _Manifest()
    lists = {key: tuple(found[key]) for key in ("lost", "read_back", "left_out")}
    return _Manifest(files=found["files"], **lists)


def _tell(place: Place, tell: Tell) -> None:
    found = _read(place.sidecar)
    for line in found.left_out:
        tell(LeftOut(path=place.sidecar, problem=line))
    for line in found.lost:
        tell(Note(text=f"{place.name}: {line}"))
    if found.read_back:
        command = ["zfcal", "import", str(place.where / place.reads), "TRIAL", *found.read_back]
        tell(Note(text=f"{place.name}: read back with: {shlex.join(command)}"))
