"""What the models of rules score on a window: simulated from where all were at its beginning.

Two things make a score by one long run unfit to choose a model. Fish still are where they have
been, so their two minutes resemble a model that soon forgets where it was more than their own. And
a run that visits a zone in which no fish was in these two minutes counts as wholly unlike them
there, so a model that never goes where fish seldom go is ahead of the true one. So a window is held
against single windows of a model, from where all were, with what these differ among themselves.

That is an energy score (Gneiting and Raftery 2007, section 4.2): in the mean it is highest for the
true law. It is so because the similarities are one minus distances between points: a histogram is
the point of the roots of its shares, an empty one a point on an axis of its own, and the four
statistics are averaged. S, their geometric mean that leaves empty zones out, has not this property.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from zfcal.arrays import Floats
from zfcal.behaviour.histograms import similarity
from zfcal.behaviour.scores import Counts as CountsLike
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import (
    Purpose,
    Startable,
    runs_of,
)
from zfcal.calibrate.rules import LONG_RUNS, START, Candidate, Followed, Record
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
    scores = tuple(compare(m.long_run, control).S for m in models)
    return Followed(scores=scores, noise=noise, by=LONG_RUNS)


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
        runs = _runs(task, settings, models, NEAREST_RUNS)
        scores = kernel_scores(runs, task.control)
    return models[int(np.argmax(np.nan_to_num(scores, nan=-1.0)))]


def _followed(
    task: Task, settings: Settings, models: Sequence[Candidate], in_charge: str
) -> Followed:
    runs = _runs(task, settings, models, FOLLOWED_RUNS)
    first = next((k for k, model in enumerate(models) if model.rule == in_charge), 0)
    among = [_apart(_table(runs_of(runs, k), runs_of(runs, k))) for k in range(len(models))]
    leads = []
    for k, model in enumerate(models):
        if not np.array_equal(model.genes, models[first].genes):
            across = _table(runs_of(runs, k), runs_of(runs, first))
            leads.append(np.nanmean(among[k], axis=1) - across.mean(axis=1))
            leads.append(across.mean(axis=0) - np.nanmean(among[first], axis=1))
    return Followed(
        scores=tuple(kernel_scores(runs, task.control).tolist()),
        noise=_spread([np.nanmean(own, axis=1) for own in among]),
        by=START,
        lead_noise=_spread(leads),
    )


def kernel_scores(runs: Counts, control: Statistics) -> Floats:
    """Return how well models foretell a window: their energy scores, from below 0 to 1.5.

    The mean similarity of the window and a simulated one, and half of what two simulated ones lack
    to 1. In the mean a true model has 1 less half of what two of its windows lack.

    Parameters
    ----------
    runs
        Simulated windows, leading axes (model, run).
    control
        The window.

    Returns
    -------
    ndarray, shape (model,)
        NaN where the window holds nothing.
    """
    if not control.occupation.sum():
        return np.full(len(runs.occupation), np.nan)
    toward = alike(runs, control).mean(axis=1)
    among = [
        np.nanmean(_apart(_table(runs_of(runs, k), runs_of(runs, k)))) for k in range(len(toward))
    ]
    return np.asarray(toward + (1 - np.array(among)) / 2)


def alike(ours: CountsLike, theirs: CountsLike) -> Floats:
    """Return one minus the mean distance of D, W, O and T, leading axes broadcast.

    A zone that is empty on both sides is the same on both, on one side only as far as can be. D, W
    and T are means over all zones.
    """
    zones = [
        np.nan_to_num(similarity(getattr(ours, name), getattr(theirs, name)), nan=1.0).mean(axis=-1)
        for name in ("distance", "wall", "transition")
    ]
    where = np.nan_to_num(similarity(ours.occupation, theirs.occupation), nan=1.0)
    return np.asarray((zones[0] + zones[1] + zones[2] + where) / 4)


def _runs(task: Task, settings: Settings, models: Sequence[Candidate], n_runs: int) -> Counts:
    """Return what models do from where all were, as long as the window and with its speeds."""
    group = task.simulator
    if task.start is None or not isinstance(group, Startable):
        raise InputError(f"{type(group).__name__} cannot begin where agents were seen.")
    return group.begun(task.start).simulate(
        np.stack([model.genes for model in models]),
        n_counted=group.n_fish or group.n_agents,
        n_steps=task.steps_of(settings.window_s),
        seeds=task.seeds.seeds(Purpose.JUDGING, n_runs),
    )


def _table(ours: Counts, theirs: Counts) -> Floats:
    """Return how alike each window of one set and each of another are, shape (ours, theirs)."""
    rows = Counts(*(part[:, None] for part in ours))
    return alike(rows, Counts(*(part[None] for part in theirs)))


def _apart(table: Floats) -> Floats:
    """Return a table of windows of one set without those of each with itself."""
    return np.where(np.eye(len(table), dtype=bool), np.nan, table)


def _spread(rows: Sequence[Floats]) -> float:
    """Return the standard deviation within rows, all rows together; NaN without any."""
    return math.sqrt(np.mean([row.var() for row in rows])) if len(rows) else math.nan
