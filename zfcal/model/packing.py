"""Models and genes into the kernels' arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.effects import MAX_PARAMETERS, NEIGHBOURS, Effect, find_effect
from zfcal.model.effects.genome import genome_length, with_strengths
from zfcal.model.kernels.curves import CURVE_COLUMNS, LEVELS, has_curve, knots_of, strengths_at
from zfcal.model.kernels.staircase import COLUMNS, ROWS, SCALE_AT, TAKE, build
from zfcal.model.kernels.state import (
    KAPPA_BASE,
    KAPPA_F,
    LAG_MAX,
    LATE_COLUMNS,
    LATE_FELT_M,
    LATE_NEAR,
    LATE_PART,
    LATE_SHARE,
    LATE_THEN,
    LATE_WHOLE,
    LAW_BASE,
    LAW_F,
    LAWS,
    ZONE_COLUMNS,
    Packed,
)
from zfcal.parameters import SPEED_BINS, Parameters, ZoneParameters, gene_scales, n_genes

_WHOLE = 1e-6
"""Steps by which a delay may miss a whole number of them."""


def check_model(parameters: Parameters, arena: Arena) -> None:
    """Raise an `InputError` unless the model's zones are the arena's, in order, and gamma whole."""
    if parameters.zone_names != arena.zone_names:
        raise InputError(
            f"The model has zones {list(parameters.zone_names)}, arena {arena.name!r} has "
            f"{list(arena.zone_names)}.",
            hint="A model is calibrated for one arena; calibrate it again for another one.",
        )
    for zone in parameters.zones:
        if set(zone.gamma) != set(arena.zone_names):
            raise InputError(
                f"Zone {zone.name!r}: gamma names {sorted(zone.gamma)}, expected one value for "
                f"each of {list(arena.zone_names)}."
            )


def pack(models: Sequence[Parameters], arena: Arena) -> Packed:
    """Return models in the kernels' arrays.

    Parameters
    ----------
    models
        With one step, one set of effects, and the arena's zones in its order.

    Raises
    ------
    InputError
        Zones, steps or effects do not fit together.
    """
    if not models:
        raise InputError("There is no model to pack; expected at least one.")
    first = models[0]
    for parameters in models:
        check_model(parameters, arena)
        if parameters.dt_s != first.dt_s or list(parameters.effects) != list(first.effects):
            raise InputError("Models of one population need the same dt_s and the same effects.")
    own = np.array([[(zone.kappa_0, zone.kappa_f, zone.alpha) for zone in p.zones] for p in models])
    gamma = np.array([p.gamma_matrix() for p in models])
    return _packed(own, gamma, models, arena)


def pack_genes(genes: ArrayLike, template: Parameters, arena: Arena) -> Packed:
    """Return a population of genomes in the kernels' arrays.

    Parameters
    ----------
    genes : array_like, shape (model, gene)
        In [0, 1], in the order of `zfcal.model.effects.genome.genome_names`; those of the base
        alone leave the strengths of effects as the template has them.
    template
        Gives all that is not calibrated.

    Raises
    ------
    InputError
        The template is not for the arena, or the genes are none: a NaN would
        keep the sampler waiting for ever.
    """
    check_model(template, arena)
    n_zones = len(template.zones)
    table, base = np.asarray(genes, dtype=np.float64), n_genes(n_zones)
    known = table.shape[1:] in {(base,), (genome_length(template),)}
    if not known or not ((table >= 0) & (table <= 1)).all():
        effects = f" and {len(template.effects)} of effects" if template.effects else ""
        raise InputError(
            f"Genomes of {n_zones} zones need {base} genes{effects} in [0, 1], got an array "
            f"of shape {table.shape} from {np.min(table, initial=1):g} to "
            f"{np.max(table, initial=0):g}."
        )
    values = table[:, :base] * gene_scales(n_zones)
    own = values[:, : 3 * n_zones].reshape(-1, n_zones, 3)
    gamma = values[:, 3 * n_zones :].reshape(-1, n_zones, n_zones)
    moved = table.shape[1] > base
    models = [with_strengths(template, row[base:]) for row in table] if moved else [template]
    return _packed(own, gamma, models, arena)


def _packed(own: Floats, gamma: Floats, models: Sequence[Parameters], arena: Arena) -> Packed:
    """Pack; ``models`` holds one for each row, or one for all."""
    n_models, n_zones = own.shape[:2]
    zones = np.zeros((n_models, n_zones + 1, ZONE_COLUMNS))
    kappa_base = _base_kappa(own[:, :, 0], models, arena)
    zones[:, 1:] = np.stack([kappa_base, own[:, :, 1], own[:, :, 2]], axis=-1)
    turns = np.zeros((*zones.shape[:2], LAWS, ROWS, COLUMNS))
    build(zones[:, :, [KAPPA_BASE, KAPPA_F]].ravel(), turns.reshape(-1, ROWS, COLUMNS))
    turns[:, :, [LAW_BASE, LAW_F], TAKE, SCALE_AT] = 1.0 / (
        2.0 * math.pi * i0e(zones[:, :, [KAPPA_BASE, KAPPA_F]])
    )
    attraction = np.zeros((n_models, n_zones + 1, n_zones + 1))
    top = gamma.max(axis=2, keepdims=True)
    # A row of zeros asks for nothing: without a preference all zones are alike.
    attraction[:, 1:, 1:] = np.divide(gamma, top, out=np.ones_like(gamma), where=top > 0)
    tables = [[_alias(zone) for zone in parameters.zones] for parameters in models]
    take = np.ones((n_models, n_zones + 1, SPEED_BINS))
    other = np.zeros((n_models, n_zones + 1, SPEED_BINS), dtype=np.int64)
    take[:, 1:] = [[table[0] for table in row] for row in tables]
    other[:, 1:] = [[table[1] for table in row] for row in tables]
    effects = [find_effect(name) for name in models[0].effects]
    fov = np.array([parameters.fov_rad for parameters in models])
    # At pi everything is seen, whatever the rounding of the cosine.
    cos_fov = np.where(fov >= math.pi, -2.0, np.cos(fov))
    rows, curves = _effect_parameters(effects, models, n_models)
    return Packed(
        zones=zones,
        turns=turns,
        gamma=attraction,
        speed_take=take,
        speed_other=other,
        # A copy: a read-only array is another type, for which all would be compiled again.
        cos_fov=np.broadcast_to(cos_fov, (n_models,)).copy(),
        dt_s=float(models[0].dt_s),
        lags=_lags(effects, models, n_models),
        lates=_lates(effects, models, n_models),
        clock_s=np.array([0.0, 1.0]),
        components=_with_each(_hooks(effects, "component", models), effects, models),
        factors=_hooks(effects, "factor", models),
        speeds=_hooks(effects, "speed", models),
        sights=_hooks(effects, "sight", models),
        rotations=_hooks(effects, "rotation", models),
        whole_rotations=_hooks(effects, "whole_rotation", models),
        effects=rows,
        curves=curves,
    )


def _base_kappa(kappa_0: Floats, models: Sequence[Parameters], arena: Arena) -> Floats:
    base = kappa_0.copy()
    for z, zone in enumerate(arena.zones):
        if zone.follows_walls:
            given = [parameters.zones[z].kappa_w for parameters in models]
            base[:, z] = [
                kappa_0[m, z] if given[m % len(given)] is None else given[m % len(given)]
                for m in range(len(base))
            ]
    return base


def _alias(zone: ZoneParameters) -> tuple[Floats, NDArray[np.int64]]:
    """Return Walker's alias table of a zone's speed histogram.

    Source: Walker 1977, ACM Transactions on Mathematical Software 3(3), with
    the pairing of Vose 1991, IEEE Transactions on Software Engineering 17(9).
    """
    share = np.array(zone.speed_frequency) / sum(zone.speed_frequency) * SPEED_BINS
    take, other = np.ones(SPEED_BINS), np.arange(SPEED_BINS)
    small = [k for k in range(SPEED_BINS) if share[k] < 1]
    large = [k for k in range(SPEED_BINS) if share[k] >= 1]
    while small and large:
        poor, rich = small.pop(), large.pop()
        take[poor], other[poor] = share[poor], rich
        share[rich] -= 1 - share[poor]
        (small if share[rich] < 1 else large).append(rich)
    return take, other


def _hooks(effects: Sequence[Effect], kind: str, models: Sequence[Parameters]) -> NDArray[np.int64]:
    """Return addresses of the functions of a kind that have anything to do in any model."""
    rows = [
        (getattr(effect, kind).address, row)
        for row, effect in enumerate(effects)
        if any(effect.calls(kind, model.effects[effect.name]) for model in models)
    ]
    return np.array(rows, dtype=np.int64).reshape(-1, 2)


def _with_each(
    components: NDArray[np.int64], effects: Sequence[Effect], models: Sequence[Parameters]
) -> NDArray[np.int64]:
    """Return the calls of components with those for each neighbour, on parameters of their own."""
    rows = [
        (effects[row].component.address, len(effects) + NEIGHBOURS * number + rank)
        for number, row in enumerate(_of_each(effects, models))
        for rank in range(NEIGHBOURS)
    ]
    return np.concatenate([components, np.array(rows, dtype=np.int64).reshape(-1, 2)])


def _of_each(effects: Sequence[Effect], models: Sequence[Parameters]) -> list[int]:
    """Return which effects have a component for each neighbour in any model."""
    return [
        row
        for row, effect in enumerate(effects)
        if effect.each
        and any(
            effect.spelt_out(model.effects[effect.name])[effect.each] != 0.0 for model in models
        )
    ]


def _lags(
    effects: Sequence[Effect], models: Sequence[Parameters], n_models: int
) -> NDArray[np.int64]:
    """Return by how many steps each model responds late, the begun one counted."""
    lags = np.zeros(n_models, dtype=np.int64)
    for effect in effects:
        if effect.lag is None:
            continue
        for model in range(n_models):
            given = models[model % len(models)]
            values = effect.spelt_out(given.effects[effect.name])
            lags[model] = max(lags[model], math.ceil(_steps_late(values[effect.lag], given.dt_s)))
    return lags


def _steps_late(delay_s: float, dt_s: float) -> float:
    """Return a delay in steps; whole where it is that but for rounding."""
    steps = min(float(LAG_MAX), delay_s / dt_s)
    return float(round(steps)) if abs(steps - round(steps)) < _WHOLE else steps


def _lates(effects: Sequence[Effect], models: Sequence[Parameters], n_models: int) -> Floats:
    """Return what each model sees late: see `zfcal.model.kernels.state.LATE_SHARE`."""
    made = np.ones((n_models, LATE_COLUMNS))
    made[:, [LATE_FELT_M, LATE_THEN, LATE_NEAR]] = 0.0
    for effect in effects:
        for model in range(n_models if effect.lag is not None else 0):
            given = models[model % len(models)]
            values = effect.spelt_out(given.effects[effect.name])
            steps = _steps_late(values[effect.lag], given.dt_s) if effect.lag else 0.0
            made[model, LATE_SHARE] = values[effect.strength]
            made[model, LATE_FELT_M] = values["felt_m"]
            made[model, LATE_WHOLE] = values["whole"]
            made[model, LATE_THEN] = values["then"]
            made[model, LATE_NEAR] = values["near"]
            made[model, LATE_PART] = steps - math.ceil(steps) + 1.0
    return made


def _effect_parameters(
    effects: Sequence[Effect], models: Sequence[Parameters], n_models: int
) -> tuple[Floats, Floats]:
    """Return the parameters of effects, and the curves that their strengths follow."""
    packed = np.zeros((n_models, len(effects), MAX_PARAMETERS))
    for row, effect in enumerate(effects):
        for model in range(n_models):
            given = models[model % len(models)].effects[effect.name]
            packed[model, row, : len(effect.parameters)] = effect.values(given)
    each = _of_each(effects, models)
    ranked = [
        np.where(np.arange(MAX_PARAMETERS) == MAX_PARAMETERS - 1, rank, packed[:, row])
        for row in each
        for rank in range(1, NEIGHBOURS + 1)
    ]
    rows = [*range(len(effects)), *(row for row in each for _ in range(NEIGHBOURS))]
    whole = np.concatenate([packed, np.stack(ranked, axis=1)], axis=1) if ranked else packed
    return _with_levels(whole, [effects[row] for row in rows], models)


def _with_levels(
    packed: Floats, effects: Sequence[Effect], models: Sequence[Parameters]
) -> tuple[Floats, Floats]:
    """Return rows of parameters with those of levels after them, and the curves.

    Parameters
    ----------
    packed : ndarray, shape (model, row, 8)
    effects
        Of each row.
    """
    n_models, n_rows = packed.shape[:2]
    given = [[model.effects[effect.name] for effect in effects] for model in models]
    curved = [row for row in range(n_rows) if any(has_curve(own[row]) for own in given)]
    if not curved:
        return packed, np.zeros((n_models, 0, CURVE_COLUMNS))
    curves = np.zeros((n_models, n_rows, CURVE_COLUMNS))
    levels = np.repeat(packed[:, curved], LEVELS, axis=1)
    for number, row in enumerate(curved):
        strength = effects[row].parameter(effects[row].strength)
        at, ends = effects[row].names.index(strength.name), (strength.low, strength.high)
        for model in range(n_models):
            own = given[model % len(given)][row]
            if has_curve(own):
                first = number * LEVELS
                curves[model, row] = (own["by"], n_rows + first, *knots_of(own))
                value = own.get(strength.name, strength.default)
                levels[model, first : first + LEVELS, at] = strengths_at(own, value, ends)
    return np.concatenate([packed, levels], axis=1), curves
