"""Genomes of models with effects: the base's genes, then a gene for the strength of each effect.

A genome of the base alone leaves the strengths as its template has them.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.effects import find_effect
from zfcal.parameters import (
    Parameters,
    from_genes,
    gene_names,
    gene_scales,
    n_genes,
    to_genes,
)


def strengths_of(template: Parameters) -> tuple[tuple[str, str], ...]:
    """Return the effects of a model and the name of each one's strength, in the model's order."""
    return tuple((name, find_effect(name).strength) for name in template.effects)


def spelt_out(template: Parameters) -> Parameters:
    """Return a model whose effects name all their parameters, those left to the default as well."""
    effects = [(find_effect(name), given) for name, given in template.effects.items()]
    return dataclasses.replace(
        template,
        effects={effect.name: effect.spelt_out(given) for effect, given in effects},
    )


def check_effects(parameters: Parameters, *, of: object) -> None:
    """Refuse a model that has an effect which there is not, or a parameter out of its bounds.

    Parameters
    ----------
    parameters
        The model.
    of
        Where it stands, for the message.

    Raises
    ------
    InputError
        What is wrong, and where.
    """
    try:
        spelt_out(parameters)
    except InputError as error:
        raise InputError(f"{of}: {error}", hint=error.hint) from error


def genome_length(template: Parameters) -> int:
    """Return the number of genes of a model with its effects."""
    return n_genes(len(template.zones)) + len(template.effects)


def genome_names(template: Parameters) -> tuple[str, ...]:
    """Return a name per gene, such as ``walls.kappa_0`` or ``alignment.strength``."""
    own = tuple(f"{name}.{key}" for name, key in strengths_of(template))
    return gene_names(template.zone_names) + own


def genome_ranges(template: Parameters) -> tuple[Floats, Floats]:
    """Return the values that genes 0 and 1 stand for, shape (gene,) each."""
    scales = gene_scales(len(template.zones))
    own = np.array([_range(*pair) for pair in strengths_of(template)]).reshape(-1, 2)
    return np.concatenate([np.zeros_like(scales), own[:, 0]]), np.concatenate([scales, own[:, 1]])


def check_genomes(genes: ArrayLike, template: Parameters) -> None:
    """Refuse genomes that are of another arena, or of other effects.

    Raises
    ------
    InputError
        The last axis is neither the number of genes of the base nor that with the effects.
    """
    shape, base, whole = np.shape(genes), n_genes(len(template.zones)), genome_length(template)
    if shape[-1:] not in {(base,), (whole,)}:
        effects = f" and {len(template.effects)} of effects" if template.effects else ""
        raise InputError(
            f"Genomes of {len(template.zones)} zones need {base} genes{effects}, got a table of "
            f"shape {shape}.",
            hint="A population of another arena, or with other effects, cannot be taken over.",
        )


_SETTLED_DECIMALS = 9
"""Of genes that go from a fit into a search: a millionth of any interval, and far beyond the last
digits in which compiled code differs."""


def settled(genes: ArrayLike) -> Floats:
    """Return genes without the last digits, which are another processor's or compiler's choice.

    A search makes much of little: two that begin a last digit apart end elsewhere.
    """
    return np.asarray(genes, dtype=np.float64).round(_SETTLED_DECIMALS)


def to_genome(parameters: Parameters) -> Floats:
    """Return the genes in [0, 1] of a model and its effects, shape (gene,), cut off beyond."""
    low, high = genome_ranges(parameters)
    base = n_genes(len(parameters.zones))
    effects = spelt_out(parameters).effects
    own = [effects[name][key] for name, key in strengths_of(parameters)]
    part = (np.array(own) - low[base:]) / (high[base:] - low[base:])
    return np.concatenate([to_genes(parameters), np.clip(part, 0.0, 1.0)])


def from_genome(genes: ArrayLike, template: Parameters) -> Parameters:
    """Return ``template`` with the calibrated parameters taken from genes.

    Parameters
    ----------
    genes : array_like, shape (gene,)
        In [0, 1], in the order of `genome_names`; those of the base alone leave the effects.
    template
        Gives all else.

    Raises
    ------
    InputError
        The genome is of another length, or a value is none of a model.
    """
    check_genomes(genes, template)
    values, base = np.asarray(genes, dtype=np.float64), n_genes(len(template.zones))
    return with_strengths(from_genes(values[:base], template), values[base:])


def with_strengths(template: Parameters, genes: Floats) -> Parameters:
    """Return a model with the strengths of its effects taken from genes.

    Parameters
    ----------
    genes : ndarray, shape (effect,)
        In [0, 1]; none leaves them as they are.
    """
    effects = dict(template.effects)
    for gene, (name, key) in zip(genes, strengths_of(template) if len(genes) else (), strict=True):
        low, high = _range(name, key)
        # Rounding can push the end of a range just past the bound.
        value = min(max(float(low + gene * (high - low)), low), high)
        effects[name] = {**effects[name], key: value}
    return dataclasses.replace(template, effects=effects)


def _range(name: str, key: str) -> tuple[float, float]:
    found = find_effect(name).parameter(key)
    return found.low, found.high
