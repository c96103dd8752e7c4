"""Which model is handed on: what rules have scored, and when a lead is more than chance."""

import math
from dataclasses import replace

import numpy as np
import pytest

from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.judging import by_long_runs
from zfcal.calibrate.rules import (
    COMPROMISE,
    KEEP,
    LIKELIHOOD,
    LONG_RUNS,
    MADE,
    MEMORY,
    NEAREST,
    RULES,
    SAYS,
    SCORE,
    START,
    Candidate,
    Followed,
    Forward,
    Lead,
    Record,
    half_way,
)

NOISE = 0.05


def statistics(n_first=50, *, n=100):
    """Return counts of one zone of two, of which the first gets so many of n in each statistic."""
    two = np.array([n_first, n - n_first], dtype=np.int64)
    bins = np.zeros((2, 10), dtype=np.int64)
    bins[:, 0] = bins[:, 1] = two
    return Statistics(
        zone_names=("one", "other"),
        distance=bins,
        wall=bins,
        occupation=two,
        transition=np.outer(two, two),
        speed=bins,
    )


NOTHING = statistics(n=0, n_first=0)


def model(rule, made_at_s, *, n_first=50, gene=0.5, of_s=None):
    """Return a model of a rule."""
    return Candidate(
        rule=rule,
        made_at_s=made_at_s,
        of_s=made_at_s if of_s is None else of_s,
        genes=np.full(3, gene),
        long_run=statistics(n_first),
    )


def row(rule, end_s, score):
    """Return a forward score of a window."""
    return Forward(
        window_end_s=end_s, rule=rule, made_at_s=end_s - 120, S=score, low=0.0, high=1.0, n=9
    )


def judged(record, control, end_s, noise):
    """Return a record with the models that are due, by their long runs."""
    found = by_long_runs(record.due(end_s), control, noise)
    return record.judged(found, end_s=end_s, n=int(control.occupation.sum()))


def record_of(scores, *, n_rounds=5, in_charge=NEAREST):
    """Return a record of rules, each with a score per minute."""
    rows = [
        row(rule, 240 + 60 * k, score)
        for rule, values in scores.items()
        for k, score in enumerate(values)
        if score is not None
    ]
    return Record(rows=tuple(rows), n_rounds=n_rounds, in_charge=in_charge)


def test_a_model_is_judged_on_the_first_window_that_begins_after_it_was_made():
    """One made at 120 s is judged at 240 s and not at 180 s, whose first minute it has seen."""
    record = Record(models=(model(SCORE, 120), model(SCORE, 180)))
    assert judged(record, statistics(), 180, NOISE).rows == ()
    assert judged(record, statistics(), 239, NOISE).rows == ()
    (found,) = judged(record, statistics(), 240, NOISE).rows
    assert (found.window_end_s, found.made_at_s, found.rule) == (240, 120, SCORE)


def test_a_row_says_what_the_model_scores_and_how_far_windows_differ():
    """S by the definition, 1.96 standard deviations to each side and no farther than 0 and 1."""
    control = statistics(40)
    record = Record(models=(model(SCORE, 120, n_first=60), model(KEEP, 120, n_first=40)))
    first, second = judged(record, control, 240, NOISE).rows
    wanted = compare(statistics(60), control).S
    assert 0.5 < wanted < 1.0
    assert wanted == first.S
    assert first.low == pytest.approx(wanted - 0.098)
    assert first.high == pytest.approx(min(1.0, wanted + 0.098))
    assert (second.S, second.high) == (pytest.approx(1.0), 1.0)
    assert {first.n, second.n} == {100}


def test_every_model_of_a_round_is_judged_once():
    """A window that is seen again, or one that comes where nothing new is due, adds no row."""
    record = Record(models=tuple(model(rule, 120) for rule in RULES))
    once = judged(record, statistics(), 240, NOISE)
    assert [found.rule for found in once.rows] == list(RULES)
    assert judged(once, statistics(), 240, NOISE).rows == once.rows
    assert judged(once, statistics(), 300, NOISE).rows == once.rows


def test_after_windows_that_were_passed_over_the_newest_models_are_judged_alone():
    """Made at 120, 180 and 240 s, nothing until 600 s: those of 240 s; the others never are."""
    record = Record(models=tuple(model(SCORE, end) for end in (120, 180, 240)))
    later = judged(record, statistics(), 600, NOISE)
    assert [found.made_at_s for found in later.rows] == [240]
    assert judged(later, statistics(), 660, NOISE).rows == later.rows


def test_a_window_that_holds_nothing_gives_no_number():
    """S and its interval are NaN, and so is an interval whose noise is unknown."""
    still = replace(model(SCORE, 120), long_run=NOTHING)
    (found,) = judged(Record(models=(still,)), NOTHING, 240, NOISE).rows
    assert all(map(math.isnan, (found.S, found.low, found.high)))
    assert found.n == 0
    record = Record(models=(model(SCORE, 120),))
    (found,) = judged(record, statistics(), 240, math.nan).rows
    assert pytest.approx(1.0) == found.S
    assert math.isnan(found.low)
    assert math.isnan(found.high)


def test_models_wait_until_they_have_been_judged():
    """Those of the last two windows wait; older ones of rules that make none are dropped."""
    record = Record()
    for end in (120, 180, 240, 300, 360):
        record = record.with_models([model(NEAREST, end), model(KEEP, end)])
    assert {found.made_at_s for found in record.models} == {180, 240, 300, 360}


def test_no_model_is_dropped_before_its_window_comes():
    """Round after round, a minute apart or more: each newest set that is due is there."""
    for apart in (60, 120, 180, 240, 600):
        record = Record()
        for end in range(120, 4000, apart):
            record = judged(record, statistics(), end, NOISE)
            record = record.with_models([model(rule, end) for rule in RULES])
        seen = {(found.rule, found.made_at_s) for found in record.rows}
        ends = [end for end in range(120, 4000, apart) if end <= max(m for _, m in seen)]
        assert seen == {(rule, end) for rule in RULES for end in ends}


def test_the_sixty_newest_models_that_rules_made_are_kept():
    """For the rule that takes the nearest of them, however old."""
    record = Record()
    for k in range(100):
        record = record.with_models([model(SCORE, 120 + 60 * k), model(KEEP, 120 + 60 * k)])
    made = [found.made_at_s for found in record.models if found.rule in MADE]
    assert made == [120 + 60 * k for k in range(40, 100)]


def test_the_estimate_over_all_minutes_is_in_charge_first():
    """Where there are estimates; without tracks it is the nearest of all models."""
    assert Record(n_rounds=2).choose({SCORE, MEMORY, NEAREST}, NOISE).rule == MEMORY
    assert Record().choose({LIKELIHOOD}, NOISE).in_charge == MEMORY
    without = record_of({SCORE: [0.6] * 3, NEAREST: [0.6] * 3}, in_charge=MEMORY)
    choice = without.choose({SCORE, NEAREST}, NOISE)
    assert (choice.rule, choice.in_charge) == (NEAREST, NEAREST)
    # One that has had models stays in charge over a window without.
    had = record_of({MEMORY: [0.6] * 3, NEAREST: [0.6] * 3}, in_charge=MEMORY)
    assert had.choose({SCORE, NEAREST}, NOISE).in_charge == MEMORY


def test_a_lead_is_held_against_the_noise_of_leads():
    """That of S is much larger, and counts only as long as no window has told the other one."""
    record = record_of({NEAREST: [0.7] * 5, MEMORY: [0.75] * 5})
    assert record.choose([NEAREST, MEMORY], 0.2).rule == NEAREST
    assert replace(record, lead_noises=(0.01,)).choose([NEAREST, MEMORY], 0.2).rule == MEMORY


def test_scores_of_two_kinds_are_never_in_one_record():
    """A window without a start judges nothing; the first with one begins anew."""
    record = Record(models=tuple(model(SCORE, end) for end in (120, 240)))
    long = Followed(scores=(0.7,), noise=NOISE, by=LONG_RUNS)
    start = Followed(scores=(0.9,), noise=NOISE, by=START, lead_noise=0.02)
    first = record.judged(long, end_s=240, n=9)
    assert [found.S for found in first.rows] == [0.7]
    assert math.isnan(first.lead_noise)
    then = first.judged(start, end_s=360, n=9)
    assert [(found.S, found.window_end_s) for found in then.rows] == [(0.9, 360)]
    assert (then.by, then.lead_noise) == (START, pytest.approx(0.02))
    more = replace(then, models=(*then.models, model(SCORE, 360)))
    assert more.judged(long, end_s=480, n=9) is more
    last = more.judged(replace(start, lead_noise=0.04), end_s=540, n=9)
    assert len(last.rows) == 2
    assert last.lead_noise == pytest.approx(math.sqrt((0.02**2 + 0.04**2) / 2))


def test_a_score_from_a_start_may_exceed_one():
    """Its interval is not cut there; that of an S is."""
    record = Record(models=(model(SCORE, 120),))
    for by, high in ((START, 1.078), (LONG_RUNS, 1.0)):
        (found,) = record.judged(Followed(scores=(0.98,), noise=0.05, by=by), end_s=240, n=9).rows
        assert found.high == pytest.approx(high)


def test_means_leave_out_what_has_no_number():
    """NaN is no score; a rule that has none at all has no mean."""
    record = record_of({SCORE: [0.8, math.nan, 0.6], KEEP: [math.nan], MEMORY: [0.5]})
    assert record.means() == {SCORE: pytest.approx(0.7), MEMORY: 0.5}
    assert Record().means() == {}


def test_a_lead_by_hand():
    """Differences 0.1 and 0.2, noise 0.05: mean 0.15, error sqrt((0.005 + 0.0025) / 2 / 1.5).

    The windows of 120 s are a minute apart: they cover 180 s, as one window and a half.
    """
    record = record_of({SCORE: [0.8, 0.9], KEEP: [0.7, 0.7]})
    lead = record.lead(SCORE, KEEP, NOISE)
    assert (lead.mean, lead.n, lead.n_apart) == (pytest.approx(0.15), 2, 1.5)
    assert lead.error == pytest.approx(0.05, abs=1e-7)
    assert record.lead(KEEP, SCORE, NOISE).mean == pytest.approx(-0.15)


def test_windows_that_lie_far_apart_are_as_many_as_they_are():
    """Three of them, two minutes or more apart; five that are a minute apart are three."""
    rows = [row(rule, end, 0.5) for rule in (SCORE, KEEP) for end in (240, 360, 1200)]
    assert Record(rows=tuple(rows)).lead(SCORE, KEEP, NOISE).n_apart == 3
    assert record_of({SCORE: [0.5] * 5, KEEP: [0.5] * 5}).lead(SCORE, KEEP, NOISE).n_apart == 3


def test_a_lead_counts_windows_that_both_were_judged_on():
    """The second minute lacks one of them, the third has no number."""
    record = record_of({SCORE: [0.8, 0.9, math.nan, 0.7], KEEP: [0.7, None, 0.1, 0.7]})
    lead = record.lead(SCORE, KEEP, NOISE)
    assert (lead.mean, lead.n) == (pytest.approx(0.05), 2)


def test_no_window_in_common_is_no_lead():
    """And surely none that is sure."""
    lead = record_of({SCORE: [0.8], KEEP: [None, 0.7]}).lead(SCORE, KEEP, NOISE)
    assert (lead.n, lead.is_sure(1)) == (0, False)
    assert math.isnan(lead.mean)


@pytest.mark.parametrize(("mean", "n", "n_rules", "sure"), [
    (1.377, 1, 1, True), (1.376, 1, 1, False), (1.061, 2, 1, True), (1.060, 2, 1, False),
    (0.920, 5, 1, True), (0.919, 5, 1, False), (-9.0, 5, 1, False), (0.0, 5, 1, False),
    (1.476, 5, 2, True), (1.475, 5, 2, False), (1.813, 10, 4, True), (1.812, 10, 4, False),
])  # fmt: skip
def test_a_lead_is_sure_beyond_the_quantile_of_student(mean, n, n_rules, sure):
    """One-sided at 0.8: 1.3764, 1.0607 and 0.9195 errors for 1, 2 and 5 windows, from a table.

    The best of two has to pass 0.9, the best of four 0.95: 1.4759 for 5 and 1.8125 for 10.
    """
    assert Lead(mean=mean, error=1.0, n=n, n_apart=n).is_sure(n_rules) is sure


def test_a_lead_of_unknown_error_is_not_sure():
    """NaN fails."""
    assert not Lead(mean=0.9, error=math.nan, n=9, n_apart=9.0).is_sure(1)
    record = record_of({SCORE: [0.9, 0.9], NEAREST: [0.1, 0.1]})
    assert record.choose({SCORE, NEAREST}, math.nan).rule == NEAREST


@pytest.mark.parametrize("n_rounds", [0, 1])
def test_the_first_two_rounds_publish_the_estimate(n_rounds):
    """Whatever the record says; without an estimate the best by its score."""
    record = record_of({SCORE: [0.9] * 9, KEEP: [0.1] * 9}, n_rounds=n_rounds)
    assert record.choose({SCORE, LIKELIHOOD}, NOISE).rule == LIKELIHOOD
    assert record.choose({SCORE}, NOISE).rule == SCORE


def test_without_any_score_the_nearest_is_published():
    """Nothing was judged yet, or on windows without a number."""
    assert Record(n_rounds=7).choose({SCORE, MEMORY}, NOISE).rule == MEMORY
    blind = record_of({SCORE: [math.nan], NEAREST: [math.nan]})
    choice = blind.choose({SCORE, NEAREST}, NOISE)
    assert (choice.rule, choice.because, choice.lead) == (NEAREST, "no rule has been better", None)


def test_the_rule_that_leads_takes_over():
    """By more than chance over the one in charge, and by most of all; it is in charge then."""
    record = record_of({SCORE: [0.8] * 5, MEMORY: [0.9] * 5, NEAREST: [0.5] * 5})
    choice = record.choose({SCORE, MEMORY, NEAREST}, NOISE)
    assert (choice.rule, choice.in_charge) == (MEMORY, MEMORY)
    assert choice.because == "its models have been better than those of nearest"
    assert (choice.lead.mean, choice.lead.n) == (pytest.approx(0.4), 5)


def test_the_rule_in_charge_publishes_until_another_is_surely_better():
    """Its lead over the others is not asked for: score was, and no longer is, the better one."""
    scores = {SCORE: [0.6] * 5, NEAREST: [0.605] * 5}
    choice = record_of(scores, in_charge=SCORE).choose({SCORE, NEAREST}, NOISE)
    assert (choice.rule, choice.in_charge) == (SCORE, SCORE)
    assert choice.because == "the lead of nearest may be chance"


def test_to_keep_the_model_is_a_rule_as_well():
    """Where fish never change, what was handed on last may be the best for good."""
    record = record_of({KEEP: [0.9] * 5, NEAREST: [0.5] * 5})
    choice = record.choose({NEAREST}, NOISE)
    assert (choice.rule, choice.in_charge) == (KEEP, KEEP)
    later = record_of({KEEP: [0.9] * 5, NEAREST: [0.5] * 5}, in_charge=KEEP)
    assert later.choose({NEAREST}, NOISE).rule == KEEP


def test_a_rule_without_a_model_publishes_nothing():
    """The one that leads has no estimate in this minute."""
    record = record_of({SCORE: [0.8] * 5, MEMORY: [0.9] * 5, NEAREST: [0.5] * 5})
    assert record.choose({SCORE, NEAREST}, NOISE).rule == SCORE


def test_the_rule_in_charge_without_a_model_keeps_the_one_in_use():
    """For this minute: it stays in charge."""
    record = record_of({MEMORY: [0.9] * 5, NEAREST: [0.5] * 5}, in_charge=MEMORY)
    choice = record.choose({SCORE, NEAREST}, NOISE)
    assert (choice.rule, choice.in_charge) == (KEEP, MEMORY)
    assert choice.because == "memory has no model of this window"


def test_nothing_better_leaves_the_rule_in_charge():
    """The best of the others is as good or worse."""
    record = record_of({SCORE: [0.5] * 3, LIKELIHOOD: [0.6] * 3, NEAREST: [0.6] * 3})
    choice = record.choose({SCORE, LIKELIHOOD, NEAREST}, NOISE)
    assert (choice.rule, choice.because) == (NEAREST, "no rule has been better")


def test_a_lead_that_may_be_chance_changes_nothing():
    """It says whose lead, and how large."""
    record = record_of({COMPROMISE: [0.62], NEAREST: [0.6]})
    choice = record.choose({COMPROMISE, NEAREST}, NOISE)
    assert (choice.rule, choice.because) == (NEAREST, "the lead of compromise may be chance")
    assert choice.lead.mean == pytest.approx(0.02)


def test_a_rule_that_missed_hard_minutes_does_not_lead_by_that():
    """The estimate has 0.9 in the easy minute alone, where all have: score leads, by 0.3."""
    hard = [0.9] + [0.4] * 8
    record = record_of({SCORE: [0.9] + [0.7] * 8, LIKELIHOOD: [0.9] + [None] * 8, NEAREST: hard})
    assert max(record.means(), key=record.means().get) == LIKELIHOOD
    choice = record.choose({SCORE, LIKELIHOOD, NEAREST}, NOISE)
    assert choice.rule == SCORE
    assert choice.lead.mean == pytest.approx(8 * 0.3 / 9)


@pytest.mark.parametrize("minutes", [1, 2])
def test_chance_alone_seldom_changes_the_rule(minutes):
    """Of four rules as good as the one in charge one takes over in one record of five or fewer.

    Over 2000 records of eight windows, a minute apart or two. Each minute has its own luck, which
    the two windows share that it lies in. Errors are of 2000 draws.
    """
    rng, rules = np.random.default_rng(3), (SCORE, LIKELIHOOD, COMPROMISE, MEMORY, NEAREST)
    luck = rng.normal(0, NOISE * math.sqrt(2), size=(2000, len(rules), 17))
    ends = [240 + 60 * minutes * k for k in range(8)]
    changed = 0
    for minute in luck:
        rows = [
            row(rule, end, 0.5 + minute[k][(end - 240) // 60 :][:2].mean())
            for k, rule in enumerate(rules)
            for end in ends
        ]
        record = Record(rows=tuple(rows), n_rounds=9)
        changed += record.choose(rules, NOISE).rule != MEMORY
    assert 0.02 < changed / 2000 < 0.2 + 3 * math.sqrt(0.16 / 2000)


def test_half_way_is_the_middle():
    """Gene by gene."""
    assert half_way(np.array([0.0, 1.0]), np.array([0.5, 0.0])).tolist() == [0.25, 0.5]


def test_every_rule_says_what_it_is():
    """For the model's file, and for those who look on."""
    assert set(SAYS) == set(RULES)
    assert {*MADE, NEAREST, KEEP} == set(RULES)


def test_judging_leaves_the_record_as_it_was():
    """Rounds that are killed are done again from it."""
    record = Record(models=(model(SCORE, 120),))
    judged(record, statistics(), 240, NOISE)
    replace(record).with_models([model(SCORE, 300)])
    assert (record.rows, len(record.models)) == ((), 1)
