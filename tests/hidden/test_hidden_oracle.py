"""The oracle sees nothing where nothing is hidden, and more where more is."""

import re
from pathlib import Path

import numpy as np
import pytest

from hidden import geometry, kernels
from hidden.chain import Chain
from hidden.effects import EFFECTS, LISTED, UNLISTED
from hidden.freshness import forget_stale_kernels
from hidden.law import empty_past, law_of, natural, no_plan, world_of
from hidden.oracle import acts_on, fit_base, log_base_speed, usable_steps
from hidden.scenario import Scenario, make_trial
from hidden.worlds import two_rooms

FREE = 13
"""Parameters of headings: three a zone, and a zone's attractions but its own."""

BINS = 33
"""Bins of speed in three zones that base fish reach."""


@pytest.mark.parametrize("base", ["natural", pytest.param("shifted", marks=pytest.mark.slow)])
@pytest.mark.parametrize("arena", ["two-rooms", pytest.param("rectangle", marks=pytest.mark.slow)])
def test_base_fish_are_worth_no_nats(base, arena):
    """The best fit beats the truth, by half a nat a parameter on average.

    Twice the gain is chi-squared: 2.5 p is passed by fewer than one trial in a hundred
    thousand, and an effect of 15 nats would lift the sum over zero.
    """
    trial = make_trial(Scenario(seed=9200, minutes=10, base=base, arena=arena))
    assert -1.25 * FREE * 2 < trial.oracle_nats["heading"] < 0.5
    assert -1.25 * BINS < trial.oracle_nats["speed"] < 0
    assert trial.oracle_nats["total"] == pytest.approx(
        trial.oracle_nats["heading"] + trial.oracle_nats["speed"]
    )


@pytest.mark.slow
def test_the_fit_finds_the_parameters_back():
    """Half an hour of five fish gives each kappa and alpha to within 20 %."""
    base, world = natural(), world_of(two_rooms())
    past = empty_past(9300, 5, first=300)
    kernels.run(world, law_of(base), past, no_plan(5), np.random.default_rng(9201))
    found = fit_base(base, world, past, usable_steps(past, 5))

    for name in ("kappa_0", "kappa_f", "alpha"):
        np.testing.assert_allclose(getattr(found, name)[1:], getattr(base, name)[1:], rtol=0.2)
    ratio = found.gamma[2, 1:] / found.gamma[2, 2]
    np.testing.assert_allclose(ratio, base.gamma[2, 1:] / base.gamma[2, 2], rtol=0.3)


@pytest.mark.slow
def test_the_best_fit_is_the_best():
    """Each parameter of the walls, moved by 10 % either way, makes the headings less likely."""
    base, world = natural(), world_of(two_rooms())
    past = empty_past(3300, 5, first=300)
    kernels.run(world, law_of(base), past, no_plan(5), np.random.default_rng(9202))
    steps = usable_steps(past, 5)
    steps = tuple(part[past.zone[steps] == 2] for part in steps)

    def total(law):
        return np.nansum(kernels.log_base(*steps, world, law_of(law), past, no_plan(5)))

    best = fit_base(base, world, past, steps)
    highest = total(best)
    for name in ("kappa_0", "kappa_f", "alpha"):
        for factor in (0.9, 1.1):
            values = getattr(best, name)
            kept = values[2]
            values[2] = kept * factor
            # The fit sums over 72 angles, the law over 180.
            assert total(best) < highest + 0.5
            values[2] = kept


@pytest.mark.slow
@pytest.mark.parametrize("name", ["alignment", "burst-and-coast", "turning-memory"])
def test_more_of_an_effect_is_worth_more_nats(name):
    """Faint, clear and strong stand in this order."""
    worth = [
        make_trial(Scenario(effect=name, strength=s, seed=9203, minutes=15)).oracle_nats["total"]
        for s in ("faint", "clear", "strong")
    ]
    assert worth == sorted(worth)
    assert worth[2] > 200


def test_speeds_are_compared_with_the_shares_of_their_bins():
    """Two of four speeds in a bin give log(1/2) each; zones are counted apart."""
    speed = np.array([0.03, 0.035, 0.05, 0.07, 0.03])
    zone = np.array([2, 2, 2, 2, 3])
    expected = np.log([0.5, 0.5, 0.25, 0.25, 1.0])

    np.testing.assert_allclose(log_base_speed(speed, zone), expected)


def test_every_listed_effect_can_be_hidden():
    """Twenty-one effects are on the tool's list, and at least four are not."""
    assert len(LISTED) == 21
    assert len(UNLISTED) >= 4
    assert acts_on(["alignment", "fatigue"]) == "heading and speed"
    assert acts_on(["alignment", "boldness"]) == "heading"


def test_a_seed_makes_a_trial_again():
    """The same scenario gives the same table; another seed gives another."""
    wanted = {"effect": "alignment", "second": "fatigue", "minutes": 0.5}
    chain = Chain(noise_mm=1, drops_per_min=3, swaps_per_min=3)
    a, b, c = (
        make_trial(Scenario(**wanted, chain=chain, seed=s), oracle=False)
        for s in (9204, 9204, 9205)
    )
    assert a.tracks.equals(b.tracks)
    assert not a.tracks.equals(c.tracks)
    assert a.truth["effects"].keys() == {"alignment", "fatigue"}


@pytest.mark.slow
def test_fish_never_leave_the_tank():
    """Whatever is hidden, two minutes later everybody is inside."""
    world = world_of(two_rooms())
    for name in EFFECTS:
        trial = make_trial(
            Scenario(effect=name, strength="strong", minutes=2, seed=9206), oracle=False
        )
        assert all(geometry.zone_of(x, y, world) > 0 for x, y in trial.states_m.reshape(-1, 2)[::7])


def test_the_simulator_shares_no_code_with_zfcal():
    """No module of it imports zfcal; its tests do, to compare."""
    folder = Path(kernels.__file__).parent
    modules = [path for path in folder.glob("*.py") if not path.name.startswith("test_")]
    assert len(modules) > 8
    for path in modules:
        assert not re.search(r"^\s*(import|from) zfcal", path.read_text(), re.MULTILINE), path


def test_compiled_loops_are_dropped_when_a_source_changes(tmp_path):
    """The first look and one after an edit empty the cache, the one between does not."""
    for path in Path(kernels.__file__).parent.glob("*.py"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "__pycache__").mkdir()
    stale = tmp_path / "__pycache__" / "kernels.run.nbi"
    found = []
    for edit in ("", "", "# edited"):
        stale.write_bytes(b"")
        with (tmp_path / "states.py").open("a") as file:
            file.write(edit)
        found.append((forget_stale_kernels(tmp_path), stale.exists()))

    assert found == [(True, False), (False, True), (True, False)]
