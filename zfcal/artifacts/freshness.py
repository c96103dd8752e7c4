"""Whether an artifact is up to date with what it was made from."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from zfcal.artifacts.lineage import JSON, Lineage, read_lineage, to_json
from zfcal.artifacts.reading.contents import hash_of
from zfcal.errors import DamagedError, InputError


def hash_inputs(root: Path, paths: Iterable[Path]) -> dict[str, str]:
    """Return the SHA-256 of files by their path relative to the trial, sorted.

    A file is hashed once for as long as its time, size and inode stay.

    Parameters
    ----------
    root
        The trial's directory.
    paths
        Files, of this trial or of others.

    Raises
    ------
    InputError
        A file is missing or cannot be read.
    """
    return dict(sorted((relative_to(root, path), hash_of(path)) for path in paths))


def relative_to(root: Path, path: Path) -> str:
    """Return a path as lineage states it: relative to the trial, with forward slashes."""
    start, text = f"{root}{os.sep}", str(path)
    if text.startswith(start) and ".." not in text and os.sep == "/":
        # The common case, and the quick one: a trial of a day asks it a million times.
        return text.removeprefix(start)
    return Path(os.path.relpath(path.absolute(), root.absolute())).as_posix()


def stale_reason(
    outputs: Sequence[Path],
    expected: Lineage,
    *,
    ignore_options: Sequence[str] = (),
    root: Path | None = None,
) -> str | None:
    """Return why outputs must be made again; None if they are up to date.

    A new package version is no reason: see `version_change`. Nor is another
    schema's name, since one run of a command may write files of several.

    Parameters
    ----------
    outputs
        All files that one run makes.
    expected
        The lineage that they would get now.
    ignore_options
        Options that do not bear on the result of this run.
    root
        The folder to which the paths in lineage are relative; None for one above the output.

    Returns
    -------
    str or None
        One line, such as ``missing`` or ``option runs: 1 -> 2``.
    """
    for path in outputs:
        roots = path.absolute().parents if root is None else [root]
        reason = _reason(path, expected, ignore_options, roots)
        if reason:
            return reason
    return None


def version_change(outputs: Sequence[Path], expected: Lineage) -> str | None:
    """Return ``made by 0.1.0, this is 0.2.0`` if an output is of another package version."""
    for path in outputs:
        try:
            found = read_lineage(path).version
        except (InputError, DamagedError):
            continue
        if found != expected.version:
            return f"made by {found}, this is {expected.version}"
    return None


def _reason(
    path: Path, expected: Lineage, ignore_options: Sequence[str], roots: Sequence[Path]
) -> str | None:
    if not path.exists():
        return "missing"
    try:
        found = read_lineage(path)
    except (InputError, DamagedError) as error:
        return f"damaged: {str(error).removeprefix(f'{path}: ').rstrip('.')}"
    return (
        _schema_change(found.schema, expected.schema)
        or _command_change(found, expected)
        or _input_change(found.inputs, expected.inputs, roots)
        or _option_change(found.options, expected.options, ignore_options)
        or (None if found.seed == expected.seed else f"seed: {found.seed} -> {expected.seed}")
    )


def _schema_change(found: str, expected: str) -> str | None:
    same_kind = found.partition("/")[0] == expected.partition("/")[0]
    return f"schema: {found} -> {expected}" if same_kind and found != expected else None


def _command_change(found: Lineage, expected: Lineage) -> str | None:
    if found.command == expected.command:
        return None
    return f"made by {found.command}, not by {expected.command}"


def _input_change(
    found: Mapping[str, str], expected: Mapping[str, str], roots: Sequence[Path]
) -> str | None:
    for name in sorted({*found, *expected}):
        if name not in found:
            return f"input {name} is new"
        if name not in expected:
            # It may be there, and not be asked any more: another option, or a shorter stretch.
            is_there = any((root / name).exists() for root in roots)
            return f"{name} is no longer an input" if is_there else f"input {name} is gone"
        if found[name] != expected[name]:
            return f"input {name} changed"
    return None


def _option_change(
    found: Mapping[str, JSON], expected: Mapping[str, JSON], ignore: Sequence[str]
) -> str | None:
    for name in sorted({*found, *expected}.difference(ignore)):
        old, new = found.get(name), expected.get(name)
        # 1 and True are equal in Python, and not in a file.
        if old != new or isinstance(old, bool) != isinstance(new, bool):
            return f"option {name}: {_shown(old)} -> {_shown(new)}"
    return None


def _shown(value: JSON) -> str:
    if value is None:
        return "none"
    return value if isinstance(value, str) else to_json(value)
