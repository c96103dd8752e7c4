"""What the models of rules score on a window: simulated from where all were at its beginning.

A long run from anywhere is no measure of two minutes of fish that still are where they have been.
Fish of the very model score .78 against its long run in two rooms, fish of another one .80, since
that one forgets sooner where it was. From where they were, the true model is the best one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from zfcal.arrays import Floats
from zfcal.behaviour.scores import compare, population_scores
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import (
    Purpose,
    Simulator,
    Startable,
    pool_runs,
    runs_of,
    with_measured_speeds,
)
from zfcal.calibrate.rules import Candidate, Followed, Record
from zfcal.calibrate.task import FOLLOWED_RUNS, NEAREST_RUNS, Settings, Task
from zfcal.errors import InputError
from zfcal.model.simulate import Counts


def judged(task: Task, settings: Settings, noise: float) -> Record:
    """Return a round's record with the models that its window is the first to follow.

    Parameters
    ----------
    task, settings
        Of the round. Without a start models are judged by their long runs.
    noise
        Standard deviation of S between windows of one model, by long runs.
    """
    record, end_s = task.record, task.seeds.window_end_s
    models = record.due(end_s)
    if not models:
        return record
    if task.start is None:
        found = by_long_runs(models, task.control, noise)
    else:
        found = _followed(task, settings, models, record.in_charge)
    return record.judged(found, end_s=end_s, n=int(task.control.occupation.sum()))


def by_long_runs(models: Sequence[Candidate], control: Statistics, noise: float) -> Followed:
    """Return what models score by the long runs that they were handed on with.

    Parameters
    ----------
    models
        Any.
    control
        The window's statistics.
    noise
        Standard deviation of S between windows of one model.
    """
    return Followed(scores=tuple(compare(m.long_run, control).S for m in models), noise=noise)


def nearest(task: Task, settings: Settings, models: Sequence[Candidate]) -> Candidate | None:
    """Return the model that is nearest to a round's window; None without any.

    Most of them were made of other windows, so this one is their test.

    Parameters
    ----------
    task, settings
        Of the round.
    models
        Among which.
    """
    if not models:
        return None
    if task.start is None:
        scores = np.array(by_long_runs(models, task.control, math.nan).scores)
    else:
        runs = _runs(task, settings, task.simulator, models, NEAREST_RUNS)
        scores = population_scores(pool_runs(runs), task.control).S
    return models[int(np.argmax(np.nan_to_num(scores, nan=-1.0)))]


def _followed(
    task: Task, settings: Settings, models: Sequence[Candidate], in_charge: str
) -> Followed:
    # They are judged with the speeds of the window at which they were chosen, as they drove.
    template = with_measured_speeds(task.group.template, models[0].long_run)
    group = task.group.with_template(template)
    runs = _runs(task, settings, group, models, FOLLOWED_RUNS)
    pooled = pool_runs(runs)
    apart = _between_windows(runs, pooled)
    own = np.array([table[k] for k, table in enumerate(apart)])
    first = next((k for k, model in enumerate(models) if model.rule == in_charge), 0)
    leads = [
        truth[k] - truth[first]
        for k in range(len(models))
        for truth in (apart[k], apart[first])
        if k != first and not np.array_equal(models[k].genes, models[first].genes)
    ]
    return Followed(
        scores=tuple(population_scores(pooled, task.control).S.tolist()),
        noise=_spread(own),
        lead_noise=_spread(np.array(leads)) if leads else math.nan,
    )


def _runs(
    task: Task, settings: Settings, group: Simulator, models: Sequence[Candidate], n_runs: int
) -> Counts:
    """Return what models do from where all were, for as long as the window is."""
    if task.start is None or not isinstance(group, Startable):
        raise InputError(f"{type(group).__name__} cannot begin where agents were seen.")
    return group.begun(task.start).simulate(
        np.stack([model.genes for model in models]),
        n_counted=group.n_fish or group.n_agents,
        n_steps=task.steps_of(settings.window_s),
        seeds=task.seeds.seeds(Purpose.JUDGING, n_runs),
    )


def _between_windows(runs: Counts, pooled: Counts) -> list[Floats]:
    """Return, for each model as the truth, what all models score on its windows.

    Returns
    -------
    list of ndarray, shape (model, run)
    """
    n_models = len(pooled.occupation)
    return [
        np.stack(
            [
                population_scores(runs_of(runs, truth), runs_of(pooled, model)).S
                for model in range(n_models)
            ]
        )
        for truth in range(n_models)
    ]


def _spread(values: Floats) -> float:
    """Return the standard deviation over runs, the last axis, of all rows together."""
    return float(np.sqrt(np.nanmean(np.nanvar(values, axis=-1))))
