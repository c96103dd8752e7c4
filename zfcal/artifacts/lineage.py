"""Where an artifact comes from: what every file of a trial carries about itself.

Provenance holds what bears on the numbers (command, options, inputs by hash,
seed, version) and nothing that does not (workers, host, clock), so that the same
work leaves the same bytes. Whether an artifact is out of date is in `freshness`.
"""

from __future__ import annotations

import errno
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeAlias, Union

from zfcal.artifacts.reading.opening import open_regular, read_limited, unreadable
from zfcal.artifacts.reading.parsing import json_of, toml_of
from zfcal.errors import DamagedError, InputError

JSON: TypeAlias = Union["Mapping[str, JSON]", "Sequence[JSON]", str, int, float, bool, None]
"""A value that JSON can hold."""

LINEAGE_KEY = "zfcal.lineage"
"""Key of the Parquet metadata, and name of the MCAP metadata record."""


@cache
def package_version() -> str:
    """Return the version of zfcal that is at work."""
    return version("zfcal")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lineage:
    """Where an artifact comes from.

    Parameters
    ----------
    schema
        Name and version of its form, such as ``zfcal.tracks/1``.
    command
        The command that made it, such as ``analyse``.
    options
        What the command was told and what bears on the result; values that
        are None are left out: not given and None are the same.
    version
        The package version.
    seed
        The seed of its random numbers; None where there are none.
    inputs
        SHA-256 of each input by its path relative to the trial.
    """

    schema: str
    command: str
    options: Mapping[str, JSON] = field(default_factory=dict)
    version: str = field(default_factory=package_version)
    seed: int | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # As they will be read back, so that what is planned can be compared with what is there.
        object.__setattr__(self, "options", json.loads(to_json(_without_none(self.options))))
        object.__setattr__(self, "inputs", dict(sorted(self.inputs.items())))

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON or TOML; the seed is absent where there is none."""
        seed = {} if self.seed is None else {"seed": int(self.seed)}
        return {
            "schema": self.schema,
            "command": self.command,
            "version": self.version,
            **seed,
            "options": dict(self.options),
            "inputs": dict(self.inputs),
        }

    def as_text(self) -> dict[str, str]:
        """Return it for an MCAP metadata record, whose values are text (JSON where no text)."""
        items = self.as_dict().items()
        return {key: value if isinstance(value, str) else to_json(value) for key, value in items}


def to_json(value: object) -> str:
    """Return JSON on one line with sorted keys: the same value, the same text.

    Raises
    ------
    InputError
        The value holds a NaN, an infinity or something that JSON has no word for.
    """
    try:
        return json.dumps(value, sort_keys=True, allow_nan=False, ensure_ascii=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"A value cannot be recorded as JSON: {error}.") from error


def read_lineage(path: Path) -> Lineage:
    """Return what an artifact says about where it comes from.

    Parameters
    ----------
    path
        A ``.parquet``, ``.toml``, ``.mcap`` or ``.json`` file.

    Raises
    ------
    InputError
        The file is missing, or of a kind that carries no lineage.
    DamagedError
        It cannot be read, or carries no lineage or one of another form.
    """
    reader = _READERS.get(path.suffix)
    if reader is None:
        raise InputError(
            f"{path}: files of this kind carry no lineage.",
            hint=f"Those that do end in {', '.join(sorted(_READERS))}.",
        )
    try:
        return _from_dict(path, reader(path))
    except (FileNotFoundError, IsADirectoryError, PermissionError) as error:
        raise unreadable(path, error) from error
    except (OSError, ValueError, MemoryError, struct.error) as error:
        if isinstance(error, OSError) and error.errno == errno.EXDEV:
            raise unreadable(path, error) from error
        raise DamagedError(
            f"{path}: cannot be read whole ({first_line(error)}).",
            hint="Copy it again from where it was made, or remove it and make it again.",
        ) from error


def first_line(error: Exception) -> str:
    """Return the first line of an error's text, without the full stop."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0].rstrip(".")


def _from_dict(path: Path, found: Mapping[str, Any] | None) -> Lineage:
    if found is None:
        raise DamagedError(
            f"{path}: carries no lineage.",
            hint="It was not made by zfcal, or another program has rewritten it.",
        )
    wanted = {"schema": str, "command": str, "version": str, "options": dict, "inputs": dict}
    wrong = [key for key, kind in wanted.items() if not isinstance(found.get(key), kind)]
    seed = found.get("seed")
    if wrong or not (seed is None or isinstance(seed, int)):
        raise DamagedError(
            f"{path}: its lineage is incomplete: {', '.join(wrong or ['seed'])} missing or no "
            f"{'text or table' if wrong else 'whole number'}.",
            hint="Another program has rewritten it: make it again.",
        )
    return Lineage(**{key: found[key] for key in wanted}, seed=seed)


def _without_none(value: JSON) -> JSON:
    if isinstance(value, Mapping):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return value


def _of_parquet(path: Path) -> Mapping[str, Any] | None:
    import pyarrow.parquet as pq  # slow to import, and a TOML file does not need it

    with open_regular(path) as file:
        metadata = pq.ParquetFile(file).metadata.metadata or {}
    text = metadata.get(LINEAGE_KEY.encode())
    return None if text is None else _as_mapping(json_of(text))


def _text_of(path: Path) -> str:
    # An artifact is asked where it comes from, not read: what it holds bears on nothing here.
    return read_limited(path).decode("utf-8-sig")


def _of_toml(path: Path) -> Mapping[str, Any] | None:
    return _of_document(toml_of(_text_of(path)))


def _of_json(path: Path) -> Mapping[str, Any] | None:
    return _of_document(_as_mapping(json_of(_text_of(path))))


def _of_mcap(path: Path) -> Mapping[str, Any] | None:
    from zfcal.artifacts.mcap_files import read_metadata  # as above

    record = read_metadata(path, LINEAGE_KEY)
    if record is None:
        return None
    as_json = {"options", "inputs", "seed"}
    return {key: json_of(text) if key in as_json else text for key, text in record.items()}


def _of_document(document: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Take the lineage's schema from the document's head, where it stands for both."""
    found = document.get("lineage")
    head = {"schema": document.get("schema")}
    return None if found is None else {**head, "options": {}, "inputs": {}, **_as_mapping(found)}


def _as_mapping(value: object) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        message = f"expected a table, got {type(value).__name__}"
        raise ValueError(message)  # noqa: TRY004 - becomes a DamagedError with the others
    return value


_READERS = {
    ".parquet": _of_parquet,
    ".toml": _of_toml,
    ".json": _of_json,
    ".mcap": _of_mcap,
}
