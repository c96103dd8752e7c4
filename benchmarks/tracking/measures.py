"""Tracks against the truth: what a benchmark of tracking measures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import motmetrics
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

motmetrics.lap.default_solver = "scipy"

Row = tuple[int, float, float]
"""A track id and its place, in the unit of the truth."""


def measures(
    truth: NDArray[np.float64], told: Sequence[Sequence[Row]], *, gate: float, fps: float
) -> dict[str, Any]:
    """Return how tracks compare with the truth.

    A track of an animal that the truth lacks is a false positive: ``precision_of_whole`` is
    that of the frames in which the truth knows everybody.

    Parameters
    ----------
    truth : ndarray, shape (frame, agent, 2)
        NaN where it is not known.
    told
        For each frame its rows.
    gate
        What is farther away is somebody else, in the unit of the truth.
    fps
        Frames per second.
    """
    found = motmetrics.MOTAccumulator(auto_id=True)
    errors: list[float] = []
    exact = 0
    hits, rows_of_whole = 0, 0
    for places, rows in zip(truth, told, strict=True):
        known = np.flatnonzero(np.isfinite(places).all(axis=1))
        at = np.array([row[1:] for row in rows], float).reshape(-1, 2)
        away = np.hypot(*np.moveaxis(places[known, None] - at[None], -1, 0))
        found.update(list(known), [row[0] for row in rows], np.where(away < gate, away, np.nan))
        pairs = linear_sum_assignment(np.minimum(away, 10 * gate))
        near = [float(e) for e in away[pairs] if e < gate]
        errors += near
        if len(known) == len(places):
            hits, rows_of_whole = hits + len(near), rows_of_whole + len(rows)
        exact += len(rows) == truth.shape[1]
    names = ["mota", "idf1", "precision", "recall", "num_switches", "num_misses"]
    host = motmetrics.metrics.create()
    told_of = host.compute(found, metrics=names, name="all").iloc[0]
    minutes = float(np.isfinite(truth).all(axis=2).sum()) / fps / 60
    return {
        "mota": float(told_of["mota"]),
        "idf1": float(told_of["idf1"]),
        "precision": float(told_of["precision"]),
        "precision_of_whole": hits / rows_of_whole if rows_of_whole else float("nan"),
        "recall": float(told_of["recall"]),
        "switches_per_fish_minute": float(told_of["num_switches"]) / minutes,
        "missed": float(told_of["num_misses"]),
        "median_error": float(np.median(errors)) if errors else float("nan"),
        "error_95": float(np.quantile(errors, 0.95)) if errors else float("nan"),
        "exact": exact / len(truth),
    }
