"""A round that judges rules: which model it hands on, and what it says of it."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.calibrate.ceiling import window_noise
from zfcal.calibrate.group import scale_gamma
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.rules import (
    COMPROMISE,
    KEEP,
    LIKELIHOOD,
    LONG_RUNS,
    MEMORY,
    NEAREST,
    RULES,
    SCORE,
    Candidate,
    Forward,
    Record,
)
from zfcal.calibrate.task import Previous
from zfcal.parameters import to_genes

COUNTED = ("distance", "wall", "occupation", "transition", "speed")


@pytest.fixture
def forward(small):
    """Return settings of a round that judges rules."""
    return replace(small, champion="forward")


@pytest.fixture
def guided(task, truth):
    """Return a task with an estimate and one over all minutes."""
    return replace(task, guests=truth[None], memory=np.clip(truth + 0.05, 0, 1))


@pytest.fixture
def later(guided):
    """Return what makes a task of a third round, in which rules have scored as given."""

    def make(scores, in_use):
        rows = tuple(
            Forward(
                window_end_s=end, rule=rule, made_at_s=end - 120, S=score, low=0.0, high=1.0, n=9
            )
            for end in (240, 300, 360)
            for rule, score in scores.items()
        )
        record = Record(rows=rows, models=(in_use,), n_rounds=3, in_use=in_use, by=LONG_RUNS)
        return replace(guided, record=record, seeds=replace(guided.seeds, window_end_s=420))

    return make


@pytest.fixture
def old(task, small, truth):
    """Return a model that was made two rounds ago."""
    genes = scale_gamma(np.clip(truth + 0.2, 0, 1), 3)
    run = task.confirmation(small).simulate(genes[None])
    return Candidate(
        rule=MEMORY,
        made_at_s=300,
        of_s=300,
        genes=genes,
        long_run=run.as_statistics(0, task.control.zone_names),
    )


def counts_of(statistics):
    """Return all counts of statistics, to compare."""
    return [getattr(statistics, name).tolist() for name in COUNTED]


def test_the_first_round_hands_on_the_estimate(guided, forward, truth):
    """And keeps a model of each rule; the one in use before it is the starting model."""
    result = calibrate_window(guided, forward)
    record = result.handed.record
    assert result.rule == LIKELIHOOD
    np.testing.assert_array_equal(result.genes, scale_gamma(truth, 3))
    assert sorted(model.rule for model in record.models) == sorted(RULES)
    assert {model.made_at_s for model in record.models} == {120}
    assert (record.n_rounds, record.in_use.rule, record.rows) == (1, LIKELIHOOD, ())
    (kept,) = [model for model in record.models if model.rule == KEEP]
    np.testing.assert_array_equal(kept.genes, to_genes(guided.group.template))


def test_all_models_are_simulated_alike(guided, forward):
    """By the long runs and the seeds of the round, whichever rule made them."""
    result = calibrate_window(guided, forward)
    objective = guided.confirmation(forward)
    for model in result.handed.record.models:
        if model.rule == SCORE:
            # Simulated as it was bred; rows of gamma are the same up to their scale.
            continue
        runs = objective.simulate(model.genes[None])
        alone = runs.as_statistics(0, guided.control.zone_names)
        assert counts_of(alone) == counts_of(model.long_run)


def test_the_score_and_the_ceiling_are_those_of_the_model_that_is_published(guided, forward):
    """Not of the window's best, which scores more: the estimate is a poor one."""
    guided = replace(guided, guests=1.0 - guided.guests)
    result = calibrate_window(guided, forward)
    assert guided.confirmation(forward).scores(result.genes[None]).S[0] == result.scores.S
    by_score = calibrate_window(guided, replace(forward, champion="score"))
    assert by_score.scores.S > result.scores.S
    assert by_score.ceiling != result.ceiling
    assert by_score.rule == SCORE
    assert by_score.handed is None


def test_without_an_estimate_the_windows_best_is_handed_on(task, forward, small):
    """The same model, score, ceiling and intervals as by --publish score."""
    result = calibrate_window(task, forward)
    by_score = calibrate_window(task, small)
    assert result.rule == SCORE
    assert {model.rule for model in result.handed.record.models} == {SCORE, NEAREST, KEEP}
    assert (result.genes == by_score.genes).all()
    for name in ("champion", "scores", "ceiling", "intervals"):
        assert getattr(result, name) == getattr(by_score, name)


@pytest.mark.parametrize("rule", [SCORE, LIKELIHOOD, COMPROMISE, MEMORY, NEAREST])
def test_the_rule_that_leads_hands_on_its_model(later, old, forward, rule):
    """Genes of its model, and S by a simulation of them."""
    task = later({**dict.fromkeys(RULES, 0.5), rule: 0.9}, old)
    result = calibrate_window(task, forward)
    assert result.rule == rule
    in_use = result.handed.record.in_use
    assert in_use.rule == result.handed.record.in_charge == rule
    np.testing.assert_allclose(scale_gamma(result.genes, 3), in_use.genes)
    scored = task.confirmation(forward).scores(result.genes[None]).S[0]
    assert scored == result.scores.S


def test_the_compromise_is_half_way_between_best_and_estimate(later, old, forward):
    """Gene by gene, with scaled rows of gamma."""
    result = calibrate_window(later({KEEP: 0.5, SCORE: 0.5}, old), forward)
    made = {model.rule: model.genes for model in result.handed.record.models}
    np.testing.assert_allclose(made[COMPROMISE], (made[SCORE] + made[LIKELIHOOD]) / 2)


def test_a_model_that_is_kept_stays_to_the_bit(later, old, forward):
    """It says of which window it is, and is judged as it drives on: with speeds of the new one."""
    task = later({KEEP: 0.9, MEMORY: 0.5}, old)
    slow = np.zeros_like(task.control.speed)
    slow[:, 0] = task.control.speed.sum(axis=1)
    task = replace(task, control=replace(task.control, speed=slow))
    result = calibrate_window(task, forward)
    in_use = result.handed.record.in_use
    assert (result.rule, in_use.rule, in_use.of_s, in_use.made_at_s) == (KEEP, KEEP, 300, 420)
    assert (result.genes == old.genes).all()
    runs = task.confirmation(forward).simulate(old.genes[None])
    driven = runs.as_statistics(0, task.control.zone_names)
    assert counts_of(in_use.long_run) == counts_of(driven) != counts_of(old.long_run)
    assert task.confirmation(forward).scores(old.genes[None]).S[0] == result.scores.S


def test_before_rules_are_judged_the_last_champion_is_in_use(guided, forward, truth):
    """Of a trial that was published otherwise until now, not the starting model."""
    champion = np.clip(truth + 0.1, 0, 1)
    before = Previous(
        genes=np.stack([truth, champion]), scores=np.ones(2), champion=champion, noise=0.1
    )
    result = calibrate_window(replace(guided, previous=before), forward)
    (kept,) = [model for model in result.handed.record.models if model.rule == KEEP]
    np.testing.assert_array_equal(kept.genes, scale_gamma(champion, 3))


def test_what_followed_is_judged_before_it_is_chosen(guided, forward, old):
    """Of a record whose model waits for this window, the row is among those that decide."""
    record = Record(models=(old,), n_rounds=3, in_use=old)
    task = replace(guided, record=record, seeds=replace(guided.seeds, window_end_s=420))
    result = calibrate_window(task, forward)
    (row,) = result.handed.record.rows
    assert (row.window_end_s, row.made_at_s, row.rule) == (420, 300, MEMORY)
    assert row.n == guided.control.occupation.sum()
    by_score = calibrate_window(replace(task, record=Record()), replace(forward, champion="score"))
    assert row.high - row.low <= 2 * 1.96 * window_noise(by_score.ceiling) + 1e-12


def test_the_next_search_starts_from_what_is_published(guided, forward, truth):
    """It is the last champion to the next round."""
    result = calibrate_window(guided, forward)
    assert (result.as_previous.champion == scale_gamma(truth, 3)).all()


def test_a_killed_round_judges_as_one_that_was_not(guided, forward):
    """Resumed from its second generation."""
    seen = []
    whole = calibrate_window(guided, forward, watch=seen.append)
    again = calibrate_window(guided, forward, resume=seen[2])
    assert again.champion == whole.champion
    assert again.handed.choice == whole.handed.choice
    for one, other in zip(again.handed.record.models, whole.handed.record.models, strict=True):
        assert (one.rule, counts_of(one.long_run)) == (other.rule, counts_of(other.long_run))
