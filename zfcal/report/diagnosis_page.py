"""The page of a diagnosis: drawn from findings alone, and whether it still shows them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from zfcal.artifacts.atomic import sha256_of, storage_error, write_text_whole, write_whole
from zfcal.artifacts.lineage import package_version
from zfcal.diagnose.document import Sheet
from zfcal.report.diagnosis_figures import finding_picture
from zfcal.report.diagnosis_overview import gap_picture, screened_picture
from zfcal.report.diagnosis_tables import tables
from zfcal.report.diagnosis_words import facts, statements, verdict_sentence
from zfcal.report.panels import Picture, write_picture
from zfcal.report.render import render

PAGE = "report.html"

_EMBEDDED = re.compile(r'<script type="application/json" id="provenance">(.*?)</script>', re.DOTALL)


def write(folder: Path, sheet: Sheet) -> list[Path]:
    """Draw pictures and page of findings.

    Parameters
    ----------
    folder
        Where they go.
    sheet
        What they show.

    Returns
    -------
    list of Path
        The page, then the pictures. The page appears last: whoever finds it finds the
        pictures too.

    Raises
    ------
    StorageError
        The disk is full, or the place cannot be written.
    """
    pictures = pictures_of(sheet)
    hashes = {}
    for picture in pictures:
        path = folder / f"{picture.name}.png"
        write_whole(path, _drawer(picture))
        hashes[path.name] = sha256_of(path)
    _remove_outdated(folder, set(hashes))
    provenance = {**sheet.provenance, "pictures": hashes, "version": package_version()}
    write_text_whole(folder / PAGE, render(_content(sheet), pictures, provenance))
    return files(folder)


def reason(folder: Path, findings_sha256: str) -> str | None:
    """Return why a page must be drawn; None if it is whole and shows the findings.

    Parameters
    ----------
    folder
        Where it lies.
    findings_sha256
        Of the findings that it has to show.
    """
    page = folder / PAGE
    if not page.is_file():
        return "missing"
    said = _provenance(page)
    if said is None:
        return "damaged: it does not say what it shows"
    if said.get("findings") != findings_sha256:
        return "the findings changed"
    for name, digest in said.get("pictures", {}).items():
        path = folder / name
        if not path.is_file():
            return f"{name} is missing"
        if sha256_of(path) != digest:
            return f"{name} was changed"
    return None


def files(folder: Path) -> list[Path]:
    """Return the page that is there and its pictures, the page first."""
    said = _provenance(folder / PAGE) or {}
    return [folder / PAGE, *(folder / name for name in said.get("pictures", {}))]


def pictures_of(sheet: Sheet) -> list[Picture]:
    """Return the pictures of findings, in the order in which they are told."""
    findings = sheet.findings
    found = [effect.name for effect in findings.effects]
    made = [
        gap_picture(findings.gap),
        *(
            None if pictured is None else finding_picture(name, number, pictured, sheet.arena)
            for number, (name, pictured) in enumerate(
                zip(found, findings.pictured, strict=True), start=1
            )
        ),
        screened_picture(findings.screened, found),
    ]
    return [picture for picture in made if picture is not None]


def _content(sheet: Sheet) -> dict[str, Any]:
    return {
        "title": verdict_sentence(sheet.findings),
        "facts": facts(sheet),
        "statements": statements(sheet.findings),
        "gaps": [],
        "left_out": [note.says for note in sheet.findings.notes if note.name == "left-out"],
        "tables": tables(sheet),
    }


def _provenance(page: Path) -> dict[str, Any] | None:
    try:
        found = _EMBEDDED.search(page.read_text(encoding="utf-8"))
        said = json.loads(found.group(1)) if found else None
    except (OSError, ValueError):
        return None
    return said if isinstance(said, dict) else None


def _drawer(picture: Picture) -> Callable[[Path], None]:
    return lambda part: write_picture(picture, part)


def _remove_outdated(folder: Path, made: set[str]) -> None:
    """Remove pictures of an older page that this one has not: they would pass for current."""
    before = (_provenance(folder / PAGE) or {}).get("pictures", {})
    for name in set(before) - made:
        if Path(name).name == name and name.endswith(".png"):
            try:
                (folder / name).unlink(missing_ok=True)
            except OSError as error:
                raise storage_error(folder / name, error) from error
