"""Which parameter values a window leaves open."""

import numpy as np
import pytest

from zfcal.behaviour.ceilings import Ceiling
from zfcal.calibrate.intervals import acceptance_threshold, parameter_intervals
from zfcal.parameters import gene_names, natural

NAMES = ("corridor", "walls", "centre")


def ceiling(mean, low):
    """Return a ceiling of which all scores are alike."""
    return Ceiling(
        zone_names=NAMES, mean=(mean,) * 14, low=(low,) * 14, high=(1.0,) * 14, n_windows=200
    )


MODEL = natural((("corridor", True), ("walls", True), ("centre", False)), dt_s=0.2)


@pytest.fixture
def champion():
    """Return a genome in the midst of its range, without preference between zones."""
    return np.array([*[0.5] * 9, *[1.0] * 9])


def intervals(champion, genes, scores, *, score=0.85):
    """Return intervals under a ceiling of 0.85 with a low end of 0.75."""
    return parameter_intervals(
        champion,
        (np.asarray(genes), np.asarray(scores)),
        score=score,
        ceiling=ceiling(0.85, 0.75),
        template=MODEL,
    )


def test_the_threshold_is_the_low_end_of_the_champions_own_windows():
    """A champion within its ceiling; one below it keeps the same margin of 0.1."""
    assert acceptance_threshold(0.80, ceiling(0.85, 0.75)) == (0.75, True)
    assert acceptance_threshold(0.75, ceiling(0.85, 0.75)) == (0.75, True)
    threshold, within = acceptance_threshold(0.60, ceiling(0.85, 0.75))
    assert threshold == pytest.approx(0.50)
    assert not within


def test_quantiles_by_hand(champion):
    """kappa_0 = 30 g with g = 0, 0.01 ... 1 compatible: 2.5 % is 0.75, 97.5 % is 29.25.

    The champion, at 15, is one of the 102 values and moves them by under 0.02.
    """
    genes = np.tile(champion, (101, 1))
    genes[:, 0] = np.linspace(0.0, 1.0, 101)
    first = intervals(champion, genes, np.full(101, 0.8)).parameters[0]
    assert first.name == "corridor.kappa_0"
    assert first.value == 15.0
    assert first.low == pytest.approx(0.75, abs=0.02)
    assert first.high == pytest.approx(29.25, abs=0.02)
    assert not first.identified


def test_only_compatible_genomes_count_and_null_scores_never_do(champion):
    """Of 100 genomes at gene 0.5 and 100 at 0.9, those at 0.9 score too low or nothing."""
    genes = np.tile(champion, (200, 1))
    genes[100:, 0] = 0.9
    scores = np.r_[np.full(100, 0.75), np.full(50, 0.7499), np.full(50, np.nan)]
    found = intervals(champion, genes, scores)
    assert found.n_compatible == 100
    assert (found.parameters[0].low, found.parameters[0].high) == (15.0, 15.0)
    assert found.parameters[0].identified


def test_an_interval_of_seventy_percent_is_the_widest_that_identifies(champion):
    """Half the genomes at either end of 69 % and of 71 % of the range."""
    for width, identified in ((0.69, True), (0.71, False)):
        genes = np.tile(champion, (200, 1))
        genes[:100, 3], genes[100:, 3] = 0.1, 0.1 + width
        found = intervals(champion, genes, np.full(200, 0.8)).parameters[3]
        assert found.identified is identified
        assert found.high - found.low == pytest.approx(30 * width)


def test_the_champion_lies_within_its_intervals(champion):
    """Also where the search crowded elsewhere."""
    genes = np.random.default_rng(0).random((300, 18)) * 0.2
    for one in intervals(champion, genes, np.full(300, 0.8)).parameters:
        assert one.low <= one.value <= one.high


def test_gamma_is_compared_after_its_rows_are_scaled(champion):
    """Rows (.2 .1 .2) and (.8 .4 .8) are one and the same."""
    genes = np.tile(champion, (60, 1))
    genes[:, 9:12] = [0.2, 0.1, 0.2]
    genes[::2, 9:12] = [0.8, 0.4, 0.8]
    same = champion.copy()
    same[9:12] = [0.4, 0.2, 0.4]
    found = {one.name: one for one in intervals(same, genes, np.full(60, 0.8)).parameters}
    assert tuple(found) == gene_names(NAMES)
    walls = found["corridor.gamma.walls"]
    assert (walls.low, walls.value, walls.high) == pytest.approx((0.5, 0.5, 0.5))


def test_few_compatible_genomes_identify_nothing(champion):
    """Nineteen in one place may be the search's doing; twenty are taken for the window's."""
    for n, identified in ((19, False), (20, True)):
        found = intervals(champion, np.tile(champion, (n, 1)), np.full(n, 0.8))
        assert found.parameters[0].identified is identified


def test_a_champion_without_a_score_has_intervals_of_no_width_that_identify_nothing(champion):
    """All features null: nobody is compatible."""
    found = intervals(champion, np.tile(champion, (50, 1)), np.full(50, np.nan), score=np.nan)
    assert found.n_compatible == 0
    assert not found.within_ceiling
    assert not any(one.identified for one in found.parameters)
    assert found.parameters[0].low == found.parameters[0].high == 15.0
