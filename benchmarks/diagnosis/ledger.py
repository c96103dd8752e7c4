"""What the benchmark of the diagnosis has done so far: a line of JSON per finished trial.

A line is keyed by what was asked and by the code that answered, so that a run that was
stopped goes on, and one after a change of the code begins again.
"""

from __future__ import annotations

import ast
import gzip
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

Row = dict[str, Any]


def key_of(said: Mapping[str, Any]) -> str:
    """Return the key of what was asked, whatever the order of its entries."""
    text = json.dumps(said, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def fingerprint(root: Path, places: Iterable[str]) -> str:
    """Return the fingerprint of source files; comments, docstrings and layout do not count.

    Parameters
    ----------
    root
        Of the source tree.
    places
        Files, or folders with all that is in them, relative to it. Tests do not count.
    """
    digest = hashlib.sha256()
    for path in sorted(_files(root, places)):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(_substance(path))
    return digest.hexdigest()[:16]


def _files(root: Path, places: Iterable[str]) -> set[Path]:
    found: set[Path] = set()
    for place in places:
        path = root / place
        inside = path.rglob("*") if path.is_dir() else (path,)
        found |= {each for each in inside if each.suffix in {".py", ".geojson"}}
    return {path for path in found if not path.name.startswith(("test_", "conftest"))}


def _substance(path: Path) -> bytes:
    if path.suffix != ".py":
        return path.read_bytes()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [each for each in body if not _is_text(each)]  # type: ignore[attr-defined]
    return ast.dump(tree).encode()


def _is_text(node: ast.AST) -> bool:
    """Return whether a statement is a string that nobody uses, as docstrings are."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def read(path: Path) -> list[Row]:
    """Return the rows of a ledger, packed or not; a last line that a kill has torn is left out.

    Raises
    ------
    ValueError
        Another line is damaged.
    """
    if not path.exists():
        return []
    data = path.read_bytes()
    text = gzip.decompress(data) if path.suffix == ".gz" else data
    lines = text.decode().split("\n")
    rows = []
    for number, line in enumerate(lines):
        try:
            rows += [json.loads(line)] if line else []
        except json.JSONDecodeError as error:
            if number < len(lines) - 1:
                raise ValueError(f"{path}, line {number + 1} is damaged: {line[:40]!r}") from error
    return rows


def append(path: Path, row: Row) -> None:
    """Add a row to a ledger; it is on the disk when this returns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists():
        _cut_torn(path)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")
        file.flush()
        os.fsync(file.fileno())


def pack(path: Path, rows: Iterable[Row]) -> None:
    """Write rows as one packed ledger; the same rows give the same bytes."""
    lines = sorted(json.dumps(row, sort_keys=True) for row in rows)
    text = "".join(f"{line}\n" for line in lines)
    path.write_bytes(gzip.compress(text.encode(), mtime=0))


def _cut_torn(path: Path) -> None:
    """Cut off a last line without an end."""
    with path.open("r+b") as file:
        if not file.seek(0, os.SEEK_END):
            return
        file.seek(-1, os.SEEK_END)
        if file.read(1) != b"\n":
            file.seek(0)
            file.truncate(file.read().rfind(b"\n") + 1)


def current(rows: Iterable[Row], marks: Mapping[str, str]) -> dict[str, Row]:
    """Return by key the rows that the present code has made; of one key the last counts.

    Parameters
    ----------
    rows
        With ``key``, ``code`` and ``section``.
    marks
        The fingerprint of the code of each section.
    """
    return {row["key"]: row for row in rows if row["code"] == marks.get(row["section"])}
