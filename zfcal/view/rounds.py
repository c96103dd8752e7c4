"""The rounds of a trial as the page shows them: S against its ceiling, and the parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from zfcal.arena import Arena
from zfcal.artifacts.models import read_model_for, read_result
from zfcal.artifacts.tables import SCORES, read_table
from zfcal.parameters import gene_names, gene_scales
from zfcal.report.figures.parameters import values_of
from zfcal.report.gather import round_of
from zfcal.report.standing import is_above, share_of
from zfcal.report.views import MODEL, ROBOT, Mark, Round
from zfcal.trial import Trial
from zfcal.view.reading import Reader

_SCORE = "S"
_MARKS = ("value", "low", "high", "ceiling")


def rounds_of(reader: Reader, trial: Trial, arena: Arena) -> list[dict[str, Any]]:
    """Return the models of a trial, the starting one first.

    Returns
    -------
    list of dict
        ``end_s`` (0 for the starting model); ``rule``; ``by``, what the intervals are of; and
        ``parameters``, each with ``name``, ``value``, ``most`` (the end of its scale), and
        ``low``, ``high`` and ``identified``, null where they are not known. Models that cannot
        be read are left out.
    """
    read = partial(_round, arena=arena, dt_s=trial.dt_s)
    found = (reader.read(path, read) for path in reader.files("models", ".toml").values())
    return [each for each in found if each is not None]


def scores_of(reader: Reader) -> list[dict[str, Any]]:
    """Return S of each window.

    Returns
    -------
    list of dict
        ``end_s``; ``compared`` (such as ``model-vs-control``); ``value``; and ``ceiling`` with
        its ``low`` and ``high``, null where there are none; ``above``, whether it is above that
        range; ``says``, how they stand to each other. In the order of time.
    """
    paths = [
        *reader.files("scores", ".parquet").values(),
        *reader.files("scores", "-model.parquet").values(),
    ]
    rows = [row for path in paths for row in reader.read(path, _scores) or ()]
    return sorted(rows, key=lambda row: (row["end_s"], row["compared"]))


def _scores(path: Path) -> list[dict[str, Any]]:
    rows = read_table(path, SCORES).to_pylist()
    return [
        {
            "end_s": row["window_end_s"],
            "compared": row["compared"],
            **{key: _number(row[key]) for key in _MARKS},
            "above": is_above(_mark(row)),
            "says": _standing(row),
        }
        for row in rows
        if row["feature"] == _SCORE
        and row["compared"] in {MODEL, ROBOT}
        and row["value"] is not None
    ]


def _mark(row: dict[str, Any]) -> Mark:
    value, low, high, ceiling = (math.nan if row[key] is None else row[key] for key in _MARKS)
    return Mark(value=value, low=low, high=high, ceiling=ceiling)


def _standing(row: dict[str, Any]) -> str:
    """Return how a score stands to its ceiling: never more than all of it."""
    mark = _mark(row)
    is_model = row["compared"] == MODEL
    if is_above(mark):
        return "above the range of its ceiling" + (": it fits chance" if is_model else "")
    if mark.low <= mark.value <= mark.high:
        of = "within what windows of the model itself score"
        return of if is_model else "within the range of its ceiling"
    share = share_of(mark)
    return share if math.isnan(mark.against_ceiling) else f"{share} of its ceiling"


def _round(path: Path, *, arena: Arena, dt_s: float) -> dict[str, Any]:
    result = read_result(path)
    made = round_of(int(path.stem), read_model_for(path, arena, dt_s=dt_s), result)
    return {
        "end_s": made.second,
        "rule": "" if made.published is None else made.published.rule,
        "by": made.intervals_by if made.intervals else "",
        "parameters": list(_parameters(made)),
    }


def _parameters(made: Round) -> Iterator[dict[str, Any]]:
    zones = made.parameters.zone_names
    values = values_of(made)
    for name, most in zip(gene_names(zones), gene_scales(len(zones)).tolist(), strict=True):
        yield _parameter(made, name, values[name], most)
    for effect, table in made.parameters.effects.items():
        for key, value in table.items():
            yield _parameter(made, f"{effect}.{key}", value, None)


def _parameter(made: Round, name: str, value: float, most: float | None) -> dict[str, Any]:
    low, high = made.intervals.get(name, (None, None))
    identified = None if low is None else name not in made.unidentified
    numbers = {"value": value, "low": low, "high": high}
    return {
        "name": name,
        "most": most,
        "identified": identified,
        **{key: _number(each) for key, each in numbers.items()},
    }


def _number(value: float | None) -> float | None:
    """Return a number for JSON, to six digits; null for what is none."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.6g}")
