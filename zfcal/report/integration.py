"""The robot among the fish, and how alike the fish are to themselves.

Robot against fish comes from the scores, which pool it from 300 s to the end of
the newest window; its ceiling puts each fish in the robot's place. The halves
of the recording are compared here. All of it is also a JSON document, for whoever computes on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from zfcal.artifacts.lineage import Lineage
from zfcal.report.followed import followed_document
from zfcal.report.seen import Seen
from zfcal.report.views import FEATURE_NAMES, ROBOT, Course, CourseKey, Integration, Mark, TrialView

SCHEMA = "zfcal.integration/1"

_LATE_S = 300
"""From here on the robot is judged (Cazenille et al.: scores have settled by then)."""

NOT_COMPARED = "The robot has not been compared with the fish yet."

_HALVES_MIN_S = 600.0
"""Five minutes a half: with less, chance alone makes the halves differ as two windows do."""


def measure_integration(
    courses: Mapping[CourseKey, Course],
    seen: Seen | None,
    *,
    has_robot: bool,
    start_s: int,
) -> Integration:
    """Return how fish-like the robot moves, and how alike two halves of the fish are.

    Parameters
    ----------
    courses
        The scores over time.
    seen
        All agents of the trial; None without tracks.
    has_robot
        Whether the trial has one.
    start_s
        From when on the newest scores pool the robot.

    Returns
    -------
    Integration
        What is missing is said in it.
    """
    missing: list[str] = []
    robot, end_s = _robot(courses)
    if not has_robot:
        missing.append("There is no robot in this trial.")
    elif not robot:
        missing.append(NOT_COMPARED)
    elif start_s < _LATE_S:
        missing.append(
            f"The trial is too young to judge the robot from {_LATE_S} s on: the times before "
            "are in, when the fish were still getting used to it."
        )
    if robot and math.isnan(robot["S"].ceiling):
        missing.append(
            "There is no ceiling for the robot: to put a fish in its place needs three fish."
        )
    halves, why = _halves(seen)
    return Integration(
        start_s=start_s,
        end_s=end_s,
        robot=robot,
        halves=halves,
        missing=(*missing, *([why] if why else [])),
    )


def _robot(courses: Mapping[CourseKey, Course]) -> tuple[dict[str, Mark], int]:
    """Return the newest robot-vs-fish scores by feature, and where their window ends."""
    newest = courses.get((ROBOT, "S", None))
    if newest is None or newest.last is None:
        return {}, 0
    end_s = int(newest.end_s[newest.last])
    marks = {}
    for feature in FEATURE_NAMES:
        course = courses.get((ROBOT, feature, None))
        at = [] if course is None else [i for i, end in enumerate(course.end_s) if end == end_s]
        if course is not None and at:
            marks[feature] = course.mark(at[0])
    return marks, end_s


def _halves(seen: Seen | None) -> tuple[dict[str, float], str]:
    """Return the fish of every other minute against the others, or why not."""
    if seen is None or not seen.n_points:
        return {}, "There are no tracks."
    length_s = (seen.last_k - seen.first_k + 1) * seen.dt_s
    if length_s < _HALVES_MIN_S - seen.dt_s:
        return {}, (
            f"The recording is {length_s:.0f} s long; to compare its halves with each other it "
            f"needs {_HALVES_MIN_S:.0f} s."
        )
    scores = seen.halves.scores()
    if scores is None:
        return {}, "There are no fish in one half of the recording."
    named = {"D": scores.I_D, "W": scores.I_W, "O": scores.I_O, "T": scores.I_T, "S": scores.S}
    return {name: value for name, value in named.items() if not math.isnan(value)}, ""


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
        "trials": [_trial(view) for view in views],
        "files": dict(files),
        "lineage": origin,
    }


def _trial(view: TrialView) -> dict[str, Any]:
    found = view.integration
    robot = {
        "start_s": found.start_s,
        "end_s": found.end_s,
        "features": {feature: _mark(mark) for feature, mark in found.robot.items()},
    }
    return {
        "trial": view.name,
        "robot_vs_fish": robot if found.robot else None,
        "halves": dict(found.halves) or None,
        "missing": list(found.missing),
        **({} if view.following is None else {"following": followed_document(view.following)}),
        **({"left_out": list(view.left_out)} if view.left_out else {}),
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
