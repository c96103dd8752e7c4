"""What counts as a suspect, and against which null."""

import numpy as np
import pytest
from scipy.stats import norm

from zfcal.diagnose.candidates import candidates_of
from zfcal.diagnose.null import from_replicates, theory
from zfcal.diagnose.scores import Score
from zfcal.diagnose.selection import Asked, best_of
from zfcal.model.effects import find_effect


@pytest.fixture(scope="module")
def shapes(tank):
    """Return handedness, robot avoidance and a blind zone at each of their shapes."""
    effects = ("turning-bias", "robot-avoidance", "rear-blind-zone")
    return candidates_of(tuple(find_effect(name) for name in effects), tank)


def scores_of(shapes, z):
    """Return scores of so many standard errors, zero where none are given."""
    none = np.zeros(0)
    return [
        Score(candidate=each, z=float(z.get(k, 0.0)), strength=0.1, information=1.0, steps=none)
        for k, each in enumerate(shapes)
    ]


def with_centre(shapes, held, centre):
    """Return the family of which one candidate has 40 replicates about a centre, of spread one."""
    drawn = np.random.default_rng(1).normal(0.0, 1.0, (40, 1))
    table = centre + (drawn - drawn.mean()) / drawn.std()
    return Asked(candidates=shapes, held=(shapes[held],), null=from_replicates(table))


def test_without_replicates_scores_stand_as_they_are(shapes):
    """A one-sided effect on the side that cannot be counts for nothing."""
    family = Asked(candidates=shapes, held=(), null=theory(0))
    z = family.standardised(scores_of(shapes, {0: -4.0, 2: 3.0, 4: -5.0}))
    assert z[[0, 2, 4]].tolist() == [-4.0, 3.0, 0.0]


def test_what_noise_makes_of_an_effect_is_taken_off(shapes):
    """Ten less eight, over a spread that holds that replicates may miss a quarter of the eight."""
    z = with_centre(shapes, 0, 8.0).standardised(scores_of(shapes, {0: 10.0}))
    assert z[0] == pytest.approx(2.0 / np.hypot(1.0, 2.0), rel=0.05)


def test_another_shape_is_not_made_a_suspect_by_it(shapes):
    """Of its own three, and seven from the other shape's centre, the less counts."""
    z = with_centre(shapes, 2, -4.0).standardised(scores_of(shapes, {2: -4.0, 3: 3.0}))
    assert z[2] == pytest.approx(0.0, abs=1e-9)
    assert z[3] == 3.0
    spared = with_centre(shapes, 2, 4.0).standardised(scores_of(shapes, {3: 5.0}))
    assert abs(spared[3]) < 1.0


def test_each_effect_stands_at_its_best_shape(shapes):
    """The clearest first; p-values are of the whole family."""
    family = Asked(candidates=shapes, held=(), null=theory(0))
    ranked = best_of(family, scores_of(shapes, {0: 2.0, 1: -6.0, 5: 3.0}))
    names = [best.score.candidate.name for best in ranked]
    assert names[:2] == ["turning-bias", "rear-blind-zone"]
    assert ranked[0].score.candidate is shapes[1]
    assert ranked[0].p < 1e-6
    assert ranked[1].p > 0.01


def test_the_family_is_as_large_however_many_are_asked(shapes):
    """What the model has already is not asked for again, and makes the others no more unlikely."""
    family = Asked(candidates=shapes, held=(), null=theory(0))
    scores = scores_of(shapes, {2: 3.5})
    (alone,) = best_of(family, scores[2:3])
    (among,) = (each for each in best_of(family, scores) if each.score is scores[2])
    assert alone.p == among.p
    assert alone.p == pytest.approx(1 - (1 - 2 * norm.sf(3.5)) ** len(shapes), rel=1e-6)


def test_where_nothing_was_asked_nothing_is_best(shapes):
    """None beyond the list may have had any hope."""
    assert best_of(Asked(candidates=shapes, held=(), null=theory(0)), []) == []
