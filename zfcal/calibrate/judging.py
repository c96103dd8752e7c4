"""What the models of rules score on a window: simulated from where all were at its beginning.

Two things make a score by one long run unfit to choose a model. Fish still are where they have
been, so their two minutes resemble a model that soon forgets where it was more than their own. And
a run that visits a zone in which no fish was in these two minutes counts as wholly unlike them
there, so a model that never goes where fish seldom go is ahead of the true one. So a window is held
against single windows of a model, from where all were, with what these differ among themselves: a
kernel score, which is highest for the true model in the mean (Gneiting and Raftery 2007,
section 5).
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
        scores = kernel_scores(runs, task.control)
    return models[int(np.argmax(np.nan_to_num(scores, nan=-1.0)))]


def _followed(
    task: Task, settings: Settings, models: Sequence[Candidate], in_charge: str
) -> Followed:
    # They are judged with the speeds of the window at which they were chosen, as they drove.
    template = with_measured_speeds(task.group.template, models[0].long_run)
    group = task.group.with_template(template)
    runs = _runs(task, settings, group, models, FOLLOWED_RUNS)
    first = next((k for k, model in enumerate(models) if model.rule == in_charge), 0)
    among = [_apart(_alike(runs_of(runs, k), runs_of(runs, k))) for k in range(len(models))]
    leads = []
    for k, model in enumerate(models):
        if not np.array_equal(model.genes, models[first].genes):
            across = _alike(runs_of(runs, k), runs_of(runs, first))
            leads.append(_mean(among[k], 1) - _mean(across, 1))
            leads.append(_mean(across, 0) - _mean(among[first], 1))
    return Followed(
        scores=tuple(kernel_scores(runs, task.control).tolist()),
        noise=_spread([_mean(own, 1) for own in among]),
        lead_noise=_spread(leads),
    )


def kernel_scores(runs: Counts, control: Statistics) -> Floats:
    """Return how well models foretell a window, about as large as S.

    The mean S of the window and a simulated one, and half of what two simulated ones lack to 1.

    Parameters
    ----------
    runs
        Simulated windows, leading axes (model, run).
    control
        The window.

    Returns
    -------
    ndarray, shape (model,)
        NaN where no feature can be counted.
    """
    toward = _mean(population_scores(runs, control).S, 1)
    among = [
        _mean(_apart(_alike(runs_of(runs, k), runs_of(runs, k))).ravel(), 0)
        for k in range(len(toward))
    ]
    return np.asarray(toward + (1 - np.array(among)) / 2)


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


def _alike(ours: Counts, theirs: Counts) -> Floats:
    """Return S of each window of one set and each of another, shape (ours, theirs)."""
    rows = Counts(*(part[:, None] for part in ours))
    columns = Counts(*(part[None] for part in theirs))
    return population_scores(rows, columns).S


def _apart(alike: Floats) -> Floats:
    """Return a table of windows of one set without those of each with itself."""
    return np.where(np.eye(len(alike), dtype=bool), np.nan, alike)


def _mean(values: Floats, axis: int) -> Floats:
    """Return the mean of what is not NaN; NaN where all is."""
    known = ~np.isnan(values)
    n = known.sum(axis=axis)
    total = np.where(known, values, 0.0).sum(axis=axis)
    return np.asarray(np.where(n > 0, total / np.maximum(n, 1), np.nan))


def _spread(rows: Sequence[Floats]) -> float:
    """Return the standard deviation within rows, all rows together; NaN without any."""
    found = [row[~np.isnan(row)] for row in rows]
    found = [row for row in found if len(row)]
    return math.sqrt(np.mean([row.var() for row in found])) if found else math.nan
