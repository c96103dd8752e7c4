"""The numbers of integration as a JSON document, for whoever computes on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from zfcal.artifacts.lineage import Lineage
from zfcal.report.views import Integration, Mark, TrialView

SCHEMA = "zfcal.integration/1"


def integration_document(
    views: Sequence[TrialView], lineage: Lineage, files: Mapping[str, str]
) -> dict[str, Any]:
    """Return robot against fish, its ceiling and the halves, trial by trial.

    Parameters
    ----------
    views
        The trials.
    lineage
        Of the report.
    files
        SHA-256 of the report's other files, by name.

    Returns
    -------
    dict
        Fits ``schemas/integration.schema.json``; what is missing is null, with
        the reason under ``missing``.
    """
    origin = lineage.as_dict()
    del origin["schema"]
    return {
        "schema": SCHEMA,
        "trials": [_trial(view.name, view.integration, view.left_out) for view in views],
        "files": dict(files),
        "lineage": origin,
    }


def _trial(name: str, found: Integration, left_out: Sequence[str]) -> dict[str, Any]:
    robot = {
        "start_s": found.start_s,
        "end_s": found.end_s,
        "features": {feature: _mark(mark) for feature, mark in found.robot.items()},
    }
    return {
        "trial": name,
        "robot_vs_fish": robot if found.robot else None,
        "halves": dict(found.halves) or None,
        "missing": list(found.missing),
        **({"left_out": list(left_out)} if left_out else {}),
    }


def _mark(mark: Mark) -> dict[str, float | int | None]:
    numbers = {
        "value": mark.value,
        "ceiling": mark.ceiling,
        "low": mark.low,
        "high": mark.high,
        "against_ceiling": mark.against_ceiling,
    }
    known = {key: None if math.isnan(value) else value for key, value in numbers.items()}
    return {**known, "n_fish": mark.n}
