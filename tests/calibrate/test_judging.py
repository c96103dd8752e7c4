"""What models of rules score on a window: from where all were at its beginning."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.scores import population_scores
from zfcal.calibrate.group import (
    Group,
    SeedSource,
    as_statistics,
    pool_runs,
)
from zfcal.calibrate.judging import by_long_runs, judged, kernel_scores, nearest
from zfcal.calibrate.rules import KEEP, LIKELIHOOD, MEMORY, NEAREST, Candidate, Record
from zfcal.calibrate.task import Settings, Task
from zfcal.errors import InputError
from zfcal.model.simulate import Counts, simulate_tracks
from zfcal.model.start import Start
from zfcal.parameters import gene_names, natural, to_genes

N_STEPS = 600
NOISE = 0.3


@pytest.fixture(scope="module")
def two_rooms():
    """Return the default arena."""
    return load_arena("two-rooms", Path())


@pytest.fixture(scope="module")
def models(two_rooms):
    """Return natural fish, and fish that forget sooner where they were."""
    zones = tuple((zone.name, zone.follows_walls) for zone in two_rooms.zones)
    true = natural(zones, dt_s=0.2)
    flat = tuple(
        replace(
            zone,
            kappa_0=6.3,
            kappa_f=20.0,
            kappa_w=None,
            alpha=20.0,
            gamma=dict.fromkeys(zone.gamma, 1.0),
        )
        for zone in true.zones
    )
    return true, replace(true, zones=flat)


@pytest.fixture(scope="module")
def group(two_rooms, models):
    """Return four fish and a robot."""
    return Group(arena=two_rooms, template=models[0], n_fish=4, n_robots=1, n_workers=2)


@pytest.fixture(scope="module")
def starts(two_rooms, models):
    """Return where the true model's agents were in different runs, after a minute."""

    def at(seed):
        xy_m, heading = simulate_tracks(
            models[0], two_rooms, n_agents=5, n_steps=1, n_robots=1, seed=seed
        )
        return Start(poses=np.column_stack([xy_m[0], heading[0]]), time_s=0.0)

    return [at(seed) for seed in range(36)]


@pytest.fixture(scope="module")
def candidates(group, models, two_rooms):
    """Return a candidate of a rule for each model, with its long run."""
    genes = np.stack([to_genes(model) for model in models])
    seeds = np.arange(6, dtype=np.uint64)
    runs = pool_runs(group.simulate(genes, n_counted=5, n_steps=9000, seeds=seeds))
    return tuple(
        Candidate(
            rule=rule,
            made_at_s=120,
            of_s=120,
            genes=own,
            long_run=as_statistics(runs, k, two_rooms.zone_names),
        )
        for k, (rule, own) in enumerate(zip((MEMORY, NEAREST), genes, strict=True))
    )


@pytest.fixture(scope="module")
def make_task(group, models, two_rooms, candidates):
    """Return what makes the task of a window of the true model, from a start."""

    def make(start, seed=77, *, given=True):
        counts = group.begun(start).simulate(
            to_genes(models[0])[None],
            n_counted=4,
            n_steps=N_STEPS,
            seeds=np.array([seed], dtype=np.uint64),
        )
        return Task(
            group=group,
            control=as_statistics(pool_runs(counts), 0, two_rooms.zone_names),
            seeds=SeedSource(trial_seed=7, window_end_s=240),
            record=Record(models=candidates, n_rounds=2),
            start=start if given else None,
        )

    return make


@pytest.mark.slow
def test_from_where_they_were_the_true_model_is_the_better_one(make_task, starts, candidates):
    """Against long runs it is the worse one: fish are still where they have been.

    So long runs would hand another model to the robot, whatever the number of windows.
    """
    by_long, by_start = [], []
    for k, start in enumerate(starts):
        task = make_task(start, seed=1000 + k)
        true, other = judged(task, Settings(), NOISE).rows
        by_start.append(true.S - other.S)
        long = by_long_runs(candidates, task.control, NOISE).scores
        by_long.append(long[0] - long[1])
    assert np.mean(by_long) < 0 < np.mean(by_start)
    assert np.mean(by_start) > 2 * np.std(by_start, ddof=1) / math.sqrt(len(by_start))


def test_scores_and_noise_by_hand(make_task, starts, group, candidates):
    """The mean S of window and run, half of what runs lack among themselves; noise by the runs."""
    task = make_task(starts[0])
    record = judged(task, Settings(), NOISE)
    runs = task.simulator.begun(starts[0]).simulate(
        np.stack([model.genes for model in candidates]),
        n_counted=4,
        n_steps=N_STEPS,
        seeds=task.seeds.seeds(9, 40),
    )
    windows = [Counts(*(part[model] for part in runs)) for model in range(2)]
    own, across = np.full((2, 40, 40), np.nan), np.empty((40, 40))
    for k in range(40):
        for j in range(40):
            across[k, j] = by_hand(runs_of_one(windows[0], k), runs_of_one(windows[1], j))
            for model in range(2):
                if k != j:
                    own[model, k, j] = by_hand(
                        runs_of_one(windows[model], k), runs_of_one(windows[model], j)
                    )
    toward = [
        np.mean([by_hand(runs_of_one(runs, k), task.control) for k in range(40)])
        for runs in windows
    ]
    wanted = [toward[k] + (1 - np.nanmean(own[k])) / 2 for k in range(2)]
    assert [row.S for row in record.rows] == pytest.approx(wanted)
    noise = math.sqrt(np.mean([np.nanmean(table, axis=1).var() for table in own]))
    leads = (
        np.nanmean(own[0], axis=1) - across.mean(axis=1),
        across.mean(axis=0) - np.nanmean(own[1], axis=1),
    )
    assert record.lead_noise == pytest.approx(math.sqrt(np.mean([lead.var() for lead in leads])))
    assert record.lead_noise < noise < NOISE
    assert record.rows[0].low == pytest.approx(record.rows[0].S - 1.96 * noise)


def runs_of_one(runs, k):
    """Return the counts of one window."""
    return Counts(*(part[k] for part in runs))


def by_hand(ours, theirs):
    """Return one minus the mean distance of the four statistics, zone by zone."""

    def one(p, q):
        if not p.sum() or not q.sum():
            return float(p.sum() == q.sum())
        roots = np.sqrt(p / p.sum()) - np.sqrt(q / q.sum())
        return 1 - math.sqrt((roots**2).sum() / 2)

    total = one(ours.occupation, theirs.occupation)
    for name in ("distance", "wall", "transition"):
        a, b = getattr(ours, name), getattr(theirs, name)
        total += np.mean([one(p, q) for p, q in zip(a, b, strict=True)])
    return total / 4


def test_no_law_scores_more_than_the_true_one():
    """Nor one in between: pairs are in one zone or in the other, half of the windows each.

    By S, a geometric mean that leaves empty zones out, a model that has pairs in both scores more.
    """

    def windows(shares):
        zones = np.array(shares)[:, :, None] * np.eye(10, dtype=np.int64)[0]
        flat = np.ones((len(zones), 2, 10), dtype=np.int64)
        two = np.ones((len(zones), 2), dtype=np.int64)
        stay = np.ones((len(zones), 2, 2), dtype=np.int64)
        return Counts(zones, flat, two, stay, flat)

    true = windows([(9, 0), (0, 9)] * 20)
    runs = Counts(*(np.stack(pair) for pair in zip(true, windows([(5, 4)] * 40), strict=True)))
    scores = []
    for k in range(2):
        control = as_statistics(Counts(*(part[k : k + 1] for part in true)), 0, ("one", "other"))
        scores.append(kernel_scores(runs, control))
    own, wrong = np.mean(scores, axis=0)
    assert own > wrong + 0.02


@pytest.mark.slow
def test_a_model_that_avoids_a_zone_is_not_ahead_for_it(group, models, starts):
    """In the mean over windows of the true model, whether a fish was in the corridor or not.

    Against all runs together a window without a visit lacks a zone, so a model that hardly goes
    there is hardly worse; single windows without a visit are windows of the true model as well.
    """
    true = to_genes(models[0])
    avoids = true.copy()
    names = gene_names(group.arena.zone_names)
    avoids[[k for k, name in enumerate(names) if name.endswith("gamma.corridor")]] = 0.0
    seeds = np.arange(20, dtype=np.uint64)
    words = {"n_counted": 4, "n_steps": N_STEPS}
    pooled, leads = [], []
    for k, start in enumerate(starts[:24]):
        begun = group.begun(start)
        window = begun.simulate(true[None], seeds=np.array([500 + k], dtype=np.uint64), **words)
        control = as_statistics(pool_runs(window), 0, group.arena.zone_names)
        runs = begun.simulate(np.stack([true, avoids]), seeds=seeds, **words)
        pooled.append(-np.diff(population_scores(pool_runs(runs), control).S)[0])
        leads.append(-np.diff(kernel_scores(runs, control))[0])
    error = np.std(leads, ddof=1) / math.sqrt(len(leads))
    assert np.mean(leads) > 3 * error
    assert np.mean(leads) / np.std(leads) > np.mean(pooled) / np.std(pooled)


def test_without_a_start_long_runs_are_what_counts(make_task, starts, candidates):
    """As where no track says where all were; the noise of leads is not known then."""
    task = make_task(starts[0], given=False)
    record = judged(task, Settings(), NOISE)
    assert [row.S for row in record.rows] == list(
        by_long_runs(candidates, task.control, NOISE).scores
    )
    assert math.isnan(record.lead_noise)


def test_one_model_twice_has_no_noise_of_leads(make_task, starts, candidates):
    """As in the first round, where the window's estimate is that of all minutes."""
    twice = tuple(replace(candidates[0], rule=rule) for rule in (LIKELIHOOD, MEMORY, KEEP))
    record = judged(replace(make_task(starts[0]), record=Record(models=twice)), Settings(), NOISE)
    assert len({row.S for row in record.rows}) == 1
    assert math.isnan(record.lead_noise)


def test_nothing_is_due_in_the_first_rounds(make_task, starts):
    """The record stays what it is."""
    record = Record(n_rounds=1)
    assert judged(replace(make_task(starts[0]), record=record), Settings(), NOISE) is record


def test_the_nearest_is_the_model_that_scores_best(make_task, starts, candidates):
    """By windows from the start, with the speeds of the window; without one by long runs."""
    task = make_task(starts[3])
    runs = task.simulator.begun(starts[3]).simulate(
        np.stack([model.genes for model in candidates]),
        n_counted=4,
        n_steps=N_STEPS,
        seeds=task.seeds.seeds(9, 20),
    )
    best = int(np.argmax(kernel_scores(runs, task.control)))
    assert nearest(task, Settings(), candidates) is candidates[best]
    assert nearest(task, Settings(), candidates[::-1]) is candidates[best]
    assert nearest(task, Settings(), ()) is None
    far = replace(task, start=None)
    scores = by_long_runs(candidates, task.control, NOISE).scores
    assert nearest(far, Settings(), candidates) is candidates[int(np.argmax(scores))]


def test_a_window_of_nothing_has_no_nearest_but_the_first(make_task, starts, candidates):
    """All scores are null."""
    task = make_task(starts[0])
    empty = task.control - task.control
    assert nearest(replace(task, control=empty), Settings(), candidates) is candidates[0]


@dataclass(frozen=True)
class Fixed:
    """A group that can begin nowhere but anywhere."""

    template: object
    n_agents: int = 5
    n_fish: int = 4
    n_workers: int = 1

    def with_template(self, template):
        """Return the same."""
        return replace(self, template=template)


def test_a_group_that_cannot_begin_there_says_so(make_task, starts, group, candidates):
    """One line, as for statistics that a group cannot count."""
    task = replace(make_task(starts[0]), group=Fixed(template=group.template))
    with pytest.raises(InputError, match="Fixed cannot begin where agents were seen"):
        nearest(task, Settings(), candidates)


def test_a_closing_takes_the_time_of_judging(make_task, starts):
    """Windows of each model that is due, and of each that may be the nearest."""
    task = make_task(starts[0])
    forward = Settings(champion="forward")
    more = task.closing_work(forward) - replace(task, start=None).closing_work(forward)
    n_own = len(task.record.own)
    assert more == task.work(n_genomes=6 * 40 + n_own * 20, n_runs=1, n_steps=N_STEPS)
    score = Settings()
    assert task.closing_work(score) == replace(task, start=None).closing_work(score)
