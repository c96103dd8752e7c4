"""Seeds, speeds, and the models that genomes stand for."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import Purpose, SeedSource, express, scale_gamma, with_measured_speeds
from zfcal.errors import InputError
from zfcal.parameters import to_genes

NAMES = ("corridor", "walls", "centre")


def statistics_of_speeds(speed):
    """Return a window of which only the speeds are known."""
    return Statistics(
        zone_names=NAMES,
        distance=np.zeros((3, 10), dtype=np.int64),
        wall=np.zeros((3, 10), dtype=np.int64),
        occupation=np.ones(3, dtype=np.int64),
        transition=np.zeros((3, 3), dtype=np.int64),
        speed=np.array(speed, dtype=np.int64),
    )


def test_a_seed_depends_on_trial_window_purpose_and_run_and_on_nothing_else():
    """All 2 x 2 x 8 x 20 seeds differ, and asking in another order gives the same."""
    sources = [SeedSource(trial_seed=t, window_end_s=w) for t in (0, 1) for w in (120, 180)]
    table = np.array([[source.seeds(purpose, 20) for purpose in Purpose] for source in sources])
    assert table.dtype == np.uint64
    assert np.unique(table).size == table.size
    backwards = [[source.seeds(p, 20) for p in reversed(Purpose)] for source in reversed(sources)]
    assert (np.array(backwards)[::-1, ::-1] == table).all()


def test_more_runs_keep_the_seeds_of_the_first_ones():
    """Run r has its seed whatever the number of runs."""
    source = SeedSource(trial_seed=3, window_end_s=60)
    few, many = source.seeds(Purpose.CEILING, 3), source.seeds(Purpose.CEILING, 9)
    assert few.tolist() == many[:3].tolist()
    assert source.seeds(Purpose.CEILING, 0).size == 0


def test_a_seed_by_numpys_own_recipe():
    """Entropy is the trial's seed; window, purpose and run are the spawn key."""
    expected = np.random.SeedSequence(7, spawn_key=(120, 2, 1)).generate_state(1, np.uint64)
    found = SeedSource(trial_seed=7, window_end_s=120).seeds(Purpose.EVALUATION, 2)
    assert found[1] == expected[0]


@pytest.mark.parametrize(("seed", "second"), [(-1, 120), (1, -60)])
def test_a_negative_seed_is_refused(seed, second):
    """Seed sequences know none."""
    with pytest.raises(InputError, match="must not be negative"):
        SeedSource(trial_seed=seed, window_end_s=second)


def test_speeds_are_those_of_the_zone_else_of_all_zones(template):
    """Corridor has 4 + 12, walls only 9 in all, centre none: these take all 25 together."""
    speed = np.zeros((3, 10))
    speed[0, 0], speed[0, 3] = 4, 12
    speed[1, 9] = 9
    zones = with_measured_speeds(template, statistics_of_speeds(speed)).zones
    assert zones[0].speed_frequency == (0.25, 0, 0, 0.75, 0, 0, 0, 0, 0, 0)
    for zone in zones[1:]:
        assert zone.speed_frequency == (0.16, 0, 0, 0.48, 0, 0, 0, 0, 0, 0.36)


def test_without_speeds_the_templates_stay(template):
    """A window of still pictures, or of nine steps in all."""
    for n in (0, 3):
        speed = np.zeros((3, 10))
        speed[:, 2] = n
        made = with_measured_speeds(template, statistics_of_speeds(speed))
        assert made == template


def test_measured_speeds_change_nothing_else(template, window):
    """Genes, step, view and effects are the template's; doing it twice is doing it once."""
    control = window()
    made = with_measured_speeds(template, control)
    assert (to_genes(made) == to_genes(template)).all()
    assert (made.dt_s, made.fov_rad, made.effects) == (0.2, template.fov_rad, {})
    assert with_measured_speeds(made, control) == made


def test_speeds_of_another_arena_are_refused(template):
    """The zones of both are named."""
    control = replace(statistics_of_speeds(np.zeros((3, 10))), zone_names=("a", "b", "c"))
    with pytest.raises(InputError, match="corridor, walls, centre, the window's a, b, c"):
        with_measured_speeds(template, control)


def test_gamma_rows_are_scaled_to_a_maximum_of_one():
    """Rows (.2 .4 .1) and (0 0 0) become (.5 1 .25) and (1 1 1); the rest stays."""
    genes = np.array([*[0.3] * 9, 0.2, 0.4, 0.1, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0])
    expected = [*[0.3] * 9, 0.5, 1.0, 0.25, 1.0, 1.0, 1.0, 0.5, 0.5, 1.0]
    assert scale_gamma(genes, 3) == pytest.approx(expected)
    assert genes[9] == 0.2
    np.testing.assert_allclose(scale_gamma(np.stack([genes, genes]), 3)[1], expected)


def test_a_genome_of_zeros_is_still_a_model(template):
    """Rows of zeros would be no law of motion."""
    model = express(np.zeros(18), template)
    assert model.gamma_matrix().tolist() == [[1.0] * 3] * 3
    assert model.zones[0].kappa_0 == 0.0


@pytest.mark.parametrize("shape", [(17,), (2, 4), ()])
def test_genes_of_another_arena_are_refused(shape):
    """Three zones have 18 genes."""
    with pytest.raises(InputError, match="need 18 genes"):
        scale_gamma(np.zeros(shape), 3)
