"""A round from a window to a champion."""

from dataclasses import dataclass, field, fields, replace

import numpy as np
import pytest

from zfcal.calibrate.ceiling import window_noise
from zfcal.calibrate.group import scale_gamma
from zfcal.calibrate.rounds import calibrate_window, conclude
from zfcal.calibrate.search import search
from zfcal.parameters import to_genes


@pytest.fixture
def result(task, small):
    """Return a round of four generations of twenty."""
    return calibrate_window(task, small)


def test_twelve_generations_find_a_better_model_than_none(task, small):
    """Under the same long simulations, for this seed."""
    longer = calibrate_window(task, replace(small, generations=12))
    start = calibrate_window(task, replace(small, generations=0))
    assert longer.scores.S > start.scores.S
    assert longer.history[-1].hypervolume > 0


def test_the_champion_is_the_best_of_ten_by_a_second_look(task, small):
    """The ten best by S of all 100 evaluated genomes, found the slow way."""
    seen = []
    result = calibrate_window(task, small, watch=seen.append)
    last = seen[-1]
    table = dict(zip(map(tuple, last.genes), last.scores, strict=True))
    ten = np.array(sorted(table, key=table.get)[-10:])
    scores = task.confirmation(small).scores(ten).S
    assert (result.genes == ten[np.argmax(scores)]).all()
    assert scores.max() == result.scores.S


def test_without_a_second_look_the_searchs_own_score_chooses(task, small):
    """The best of the last population; its score is reported as the search saw it."""
    seen = []
    plain = calibrate_window(task, replace(small, n_confirmed=0), watch=seen.append)
    last = seen[-1].state
    assert (plain.genes == last.genes[np.argmax(last.scores)]).all()
    assert plain.scores.S == plain.optimiser_score == last.scores.max()
    assert plain.ceiling.overall[0] > 0


def test_nobody_good_is_lost_on_the_way(task, small, truth):
    """The ten are of all that was evaluated, not of the last population alone."""
    last = search(task, small)
    features = task.evaluation(small)(truth[None])
    wider = replace(last, parts=((truth[None], features), *last.parts))
    assert not (last.state.genes == truth).all(axis=1).any()
    assert (conclude(task, small, wider).genes == truth).all()


def test_the_likely_one_is_handed_on_where_its_score_allows(task, small, truth):
    """The true model, though ten others of the search score better on the window by luck."""
    guided = replace(task, guests=truth[None])
    likely = calibrate_window(guided, replace(small, champion="likely"))
    by_score = calibrate_window(guided, small)
    assert (likely.genes == truth).all()
    assert likely.rule == "likelihood"
    assert likely.intervals.within_ceiling
    assert task.confirmation(small).scores(truth[None]).S[0] == likely.scores.S
    assert by_score.rule == "score"
    assert by_score.scores.S >= likely.scores.S


def test_an_estimate_that_scores_less_than_its_own_windows_is_none(task, small, truth):
    """A wrong one is no champion: the best by its score is, as without it."""
    guided = replace(task, guests=1.0 - truth[None])
    asked = calibrate_window(guided, replace(small, champion="likely"))
    by_score = calibrate_window(guided, small)
    assert asked.rule == "score"
    assert (asked.genes == by_score.genes).all()
    assert asked.ceiling == by_score.ceiling


def test_without_an_estimate_the_score_decides(task, small, result):
    """Where there are no tracks, say."""
    asked = calibrate_window(task, replace(small, champion="likely"))
    assert (asked.genes == result.genes).all()
    assert asked.rule == "score"


@dataclass(frozen=True)
class Noting:
    """A group that notes the seeds of each simulation by its number of steps."""

    inner: object
    seeds: dict = field(default_factory=dict)

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def with_template(self, template):
        """Go on noting."""
        return Noting(self.inner.with_template(template), self.seeds)

    def simulate(self, genes, *, n_counted, n_steps, seeds):
        """Note the seeds."""
        self.seeds.setdefault(n_steps, set()).update(seeds.tolist())
        return self.inner.simulate(genes, n_counted=n_counted, n_steps=n_steps, seeds=seeds)


def test_search_confirmation_and_ceiling_have_no_seed_in_common(task, small):
    """One of the search, two of the long runs, forty of the windows: 43 different ones."""
    group = Noting(task.group)
    calibrate_window(replace(task, group=group), replace(small, long_s=130.0))
    assert {steps: len(seeds) for steps, seeds in group.seeds.items()} == {300: 1, 650: 2, 600: 40}
    assert len(set().union(*group.seeds.values())) == 43


def test_the_reported_score_is_not_the_optimisers_own(result):
    """The search's own best is higher by its luck, and stands apart."""
    assert result.optimiser_score == max(line.best_score for line in result.history)
    assert result.optimiser_score != result.scores.S


def test_the_champion_is_the_genome_with_its_gamma_rows_scaled(task, result):
    """And it draws the window's speeds."""
    assert result.champion.gamma_matrix().max(axis=1).tolist() == [1.0, 1.0, 1.0]
    np.testing.assert_allclose(to_genes(result.champion), scale_gamma(result.genes, 3))
    found = [zone.speed_frequency for zone in result.champion.zones]
    assert found == [zone.speed_frequency for zone in task.simulator.template.zones]


def test_a_seed_gives_the_same_round_bit_by_bit(task, small, result):
    """Champion, scores, ceiling, intervals, history and population."""
    again = calibrate_window(task, small)
    plain = ("champion", "scores", "ceiling", "intervals", "history", "optimiser_score")
    for name in plain:
        assert getattr(again, name) == getattr(result, name)
    for one in fields(result.population):
        np.testing.assert_equal(
            getattr(again.population, one.name), getattr(result.population, one.name)
        )


def test_another_trial_seed_gives_another_round(task, small, result):
    """The seed matters."""
    other = calibrate_window(replace(task, seeds=replace(task.seeds, trial_seed=8)), small)
    assert other.champion != result.champion


def test_a_killed_round_ends_in_the_same_result(task, small, result):
    """Resumed from its third generation."""
    seen = []
    calibrate_window(task, small, watch=seen.append)
    again = calibrate_window(task, small, resume=seen[3])
    assert again.champion == result.champion
    assert again.ceiling == result.ceiling
    assert again.history == result.history


def test_a_round_counts_what_it_did(result):
    """Four generations of twenty and the initial population."""
    assert (result.generations, result.evaluations) == (4, 100)
    assert (result.world_changed, result.n_renewed) == (False, 0)


def test_the_score_is_set_against_its_ceiling(result):
    """S over the mean of S among the champion's own windows."""
    mean, low, high = result.ceiling.of("S")
    assert result.ceiling.n_windows == 40
    assert low < mean < high
    assert result.against_ceiling == pytest.approx(result.scores.S / mean)


def test_there_is_an_interval_for_each_of_eighteen_parameters(result):
    """Around the champion's value; rows of gamma end at one."""
    names = [one.name for one in result.intervals.parameters]
    assert len(names) == 18
    assert names[0] == "corridor.kappa_0"
    for one in result.intervals.parameters:
        assert one.low <= one.value <= one.high
    assert result.intervals.n_compatible <= 100


def test_the_next_round_starts_where_this_one_ended(task, small, result, window):
    """On an equal world nothing is renewed; the last champion is among the first."""
    old = result.as_previous
    assert old.noise == window_noise(result.ceiling)
    assert (old.champion == result.genes).all()
    later = replace(
        task,
        previous=replace(old, noise=0.5),
        control=window(seed=2),
        seeds=replace(task.seeds, window_end_s=180),
    )
    seen = []
    second = calibrate_window(later, small, watch=seen.append)
    assert (seen[0].genes == result.genes).all(axis=1).any()
    assert not second.world_changed
    assert second.history[0].best_score > result.history[0].best_score


def test_a_world_that_has_changed_renews_a_fifth(task, small, result, window, truth):
    """The window of a group with the mirrored genome."""
    later = replace(
        task, previous=replace(result.as_previous, noise=0.01), control=window(genes=1.0 - truth)
    )
    second = calibrate_window(later, small)
    assert second.world_changed
    assert second.n_renewed == 4
    assert second.evaluations == 104


def test_nobody_is_renewed_where_that_is_not_wanted(task, small, result, window, truth):
    """The very round that renews a fifth otherwise."""
    other = replace(
        task, control=window(genes=1.0 - truth), previous=replace(result.as_previous, noise=0.01)
    )
    assert calibrate_window(other, small).n_renewed > 0
    kept = calibrate_window(other, replace(small, renews=False))
    assert (kept.n_renewed, kept.world_changed) == (0, False)


def test_a_round_on_the_truths_window_comes_near_its_ceiling(task, small, truth):
    """With the true genome as a guest the champion is within noise of a perfect model."""
    result = calibrate_window(replace(task, guests=truth[None]), replace(small, long_s=600.0))
    assert result.intervals.within_ceiling
    assert result.against_ceiling > 0.95


def test_the_model_that_is_handed_on_scores_what_was_reported(task, small, result):
    """Its file says all: gamma as scaled, genes as values."""
    again = task.confirmation(small).scores(to_genes(result.champion)[None])
    assert again.S[0] == pytest.approx(result.scores.S, abs=1e-3)
