"""Calibrating on other statistics than D, W, O and T."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.features.registry import SCORED
from zfcal.behaviour.scores import compare, named_scores, similarities
from zfcal.calibrate.confirm import confirm
from zfcal.calibrate.group import Group, SeedSource
from zfcal.calibrate.objective import Objective, score_each, simulate_named
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.task import Settings, Task
from zfcal.errors import InputError

FEATURES = ("D", "W", "O", "T", "curvature", "residence")
SEEDS = np.array([5, 6], dtype=np.uint64)


@pytest.fixture
def group(template):
    """Return four fish and a robot in the published arena."""
    return Group(arena=load_arena("two-rooms", Path()), template=template, n_fish=4, n_robots=1)


@pytest.fixture
def two(truth):
    """Return two genomes: that of the natural model and another."""
    return np.stack([truth, np.random.default_rng(3).random(len(truth))])


@pytest.fixture
def control(group, truth):
    """Return a window of the natural model, with all that is named."""
    found = simulate_named(
        group, truth[None], FEATURES, n_counted=5, n_steps=600, seeds=SEEDS[:1] + np.uint64(9)
    )
    return found.pooled().as_statistics(0, group.arena.zone_names)


@pytest.fixture
def task(group, control):
    """Return the task of calibrating on that window."""
    return Task(group=group, control=control, seeds=SeedSource(trial_seed=7, window_end_s=120))


@pytest.fixture
def short():
    """Return settings of a round that takes a moment."""
    return Settings(
        population=8,
        generations=2,
        steps=100,
        n_confirmed=2,
        long_runs=1,
        long_s=60.0,
        n_windows=4,
        features=FEATURES,
    )


def test_recorded_paths_are_those_that_were_counted(group, two):
    """The registry's O and T of the recorded paths are the compiled simulation's, to the count."""
    sizes = {"n_counted": 4, "n_steps": 200, "seeds": SEEDS}
    counts = group.simulate(two, **sizes)
    again = group.record(two, ["O", "T", "W"], **sizes)
    assert np.array_equal(again["O"], counts.occupation)
    assert np.array_equal(again["T"], counts.transition)
    # A distance on the edge of a bin may fall to either side.
    assert np.abs(again["W"] - counts.wall).sum() <= 2


def test_threads_change_no_number(group, two):
    """One thread or two."""
    sizes = {"n_counted": 5, "n_steps": 200, "seeds": SEEDS}
    alone = group.record(two, ["curvature"], **sizes)
    together = replace(group, n_workers=2).record(two, ["curvature"], **sizes)
    assert np.array_equal(alone["curvature"], together["curvature"])
    assert alone["curvature"].shape == (2, 2, 3, 10)


def test_a_score_by_hand():
    """Similarities 1, 1/4 and none: the geometric mean of two is 1/2."""
    nothing = np.zeros((1, 2), dtype=np.int64)
    counts = {"D": np.array([[[1, 0]]]), "O": np.array([[3, 1]]), "W": nothing[None]}
    control = {"D": np.array([[1, 0]]), "O": np.array([3, 1]), "W": nothing}
    values = similarities(counts, control, ("D", "O", "W"))
    assert values[0, :2].tolist() == [1.0, 1.0]
    assert np.isnan(values[0, 2])
    (score,) = named_scores(("D", "O", "W"), np.array([[1.0, 0.25, np.nan]]))
    assert (score.value, score.n_features) == (0.5, 2)


def test_named_similarities_of_the_four_are_those_of_s(group, two, control):
    """D, W, O and T do not depend on what is named beside them."""
    objective = Objective(group=group, control=control, n_steps=200, seeds=SEEDS, features=FEATURES)
    plain = replace(objective, features=SCORED)
    values = objective(two)
    assert values.shape == (2, 6)
    assert np.array_equal(values[:, :4], plain(two))
    assert not np.isnan(values).any()


def test_a_score_of_others_is_never_s(group, two, control):
    """S is that of D, W, O and T, whatever decides."""
    objective = Objective(
        group=group, control=control, n_steps=200, seeds=SEEDS, features=("D", "curvature")
    )
    found = objective.simulate(two)
    scores = score_each(found, control, objective.features)
    for row, one in enumerate(scores):
        plain = compare(found.as_statistics(row, control.zone_names), control)
        assert one.S == plain.S
        assert one.named.features == ("D", "curvature")
        assert one.overall == one.named.value
        assert one.named.value == pytest.approx(np.sqrt(one.I_D * one.named.similarities[1]))
    assert score_each(found, control, SCORED)[0].named is None


def test_confirmation_and_ceiling_go_by_what_was_named(task, short, two, control):
    """The winner is the best by it, and a window of the model against itself scores higher."""
    best = confirm(task.confirmation(short), two)
    assert best.scores.overall == best.scores.named.value == max(best.candidates)
    assert set(best.long_run.names) == set(control.names)


def test_a_round_optimises_what_was_named(task, short):
    """Population, score, ceiling and intervals are of the six."""
    result = calibrate_window(task, short)
    assert result.population.features.shape == (8, 6)
    assert result.scores.named.features == FEATURES
    mean, low, high = result.ceiling.overall
    assert low <= mean <= high
    assert result.ceiling.overall != result.ceiling.of("S")
    score = result.scores.overall
    assert result.intervals.threshold == (low if score >= low else score - (mean - low))
    assert result.against_ceiling == pytest.approx(result.scores.overall / mean)
    assert result.population.objectives[:, 0] == pytest.approx(result.population.scores)


def test_the_four_by_name_are_the_usual_settings():
    """In any order, and nothing is added to the lineage."""
    assert Settings(features=("T", "O", "W", "D")) == Settings()
    assert "features" not in Settings().said
    assert Settings(features=("curvature", "D")).said["features"] == ["D", "curvature"]
    for features, problem in (((), "at least one"), (("d",), "No statistic is called 'd'")):
        with pytest.raises(InputError, match=problem):
            Settings(features=features)


def test_what_the_window_does_not_hold_is_told(group, control):
    """With the command that counts it."""
    plain = replace(control, further={})
    with pytest.raises(InputError, match="curvature was not counted") as refused:
        Objective(group=group, control=plain, n_steps=10, seeds=SEEDS, features=("curvature",))
    assert "zfcal analyse TRIAL --features curvature" in refused.value.hint


def test_a_group_that_keeps_no_paths_refuses(stand_in, truth):
    """Such as a cluster."""
    with pytest.raises(InputError, match="counts D, W, O, T and V alone, not curvature"):
        simulate_named(stand_in, truth[None], ("curvature",), n_counted=4, n_steps=10, seeds=SEEDS)
