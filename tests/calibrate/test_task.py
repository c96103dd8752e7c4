"""What a round is given, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from zfcal.calibrate.task import Previous, Settings
from zfcal.errors import InputError


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"population": 0}, "population must be a positive multiple of 4, got 0"),
        ({"population": 58}, "population must be a positive multiple of 4, got 58"),
        ({"generations": -1}, "generations must not be negative, got -1"),
        ({"runs": 0}, "runs must be at least 1"),
        ({"steps": 0}, "steps must be at least 1"),
        ({"n_confirmed": -1}, "n_confirmed must not be negative"),
        ({"diversity": "none"}, "diversity must be 'merged' or 'population'"),
        ({"sampler": "best"}, "sampler must be 'exact' or 'grid'"),
        ({"n_windows": 0}, "n_windows must be at least 1"),
        ({"long_s": math.nan}, "long_s must be a positive time in seconds, got nan"),
        ({"window_s": 0.0}, "window_s must be a positive time in seconds, got 0.0"),
        ({"optimiser": "cma"}, "optimiser must be 'zfcal' or 'deap', got 'cma'"),
        ({"champion": "best"}, "champion must be 'score', 'likely' or 'forward', got 'best'"),
    ],
)
def test_settings_that_make_no_sense_are_refused(change, message):
    """What, expected and got."""
    with pytest.raises(InputError, match=message):
        Settings(**change)


def test_the_defaults_are_the_contracts():
    """60 genomes, one run of 3000 steps; ten of the best, 10 x 1800 s; 200 windows of 120 s."""
    settings = Settings()
    assert (settings.population, settings.runs, settings.steps) == (60, 1, 3000)
    assert (settings.n_confirmed, settings.long_runs, settings.long_s) == (10, 10, 1800.0)
    assert (settings.n_windows, settings.window_s) == (200, 120.0)


def test_a_population_of_another_arena_is_refused(task):
    """Five zones have 40 genes."""
    old = Previous(genes=np.zeros((8, 40)), scores=np.zeros(8), champion=np.zeros(40), noise=0.05)
    with pytest.raises(InputError, match=r"need 18 genes, got a table of shape \(8, 40\)"):
        replace(task, previous=old)
    with pytest.raises(InputError, match="need 18 genes"):
        replace(task, guests=np.zeros((1, 40)))


def test_a_population_without_its_scores_is_refused():
    """One score per genome."""
    with pytest.raises(InputError, match=r"\(8, 18\) and \(7,\)"):
        Previous(genes=np.zeros((8, 18)), scores=np.zeros(7), champion=np.zeros(18), noise=0.05)


def test_search_and_confirmation_have_no_seed_in_common(task):
    """Else the luck of the search would be confirmed."""
    settings = Settings(runs=10)
    search, second = task.evaluation(settings), task.confirmation(settings)
    assert not set(search.seeds.tolist()) & set(second.seeds.tolist())
    assert (search.n_steps, second.n_steps) == (3000, 9000)


def test_speeds_are_the_windows(task):
    """The simulator draws from what was measured, not from the template."""
    counts = task.control.speed
    expected = counts / counts.sum(axis=1, keepdims=True)
    found = [zone.speed_frequency for zone in task.simulator.template.zones]
    np.testing.assert_allclose(found, expected)


def test_work_by_hand(task):
    """60 genomes on 2 workers are 30 shifts of 3000 steps and 300 (60 s) of burn-in.

    The end: 10 x 10 / 2 shifts of 9300 and 200 / 2 of 900 steps.
    """
    assert task.work(n_genomes=60, n_runs=1, n_steps=3000) == 30 * 3300
    assert task.work(n_genomes=61, n_runs=1, n_steps=3000) == 31 * 3300
    assert task.closing_work(Settings()) == 50 * 9300 + 100 * 900


def test_an_estimate_that_may_be_the_champion_is_work_at_the_end(task, truth):
    """10 / 2 shifts more of its long runs, and 200 / 2 of its windows; without one, none."""
    likely, plain = Settings(champion="likely"), Settings()
    guided = replace(task, guests=truth[None])
    assert guided.closing_work(likely) == task.closing_work(plain) + 5 * 9300 + 100 * 900
    assert task.closing_work(likely) == guided.closing_work(plain) == task.closing_work(plain)


def test_lineages_of_before_stay_what_they_were():
    """A champion by its score goes without saying; another one is said."""
    assert "champion" not in Settings().said
    assert Settings(champion="likely").said["champion"] == "likely"
    assert Settings(runs=3).said["runs"] == 3
