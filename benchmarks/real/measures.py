"""Numbers of a real recording that has been imported, analysed and calibrated.

What the commands write into a trial is read from there; what they do not write
(pooled statistics, distances of all pairs, the same without the tracker's guesses) is
measured here with the library's own functions.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.real.recordings import Recording
from zfcal.arena import VOID
from zfcal.artifacts.models import read_model
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_table, read_tracks
from zfcal.behaviour.ceilings import halves_ceiling, robot_ceiling, summarise
from zfcal.behaviour.histograms import bin_edges, frequencies
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.scores import Scores, compare
from zfcal.behaviour.statistics import Statistics, measure, measure_robot
from zfcal.calibrate.group import with_measured_speeds
from zfcal.parameters import Parameters
from zfcal.report.figures.statistics import histogram_mean
from zfcal.stages.analyse.analyse import POOLED_FROM_S
from zfcal.stages.calibrate.holdout import evaluate_model
from zfcal.stages.calibrate.likelihood import estimate
from zfcal.stages.calibrate.result import score_table
from zfcal.stages.events import say_nothing
from zfcal.stages.segments import Segments
from zfcal.stages.trial_context import OpenTrial
from zfcal.stages.windows import whole_segments
from zfcal.tracks import FISH, GUESS, ROBOT

FEATURES = ("D", "W", "O", "T")

SEGMENTS = Segments()
"""Every segment is located once, whatever is asked of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Where the trials of a recording are.

    Parameters
    ----------
    trial
        With all positions.
    certain
        The same without the positions of low confidence.
    model
        The model that was calibrated on the first half.
    """

    trial: Path
    certain: Path
    model: Path


def fish_between(root: Path, span_s: tuple[float, float]) -> Located:
    """Return where the fish of a trial were in a stretch, in seconds since its start."""
    return located(root).of_kind(FISH).between(*span_s)


def located(root: Path) -> Located:
    """Return where everybody was in a whole trial."""
    opened = SEGMENTS.open(root)
    return join([SEGMENTS.read(opened, start) for start in segment_starts(root)])


def mean_pair_distance_m(points: Located) -> float:
    """Return the mean distance over all pairs at all samples, whatever their zones; NaN if none.

    Points in the void are left out.
    """
    seen = points.take(points.zone != VOID)
    total, n = 0.0, 0
    for lag in range(1, len(seen)):
        together = seen.k[lag:] == seen.k[:-lag]
        if not together.any():
            break
        first = np.flatnonzero(together)
        total += float(np.hypot(*(seen.xy_m[first + lag] - seen.xy_m[first]).T).sum())
        n += len(first)
    return total / n if n else math.nan


def statistics_table(found: Statistics, points: Located) -> dict[str, Any]:
    """Return frequencies of D, W, O, T and V by zone, with means in SI units and counts."""
    bins = points.arena.bins
    table: dict[str, Any] = {"zones": list(found.zone_names)}
    for letter, counts, limits in (
        ("D", found.distance, bins.distance_m),
        ("W", found.wall, bins.wall_distance_m),
        ("V", found.speed, bins.speed_m_s),
    ):
        table[letter] = {
            "range": list(limits),
            "n": counts.sum(axis=1).tolist(),
            "mean": [number(histogram_mean(row, bin_edges(limits))) for row in counts],
            "frequency": _numbers(frequencies(counts)),
        }
    table["O"] = {
        "n": int(found.occupation.sum()),
        "frequency": _numbers(frequencies(found.occupation)),
    }
    table["T"] = {
        "n": found.transition.sum(axis=1).tolist(),
        "frequency": _numbers(frequencies(found.transition)),
    }
    table["mean_pair_distance_m"] = number(mean_pair_distance_m(points))
    return table


def positions_table(root: Path) -> dict[str, Any]:
    """Return how many positions a trial has, and how many are guessed, settled or void."""
    opened = SEGMENTS.open(root)
    kinds, confidence, end_s = [], [], 0.0
    for start in segment_starts(root):
        tracks = read_tracks(segment_path(root, start))
        kinds.append(tracks.kind)
        confidence.append(tracks.confidence)
        end_s = max(end_s, float(tracks.time_s[-1])) if len(tracks) else end_s
    fish = np.concatenate(kinds) == FISH
    guessed = np.concatenate(confidence) < GUESS
    points = located(root).of_kind(FISH)
    return {
        "duration_s": round(end_s + 1 / opened.trial.fps, 3),
        "n_fish": opened.trial.n_fish,
        "n_robots": opened.trial.n_robots,
        "fps": opened.trial.fps,
        "dt_s": opened.trial.dt_s,
        "positions_of_fish": int(fish.sum()),
        "guessed_share_of_fish": number(guessed[fish].mean()),
        "guessed_share_of_robot": number(guessed[~fish].mean()) if (~fish).any() else None,
        "settled_share": number(points.settled.mean()),
        "void_share": number((points.zone == VOID).mean()),
    }


def held_out_table(recording: Recording, places: Places) -> dict[str, Any]:
    """Return what the models score on the half that none of them has seen.

    ``before`` is the starting model, ``own_speeds`` the same with the speeds of
    the first half, ``likelihood`` the most likely model of the first half,
    ``after`` the calibrated one; ``in_sample`` its score on the first half.
    """
    with places.model.open("rb") as file:
        result = tomllib.load(file)["result"]
    opened = SEGMENTS.open(places.trial)
    train = measure(fish_between(places.trial, recording.train_s), opened.arena)
    start = read_model(places.trial / opened.trial.model)
    table: dict[str, Any] = {
        "in_sample": {key: result[key] for key in ("S", "ceiling", "generations", "features")},
        "before": result["held_out"]["before"],
        "own_speeds": _scored(recording, opened, with_measured_speeds(start, train)),
    }
    likely = estimate(opened, start, recording.train_s, say_nothing)
    if likely is not None:
        model = with_measured_speeds(likely.found.parameters, train)
        table["likelihood"] = _scored(recording, opened, model)
    return {**table, "after": result["held_out"]["after"]}


def _scored(recording: Recording, opened: OpenTrial, model: Parameters) -> dict[str, Any]:
    found = evaluate_model(
        opened.trial.root, model, recording.held_out_s, seed=opened.trial.seed, segments=SEGMENTS
    )
    return score_table(found.scores, found.ceiling)


def alike_table(scores: Scores | None) -> dict[str, float | None]:
    """Return S and the four features."""
    if scores is None:
        return {}
    features = {f: number(getattr(scores, f"I_{f}")) for f in FEATURES}
    return {"S": number(scores.S), **features}


def without_model_table(recording: Recording, root: Path) -> dict[str, Any]:
    """Return how alike the halves are to each other: what stays the same in a recording.

    ``halves`` is the first half against the second, ``alternate_minutes`` every
    other minute against those between, which see the same slow changes.
    """
    arena = SEGMENTS.open(root).arena
    first, second = (
        measure(fish_between(root, span), arena)
        for span in (recording.train_s, recording.held_out_s)
    )
    whole = fish_between(root, (recording.halves_s[0], recording.halves_s[2]))
    return {
        "halves": alike_table(compare(first, second)),
        "alternate_minutes": alike_table(halves_ceiling(whole, arena)),
        "mean_pair_distance_m": number(mean_pair_distance_m(whole)),
    }


def certain_table(recording: Recording, places: Places) -> dict[str, Any]:
    """Return what changes when positions of low confidence are left out."""
    span = (recording.halves_s[0], recording.halves_s[2])
    kept, certain = (fish_between(root, span) for root in (places.trial, places.certain))
    a, b = measure(kept, kept.arena), measure(certain, certain.arena)
    pairs = 1 - b.distance.sum() / a.distance.sum() if a.distance.sum() else math.nan
    model = read_model(places.model)
    judged = _scored(recording, SEGMENTS.open(places.certain), model)
    return {
        "alike": alike_table(compare(a, b)),
        "lost_positions": number(1 - b.occupation.sum() / a.occupation.sum()),
        "lost_pairs": number(pairs),
        "lost_steps": number(1 - b.transition.sum() / a.transition.sum()),
        "mean_pair_distance_m": number(mean_pair_distance_m(certain)),
        "after_S": judged["S"],
        "after_ceiling": judged["ceiling"],
    }


def robot_table(root: Path) -> dict[str, Any]:
    """Return robot-vs-fish of the last window, pooled from 300 s on, with its ceiling."""
    path = max((root / "scores").glob("??????.parquet"))
    rows = _overall(path, "robot-vs-fish")
    return {
        row["feature"]: {key: row[key] for key in ("value", "ceiling", "low", "high", "n_windows")}
        for row in rows
    }


def robot_if_table(root: Path, agent: int) -> dict[str, Any]:
    """Return robot-vs-fish of the whole trial from 300 s on, were another agent the robot."""
    everybody = settled_in(root)
    kind = np.where(everybody.agent == agent, ROBOT, FISH).astype(np.int8)
    pool = replace(everybody, kind=kind)
    scores = compare(measure_robot(pool, pool.arena), measure(pool.of_kind(FISH), pool.arena))
    ceiling = summarise(robot_ceiling(pool, pool.arena)).of("S")
    return {"agent": agent, "S": scores.S, "ceiling": ceiling[0]}


def settled_in(root: Path) -> Located:
    """Return where everybody was from 300 s on, when robot and fish know each other."""
    everybody = located(root)
    return everybody.between(POOLED_FROM_S, float(everybody.k[-1] + 1) * everybody.dt_s)


def seeds_table(models: dict[int, Path]) -> dict[str, float]:
    """Return what models score on the held-out half that differ by their seed alone."""
    found = {}
    for seed, path in models.items():
        with path.open("rb") as file:
            found[str(seed)] = tomllib.load(file)["result"]["held_out"]["after"]["S"]
    return found


def control_table(trial: Path, controls: dict[str, tuple[Path, ...]]) -> dict[str, Any]:
    """Return how alike a trial's group is to robot-free trials, from 300 s to the end.

    Parameters
    ----------
    trial
        The trial; its scores are those of ``analyse --control``.
    controls
        Groups of robot-free trials by name.

    Returns
    -------
    dict
        For each group the fish among themselves against its fish, and the same of
        the whole group with the robot; for the group that ``analyse`` was given
        mean and sd of D over the windows.
    """
    everybody = settled_in(trial)
    fish = everybody.of_kind(FISH)
    table: dict[str, Any] = {"mean_pair_distance_m": number(mean_pair_distance_m(fish))}
    for name, roots in controls.items():
        control = reduce(add, (whole_fish(root) for root in roots))
        table[name] = {
            "fish": alike_table(compare(measure(fish, fish.arena), control)),
            "group": alike_table(compare(measure(everybody, fish.arena), control)),
        }
    paths = sorted((trial / "scores").glob("??????.parquet"))
    rows = [row for path in paths for row in _overall(path, "social-vs-control")]
    near = [row["value"] for row in rows if row["feature"] == "D"]
    if near:
        sd = number(np.std(near, ddof=1)) if len(near) > 1 else None
        table["windows"] = {"D_mean": number(np.mean(near)), "D_sd": sd, "n": len(near)}
    return table


def whole_fish(root: Path) -> Statistics:
    """Return the statistics of a trial's fish over its whole segments, as a control has them."""
    opened = SEGMENTS.open(root)
    parts = [SEGMENTS.read(opened, start) for start in whole_segments(opened.trial)]
    return measure(join(parts).of_kind(FISH), opened.arena)


def _overall(path: Path, compared: str) -> list[dict[str, Any]]:
    rows = read_table(path, "zfcal.scores/1").to_pylist()
    return [row for row in rows if row["compared"] == compared and row["zone"] is None]


def number(value: float) -> float | None:
    """Return a value that is fit for JSON: None for NaN."""
    return None if math.isnan(value) else float(value)


def _numbers(values: np.ndarray[Any, np.dtype[np.float64]]) -> Any:
    """Return nested lists of numbers, None for NaN."""
    if values.ndim > 1:
        return [_numbers(row) for row in values]
    return [number(value) for value in values]
