"""Compare two sets of trials, and write what was found: a document and a picture."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from zfcal.artifacts.atomic import discard, write_bytes_whole, write_text_whole
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.reading.contents import sha256_of
from zfcal.artifacts.validation import check, read_json
from zfcal.report.comparison.document import SCHEMA, compare_document
from zfcal.report.comparison.gathering import check_apart, read_values
from zfcal.report.comparison.picture import comparison_picture
from zfcal.report.figures.panels import compose, png_of
from zfcal.report.gather import Damage, input_files
from zfcal.report.labels import labels_of

Kind = Literal["png", "svg"]

DOCUMENT = "compare.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sets:
    """Two sets of trials.

    Parameters
    ----------
    a, b
        Directories of the trials; what differs is told as A less B.

    Raises
    ------
    InputError
        A set is empty, or a trial would count twice.
    """

    a: Sequence[Path]
    b: Sequence[Path]

    def __post_init__(self) -> None:
        check_apart(self.a, self.b)

    @property
    def roots(self) -> list[Path]:
        """All trials, those of A first."""
        return [*self.a, *self.b]


def compare(sets: Sets, on_damage: Damage, *, lineage: Lineage | None = None) -> dict[str, Any]:
    """Return how two sets of trials differ, as a document.

    Parameters
    ----------
    sets
        The trials.
    on_damage
        Hears of each file that is damaged and left out.
    lineage
        Where the document comes from; by default with paths relative to where one is.

    Returns
    -------
    dict
        Fits ``schemas/compare.schema.json``.

    Raises
    ------
    InputError
        One is no trial, or its settings or arena are wrong.
    """
    labels = labels_of(sets.roots)
    read = [read_values(r, label, on_damage) for r, label in zip(sets.roots, labels, strict=True)]
    split = len(sets.a)
    origin = lineage if lineage is not None else lineage_of(sets, Path())
    return compare_document(read[:split], read[split:], origin)


def write_comparison(
    sets: Sets, folder: Path, on_damage: Damage, *, kind: Kind = "png"
) -> tuple[dict[str, Any], list[Path]]:
    """Compare two sets of trials, and write document and picture.

    Parameters
    ----------
    sets
        The trials.
    folder
        Where the files go.
    on_damage
        Hears of each file that is damaged and left out.
    kind
        Of the picture.

    Returns
    -------
    dict
        The document.
    list of Path
        Its file, and the picture; without an effect size there is none.

    Raises
    ------
    InputError
        One is no trial, or its settings or arena are wrong.
    StorageError
        The disk is full, or the place cannot be written.
    """
    document = compare(sets, on_damage, lineage=lineage_of(sets, folder, kind))
    picture = comparison_picture(document)
    written = []
    if picture is not None:
        path = folder / f"{picture.name}.{kind}"
        write_bytes_whole(path, png_of(picture) if kind == "png" else _svg_of(picture))
        document["files"] = {path.name: sha256_of(path)}
        written.append(path)
    for name in ("compare.png", "compare.svg"):
        # A picture of the last comparison would pass for current.
        if name not in document["files"]:
            discard(folder / name)
    place = folder / DOCUMENT
    check(document, "compare", place)
    write_text_whole(place, json.dumps(document, indent=2, ensure_ascii=False) + "\n")
    return document, [place, *written]


def comparison_reason(sets: Sets, folder: Path, *, kind: Kind = "png") -> str | None:
    """Return why a comparison must be made; None if its files are up to date."""
    place = folder / DOCUMENT
    reason = stale_reason([place], lineage_of(sets, folder, kind))
    if reason is not None:
        return reason
    for name, digest in read_json(place)["files"].items():
        path = folder / name
        if not path.is_file():
            return f"{name} is missing"
        if sha256_of(path) != digest:
            return f"{name} was changed"
    return None


def comparison_files(folder: Path) -> tuple[dict[str, Any], list[Path]]:
    """Return a comparison that is up to date: its document, and its files."""
    document = read_json(folder / DOCUMENT)
    return document, [folder / name for name in (DOCUMENT, *document["files"])]


def lineage_of(sets: Sets, base: Path, kind: Kind | None = None) -> Lineage:
    """Return where a comparison of these trials comes from, paths relative to a folder."""
    labels: list[JSON] = [*labels_of(sets.roots)]
    split = len(sets.a)
    files = [path for root in sets.roots for path in input_files(root)]
    return Lineage(
        schema=SCHEMA,
        command="compare",
        options={"A": labels[:split], "B": labels[split:], "format": kind},
        inputs=hash_inputs(base, files),
    )


def _svg_of(picture: Any) -> bytes:
    from io import BytesIO

    from zfcal.report.figures import theme

    made = BytesIO()
    with theme.style():
        theme.save(compose(picture), made, "svg", said={"Date": None})
    return made.getvalue()
