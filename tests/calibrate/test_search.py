"""The initial population, the probe of the world, and when to stop."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from zfcal.calibrate import evolve, search
from zfcal.calibrate.evolve import overall_score
from zfcal.calibrate.group import Purpose
from zfcal.calibrate.pace import Deadline
from zfcal.calibrate.search import advance, begin, first_population, world_changed
from zfcal.calibrate.task import Previous
from zfcal.errors import InputError


def veterans(n, *, score=0.8, noise=0.05, champion=None):
    """Return a last population of n, with its champion among the first or apart."""
    genes = np.random.default_rng(9).random((n, 18))
    return Previous(
        genes=genes,
        scores=np.full(n, score),
        champion=genes[0] if champion is None else champion,
        noise=noise,
    )


def same(a, b):
    """Return whether two searches are equal bit by bit."""
    plain = ("genes", "features", "history", "world_changed", "n_renewed")
    pairs = [(getattr(a, name), getattr(b, name)) for name in plain]
    pairs += [(getattr(a.state, f.name), getattr(b.state, f.name)) for f in fields(a.state)]
    return all(np.array_equal(x, y, equal_nan=True) if isinstance(x, np.ndarray) else x == y
               for x, y in pairs)  # fmt: skip


def test_the_first_round_starts_at_random_with_its_guests(task, small, truth):
    """Twenty genomes, the guest at the end; another window draws others."""
    genes = first_population(replace(task, guests=truth[None]), small)
    assert genes.shape == (20, 18)
    assert (genes[-1] == truth).all()
    assert np.unique(genes, axis=0).shape == (20, 18)
    later = replace(task, seeds=replace(task.seeds, window_end_s=180))
    assert not (first_population(later, small)[0] == genes[0]).any()


def test_a_later_round_starts_from_the_last_population(task, small):
    """All of it, where it has the same size and holds the champion."""
    old = veterans(20)
    assert (first_population(replace(task, previous=old), small) == old.genes).all()


def test_the_last_champion_is_never_forgotten(task, small, truth):
    """It takes the place of the worst where the population has lost it."""
    old = veterans(20, champion=truth)
    genes = first_population(replace(task, previous=old), small)
    assert (genes[:19] == old.genes[:19]).all()
    assert (genes[19] == truth).all()


@pytest.mark.parametrize("n", [1, 12, 33])
def test_a_population_of_another_size_is_cut_or_filled(task, small, n):
    """The best come first, random genomes after them."""
    old = veterans(n)
    genes = first_population(replace(task, previous=old), small)
    kept = min(n, 20)
    assert genes.shape == (20, 18)
    assert (genes[:kept] == old.genes[:kept]).all()
    assert np.unique(genes, axis=0).shape[0] == 20


def test_guests_that_find_no_room_are_refused(task, small):
    """Twenty-one guests in a population of twenty."""
    with pytest.raises(InputError, match="no room for 21 guests"):
        first_population(replace(task, guests=np.zeros((21, 18))), small)


def test_the_world_has_changed_when_the_probe_falls_by_more_than_the_noise():
    """From 0.8 with a noise of 0.05: 0.76 is noise, 0.74 is a change, a rise is none."""
    old = veterans(20)
    for now, changed in ((0.76, False), (0.74, True), (0.95, False), (np.nan, True)):
        rng = np.random.default_rng(0)
        assert world_changed(old, np.full(20, now), rng=rng) is changed


def test_with_an_unknown_noise_any_fall_is_a_change():
    """NaN must not swallow the comparison."""
    old = veterans(20, noise=np.nan)
    assert world_changed(old, np.full(20, 0.79), rng=np.random.default_rng(0))
    assert not world_changed(old, np.full(20, 0.8), rng=np.random.default_rng(0))


def test_the_probe_is_a_tenth_of_the_population():
    """Of 60 equal genomes six are looked at: one that fell by 0.6 moves their mean by 0.1.

    Over the draws of 600 probes it is in about one of ten.
    """
    old = veterans(60)
    now = np.full(60, 0.8)
    now[17] = 0.2
    found = [world_changed(old, now, rng=np.random.default_rng(seed)) for seed in range(600)]
    assert np.mean(found) == pytest.approx(0.1, abs=5 * np.sqrt(0.09 / 600))


def test_everybody_is_scored_anew_on_the_new_window(task, small):
    """A lucky score of the last window does not survive."""
    old = veterans(20, score=1.0)
    evaluate = task.evaluation(small)
    progress = begin(replace(task, previous=replace(old, noise=9.0)), small, evaluate)
    assert not progress.world_changed
    np.testing.assert_array_equal(progress.state.features, evaluate(progress.state.genes))
    assert progress.state.scores.max() < 1.0
    assert progress.state.evaluations == 20


def test_a_changed_world_renews_the_worst_fifth_by_crowded_rank(task, small):
    """Four of twenty, by their rank on the new window; they cost four evaluations."""
    old = veterans(20, score=1.0)
    changed = replace(task, previous=old)
    evaluate = task.evaluation(small)
    progress = begin(changed, small, evaluate)
    unchanged = evolve.begin(old.genes, evaluate(old.genes), seed=1)
    newcomers = task.seeds.generator(Purpose.RENEWAL).random((4, 18))
    expected = np.concatenate([unchanged.genes[:16], newcomers])
    assert progress.world_changed
    assert progress.n_renewed == 4
    assert np.unique(progress.state.genes, axis=0) == pytest.approx(np.unique(expected, axis=0))
    assert progress.state.evaluations == len(progress.genes) == 24
    np.testing.assert_array_equal(progress.state.features, evaluate(progress.state.genes))


def test_every_evaluated_genome_is_kept_with_its_features(task, small):
    """Twenty and four times twenty, in order; the history has a line for each generation."""
    progress = search.search(task, small)
    assert progress.genes.shape == (100, 18)
    np.testing.assert_array_equal(progress.features, task.evaluation(small)(progress.genes))
    assert [line.generation for line in progress.history] == [0, 1, 2, 3, 4]
    assert [line.evaluations for line in progress.history] == [20, 40, 60, 80, 100]
    assert progress.history[-1].best_score == pytest.approx(np.nanmax(progress.scores))


def test_a_search_that_was_stopped_goes_on_as_if_it_had_not_been(task, small):
    """From every generation on."""
    seen = []
    whole = search.search(task, small, watch=seen.append)
    assert [progress.state.generation for progress in seen] == [0, 1, 2, 3, 4]
    for progress in seen:
        assert same(search.search(task, small, resume=progress), whole)


def test_workers_do_not_change_the_numbers(task, small):
    """Two or eight."""
    more = replace(task, group=replace(task.group, n_workers=8))
    assert same(search.search(more, small), search.search(task, small))


def test_deap_can_do_the_search(task, small):
    """The same state, another optimiser; it repeats, too."""
    settings = replace(small, optimiser="deap")
    found = search.search(task, settings)
    assert same(found, search.search(task, settings))
    assert not same(found, search.search(task, small))
    assert set(found.state.rng) == {"random", "numpy"}


def test_without_generations_and_without_a_deadline_there_are_fifteen(task, small):
    """The default of the command."""
    settings = replace(small, generations=None, steps=5)
    assert search.search(task, settings).state.generation == 15


def test_no_generation_is_a_search_among_the_initial_population(task, small):
    """Nothing is bred."""
    progress = search.search(task, replace(small, generations=0))
    assert progress.state.generation == 0
    assert len(progress.history) == 1


class Clock:
    """Seconds that simulated work costs."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        """Return the seconds so far."""
        return self.now


@dataclass(frozen=True)
class Timed:
    """A group whose every step costs a millisecond of a clock, on each worker."""

    inner: object
    clock: Clock

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def with_template(self, template):
        """Return the same group on the same clock."""
        return Timed(self.inner.with_template(template), self.clock)

    def simulate(self, genes, *, n_counted, n_steps, seeds):
        """Let the time pass that it takes."""
        shifts = -(-len(genes) * len(seeds) // self.inner.n_workers)
        self.clock.now += 0.001 * shifts * (n_steps + 300)
        return self.inner.simulate(genes, n_counted=n_counted, n_steps=n_steps, seeds=seeds)


@pytest.fixture
def timed(task):
    """Return the task with a clock of its own."""
    clock = Clock()
    return replace(task, group=Timed(task.group, clock)), clock


def test_a_deadline_stops_the_search_in_time_for_what_follows(timed, small):
    """A population costs 10 x 600 ms. The end costs 10 x 900 + 20 x 900 ms = 27 s.

    The first call takes 0.301 s, the initial population 6 s, and another generation
    is bred while 1.25 x (6 + 27) s are left of 100 s: at 6.3, 12.3, ... 54.3 s, nine.
    """
    task, clock = timed
    settings = replace(small, generations=None)
    progress = search.search(task, settings, deadline=Deadline(ends_s=100.0, clock=clock))
    assert progress.state.generation == 9
    assert clock.now + 27.0 < 100.0


def test_a_search_by_deadline_is_repeated_by_its_number_of_generations(timed, small):
    """Bit by bit."""
    task, clock = timed
    found = search.search(
        task, replace(small, generations=None), deadline=Deadline(ends_s=100.0, clock=clock)
    )
    again = search.search(task, replace(small, generations=found.state.generation))
    assert same(found, again)


def test_a_deadline_that_is_too_short_still_ends_in_a_valid_answer(timed, small):
    """The initial population is evaluated and ranked."""
    task, clock = timed
    progress = search.search(
        task, replace(small, generations=None), deadline=Deadline(ends_s=0.5, clock=clock)
    )
    assert progress.state.generation == 0
    assert np.isfinite(overall_score(progress.state.features)).all()


def test_generations_bound_a_search_that_has_time_left(timed, small):
    """Whichever comes first."""
    task, clock = timed
    progress = search.search(task, small, deadline=Deadline(ends_s=1e6, clock=clock))
    assert progress.state.generation == 4


def test_a_resumed_search_takes_its_pace_before_it_breeds(timed, small):
    """With 30 s left there is no time for a generation and the end, so none is bred."""
    task, clock = timed
    start = search.search(task, replace(small, generations=0))
    clock.now = 0.0
    progress = search.search(
        task,
        replace(small, generations=None),
        deadline=Deadline(ends_s=30.0, clock=clock),
        resume=start,
    )
    assert same(progress, start)


def test_a_generation_more_leaves_the_search_before_it_as_it_was(task, small):
    """Progress is a value."""
    evaluate = task.evaluation(small)
    start = begin(task, small, evaluate)
    again = begin(task, small, evaluate)
    advance(start, evaluate)
    assert same(start, again)
