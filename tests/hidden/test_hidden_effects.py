"""Each hidden effect does what its sentence says, by a statistic that asks no model.

Every test compares half an hour of four fish and a robot at the strong preset with as
long a time of base fish. Means over blocks of a minute give the standard error; the
statistic must lie on the right side of the base's by more than three of them, which
base fish do once in 700 times. With 30 blocks on each side, a shift by 1.1 of what the
statistic varies between minutes is noticed in nine of ten cases. Effects that are `PLAIN`
need ten minutes only.
"""

import numpy as np
import pytest

from hidden.effects import EFFECTS
from hidden.scenario import Scenario, make_trial
from hidden.statistics_of_steps import STATISTICS, Steps, standing_out

SEED = 9100

PLAIN = {
    "alignment", "wall-persistence", "interaction-range", "rear-blind-zone", "reaction-delay",
    "collective-departure", "turning-memory", "speed-matching", "crowding", "burst-and-coast",
    "speed-turn-coupling", "boldness", "sound", "kept-distance", "lit-room",
}  # fmt: skip
"""Effects that stand out by five standard errors and more within ten minutes."""


@pytest.fixture(scope="module")
def base_steps():
    """Return the steps of fish that hide nothing."""
    return Steps(make_trial(Scenario(seed=SEED), oracle=False))


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_the_effect_does_what_it_says(name, base_steps):
    """At the strong preset its statistic stands out by three standard errors."""
    minutes = 10 if name in PLAIN else 30
    scenario = Scenario(effect=name, strength="strong", seed=SEED, minutes=minutes)
    steps = Steps(make_trial(scenario, oracle=False))
    assert standing_out(STATISTICS[name], steps, base_steps) > 3


@pytest.mark.slow
def test_base_fish_show_no_effect(base_steps):
    """No statistic of other base fish differs from the base's by four standard errors."""
    others = Steps(make_trial(Scenario(seed=SEED + 1), oracle=False))
    found = {name: standing_out(STATISTICS[name], others, base_steps) for name in EFFECTS}
    assert max(map(abs, found.values())) < 4, found


@pytest.mark.parametrize("seed", [9701, 9702, 9704, 9715])
def test_a_liked_place_is_one_that_fish_come_by(seed):
    """A tenth of the time within 0.3 m: of two of these the first choice lay where nobody was."""
    trial = make_trial(Scenario(effect="place-preference", seed=seed, minutes=3), oracle=False)
    away = np.linalg.norm(trial.states_m[:, :4] - trial.truth["place_m"], axis=-1)
    assert (away < 0.3).mean() >= 0.1
