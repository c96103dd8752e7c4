"""``findings.json`` and the page beside it: read, written, kept in step."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.reading.contents import hash_of
from zfcal.artifacts.validation import check, read_json
from zfcal.diagnose.document import Findings, Sheet, read_document
from zfcal.errors import InputError
from zfcal.stages.events import Made, Planned, Tell, UpToDate
from zfcal.stages.trial_context import OpenTrial, Task

FOLDER = "diagnosis"
FILE = "findings.json"


class Draw(Protocol):
    """Who draws a page about findings into their folder."""

    def prepare(self) -> None:
        """Get ready beside other work: what takes a while is about to be computed."""

    def reason(self, folder: Path, findings_sha256: str) -> str | None:
        """Return why the page must be drawn; None if it shows these findings."""

    def files(self, folder: Path) -> list[Path]:
        """Return the page that is there and its pictures."""

    def write(self, folder: Path, sheet: Sheet) -> list[Path]:
        """Draw pictures and page and return them, the page first; it appears last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Book:
    """Where findings lie, and who draws their page.

    Parameters
    ----------
    opened
        The trial.
    folder
        Of the findings.
    draw
        None for the findings alone.
    """

    opened: OpenTrial
    folder: Path
    draw: Draw | None = None

    @property
    def path(self) -> Path:
        """The findings."""
        return self.folder / FILE

    def read(self) -> tuple[dict[str, Any], Findings]:
        """Return the findings as a document, and what it says.

        Raises
        ------
        ZfcalError
            The file is missing, damaged, or no findings.
        """
        return read_findings(self.path)

    def replace(self, document: Mapping[str, Any]) -> None:
        """Write a document that has its lineage."""
        _write(self.path, document)

    def show(self, tell: Tell, task: Task) -> None:
        """See to it that the page shows the findings, and tell of its files."""
        if self.draw is None:
            return
        digest = hash_of(self.path)
        reason = self.draw.reason(self.folder, digest) or ("forced" if task.force else None)
        if reason is None:
            for path in self.draw.files(self.folder):
                tell(UpToDate(path=path))
            return
        if task.dry_run:
            tell(Planned(path=self.folder / "report.html", reason=reason))
            return
        for path in self.draw.write(self.folder, self._sheet(digest)):
            tell(Made(path=path, reason=reason))

    def _sheet(self, digest: str) -> Sheet:
        document, findings = self.read()
        lineage = document.get("lineage", {})
        return Sheet(
            trial=self.opened.trial.root.resolve().name,
            model=str(lineage.get("options", {}).get("model", "")),
            arena=self.opened.arena,
            findings=findings,
            provenance={"findings": digest, "lineage": lineage},
        )


def write_findings(document: Mapping[str, Any], path: Path, lineage: Lineage) -> None:
    """Write findings whole, or not at all.

    Parameters
    ----------
    document
        Without lineage.
    path
        Where they go.
    lineage
        Where they come from.
    """
    origin = lineage.as_dict()
    # The file's own schema stands at its head, once.
    del origin["schema"]
    _write(path, {**document, "lineage": origin})


def _write(path: Path, document: Mapping[str, Any]) -> None:
    check(document, "findings", path)
    write_text_whole(path, json.dumps(document, indent=1, ensure_ascii=False) + "\n")


def read_findings(path: Path) -> tuple[dict[str, Any], Findings]:
    """Return findings as a document, and what it says.

    Raises
    ------
    InputError
        The file is missing, or a key is unknown, missing or wrong.
    DamagedError
        It is no JSON.
    """
    document = read_json(path)
    check(document, "findings", path)
    try:
        return document, read_document(document)
    except ValueError as error:
        raise InputError(
            f"{path}: its details do not fit its effects ({error}).",
            hint="Make it again: zfcal diagnose TRIAL --force",
        ) from error
