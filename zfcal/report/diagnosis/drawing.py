"""Drawing a diagnosis: its pictures, and the page as text. Nothing is written here.

What is returned can be sent from one process to another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from zfcal.diagnose.document import Sheet
from zfcal.report.contents import Section
from zfcal.report.diagnosis.figures import finding_picture
from zfcal.report.diagnosis.overview import gap_picture, screened_picture
from zfcal.report.diagnosis.tables import tables
from zfcal.report.diagnosis.words import facts, statements, verdict_sentence
from zfcal.report.figures.panels import Picture, png_of
from zfcal.report.figures.printing import printed
from zfcal.report.options import Printing
from zfcal.report.render import render, section_of


def files_of(sheet: Sheet, printing: Printing) -> dict[str, bytes]:
    """Return the pictures of findings as files, by their name, in their order on the page."""
    return {
        f"{picture.name}.{kind}": _file_of(picture, kind, printing)
        for picture in pictures_of(sheet)
        for kind in printing.formats
    }


def _file_of(picture: Picture, kind: str, printing: Printing) -> bytes:
    if kind == "png" and printing.width_mm is None:
        return png_of(picture)
    return printed(picture, kind, width_mm=printing.width_mm)


def sections_of(sheet: Sheet) -> list[Section]:
    """Return the pictures of findings as a page shows them."""
    return list(map(section_of, pictures_of(sheet)))


def page_of(
    sheet: Sheet,
    sections: Sequence[Section],
    provenance: Mapping[str, Any],
    formats: Sequence[str],
) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    sheet
        What it shows.
    sections
        From `sections_of`.
    provenance
        What stands in the page of where it comes from.
    formats
        In which the pictures lie beside it.
    """
    return render(_content(sheet), sections, provenance, formats)


def pictures_of(sheet: Sheet) -> list[Picture]:
    """Return the pictures of findings, in the order in which they are told."""
    findings = sheet.findings
    found = [effect.name for effect in findings.effects]
    pairs = zip(findings.effects, findings.pictured, strict=True)
    made = [
        gap_picture(findings.gap),
        *(
            None
            if pictured is None
            else finding_picture(effect.name, n, pictured, sheet.arena, effect.by_features)
            for n, (effect, pictured) in enumerate(pairs, start=1)
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
