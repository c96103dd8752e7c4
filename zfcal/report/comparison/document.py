"""A comparison as a JSON document: all that the table and the picture show.

Its form is ``schemas/compare.schema.json``. What is not known is null.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from zfcal.arrays import Floats
from zfcal.artifacts.lineage import Lineage
from zfcal.report.comparison.differences import (
    LEAST_TRIALS,
    Difference,
    Relabelling,
    Side,
    compare_sets,
)
from zfcal.report.comparison.gathering import (
    TrialValues,
    missing_of,
    rows_of,
    table_of,
    warnings_of,
)
from zfcal.report.comparison.power import (
    ALPHA,
    POWER,
    attainable_level,
    detectable_effect,
    smallest_p,
)
from zfcal.report.comparison.quantities import Quantity

SCHEMA = "zfcal.compare/1"
SEED = 0
"""Of the relabellings that are taken by chance; the same trials have the same p every time."""

_FEW = 10
"""Trials on a side below which unequal spread makes p too small."""

_SPREAD = 4.0
"""Ratio of two standard deviations from which on that is told."""


def compare_document(
    a: Sequence[TrialValues], b: Sequence[TrialValues], lineage: Lineage
) -> dict[str, Any]:
    """Return how two sets of trials differ.

    Parameters
    ----------
    a, b
        The trials of each set.
    lineage
        Of the comparison.

    Returns
    -------
    dict
        Fits ``schemas/compare.schema.json``; its ``files`` are empty.
    """
    rows = rows_of(a, b)
    values = table_of(a, rows), table_of(b, rows)
    found, how = compare_sets(*values, rng=np.random.default_rng(SEED))
    origin = lineage.as_dict()
    del origin["schema"]
    return {
        "schema": SCHEMA,
        "sets": {"A": list(map(_trial, a)), "B": list(map(_trial, b))},
        "statistics": [
            _row(row, one, tuple(part[at] for part in values))
            for at, (row, one) in enumerate(zip(rows, found, strict=True))
        ],
        "test": _test(len(a), len(b), how),
        "warnings": [*warnings_of(a, b), *_spreads(rows, found)],
        "missing": [
            {"set": name, "trial": each.trial, "statistics": list(each.names), "why": each.why}
            for name, trials in (("A", a), ("B", b))
            for trial in trials
            for each in missing_of(trial, rows)
        ],
        "left_out": [f"{trial.label}: {line}" for trial in (*a, *b) for line in trial.left_out],
        "files": {},
        "lineage": origin,
    }


def _trial(trial: TrialValues) -> dict[str, Any]:
    return {
        "trial": trial.label,
        "tracked_s": trial.tracked_s,
        "conditions": dict(trial.conditions),
    }


def _row(row: Quantity, found: Difference, values: tuple[Floats, ...]) -> dict[str, Any]:
    a, b = values
    return {
        "name": row.name,
        "label": row.label,
        "unit": row.unit,
        "of": row.group,
        "A": _side(found.a, a),
        "B": _side(found.b, b),
        "difference": _known(found.difference),
        "interval": _interval(found.low, found.high),
        "g": _known(found.g),
        "g_interval": _interval(found.g_low, found.g_high),
        "p": _known(found.p),
        "p_family": _known(found.p_family),
        "untested": _untested(found),
    }


def _side(side: Side, values: Floats) -> dict[str, Any]:
    return {
        "n": side.n,
        "mean": _known(side.mean),
        "sd": _known(side.sd),
        "values": [_known(float(value)) for value in values],
    }


def _untested(found: Difference) -> str | None:
    """Return why a row has no p; None where it has one."""
    if min(found.a.n, found.b.n) >= LEAST_TRIALS:
        return None
    return f"{found.a.n} and {found.b.n} trials have it; a test needs {LEAST_TRIALS} on each side"


def _test(n_a: int, n_b: int, how: Relabelling) -> dict[str, Any]:
    level = attainable_level(n_a, n_b)
    return {
        "by": "relabelling trials, Welch's t, both signs; over all statistics by the largest t",
        "tested": how.n_tested,
        "least_trials": LEAST_TRIALS,
        "relabellings": how.n,
        "exact": how.exact,
        "seed": None if how.exact else SEED,
        "smallest_p": how.smallest_p if how.n else smallest_p(n_a, n_b),
        "alpha": ALPHA,
        "power": POWER,
        "detectable_g": detectable_effect(n_a, n_b, alpha=level) if how.n else None,
        "detectable_g_among_all": (
            detectable_effect(n_a, n_b, alpha=level / how.n_tested) if how.n else None
        ),
        "detectable_g_by_t": detectable_effect(n_a, n_b) if min(n_a, n_b) >= 2 else None,
        "detectable_g_with_least": detectable_effect(
            LEAST_TRIALS, LEAST_TRIALS, alpha=attainable_level(LEAST_TRIALS, LEAST_TRIALS)
        ),
    }


def _spreads(rows: Sequence[Quantity], found: Sequence[Difference]) -> Iterator[str]:
    """Yield a warning where few trials have unequal spread."""
    unequal = [
        row.name
        for row, one in zip(rows, found, strict=True)
        if min(one.a.n, one.b.n) < _FEW and one.spread_ratio > _SPREAD and not math.isnan(one.p)
    ]
    if unequal:
        yield (
            f"One side's trials are more than {_SPREAD:g} times as far apart as the other's in "
            f"{', '.join(unequal)}. With fewer than {_FEW} trials on a side, and more so with "
            "unequally many, p is then too small: a difference that is not there is found too "
            "often. Welch's interval hardly suffers."
        )


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _interval(low: float, high: float) -> list[float] | None:
    return [low, high] if math.isfinite(low) and math.isfinite(high) else None
