"""From trials to one value of each quantity per trial, and what they have in common.

What a report shows of a trial is read by the report's own `gather`; nothing is computed twice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.report.comparison.means import FishMeans
from zfcal.report.comparison.quantities import (
    ROBOT_S,
    Group,
    Quantity,
    model_name,
    quantities,
    robot_name,
)
from zfcal.report.gather import Damage, gather
from zfcal.report.views import FEATURE_NAMES, MODEL, TrialView

_NO_ROBOT_CEILING = "the robot has no ceiling: to put a fish in its place needs three fish"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialValues:
    """The quantities of one trial.

    Parameters
    ----------
    label
        What the trial is called.
    values
        By the quantity's name; what is missing is not there.
    why
        Why a group's quantities are missing.
    conditions
        What trials must have in common to be compared, in words.
    left_out
        One line per file that could not be read.
    tracked_s
        Length of the recording, in seconds.
    zone_names
        The arena's zones.
    tracks
        SHA-256 of the tracks, in order of time.
    """

    label: str
    values: Mapping[str, float]
    why: Mapping[Group, str]
    conditions: Mapping[str, str]
    left_out: Sequence[str]
    tracked_s: float
    zone_names: tuple[str, ...]
    tracks: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Missing:
    """A trial that is left out of some rows.

    Parameters
    ----------
    trial
        Its label.
    names
        The rows.
    why
        For what reason.
    """

    trial: str
    names: tuple[str, ...]
    why: str


def read_values(root: Path, label: str, on_damage: Damage) -> TrialValues:
    """Return the quantities of a trial.

    Parameters
    ----------
    root
        The trial's directory.
    label
        What it is called.
    on_damage
        Hears of each file that is left out.

    Raises
    ------
    InputError
        It is no trial, or its settings or arena are wrong.
    """
    means = FishMeans()
    view = replace(gather(root, on_damage, alone=False, watch=means.add), label=label)
    return values_of(view, means.values())


def values_of(view: TrialView, fish: Mapping[str, float]) -> TrialValues:
    """Return the quantities of a trial from all that a report shows of it.

    Parameters
    ----------
    view
        The trial.
    fish
        Means of what its fish do, from `FishMeans`.
    """
    robot = view.integration.robot
    scores = {
        **{model_name(f): view.course(MODEL, f).mean().against_ceiling for f in FEATURE_NAMES},
        **{robot_name(f): mark.against_ceiling for f, mark in robot.items()},
        **({ROBOT_S: robot["S"].value} if "S" in robot else {}),
    }
    return TrialValues(
        label=view.name,
        values={**fish, **{name: v for name, v in scores.items() if not math.isnan(v)}},
        why=_why(view),
        conditions=_conditions(view),
        left_out=tuple(view.left_out),
        tracked_s=view.tracked_s,
        zone_names=view.arena.zone_names,
        tracks=tuple(s.sha256 for s in view.sources if s.path.startswith("tracks/")),
    )


def check_apart(a: Sequence[Path], b: Sequence[Path]) -> None:
    """Refuse sets that are empty, or in which a trial would count twice.

    Parameters
    ----------
    a, b
        Directories of the trials.

    Raises
    ------
    InputError
        One is empty, or a trial is named twice.
    """
    for name, roots in (("A", a), ("B", b)):
        if not roots:
            raise InputError(
                f"Set {name} has no trial.",
                hint="Name both sets: zfcal compare A1 A2 --against B1 B2",
            )
    seen: dict[Path, str] = {}
    for name, root in [*(("A", root) for root in a), *(("B", root) for root in b)]:
        before = seen.setdefault(root.resolve(), name)
        if before != name:
            raise InputError(
                f"{root} is in both sets: a trial cannot differ from itself.",
                hint="Name each trial once, before --against or after it.",
            )
    if len(seen) < len(a) + len(b):
        raise InputError("The same trial is named twice: it would count as two.")


def rows_of(a: Sequence[TrialValues], b: Sequence[TrialValues]) -> list[Quantity]:
    """Return the quantities that some trial has, in the order of the table."""
    zones = dict.fromkeys(zone for trial in (*a, *b) for zone in trial.zone_names)
    some = {name for trial in (*a, *b) for name in trial.values}
    return [each for each in quantities(tuple(zones)) if each.name in some]


def table_of(trials: Sequence[TrialValues], rows: Sequence[Quantity]) -> Floats:
    """Return the values of trials, shape (quantity, trial); NaN where one is missing."""
    values = [[trial.values.get(row.name, np.nan) for trial in trials] for row in rows]
    return np.array(values, dtype=np.float64).reshape(len(rows), len(trials))


def missing_of(trial: TrialValues, rows: Sequence[Quantity]) -> list[Missing]:
    """Return the rows that a trial is left out of, those of one reason together."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if row.name not in trial.values:
            why = trial.why.get(row.group, "there is nothing of the kind in its tracks")
            found.setdefault(why, []).append(row.name)
    return [Missing(trial=trial.label, names=tuple(names), why=why) for why, names in found.items()]


def warnings_of(a: Sequence[TrialValues], b: Sequence[TrialValues]) -> list[str]:
    """Return how the sets differ in what was not to be compared, a sentence each."""
    said = []
    for what in dict.fromkeys(key for trial in (*a, *b) for key in trial.conditions):
        one, other = (
            sorted({trial.conditions[what] for trial in side if what in trial.conditions})
            for side in (a, b)
        )
        # Where a side has no scores at all there is nothing to compare, which is said elsewhere.
        if one and other and (one != other or len(one) > 1):
            said.append(
                f"Trials differ in {what}: A has {' and '.join(one)}, B {' and '.join(other)}. "
                "What the sets differ in may come from that."
            )
    return [*said, *_same_tracks([*a, *b])]


def _same_tracks(trials: Sequence[TrialValues]) -> list[str]:
    first: dict[tuple[str, ...], str] = {}
    said = []
    for trial in trials:
        if trial.tracks:
            before = first.setdefault(trial.tracks, trial.label)
            if before != trial.label:
                said.append(
                    f"{before} and {trial.label} hold the same tracks: of what fish do they are "
                    "one trial, and count as two."
                )
    return said


def _why(view: TrialView) -> dict[Group, str]:
    why: dict[Group, str] = {}
    if not view.tracked_s:
        why["fish"] = "there are no tracks"
    why["model"] = "no model has been scored with a ceiling (zfcal calibrate does)"
    found = view.integration
    if found.robot:
        why["robot"] = _NO_ROBOT_CEILING
    elif view.trial.n_robots == 0:
        why["robot"] = "there is no robot in this trial"
    else:
        why["robot"] = "the robot has not been compared with the fish (zfcal analyse does)"
    return why


def _conditions(view: TrialView) -> dict[str, str]:
    arena, trial, found = view.arena, view.trial, view.integration
    area_m2 = f"{arena.outline.area:.3g} m²"
    conditions = {
        "the arena": f"{arena.name} ({area_m2}; {', '.join(arena.zone_names)})",
        "the number of fish": str(trial.n_fish),
        "the frame rate": f"{trial.fps:g} Hz",
        "the model's step": f"{trial.dt_s:g} s",
    }
    if view.courses:
        conditions["the scoring"] = view.scoring
    if found.robot:
        conditions["when the robot is judged from"] = f"{found.start_s} s"
    return conditions
