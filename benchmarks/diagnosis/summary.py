"""What finished trials of the diagnosis come to: rates with their intervals, matrices, times.

Pure functions of the rows of `trial.run`, each by way of `answers`.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from benchmarks.diagnosis.answers import (
    ERROR,
    FATES,
    SINGLE,
    Rate,
    Row,
    answer,
    fares,
    has_wrong_listed_name,
    has_wrong_name,
    is_right,
    is_standard,
    is_tie_with_truth,
    misdescribes,
    names,
    names_first_wrong,
    names_something,
    nats,
    rate,
    rate_of,
    says_something,
    truth,
)
from benchmarks.diagnosis.plan import (
    EXTEND,
    FURTHER,
    LISTED_SECTION,
    NULLS,
    OUTSIDE,
    PAIRS,
    TIME,
)

NATS = (0, 20, 50, 100, 200, 500, math.inf)
"""Edges of the bins of oracle nats."""


def targets(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return what was aimed at and what was reached, of rows of one mode."""
    single = [row for row in rows if row["section"] in SINGLE]
    standard = [row for row in single if is_standard(row)]
    nulls, pairs, outside = (_of(rows, section) for section in (NULLS, PAIRS, OUTSIDE))
    further = _of(rows, FURTHER)
    asked: list[tuple[str, str, Iterable[Row], Callable[[Row], bool]]] = [
        ("nulls and decoys: says anything at all", "at most 5 %", nulls, says_something),
        ("nulls and decoys: names or ties an effect", "", nulls, names_something),
        (
            "named rightly, at least 100 nats", "at least 95 %",
            (row for row in standard if nats(row) >= 100), is_right,
        ),
        (
            "named rightly, 20 to 50 nats", "at least 70 %",
            (row for row in standard if 20 <= nats(row) < 50), is_right,
        ),
        ("a wrong name anywhere", "at most 2 %", single, has_wrong_name),
        ("a wrong listed name anywhere", "", single, has_wrong_listed_name),
        ("the first name is wrong", "", single, names_first_wrong),
        ("a tie that holds the hidden effect", "", single, is_tie_with_truth),
        (
            "both of a pair named", "at least 80 %",
            pairs, lambda row: set(row["truth"]) <= set(names(row)),
        ),
        (
            "further forms, clear: named rightly", "",
            (row for row in further if row["scenario"]["strength"] == "clear"),
            lambda row: fares(row) == "right",
        ),
        (
            "further forms, clear: something else is said", "",
            (row for row in further if row["scenario"]["strength"] == "clear"),
            lambda row: fares(row) == "wrong",
        ),
        ("pairs: a wrong name anywhere", "", pairs, has_wrong_name),
        ("outside the list: a listed name that does not describe it", "none", outside,
         misdescribes),
        ("outside the list: nothing is said", "", outside, lambda row: not says_something(row)),
        ("trials that failed", "none", rows, lambda row: bool(row["verdict"] == ERROR)),
    ]  # fmt: skip
    return [
        {"what": what, "target": target, **rate_of(part, holds)}
        for what, target, part, holds in asked
    ]


def _of(rows: Iterable[Row], *sections: str) -> list[Row]:
    return [row for row in rows if row["section"] in sections]


def confusion(rows: Iterable[Row]) -> dict[str, dict[str, int]]:
    """Return how often each answer came, by what was hidden."""
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for row in rows:
        counts[truth(row)][answer(row)] += 1
    return {true: dict(found) for true, found in sorted(counts.items())}


def inversion(matrix: Mapping[str, Mapping[str, int]]) -> dict[str, dict[str, Any]]:
    """Return for each answer what was hidden, and how often what it names was.

    Parameters
    ----------
    matrix
        What `confusion` returns. The shares hold for its mixture of trials.
    """
    turned: defaultdict[str, dict[str, int]] = defaultdict(dict)
    for true, answers in matrix.items():
        for told, n in answers.items():
            turned[told][true] = n
    return {
        told: {"rate": rate(hidden.get(told, 0), sum(hidden.values())), "hidden": hidden}
        for told, hidden in sorted(turned.items())
    }


def power(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return how often the hidden effect is named, by oracle nats and by length."""
    single = [row for row in rows if row["section"] in SINGLE and row.get("nats")]
    made = []
    lengths = sorted({row["scenario"]["minutes"] for row in single})
    for minutes in [None, *lengths]:
        part = [row for row in single if minutes in {None, row["scenario"]["minutes"]}]
        for low, high in itertools.pairwise(NATS):
            within = [row for row in part if low <= max(nats(row), 0) < high]
            known = sorted(nats(row) for row in within)
            middle = round(statistics.median(known), 1) if known else None
            end = None if math.isinf(high) else high
            made.append({
                "minutes": minutes, "nats": [low, end], "median_nats": middle,
                "right": rate_of(within, is_right),
                "tie": rate_of(within, is_tie_with_truth),
                "wrong": rate_of(within, has_wrong_name),
            })  # fmt: skip
    return made


def by_kind(rows: Iterable[Row], holds: Callable[[Row], bool]) -> dict[str, Rate]:
    """Return a rate for each kind of trial."""
    kinds: defaultdict[str, list[Row]] = defaultdict(list)
    for row in rows:
        kinds[row["kind"]].append(row)
    return {kind: rate_of(part, holds) for kind, part in sorted(kinds.items())}


def effects_table(rows: Iterable[Row]) -> dict[str, dict[str, Any]]:
    """Return of each effect, at 30 minutes and clear strength, how it fared."""
    kinds: defaultdict[str, list[Row]] = defaultdict(list)
    for row in _of(rows, LISTED_SECTION):
        kinds[row["kind"]].append(row)
    return {
        kind: {
            "median_nats": _median(nats(row) for row in part),
            "right": rate_of(part, is_right),
            "tie": rate_of(part, is_tie_with_truth),
            "wrong": rate_of(part, has_wrong_name),
        }
        for kind, part in sorted(kinds.items())
    }


def further_table(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return by effect, form and strength how trials of further forms fared.

    Of each effect all its forms come first, with a form of None, then each.
    """
    parts: defaultdict[tuple[str, str, str], list[Row]] = defaultdict(list)
    for row in _of(rows, FURTHER):
        name, strength = row["truth"][0], row["scenario"]["strength"]
        for form in ("", row["scenario"]["effect"].partition("/")[2]):
            parts[name, form, strength].append(row)
    return [
        {
            "effect": name, "form": form or None, "strength": strength,
            "median_nats": _median(nats(row) for row in part),
            **{fate: rate(sum(fares(row) == fate for row in part), len(part)) for fate in FATES},
        }
        for (name, form, strength), part in sorted(
            parts.items(), key=lambda each: (each[0][0], each[0][1], each[0][2] != "faint")
        )
    ]  # fmt: skip


def noise_table(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return by the noise that was added what was estimated, and how often it was a false alarm."""
    levels: defaultdict[float, list[Row]] = defaultdict(list)
    for row in _of(rows, NULLS):
        levels[row["scenario"]["chain"]["noise_mm"]].append(row)
    return [
        {
            "noise_mm": level,
            "estimated_mm": _median(1e3 * r["noise_m"] for r in part if r.get("noise_m")),
            "alarm": rate_of(part, says_something),
        }
        for level, part in sorted(levels.items())
    ]


def gaps(rows: Iterable[Row]) -> dict[str, Any]:
    """Return how much of the gap extensions closed, by measure, and the placebo."""
    extended = [row for row in _of(rows, EXTEND) if row.get("gap")]
    closed: defaultdict[str, list[float]] = defaultdict(list)
    placebo: defaultdict[str, list[float]] = defaultdict(list)
    for row in extended:
        for entry in row["gap"]:
            for into, key in ((closed, "closed"), (placebo, "placebo")):
                if entry.get(key) is not None:
                    into[entry["measure"]].append(entry[key])
    return {
        measure: {"closed": quartiles(closed[measure]), "placebo": quartiles(placebo[measure])}
        for measure in sorted({*closed, *placebo})
    }


def quartiles(values: Iterable[float]) -> dict[str, Any]:
    """Return n, median and quartiles; None where they cannot be."""
    known = sorted(value for value in values if math.isfinite(value))
    if not known:
        return {"n": 0, "low": None, "median": None, "high": None}
    low, middle, high = (
        statistics.quantiles(known, n=4, method="inclusive") if len(known) > 1 else known * 3
    )
    return {
        "n": len(known), "low": round(low, 4), "median": round(middle, 4), "high": round(high, 4),
    }  # fmt: skip


def _median(values: Iterable[float]) -> float | None:
    found = quartiles(values)["median"]
    return None if found is None else float(found)


def times(rows: Sequence[Row]) -> dict[str, Any]:
    """Return what diagnoses took, in seconds: those of 30 minutes, and those timed alone."""
    done = [row for row in rows if row.get("cpu_s") is not None]
    long = [row for row in done if row["section"] != TIME and row["scenario"]["minutes"] == 30]
    return {
        "cpu_s": quartiles(row["cpu_s"] for row in long),
        "wall_s": quartiles(row["wall_s"] for row in long),
        "alone": [
            {key: row[key] for key in ("kind", "wall_s", "cpu_s", "command_s", "workers")}
            for row in _of(done, TIME)
        ],
    }


def brief(row: Row) -> dict[str, Any]:
    """Return a trial in a line."""
    asked = row["scenario"]
    return {
        "section": row["section"], "kind": row["kind"], "seed": asked["seed"],
        "quick": row["quick"],
        "nats": round(nats(row), 1) if row.get("nats") else None,
        "answer": answer(row),
        "effects": ["/".join([each["name"], *each["ties"]]) for each in row["effects"]],
        "p": [each["p"] for each in row["effects"]],
        "z": {name: row["z_of"][name] for name in row["truth"] if name in row.get("z_of", {})},
        "omnibus_p": row.get("omnibus_p"), "cpu_s": row.get("cpu_s"), "error": row.get("error"),
    }  # fmt: skip


def of_mode(rows: Sequence[Row]) -> dict[str, Any]:
    """Return all that the trials of one mode say."""
    matrix = confusion(_of(rows, *SINGLE, NULLS))
    return {
        "n": dict(sorted(Counter(row["section"] for row in rows).items())),
        "targets": targets(rows),
        "effects": effects_table(rows),
        "further": further_table(rows),
        "confusion": matrix,
        "inversion": inversion(matrix),
        "power": power(rows),
        "nulls": by_kind(_of(rows, NULLS), says_something),
        "noise": noise_table(rows),
        "outside": confusion(_of(rows, OUTSIDE)),
        "pairs": by_kind(_of(rows, PAIRS), lambda row: set(row["truth"]) <= set(names(row))),
        "gap": gaps(rows),
        "time": times(rows),
    }


def summarise(rows: Sequence[Row], *, planned: Mapping[str, int]) -> dict[str, Any]:
    """Return all numbers of a benchmark.

    Parameters
    ----------
    rows
        Of the finished trials.
    planned
        Trials of each section in a complete run of one mode.
    """
    ordered = sorted(rows, key=lambda r: (r["section"], r["scenario"]["seed"], r["quick"]))
    modes = {
        "quick": [row for row in ordered if row["quick"]],
        "full": [row for row in ordered if not row["quick"]],
    }
    return {
        "planned": dict(planned),
        "modes": {mode: of_mode(part) for mode, part in modes.items() if part},
        "trials": [brief(row) for row in ordered],
    }
