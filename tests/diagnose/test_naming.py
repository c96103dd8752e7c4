"""Effects in a model, and what they gain there."""

import math

import numpy as np
import pytest

from zfcal.diagnose.naming import (
    Choice,
    Refit,
    by_sample,
    free_of,
    refit,
    ties_of,
    with_traits,
)
from zfcal.model.kernels.state import TRAIT
from zfcal.model.simulate import individuals

N = 400


@pytest.fixture
def suspect(candidate):
    """Return what makes a suspect up: a mean gain per sample, and its own scatter."""

    def of(name, mean, *, scatter=0.0, seed=1, n_free=1):
        own = np.random.default_rng(seed).normal(0, scatter, N) if scatter else np.zeros(N)
        return Refit(
            candidate=candidate(name),
            screen=None,
            values={},
            interval={},
            gain=mean + own - own.mean(),
            n_free=n_free,
        )

    return of


def test_nats_are_less_what_idle_parameters_gain(suspect):
    """400 samples of 0.1 nats, less one for the one parameter."""
    assert suspect("alignment", 0.1).nats == pytest.approx(39.0)


def test_how_far_one_is_ahead_by_hand(suspect, candidate):
    """Gains 2, 0, 2, 0 against 0: ahead by 4 with a spread of 1 * sqrt 4."""
    one, other = (
        Refit(
            candidate=candidate("alignment"), screen=None, values={}, interval={}, gain=gain,
            n_free=1,
        )
        for gain in (np.array([2.0, 0.0, 2.0, 0.0]), np.zeros(4))
    )  # fmt: skip
    assert one.over(other) == pytest.approx(2.0)
    assert other.over(one) == pytest.approx(-2.0)
    assert one.over(one) == 0.0


def test_a_parameter_more_must_be_worth_it(suspect):
    """Three more at half the log of 400 samples are 9 nats: behind with 8 more, ahead with 10."""
    few = suspect("directional-drift", 0.25, scatter=0.5, seed=2, n_free=1)
    more, most = (suspect("place-preference", mean, n_free=4) for mean in (0.27, 0.275))
    assert few.worth == pytest.approx(100 - 0.5 * math.log(400))
    assert more.nats > few.nats
    assert more.over(few) < 0 < most.over(few)


@pytest.mark.parametrize(
    ("beside", "ties"), [(0.24, ()), (0.05, ("boldness",)), (None, ("boldness",))],
    ids=["worth as much", "a remnant", "not chosen"],
)  # fmt: skip
def test_what_is_chosen_as_well_is_no_other_name(suspect, beside, ties):
    """Two that are both there tie at first, since each stands beside the other."""
    best, other = suspect("rear-blind-zone", 0.26, scatter=0.5), suspect("boldness", 0.25)
    later = [] if beside is None else [suspect("boldness", beside)]
    choices = [Choice(best=each) for each in later]
    assert ties_of(Choice(best=best, ties=(other,)), choices) == ties


def test_what_is_no_smooth_matter_is_not_fitted(candidate):
    """Of alignment the weight and the concentration; of a late response its share."""
    assert free_of(candidate("alignment")) == (("alignment", "weight"), ("alignment", "kappa"))
    assert free_of(candidate("reaction-delay")) == (("reaction-delay", "share"),)


def test_a_gain_belongs_to_its_sample(screen):
    """Ones for all turns: as many as there are turns in each sample."""
    scene = screen(11, minutes=4.0).scene
    sums = by_sample(scene, scene.turns.at, np.ones(len(scene.turns)))
    assert sums.shape == scene.k.shape
    assert sums.sum() == len(scene.turns)
    assert sums[7] == (scene.turns.at == 7).sum()


def test_a_refit_finds_the_strength_again(screen, candidate):
    """A bias of 0.4 in ten minutes: in its interval, of a width below a third of it."""
    own = screen(23, {"turning-bias": {"strength": 0.4}})
    made = refit(own, own.ask(candidate("turning-bias")))
    low, high = made.interval["strength"]
    assert low < 0.4 < high
    assert high - low < 0.14
    assert made.gain.sum() == pytest.approx(made.screen.fitted.nats - own.fitted.nats, abs=1e-6)
    assert made.nats > 50
    assert abs(made.screen.ask(candidate("turning-bias")).z) < 0.5


@pytest.mark.slow
def test_a_strength_errs_by_what_its_interval_says(screen, candidate):
    """Biases of 0.4 in eight recordings, in their standard errors: without bias, and spread by one.

    Both within what chance does once in a hundred times.
    """
    errors = []
    for seed in range(60, 68):
        own = screen(seed, {"turning-bias": {"strength": 0.4}}, minutes=3.0)
        made = refit(own, own.ask(candidate("turning-bias")))
        low, high = made.interval["strength"]
        errors.append((made.values["strength"] - 0.4) / ((high - low) / 2 / 1.96))
    assert abs(np.mean(errors)) < 2.6 / math.sqrt(8)
    assert 1.6 < np.sum(np.square(errors)) < 20.1


@pytest.mark.slow
def test_a_refit_without_an_effect_gains_little(screen, candidate):
    """Twice the gain is chi-square with one degree: below 8 but once in 200."""
    own = screen(11)
    made = refit(own, own.ask(candidate("turning-bias")))
    assert -0.1 < made.gain.sum() < 8
    assert made.interval["strength"][0] < 0.0 < made.interval["strength"][1]


def test_a_refit_of_a_speed_leaves_headings_alone(screen, candidate):
    """The fit of headings stands; the strength is found."""
    own = screen(29, {"burst-and-coast": {"exponent": 0.4}}, minutes=6.0)
    made = refit(own, own.ask(candidate("burst-and-coast")))
    assert made.screen.fitted.nats == own.fitted.nats
    assert made.values["exponent"] == pytest.approx(0.4, abs=0.1)
    assert made.gain.sum() > 20


@pytest.mark.slow
@pytest.mark.parametrize(("share", "whole"), [(1.0, 1.0), (0.4, 1.0), (0.4, 0.0)])
def test_the_share_of_a_late_response_is_found(screen, candidate, share, whole):
    """At the age that was asked for, which is no smooth matter and has no interval."""
    values = {"share": share, "delay_s": 0.6, "whole": whole, "felt_m": 0.05 * (1 - whole)}
    own = screen(37, {"reaction-delay": values}, minutes=6.0)
    shape = {key: value for key, value in values.items() if key != "share"}
    made = refit(own, own.ask(candidate("reaction-delay", **shape)))
    assert made.values["share"] == pytest.approx(share, abs=0.15)
    assert made.values["delay_s"] == 0.6
    assert set(made.interval) == {"share"}
    assert made.nats > 20


@pytest.mark.slow
def test_traits_are_those_of_the_individuals(screen, candidate):
    """Mean 0, standard deviation 1, and in the order in which the simulation has them."""
    own = screen(31, {"boldness": {"spread": 0.7}})
    states = with_traits(own.scene, own.ask(candidate("boldness"))).states
    traits = states[-1, TRAIT]
    true = individuals(5, 0)[1]
    # The mean of zero is one that is weighted by how well each is known.
    assert abs(traits.mean()) < 0.6
    assert traits.std() == pytest.approx(1.0, abs=0.1)
    assert np.corrcoef(traits, true)[0, 1] > 0.9
    assert (own.scene.states[:, TRAIT] == 0).all()


def test_boldness_in_the_model_has_its_spread(screen, candidate):
    """About 0.7, with five fish of which each is known but roughly."""
    own = screen(31, {"boldness": {"spread": 0.7}})
    made = refit(own, own.ask(candidate("boldness")))
    assert made.values["spread"] == pytest.approx(0.7, rel=0.3)
    assert math.isfinite(made.nats)
