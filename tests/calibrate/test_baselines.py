"""What a round is compared with."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from zfcal.calibrate.baselines import random_search, unchanged
from zfcal.calibrate.confirm import confirm
from zfcal.calibrate.rounds import calibrate_window
from zfcal.errors import InputError


@dataclass(frozen=True)
class Counting:
    """A group that notes how many genomes it is given at a time."""

    inner: object
    sizes: list = field(default_factory=list)

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def with_template(self, template):
        """Go on counting."""
        return Counting(self.inner.with_template(template), self.sizes)

    def simulate(self, genes, **options):
        """Note the number of genomes."""
        self.sizes.append(len(genes))
        return self.inner.simulate(genes, **options)


def test_random_search_evaluates_as_many_and_confirms_ten(task, small):
    """Fifty by twenties, then the ten best."""
    group = Counting(task.group)
    random_search(replace(task, group=group), small, n_evaluations=50)
    assert group.sizes == [20, 20, 10, 10]


def test_random_search_repeats_and_more_of_it_starts_with_the_same(task, small):
    """A seed gives the same; its best is found again among more."""
    few = random_search(task, small, n_evaluations=30)
    again = random_search(task, small, n_evaluations=30)
    assert (few.genes == again.genes).all()
    more = random_search(task, small, n_evaluations=300)
    assert more.scores.S >= few.scores.S - 0.02


def test_parameters_that_stay_are_confirmed_as_they_are(task, small, truth):
    """The same score as by the confirmation itself."""
    found = unchanged(task, small, genes=truth)
    assert (found.genes == truth).all()
    assert found.scores == confirm(task.confirmation(small), truth[None]).scores


def test_a_champion_left_unchanged_scores_what_the_round_reported(task, small):
    """Both looks are one and the same, so that they can be compared."""
    result = calibrate_window(task, small)
    assert unchanged(task, small, genes=result.genes).scores == result.scores


def test_a_search_of_nothing_and_a_foreign_genome_are_refused(task, small):
    """Each with what was got."""
    with pytest.raises(InputError, match="at least one evaluation, got 0"):
        random_search(task, small, n_evaluations=0)
    with pytest.raises(InputError, match="need 18 genes"):
        unchanged(task, small, genes=np.zeros(40))
