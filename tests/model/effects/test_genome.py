"""Genes for the strengths of effects: what they stand for, and what a simulation makes of them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.model.effects import all_effects
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.genome import (
    check_effects,
    check_genomes,
    from_genome,
    genome_length,
    genome_names,
    genome_ranges,
    spelt_out,
    strengths_of,
    to_genome,
    with_strengths,
)
from zfcal.model.packing import pack, pack_genes
from zfcal.model.simulate import simulate_counts
from zfcal.parameters import to_genes

EFFECTS = {
    "alignment": {"weight": 20.0, "kappa": 8.0},
    "turning-bias": {"strength": -1.0},
    "crowding": {"per_neighbour": 0.25},
}
"""A component, a tilt, and one on speed."""

ONE_OF_EACH_KIND = (
    *EFFECTS.items(),
    ("habituation", {"per_hour": 6.0}),
    ("reaction-delay", {"share": 0.5}),
    ("freezing", {"rate_per_s": 0.1}),
)


@pytest.fixture
def extended(natural_model):
    """Return the natural model with three effects."""
    return dataclasses.replace(natural_model, effects=EFFECTS)


def test_a_gene_of_an_effect_by_hand(extended):
    """Twenty of fifty, a turn to one side of -4 to 4, a quarter of -1 to 1."""
    genes = to_genome(extended)
    assert genes[18:] == pytest.approx([0.4, 0.375, 0.625])
    assert (genes[:18] == to_genes(extended)).all()
    low, high = genome_ranges(extended)
    assert low.tolist() == [0.0] * 18 + [0.0, -4.0, -1.0]
    assert high[18:].tolist() == [50.0, 4.0, 1.0]
    assert low[:18] + genes[:18] * (high[:18] - low[:18]) == pytest.approx(
        [getattr(zone, key) for zone in extended.zones for key in ("kappa_0", "kappa_f", "alpha")]
        + extended.gamma_matrix().ravel().tolist()
    )


def test_names_are_those_of_the_base_then_an_effect_each(extended, natural_model):
    """In the model's order."""
    names = genome_names(extended)
    assert names[:18] == genome_names(natural_model)
    assert names[18:] == ("alignment.weight", "turning-bias.strength", "crowding.per_neighbour")
    assert genome_length(extended) == len(names) == 21
    assert genome_length(natural_model) == 18


def test_a_model_comes_back_from_its_genome(extended):
    """Strengths and base; shapes are the template's."""
    back = from_genome(to_genome(extended), extended)
    assert list(back.effects) == list(EFFECTS)
    for name, given in EFFECTS.items():
        assert back.effects[name] == pytest.approx(given)
    assert back.effects["alignment"]["kappa"] == 8.0
    assert to_genome(back) == pytest.approx(to_genome(extended))


def test_a_random_genome_comes_back_from_its_model(extended):
    """All 21 genes."""
    genes = np.random.default_rng(4).random(21)
    assert to_genome(from_genome(genes, extended)) == pytest.approx(genes)


def test_a_genome_of_the_base_leaves_the_effects(extended):
    """Those of the template, to the letter; the base is the genome's."""
    genes = np.full(18, 0.25)
    model = from_genome(genes, extended)
    assert model.effects == extended.effects
    assert to_genes(model) == pytest.approx(genes)


def test_a_strength_that_is_left_to_its_default_has_its_gene(natural_model):
    """A model file may name an effect and nothing else."""
    model = dataclasses.replace(natural_model, effects={"alignment": {}, "fatigue": {}})
    assert to_genome(model)[18:] == pytest.approx([0.4, (1.5 + 30) / 60])
    assert strengths_of(model) == (("alignment", "weight"), ("fatigue", "per_hour"))
    assert spelt_out(model).effects["fatigue"] == {"per_hour": 1.5, "usual_at_s": 900.0}
    assert spelt_out(model).effects["alignment"]["kappa"] == 10.0


@pytest.mark.parametrize("effect", all_effects(), ids=lambda effect: effect.name)
def test_the_ends_of_a_gene_are_the_bounds_of_the_strength(natural_model, effect):
    """Of each effect that there is; both are models."""
    template = dataclasses.replace(natural_model, effects={effect.name: {}})
    (own,) = (p for p in effect.parameters if p.name == effect.strength)
    base = to_genes(natural_model)
    for gene, bound in ((0.0, own.low), (1.0, own.high)):
        model = from_genome([*base, gene], template)
        assert model.effects[effect.name][effect.strength] == bound
        assert to_genome(model)[-1] == gene
        assert effect.values(model.effects[effect.name])


def test_a_gene_of_one_is_no_more_than_the_bound(natural_model, monkeypatch):
    """-0.1 + (0.3 - -0.1) is a little more than 0.3, which no model may have."""
    own = EffectParameter(name="strength", low=-0.1, high=0.3, default=0.1, says="Strength.")
    effect = Effect(name="odd", says="", opposite="", reference="", parameters=(own,), probe=0.01)
    monkeypatch.setattr("zfcal.model.effects.genome.find_effect", lambda _: effect)
    template = dataclasses.replace(natural_model, effects={"odd": {"strength": 0.1}})
    assert -0.1 + (0.3 - -0.1) > 0.3
    assert with_strengths(template, np.array([1.0])).effects == {"odd": {"strength": 0.3}}


@pytest.mark.parametrize("n", [17, 19, 20, 22, 0])
def test_a_genome_of_another_length_is_refused(extended, two_rooms, n):
    """The message says what is needed; a table is refused as well."""
    with pytest.raises(InputError, match="of 3 zones need 18 genes and 3 of effects"):
        from_genome(np.full(n, 0.5), extended)
    with pytest.raises(InputError, match=r"18 genes and 3 of effects, got a table of shape \(4, "):
        check_genomes(np.full((4, n), 0.5), extended)
    with pytest.raises(InputError, match="18 genes and 3 of effects in"):
        pack_genes(np.full((4, n), 0.5), extended, two_rooms)


def test_a_single_number_is_no_genome(extended):
    """It has no genes at all."""
    with pytest.raises(InputError, match=r"got a table of shape \(\)"):
        check_genomes(0.5, extended)


def test_genes_of_effects_are_of_no_use_to_a_model_without(natural_model):
    """And nothing is said of effects there."""
    with pytest.raises(InputError, match="of 3 zones need 18 genes, got"):
        from_genome(np.full(19, 0.5), natural_model)


@pytest.mark.parametrize("wrong", [np.nan, -0.01, 1.01])
def test_a_gene_of_an_effect_that_is_none_is_refused(extended, two_rooms, wrong):
    """As one of the base is: a NaN would keep the sampler waiting for ever."""
    genes = np.full((2, 21), 0.5)
    genes[1, 20] = wrong
    with pytest.raises(InputError, match=r"in \[0, 1\]"):
        pack_genes(genes, extended, two_rooms)


@pytest.mark.parametrize(
    ("effects", "says"),
    [
        ({"allignment": {}}, "model.toml: There is no effect 'allignment'"),
        ({"alignment": {"strength": 1.0}}, "has no parameter 'strength'"),
        ({"alignment": {"weight": 60.0}}, r"weight must be in \[0, 50\], got 60.0"),
        ({"alignment": {"weight": np.nan}}, r"weight must be in \[0, 50\], got nan"),
    ],
)
def test_effects_that_are_none_are_refused_by_the_name_of_the_model(natural_model, effects, says):
    """Where it stands, what is wrong, and what to do."""
    with pytest.raises(InputError, match=says) as error:
        check_effects(dataclasses.replace(natural_model, effects=effects), of="model.toml")
    assert str(error.value).startswith("model.toml: ")
    assert error.value.hint or "alignment" in effects


def test_effects_that_are_there_are_not_refused(extended, natural_model):
    """With effects, and without."""
    check_effects(extended, of="model.toml")
    check_effects(natural_model, of="model.toml")


@pytest.mark.parametrize("effect", ONE_OF_EACH_KIND, ids=lambda effect: effect[0])
def test_genes_simulate_as_the_models_that_they_stand_for(natural_model, two_rooms, effect):
    """Four genomes, with strengths from one bound to the other: the same counts bit by bit."""
    template = dataclasses.replace(natural_model, effects=dict([effect]))
    genes = np.tile(to_genome(template), (4, 1))
    genes[:, :18] = np.clip(genes[:, :18] * np.linspace(0.9, 1.1, 4)[:, None], 0.0, 1.0)
    genes[:, 18] = (0.0, 0.3, 0.8, 1.0)
    _same(genes, template, two_rooms)
    models = [from_genome(row, template) for row in genes]
    strengths = {model.effects[effect[0]][strengths_of(template)[0][1]] for model in models}
    assert len(strengths) == 4


def test_genes_of_several_effects_simulate_as_their_models(extended, two_rooms):
    """Each gene moves its own effect."""
    genes = np.tile(to_genome(extended), (3, 1))
    genes[:, 18:] = np.random.default_rng(2).random((3, 3))
    counts = _same(genes, extended, two_rooms)
    swapped = genes[:, [*range(18), 19, 20, 18]]
    other = _counts(pack_genes(swapped, extended, two_rooms), two_rooms)
    assert any((a != b).any() for a, b in zip(counts, other, strict=True))


def test_genes_of_the_base_simulate_with_the_templates_effects(extended, two_rooms):
    """As they did before strengths had genes."""
    genes = np.tile(to_genes(extended), (2, 1))
    genes[1, :3] *= 0.5
    _same(genes, extended, two_rooms)


def _same(genes, template, arena):
    """Return the counts of genomes; those of the models must be the same."""
    own = _counts(pack_genes(genes, template, arena), arena)
    models = _counts(pack([from_genome(row, template) for row in genes], arena), arena)
    for ours, theirs in zip(own, models, strict=True):
        assert (ours == theirs).all()
    return own


def _counts(packed, arena):
    return simulate_counts(
        packed, arena, n_agents=5, n_counted=4, n_robots=1, n_steps=400,
        seeds=np.array([1, 2], dtype=np.uint64), n_threads=2,
    )  # fmt: skip
