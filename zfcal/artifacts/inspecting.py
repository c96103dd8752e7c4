"""What a file of a trial is, where it comes from and what it holds, for people and programs."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import pyarrow as pa
import pyarrow.compute as pc

from zfcal.artifacts.arenas import read_arena
from zfcal.artifacts.cameras import read_camera_file
from zfcal.artifacts.columns import TABLE_SCHEMAS, form_of, problem_of
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.mcap_files import overview
from zfcal.artifacts.models import read_model
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import EXPORT, read_extra, read_parquet, schema_of
from zfcal.artifacts.validation import read_json, read_toml
from zfcal.errors import DamagedError, InputError, SchemaError
from zfcal.trial import CONFIG_NAME

Description: TypeAlias = dict[str, Any]

_HEAD_ROWS = 5


def describe(path: Path) -> Description:
    """Describe a file of a trial, as a value that JSON can hold.

    Parameters
    ----------
    path
        A ``.parquet``, ``.mcap``, ``.toml``, ``.json`` or ``.geojson`` file.

    Returns
    -------
    dict
        ``file``, ``size_bytes``, ``schema`` (None if unknown), ``problem``
        (None if it is whole and valid), ``lineage`` (None if it has none) and
        ``contents``, which differ by kind.

    Raises
    ------
    InputError
        The file is missing, or of another kind.
    DamagedError
        Nothing of it can be read.
    """
    describer = _DESCRIBERS.get(path.suffix)
    if describer is None:
        raise InputError(
            f"{path}: is of no kind that a trial holds.",
            hint=f"Those end in {', '.join(sorted(_DESCRIBERS))}.",
        )
    schema, problem, contents = describer(path)
    return {
        "file": str(path),
        "size_bytes": path.stat().st_size,
        "schema": schema,
        "problem": problem,
        "lineage": _lineage(path),
        "contents": contents,
    }


def as_lines(description: Mapping[str, Any]) -> Iterator[str]:
    """Yield a description as lines of text: a key and its value, indented by depth."""
    for key, value in description.items():
        if value is not None:
            yield from _lines(key, value, "")


def _lines(key: str, value: Any, indent: str) -> Iterator[str]:
    if isinstance(value, Mapping) and value:
        yield f"{indent}{key}:"
        for name, item in value.items():
            yield from _lines(str(name), item, indent + "  ")
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        yield f"{indent}{key}:"
        yield from (f"{indent}  {line}" for line in _as_grid(value))
    else:
        yield f"{indent}{key}: {_shown(value)}"


def _as_grid(rows: list[Mapping[str, Any]]) -> Iterator[str]:
    names = list(dict.fromkeys(itertools.chain.from_iterable(rows)))
    grid = [names, *([_shown(row.get(name)) for name in names] for row in rows)]
    widths = [max(len(line[column]) for line in grid) for column in range(len(names))]
    for line in grid:
        yield "  ".join(
            text.ljust(width) for text, width in zip(line, widths, strict=True)
        ).rstrip()


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        return ", ".join(map(_shown, value)) or "none"
    return json.dumps(value)


def _lineage(path: Path) -> Description | None:
    try:
        return read_lineage(path).as_dict()
    except (InputError, DamagedError):
        return None


def _table(path: Path) -> tuple[str | None, str | None, Description]:
    table = read_parquet(path, "Copy it again from where it was made, or make it again.")
    schema = schema_of(table)
    known = schema in TABLE_SCHEMAS
    # A table for other programs has the columns that they want.
    other = None if schema == EXPORT else f"schema is {schema}"
    problem = problem_of(table, form_of(schema)) if known else other
    says = {column.name: column.says for column in form_of(schema).columns} if known else {}
    columns = [
        {
            "name": field.name,
            "type": str(field.type),
            "nulls": table.column(field.name).null_count,
            "says": says.get(field.name),
        }
        for field in table.schema
    ]
    contents = {
        "rows": table.num_rows,
        **_span(table),
        **_agents(table),
        "columns": columns,
        "head": [_finite(row) for row in table.slice(0, _HEAD_ROWS).to_pylist()],
        "extra": read_extra(path) or None,
    }
    return (schema if known or other is None else None), problem, contents


def _span(table: pa.Table) -> Description:
    name = "time_s" if "time_s" in table.column_names else "window_end_s"
    if name not in table.column_names or table.num_rows == 0:
        return {}
    limits = pc.min_max(table.column(name)).as_py()
    return {"from_s": limits["min"], "to_s": limits["max"]}


def _agents(table: pa.Table) -> Description:
    if not {"agent", "kind"} <= set(table.column_names):
        return {}
    pairs = pa.table({"agent": table.column("agent"), "kind": table.column("kind").cast("string")})
    counts = pairs.group_by(["agent", "kind"]).aggregate([([], "count_all")]).to_pylist()
    found: dict[str, int] = {}
    for row in sorted(counts, key=lambda row: (row["kind"], row["agent"])):
        found[row["kind"]] = found.get(row["kind"], 0) + 1
    return {"agents": found}


def _finite(value: Any) -> Any:
    """Return a value with None for every NaN and infinity, which JSON does not know."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _mcap(path: Path) -> tuple[str | None, str | None, Description]:
    found = overview(path)
    topics = [
        {"topic": topic, "schema": schema, "messages": found.counts[topic]}
        for topic, schema in sorted(found.schemas.items())
    ]
    problem = None if found.whole else f"{found.problem}; {found.loss}"
    contents = {
        "messages": found.counts.total(),
        "from_s": found.start_s,
        "to_s": found.end_s,
        "topics": topics,
        "metadata": found.metadata,
        "library": found.library,
        "profile": found.profile,
        "lost_bytes": found.lost_bytes,
    }
    schema = found.metadata.get("zfcal.lineage", {}).get("schema")
    return schema, problem, contents


def _toml(path: Path) -> tuple[str | None, str | None, Description]:
    document = read_toml(path)
    schema = document.get("schema")
    readers: dict[object, Callable[[Path], object]] = {
        "zfcal.trial/1": lambda file: path.name == CONFIG_NAME and read_trial(file.parent),
        "zfcal.model/1": read_model,
        "zfcal.camera/1": read_camera_file,
    }
    problem = None
    if schema not in readers:
        problem = f"its schema is {schema!r}, none of {', '.join(map(str, readers))}"
    else:
        try:
            readers[schema](path)
        except (InputError, DamagedError) as error:
            problem = str(error).removeprefix(f"{path}: ")
    contents = {key: item for key, item in document.items() if key not in {"schema", "lineage"}}
    return (None if schema is None else str(schema)), problem, _finite(contents)


def _json(path: Path) -> tuple[str | None, str | None, Description]:
    document = read_json(path)
    schema = document.get("schema")
    contents = {key: item for key, item in document.items() if key not in {"schema", "lineage"}}
    problem = None if isinstance(schema, str) else "it names no schema"
    return (schema if isinstance(schema, str) else None), problem, contents


def _arena(path: Path) -> tuple[str | None, str | None, Description]:
    try:
        arena = read_arena(path)
    except SchemaError:
        raise
    except InputError as error:
        if not path.is_file():
            raise
        return "arena (GeoJSON)", str(error).removeprefix(f"{path}: "), {}
    zones = [
        {
            "id": number,
            "zone": zone.name,
            "follows_walls": zone.follows_walls,
            "area_m2": None if zone.polygon is None else zone.polygon.area,
        }
        for number, zone in enumerate(arena.zones, start=1)
    ]
    bins = arena.bins
    contents = {
        "name": arena.name,
        "area_m2": arena.outline.area,
        "bounds_m": list(arena.outline.bounds),
        "wall_segments": len(arena.segments_m),
        "holes": len(arena.outline.interiors),
        "wall_zone_m": arena.wall_zone_m,
        "wall_tolerance_m": arena.wall_tolerance_m,
        "bins": {
            "D": list(bins.distance_m),
            "W": list(bins.wall_distance_m),
            "V": list(bins.speed_m_s),
        },
        "zones": zones,
    }
    return "arena (GeoJSON)", None, contents


_DESCRIBERS: dict[str, Callable[[Path], tuple[str | None, str | None, Description]]] = {
    ".parquet": _table,
    ".mcap": _mcap,
    ".toml": _toml,
    ".json": _json,
    ".geojson": _arena,
}
