"""The scores of a calibrated trial, window by window, in the ways in which they can be told."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from zfcal.arrays import Seeds
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.tables import SCORES, read_table
from zfcal.behaviour.legacy import compare_legacy, extent_of, measure_legacy
from zfcal.behaviour.located import join
from zfcal.behaviour.scores import Scores, compare
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import as_statistics, pool_runs
from zfcal.calibrate.recorded import as_samples
from zfcal.model.simulate import pack, simulate_counts, simulate_tracks
from zfcal.parameters import Parameters
from zfcal.stages.calibrate.rounds import read_control
from zfcal.stages.segments import STEP_S, Segments
from zfcal.stages.trial_context import OpenTrial, open_trial
from zfcal.stages.windows import LENGTH_S
from zfcal.tracks import FISH, Samples

FEATURES = ("D", "W", "O", "T", "S")

Course = Mapping[tuple[str, int], float]
"""A score by feature and by the second at which the window ends; NaN is null."""

_RUNS, _RUN_S = 10, 1800.0
"""Simulations of a model that is scored anew, as in a confirmation."""


def reported_course(root: Path) -> Course:
    """Return what each round reported of its model on its own window.

    Parameters
    ----------
    root
        A trial with ``scores/E-model.parquet``.
    """
    places = numbered_of(root / "scores", "-model.parquet")
    return {
        (row["feature"], end_s): math.nan if row["value"] is None else row["value"]
        for end_s, path in sorted(places.items())
        for row in read_table(path, SCORES).to_pylist()
        if row["compared"] == "model-vs-control" and row["zone"] is None
    }


def legacy_course(root: Path) -> Course:
    """Return the score of each round's model on its window as the authors' scripts compute it.

    Parameters
    ----------
    root
        A trial with models and tracks. Each model is simulated for 30 min.
    """
    opened, segments = open_trial(root), Segments()
    extent_m = extent_of(opened.arena)
    found: dict[tuple[str, int], float] = {}
    for end_s, model in models_of(opened).items():
        if end_s == 0:
            continue
        starts = range(end_s - LENGTH_S, end_s, STEP_S)
        window = join([segments.read(opened, start) for start in starts]).of_kind(FISH)
        fish, swum = (
            measure_legacy(points, opened.arena, extent_m=extent_m)
            for points in (window, _paths(model, opened, end_s))
        )
        found |= _rows(compare_legacy(swum, fish), end_s)
    return found


def _paths(model: Parameters, opened: OpenTrial, end_s: int) -> Samples:
    trial = opened.trial
    xy_m, _ = simulate_tracks(
        model,
        opened.arena,
        n_agents=trial.n_fish + trial.n_robots,
        n_robots=trial.n_robots,
        n_steps=round(_RUN_S / trial.dt_s),
        seed=int(_seeds(trial.seed, end_s)[0]),
    )
    return as_samples(xy_m, trial.dt_s)


def driving_courses(root: Path, starts: Sequence[Parameters]) -> list[Course]:
    """Return the score, on each window, of the model that drove in the window's last minute.

    A round begins with the end of its window and takes a minute, as on the published rig: in a
    window's last minute the robot has the model of the window that ended two minutes before the
    end. That of the window to 120 s drives from 180 s on; until then it is the starting model.

    Parameters
    ----------
    root
        A calibrated trial with statistics. Models are simulated anew, with other random numbers.
    starts
        Models with which the robot could have begun.

    Returns
    -------
    list of Course
        One for each start.
    """
    opened = open_trial(root)
    made = {end_s: model for end_s, model in models_of(opened).items() if end_s > 0}
    courses: list[dict[tuple[str, int], float]] = [{} for _ in starts]
    for end_s, path in numbered_of(root / "stats", ".parquet").items():
        control = read_control(path, opened.arena.zone_names)
        before = [made_s for made_s in made if made_s <= end_s - 2 * STEP_S]
        drove = [made[max(before)]] if before else starts
        rows = [_rows(compare(_long_run(model, opened, end_s), control), end_s) for model in drove]
        for k in range(len(starts)):
            courses[k] |= rows[0 if before else k]
    return list(courses)


def models_of(opened: OpenTrial) -> dict[int, Parameters]:
    """Return a trial's numbered models by the second at which their window ends, 0 the first."""
    places = numbered_of(opened.trial.root / "models", ".toml")
    return {
        end_s: read_model_for(path, opened.arena, dt_s=opened.trial.dt_s)
        for end_s, path in sorted(places.items())
    }


def _long_run(model: Parameters, opened: OpenTrial, end_s: int) -> Statistics:
    trial = opened.trial
    counts = simulate_counts(
        pack([model], opened.arena),
        opened.arena,
        n_agents=trial.n_fish + trial.n_robots,
        n_robots=trial.n_robots,
        n_steps=round(_RUN_S / trial.dt_s),
        seeds=_seeds(trial.seed, end_s),
    )
    return as_statistics(pool_runs(counts), 0, opened.arena.zone_names)


def _seeds(trial_seed: int, end_s: int) -> Seeds:
    """Return seeds that no calibration has: of the trial, the window and this purpose."""
    return (
        np.random.SeedSequence([trial_seed, end_s, 1])
        .generate_state(_RUNS, np.uint64)
        .astype(np.uint64)
    )


def _rows(scores: Scores, end_s: int) -> dict[tuple[str, int], float]:
    values = (scores.I_D, scores.I_W, scores.I_O, scores.I_T, scores.S)
    return {(name, end_s): value for name, value in zip(FEATURES, values, strict=True)}
