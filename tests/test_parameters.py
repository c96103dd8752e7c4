"""Parameters of a model, and the genes that stand for them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal import parameters
from zfcal.errors import InputError
from zfcal.parameters import (
    FOV_RAD,
    PUBLISHED_SPEEDS,
    Parameters,
    ZoneParameters,
    from_genes,
    gene_names,
    gene_scales,
    n_genes,
    natural,
    to_genes,
)

TWO_ROOMS = (("corridor", True), ("walls", True), ("centre", False))
FLAT = (0.1,) * 10


def zone(**changes):
    """Return a zone that is right, changed as asked."""
    given_ = {
        "name": "walls", "kappa_0": 9.0, "kappa_f": 8.0, "alpha": 40.0, "speed_frequency": FLAT,
        "gamma": {"walls": 1.0, "centre": 0.5},
    }  # fmt: skip
    return ZoneParameters(**given_ | changes)


def two_zones():
    """Return a model whose every number is another one."""
    return Parameters(
        dt_s=0.2,
        zones=(
            zone(kappa_0=3.0, kappa_f=6.0, alpha=10.0, gamma={"walls": 0.1, "centre": 0.2}),
            zone(
                name="centre",
                kappa_0=9.0,
                kappa_f=12.0,
                alpha=40.0,
                # A dictionary has its own order, which must not matter.
                gamma={"centre": 0.4, "walls": 0.3},
                kappa_w=5.0,
            ),
        ),
    )


def test_genes_stand_zone_by_zone_and_then_row_by_row():
    """kappa_0, kappa_f and alpha of each zone, over 30, 30 and 50, then the rows of gamma."""
    assert to_genes(two_zones()) == pytest.approx(
        [0.1, 0.2, 0.2, 0.3, 0.4, 0.8, 0.1, 0.2, 0.3, 0.4]
    )
    assert gene_names(("walls", "centre")) == (
        "walls.kappa_0", "walls.kappa_f", "walls.alpha",
        "centre.kappa_0", "centre.kappa_f", "centre.alpha",
        "walls.gamma.walls", "walls.gamma.centre", "centre.gamma.walls", "centre.gamma.centre",
    )  # fmt: skip


def test_gene_one_is_kappa_30_and_alpha_50():
    """The published ranges; gamma is its own gene."""
    assert gene_scales(1).tolist() == [30.0, 30.0, 50.0, 1.0]
    assert gene_scales(2).tolist() == [30.0, 30.0, 50.0, 30.0, 30.0, 50.0, 1.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize(("n_zones", "genes"), [(1, 4), (2, 10), (3, 18), (5, 40)])
def test_the_number_of_genes(n_zones, genes):
    """3 Z + Z^2: 18 in two rooms, 40 for the five zones of the published individual."""
    names = tuple(f"z{k}" for k in range(n_zones))

    assert n_genes(n_zones) == genes
    assert len(gene_names(names)) == len(set(gene_names(names))) == genes
    assert gene_scales(n_zones).shape == (genes,)


def test_what_is_not_calibrated_is_taken_from_the_template():
    """Step, view, speeds, wall concentration and effects stay; the dictionary is a copy."""
    template = dataclasses.replace(
        two_zones(), fov_rad=2.0, base="other", effects={"alignment": {"weight": 3.0}}
    )

    made = from_genes(np.full(10, 0.5), template)

    assert (made.dt_s, made.fov_rad, made.base) == (0.2, 2.0, "other")
    assert made.effects == template.effects
    assert made.effects is not template.effects
    assert [z.kappa_w for z in made.zones] == [None, 5.0]
    assert [z.speed_frequency for z in made.zones] == [FLAT, FLAT]
    assert [(z.kappa_0, z.kappa_f, z.alpha) for z in made.zones] == [(15.0, 15.0, 25.0)] * 2
    assert (made.gamma_matrix() == 0.5).all()


@given(genes=st.lists(st.floats(0, 1), min_size=18, max_size=18))
def test_genes_make_a_model_and_come_back(genes):
    """There and back; a row of gamma that is all zero comes back as ones."""
    template = natural(TWO_ROOMS, dt_s=0.2)
    expected = np.array(genes)
    rows = expected[9:].reshape(3, 3)
    rows[(rows == 0).all(axis=1)] = 1.0

    assert to_genes(from_genes(genes, template)) == pytest.approx(expected, abs=1e-15)


def test_the_genes_given_are_left_alone():
    """Filling a row of zeros does not write into the caller's array."""
    genes = np.zeros(10)

    assert (from_genes(genes, two_zones()).gamma_matrix() == 1.0).all()
    assert (genes == 0.0).all()


def test_parameters_beyond_the_bounds_are_cut_off_as_genes():
    """A model file may hold more than the search allows: kappa 60 and gamma 7 become gene 1."""
    bold = dataclasses.replace(
        two_zones(),
        zones=(zone(kappa_0=60.0, gamma={"walls": 7.0, "centre": 0.5}), two_zones().zones[1]),
    )

    genes = to_genes(bold)

    assert genes[0] == 1.0
    assert genes[6] == 1.0
    assert genes.max() == 1.0


@pytest.mark.parametrize("genes", [np.zeros(9), np.zeros(11), np.zeros((1, 10)), 0.5])
def test_a_genome_of_another_length_is_refused(genes):
    """One of another arena, a table of genomes, a number."""
    with pytest.raises(InputError, match="2 zones has 10 genes, got an array of shape"):
        from_genes(genes, two_zones())


@pytest.mark.parametrize("gene", range(10))
def test_a_gene_that_is_nan_is_refused(gene):
    """Wherever it stands; in a row of gamma as well."""
    genes = np.full(10, 0.5)
    genes[gene] = np.nan

    with pytest.raises(InputError, match="must be finite and not negative, got nan"):
        from_genes(genes, two_zones())


def test_gamma_as_a_matrix_has_a_row_for_where_one_is():
    """From row to column, in the order of the zones, not of the dictionaries."""
    assert two_zones().gamma_matrix().tolist() == [[0.1, 0.2], [0.3, 0.4]]
    assert two_zones().zone_names == ("walls", "centre")


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
@pytest.mark.parametrize("key", ["kappa_0", "kappa_f", "alpha", "kappa_w"])
def test_numbers_that_are_none_are_refused(key, value):
    """Negative, NaN, infinite; the message says which zone, which number and the value."""
    with pytest.raises(InputError, match=f"Zone 'walls': {key} must be finite and not negative"):
        zone(**{key: value})


@pytest.mark.parametrize("key", ["kappa_0", "kappa_f", "kappa_w"])
def test_a_concentration_beyond_any_behaviour_is_refused(key):
    """Kappa 1,000 is a law 2 degrees wide; with more a density on 360 angles is none."""
    assert getattr(zone(**{key: 1000.0}), key) == 1000.0
    with pytest.raises(InputError, match=f"{key} must be at most 1000, got 1001"):
        zone(**{key: 1001.0})


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_an_attraction_that_is_none_is_refused(value):
    """The message names the zone that attracts."""
    with pytest.raises(InputError, match=r"gamma\.centre must be finite"):
        zone(gamma={"walls": 1.0, "centre": value})


@pytest.mark.parametrize("gamma", [{}, {"walls": 0.0, "centre": 0.0}])
def test_a_zone_that_nothing_attracts_from_is_refused_in_a_model(gamma):
    """A model file that forbids every landing is a mistake."""
    with pytest.raises(InputError, match="gamma needs one positive value"):
        zone(gamma=gamma)


@pytest.mark.parametrize(
    ("frequency", "says"),
    [
        ((0.1,) * 9, "needs 10 bins, got 9"),
        ((0.1,) * 11, "needs 10 bins, got 11"),
        ((0.2,) * 10, "sum to 1"),
        ((0.0,) * 10, "sum to 1"),
        ((1.1, -0.1, *(0.0,) * 8), "non-negative"),
        ((math.nan, *(0.1,) * 9), "non-negative"),
    ],
)
def test_speeds_that_are_no_histogram_are_refused(frequency, says):
    """Ten frequencies, none negative or NaN, that sum to one within a hundredth."""
    with pytest.raises(InputError, match=says):
        zone(speed_frequency=frequency)


@pytest.mark.parametrize("dt_s", [0.0, -0.2, math.nan, math.inf])
def test_a_step_that_is_none_is_refused(dt_s):
    """The step is a positive time."""
    with pytest.raises(InputError, match="dt_s must be a positive time"):
        Parameters(dt_s=dt_s, zones=(zone(),))


@pytest.mark.parametrize("fov_rad", [0.0, -1.0, 3.2, 135.0, math.nan])
def test_a_field_of_view_that_is_none_is_refused(fov_rad):
    """To each side, so at most pi; 135 is degrees, and the hint says so."""
    with pytest.raises(InputError, match="fov_rad must be in") as caught:
        Parameters(dt_s=0.2, zones=(zone(),), fov_rad=fov_rad)
    assert "135 degrees are 2.356" in caught.value.hint


def test_the_whole_circle_can_be_seen():
    """Pi to each side is allowed; the default is 135 degrees."""
    assert Parameters(dt_s=0.2, zones=(zone(),), fov_rad=math.pi).fov_rad == math.pi
    assert pytest.approx(math.radians(135)) == FOV_RAD


def test_the_published_speeds_by_hand():
    """Sums to one, ten bins of 0.02 m/s; means of 0.1022, 0.0796 and 0.0864 m/s."""
    assert set(PUBLISHED_SPEEDS) == {"corridor", "walls", "centre"}
    middles = 0.01 + 0.02 * np.arange(10)
    for row in PUBLISHED_SPEEDS.values():
        assert math.fsum(row) == pytest.approx(1.0, abs=1e-15)
        assert len(row) == 10

    means = {name: float(np.dot(middles, row)) for name, row in PUBLISHED_SPEEDS.items()}
    assert PUBLISHED_SPEEDS["walls"][3] == pytest.approx(0.17989672, abs=1e-8)
    assert PUBLISHED_SPEEDS["corridor"][5] == pytest.approx(0.15312688, abs=1e-7)
    assert PUBLISHED_SPEEDS["centre"][9] == pytest.approx(0.01494682, abs=1e-6)
    assert means == pytest.approx(
        {"corridor": 0.102179, "walls": 0.079613, "centre": 0.086419}, abs=1e-6
    )


def test_the_published_speeds_cannot_be_overwritten():
    """They are shared by all models of a process."""
    with pytest.raises(TypeError):
        PUBLISHED_SPEEDS["walls"] = FLAT
    assert parameters.SPEED_BINS == 10


def test_the_natural_fish_of_two_rooms_by_hand():
    """Kappa, alpha and gamma as the model states them, whatever the order of the zones."""
    model = natural(TWO_ROOMS, dt_s=0.25)
    turned = natural(TWO_ROOMS[::-1], dt_s=0.25)

    assert model.dt_s == 0.25
    assert [(z.kappa_0, z.kappa_f, z.alpha) for z in model.zones] == [
        (9.0, 8.0, 17.0), (9.0, 9.0, 42.0), (8.0, 20.0, 49.0),
    ]  # fmt: skip
    assert model.gamma_matrix().tolist() == [[0.6, 0.9, 0.9], [0.6, 0.5, 0.4], [0.6, 0.8, 0.9]]
    assert model.zones[0].speed_frequency == PUBLISHED_SPEEDS["corridor"]
    assert (turned.gamma_matrix()[::-1, ::-1] == model.gamma_matrix()).all()
    assert to_genes(model).max() <= 1.0


def test_the_natural_fish_of_another_arena_take_after_walls_or_centre():
    """By whether they follow walls, with no attraction; a known name keeps its speeds."""
    model = natural((("inner", True), ("open", False), ("corridor", True)), dt_s=0.2)

    assert [z.kappa_f for z in model.zones] == [9.0, 20.0, 8.0]
    assert model.zones[1].speed_frequency == PUBLISHED_SPEEDS["centre"]
    assert (model.gamma_matrix() == 1.0).all()
