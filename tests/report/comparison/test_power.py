"""What so many trials can show."""

import math

import numpy as np
import pytest
from scipy.stats import nct, t

from zfcal.errors import InputError
from zfcal.report.comparison.power import attainable_level, detectable_effect, smallest_p


def test_three_and_three_have_no_p_below_a_tenth():
    """Twenty ways, of which two are as far apart; unequal sides have one."""
    assert smallest_p(3, 3) == pytest.approx(1 / 10)
    assert smallest_p(4, 4) == pytest.approx(2 / 70)
    assert smallest_p(3, 4) == pytest.approx(1 / 35)
    assert smallest_p(1, 3) == pytest.approx(1 / 4)


def test_the_level_is_the_largest_step_below_the_one_that_is_asked_for():
    """One step of 2/70 with four, six of 2/252 with five, none with three."""
    assert attainable_level(4, 4) == pytest.approx(2 / 70)
    assert attainable_level(5, 5) == pytest.approx(12 / 252)
    assert attainable_level(3, 3) == 0
    assert attainable_level(20, 20) == pytest.approx(0.05)


@pytest.mark.parametrize(("n", "effect"), [(3, 3.07), (4, 2.38), (10, 1.32), (20, 0.909)])
def test_effects_are_those_of_the_usual_tables(n, effect):
    """A t test of both signs at 5 % and 80 % power."""
    assert detectable_effect(n, n) == pytest.approx(effect, abs=0.006)


@pytest.mark.parametrize(("n_a", "n_b", "power"), [(4, 4, 0.8), (3, 9, 0.9), (6, 5, 0.5)])
def test_at_that_effect_the_power_is_the_one_that_was_asked_for(n_a, n_b, power):
    """By the noncentral t distribution."""
    effect = detectable_effect(n_a, n_b, power=power)
    df = n_a + n_b - 2
    critical = t.isf(0.025, df)
    shift = effect * math.sqrt(n_a * n_b / (n_a + n_b))

    assert nct.sf(critical, df, shift) == pytest.approx(power, abs=1e-5)


def test_more_trials_and_looser_levels_find_smaller_effects():
    """And equal sides smaller ones than unequal."""
    effects = [detectable_effect(n, n) for n in range(2, 30)]

    assert (np.diff(effects) < 0).all()
    assert detectable_effect(5, 5, alpha=0.01) > detectable_effect(5, 5)
    assert detectable_effect(2, 8) > detectable_effect(5, 5)


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda: smallest_p(0, 3), "got 0 and 3"),
        (lambda: detectable_effect(1, 5), "got 1 and 5"),
        (lambda: detectable_effect(5, 5, power=1.0), "got 1.0"),
        (lambda: detectable_effect(5, 5, power=float("nan")), "got nan"),
    ],
)
def test_what_cannot_be_asked_is_refused(ask, says):
    """No trial on a side, no spread, certainty."""
    with pytest.raises(InputError, match=says):
        ask()


def test_the_table_of_the_documentation_is_what_is_computed(repository):
    """Smallest p and effects of each number of trials; how often they are found is measured."""
    text = (repository / "docs" / "compare.md").read_text(encoding="utf-8")
    _, _, table = text.partition("| trials a side |")
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in table.splitlines()[2:]
        if line.startswith("| ")
    ]

    assert len(rows) == 8
    for n, least, by_t, one, _, among, _ in rows:
        size = int(n)
        level = attainable_level(size, size)
        assert float(least) == pytest.approx(smallest_p(size, size), rel=0.05)
        assert float(by_t) == pytest.approx(detectable_effect(size, size), abs=0.051)
        if level:
            alone, together = (detectable_effect(size, size, alpha=level / m) for m in (1, 20))
            assert float(one) == pytest.approx(alone, abs=0.051)
            assert float(among) == pytest.approx(together, abs=0.051)
        else:
            assert (one, among) == ("none", "none")
