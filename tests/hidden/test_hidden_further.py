"""Further forms have exact densities, are the base at strength 0, and leave the old ones alone."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest

from hidden import kernels, speeds, states
from hidden.effects import EFFECTS, HEADING, LISTED, SPEED
from hidden.further import FORMS, FURTHER, drawn, name_of
from hidden.law import empty_past, law_of, natural, no_plan, world_of
from hidden.oracle import fit_base, usable_steps
from hidden.scenario import BURN_IN_STEPS, Scenario, _plan, make_trial
from hidden.statistics_of_forms import FORM_STATISTICS
from hidden.statistics_of_steps import Steps, standing_out
from hidden.strengths import LEVELS, worth
from hidden.worlds import two_rooms

GOLDEN = Path(__file__).with_name("golden-ends.json")
SEED = 9300
TURNED = [key for key, form in FURTHER.items() if form.on == HEADING]
PLAINLY = {
    "group-cohesion/centroid": 0.8, "reaction-delay/snapshot": 0.5, "robot-avoidance/flee": 1.5,
}  # fmt: skip
"""Strengths at which forms that change few steps show in a mean."""
PACED = [key for key, form in FURTHER.items() if form.on == SPEED]


def simulated(key, *, strength="strong", minutes=10.0, seed=SEED):
    """Return world, law, past and plan of a run that hides a form."""
    scenario = Scenario(effect=key, strength=strength, seed=seed)
    law, world = law_of(natural()), world_of(two_rooms())
    plan = _plan(scenario, two_rooms(), np.random.default_rng(seed))
    past = empty_past(BURN_IN_STEPS + round(300 * minutes), 5, first=BURN_IN_STEPS)
    kernels.run(world, law, past, plan, np.random.default_rng([seed, 1]))
    return world, law, past, plan


def test_every_listed_effect_has_further_forms():
    """One or two each; names are listed ones, columns no other's, and strengths rise."""
    names = [name_of(key) for key in FURTHER]
    assert set(names) == set(LISTED)
    assert max(map(names.count, names)) <= 2
    assert set(FORM_STATISTICS) == set(FURTHER)
    assert {form.column for form in FORMS.values()} <= set(range(states.N_EFFECTS))
    assert len({form.column for form in FORMS.values()}) == len(FORMS)
    for key, form in FURTHER.items():
        assert 0 < form.faint < form.clear < form.strong
        assert set(form.also) <= set(LISTED) - {name_of(key)}
        assert len(form.constants) <= states.N_CONSTANTS
        assert all(low < high for _, low, high in form.constants)


@pytest.mark.parametrize("name", [None, *EFFECTS])
def test_the_first_forms_are_as_they_were(name):
    """Half a minute at the strong preset ends where it always ended, to a nanometre."""
    ends = json.loads(GOLDEN.read_text(encoding="utf-8"))[str(name)]
    made = make_trial(
        Scenario(effect=name, strength="strong", minutes=0.5, seed=9207), oracle=False
    )
    np.testing.assert_allclose(made.states_m[-1].ravel(), ends, rtol=0, atol=1e-9)


@pytest.mark.slow
def test_a_form_without_strength_is_the_base():
    """To the last bit, in ten seconds after a minute."""
    base = make_trial(Scenario(minutes=1 / 6, seed=SEED), oracle=False)
    for key in FURTHER:
        scenario = Scenario(effect=key, strength=0.0, minutes=1 / 6, seed=SEED)
        made = make_trial(scenario, oracle=False)
        assert np.array_equal(made.states_m, base.states_m), key
        assert np.array_equal(made.heading_rad, base.heading_rad), key


def test_constants_are_the_seeds_and_within_their_range():
    """Whatever is hidden beside a form; another seed draws others."""
    for key, form in FURTHER.items():
        a, b = drawn(key, 1), drawn(key, 2)
        assert all(low <= a[what] <= high for what, low, high in form.constants)
        assert not a or a != b
    pair = Scenario(effect="fatigue/sudden", second="alignment/flow", minutes=0.2, seed=1)
    truth = make_trial(pair, oracle=False).truth
    assert truth["constants"]["alignment/flow"] == drawn("alignment/flow", 1)
    assert truth["names"] == ["alignment", "fatigue"]


def test_further_forms_are_hidden_in_pairs():
    """Each of two changes the run, beside a first form as well."""

    def end(**asked):
        return make_trial(Scenario(**asked, strength="strong", minutes=0.5, seed=SEED),
                          oracle=False).states_m[-1]  # fmt: skip

    for second in ("crowding/nearest", "turning-bias"):
        both = end(effect="alignment/flow", second=second)
        assert not np.array_equal(both, end(effect="alignment/flow"))
        assert not np.array_equal(both, end(effect=second))


@pytest.mark.slow
@pytest.mark.parametrize("key", TURNED)
def test_headings_are_drawn_from_the_density_that_is_noted(key):
    """The mean of base density over noted density is 1: both integrate to 1 over what is drawn.

    The noted one tells the steps better than the base, or nothing would be hidden. Ten minutes
    notice a density that is 3 % too high.
    """
    world, law, past, _ = simulated(key, minutes=30.0 if "habituation" in key else 10.0)
    steps = usable_steps(past, 4)
    base = kernels.log_base(*steps, world, law, past, no_plan(5))
    told = np.isfinite(base)
    gain = (past.log_heading[steps] - base)[told]
    ratio = np.exp(-gain)
    error = ratio.std() / np.sqrt(len(ratio))
    assert error < 0.01
    assert abs(ratio.mean() - 1) < 4 * error + 0.002
    assert gain.sum() > 10


@pytest.mark.slow
@pytest.mark.parametrize("key", PACED)
def test_speeds_are_drawn_from_the_distribution_that_is_noted(key):
    """The shares below the drawn speeds are uniform; steps in bouts have a law of their own.

    Ten minutes notice a share that is off by 0.02.
    """
    _, law, past, plan = simulated(key)
    shares = []
    for t, i in zip(*usable_steps(past, 4), strict=True):
        if past.frozen[t, i] == 0:
            terms = speeds.speed_terms(i, t, past, plan)
            shares.append(speeds.share_below(past.speed[t, i], i, t, *terms, law, past, plan))
    shares = np.array(shares)
    # Steps too short for a heading are not told: the shares begin where those end.
    assert kstest(shares[shares > 0.1], "uniform", args=(0.1, 0.9)).pvalue > 1e-4
    assert speeds.share_below(-1.0, 0, 400, 1.0, 0.0, law, past, plan) == 0
    assert speeds.share_below(9.0, 0, 400, 1.0, 0.0, law, past, plan) == 1


@pytest.mark.slow
@pytest.mark.parametrize("key", ["freezing/shy", "freezing/crawl"])
def test_bouts_last_as_long_as_the_seed_drew(key):
    """The mean of an hour's bouts lies within four standard errors."""
    *_, past, plan = simulated(key, minutes=60.0)
    mean_s = next(iter(drawn(key, SEED).values()))
    on = past.frozen[:, :4] > 0
    begins = on[1:] & ~on[:-1]
    lasts = 0.2 * on[1:].sum() / begins.sum()
    expected = 0.2 / (1 - np.exp(-0.2 / mean_s))
    assert abs(lasts / expected - 1) < 4 / np.sqrt(begins.sum())
    still = past.speed[:, :4][on]
    assert still.max() <= (0.002 if key.endswith("shy") else states.CRAWL_M_S) + 1e-9
    shy = plan.bold[:4] < 0
    assert on[:, shy].any()
    assert on[:, ~shy].any() == key.endswith("crawl")


@pytest.mark.slow
@pytest.mark.parametrize("key", ["interaction-range/decay", "directional-drift/bend"])
def test_the_fitted_base_takes_what_it_can(key):
    """An oracle sees less over the base at its best fit than over the true parameters."""
    world, _, past, _ = simulated(key)
    steps = usable_steps(past, 4)
    gains = []
    for base in (natural(), fit_base(natural(), world, past, steps)):
        told = kernels.log_base(*steps, world, law_of(base), past, no_plan(5))
        gains.append(np.nansum(past.log_heading[steps] - told))
    assert 0 < gains[1] < gains[0] - 5


@pytest.fixture(scope="module")
def base_steps():
    """Return the steps of fish that hide nothing, of a seed whose fish visit both rooms."""
    return Steps(make_trial(Scenario(seed=SEED + 1), oracle=False))


@pytest.mark.slow
@pytest.mark.parametrize("key", FURTHER)
def test_the_form_does_what_it_says(key, base_steps):
    """Four times as strong as strong, its statistic stands out by three standard errors.

    Some forms change few steps, each by much: an oracle sees them long before a mean does.
    A share stays below 0.9.
    """
    strong = FURTHER[key].strong
    strength = PLAINLY.get(key, min(4 * strong, max(strong, 0.9)))
    scenario = Scenario(effect=key, strength=strength, seed=SEED)
    steps = Steps(make_trial(scenario, oracle=False))
    assert standing_out(FORM_STATISTICS[key], steps, base_steps) > 3


@pytest.mark.slow
@pytest.mark.parametrize("key", ["turning-bias/sides", "crowding/jostle"])
def test_strengths_are_worth_what_they_say(key):
    """Faint 20 to 50 nats, clear 50 to 150, strong more; a median of three strays by 15 or so."""
    faint, clear, strong = (worth(key, level) for level in LEVELS)
    assert 5 < faint < 65
    assert 35 < clear < 165 < 30 + strong
    assert faint < clear < strong
