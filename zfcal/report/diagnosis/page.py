"""The page of a diagnosis: drawn from findings alone, and whether it still shows them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any, TypeVar

from zfcal.artifacts.atomic import storage_error, write_bytes_whole, write_text_whole
from zfcal.artifacts.lineage import package_version
from zfcal.artifacts.reading.contents import sha256_of
from zfcal.diagnose.document import Sheet
from zfcal.report.contents import Section
from zfcal.report.options import FORMATS, Printing, printing_of

T = TypeVar("T")

PAGE = "report.html"

_ENDINGS = tuple(f".{kind}" for kind in FORMATS)

_EMBEDDED = re.compile(r'<script type="application/json" id="provenance">(.*?)</script>', re.DOTALL)


def write(
    folder: Path,
    sheet: Sheet,
    pool: Executor | None = None,
    *,
    printing: Printing | None = None,
) -> list[Path]:
    """Draw pictures and page of findings.

    Parameters
    ----------
    folder
        Where they go.
    sheet
        What they show.
    pool
        Whose workers draw; None for whoever calls.
    printing
        In which form pictures are files; None for that of the page that is there.

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
    ask = _at_once if pool is None else pool.submit
    form = printing or printing_of((_provenance(folder / PAGE) or {}).get("printing", {}))
    drawn, sections = ask(_pictures, sheet, form), ask(_sections, sheet)
    hashes = {}
    for name, picture in drawn.result().items():
        path = folder / name
        write_bytes_whole(path, picture)
        hashes[path.name] = sha256_of(path)
    _remove_outdated(folder, set(hashes))
    provenance = {**sheet.provenance, "pictures": hashes, "version": package_version()}
    if said := form.as_lineage():
        provenance["printing"] = said
    page = ask(_page, sheet, sections.result(), provenance, form.formats)
    write_text_whole(folder / PAGE, page.result())
    return files(folder)


def reason(folder: Path, findings_sha256: str, printing: Printing | None = None) -> str | None:
    """Return why a page must be drawn; None if it is whole and shows the findings.

    Parameters
    ----------
    folder
        Where it lies.
    findings_sha256
        Of the findings that it has to show.
    printing
        In which form pictures have to be files; None for any.
    """
    page = folder / PAGE
    if not page.is_file():
        return "missing"
    said = _provenance(page)
    if said is None:
        return "damaged: it does not say what it shows"
    if said.get("findings") != findings_sha256:
        return "the findings changed"
    if printing is not None and said.get("printing", {}) != printing.as_lineage():
        return "format or width of the pictures changed"
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


def _provenance(page: Path) -> dict[str, Any] | None:
    try:
        found = _EMBEDDED.search(page.read_text(encoding="utf-8"))
        said = json.loads(found.group(1)) if found else None
    except (OSError, ValueError):
        return None
    return said if isinstance(said, dict) else None


def _at_once(work: Callable[..., T], *args: Any) -> Future[T]:
    done: Future[T] = Future()
    done.set_result(work(*args))
    return done


# Matplotlib is slow to load: whoever draws loads it, and a page that is up to date needs nobody.


def _pictures(sheet: Sheet, printing: Printing) -> dict[str, bytes]:
    from zfcal.report.diagnosis.drawing import files_of

    return files_of(sheet, printing)


def _sections(sheet: Sheet) -> list[Section]:
    from zfcal.report.diagnosis.drawing import sections_of

    return sections_of(sheet)


def _page(
    sheet: Sheet,
    sections: Sequence[Section],
    provenance: Mapping[str, Any],
    formats: Sequence[str],
) -> str:
    from zfcal.report.diagnosis.drawing import page_of

    return page_of(sheet, sections, provenance, formats)


def _remove_outdated(folder: Path, made: set[str]) -> None:
    """Remove pictures of an older page that this one has not: they would pass for current."""
    before = (_provenance(folder / PAGE) or {}).get("pictures", {})
    for name in set(before) - made:
        if Path(name).name == name and name.endswith(_ENDINGS):
            try:
                (folder / name).unlink(missing_ok=True)
            except OSError as error:
                raise storage_error(folder / name, error) from error
