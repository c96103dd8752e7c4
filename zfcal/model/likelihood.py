"""The estimate of a model's parameters from measured steps, and how well it is known.

The law is that of `zfcal.model.fitted`, the climb that of `zfcal.model.extended`, here within what
a genome can hold. The strengths of effects on headings are fitted along; all else of an effect
stays as the model has it. Intervals are by profile likelihood, those of effects by the information.
"""

from __future__ import annotations

import itertools
import math
import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from zfcal.errors import InputError
from zfcal.model.effects import find_effect
from zfcal.model.effects.genome import spelt_out, strengths_of
from zfcal.model.extended import GENES, LOG_GAMMA_SPAN, bounds_of, limits_of, maximise
from zfcal.model.fitted import MIN_STEPS, SCALES, Fitted, zone_turns
from zfcal.model.packing import check_model
from zfcal.model.profiles import Profile, profile_about
from zfcal.model.reach import within_reach
from zfcal.model.scene import Scene
from zfcal.parameters import Parameters

LEVEL = 0.95
"""Of intervals that are reported."""

IDENTIFIED = 0.7
"""Of a parameter's range: an interval that is no shorter says nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The estimate and how well it is known.

    Parameters
    ----------
    parameters
        The most likely ones; a zone with fewer than 30 steps keeps the template's.
    interval : dict
        For each parameter (``walls.kappa_0``, ``walls.gamma.centre``,
        ``alignment.strength``) its 95 % interval; the whole range where the recording says nothing.
        A gamma is one over the largest of those within a step's reach.
    identified : dict
        Whether the interval is shorter than 70 % of the range.
    lapse : dict
        Fitted share of headings drawn from the uniform law, by zone.
    nats_per_step
        Mean log density per radian of the headings taken.
    n_steps
        Steps that were used.
    """

    parameters: Parameters
    interval: dict[str, tuple[float, float]]
    identified: dict[str, bool]
    lapse: dict[str, float]
    nats_per_step: float
    n_steps: int


def fit(scene: Scene, template: Parameters, *, level: float | None = LEVEL) -> Fit:
    """Return the most likely parameters of a model, and strengths of its effects on headings.

    Parameters
    ----------
    scene
        What was measured.
    template
        Gives all that is not calibrated (the speeds, the step, the field of view), and where the
        climb starts.
    level
        Of the intervals, 0.95 for 95 %; None for no intervals, which take longer than the rest.

    Raises
    ------
    InputError
        No zone has 30 usable steps.
    """
    check_model(template, scene.arena)
    if not any(turns.enough for turns in zone_turns(scene)):
        raise InputError(
            f"No zone has {MIN_STEPS} steps with a heading; {len(scene.turns)} steps in all.",
            hint="A likelihood needs agents that move and keep their track for three samples.",
        )
    free = tuple(
        (name, key) for name, key in strengths_of(template) if find_effect(name).on_headings
    )
    model, n_workers = spelt_out(template), os.cpu_count() or 1
    found = maximise(scene, model, free=free, bounds=GENES, n_workers=n_workers)
    interval, spans = ({}, {}) if level is None else _intervals_of(found, scene, level)
    names = scene.arena.zone_names
    fitted = [
        (zone, x[-1]) for zone, x, turns in zip(names, found.x, found.turns, strict=True)
        if turns.enough
    ]  # fmt: skip
    n_steps = int(found.used.sum())
    return Fit(
        parameters=found.parameters,
        interval=interval,
        identified={n: high - low < IDENTIFIED * spans[n] for n, (low, high) in interval.items()},
        lapse={zone: float(lapse) for zone, lapse in fitted},
        nats_per_step=found.nats / n_steps,
        n_steps=n_steps,
    )


def _intervals_of(
    found: Fitted, scene: Scene, level: float
) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """Return the intervals of all parameters, and the lengths of their ranges."""
    depth = float(ndtri(0.5 + level / 2))
    names, reach = scene.arena.zone_names, within_reach(scene.arena, scene.dt_s)
    interval: dict[str, tuple[float, float]] = {}
    for zone, x, turns, near in zip(names, found.x, found.turns, reach, strict=True):
        interval |= _unknown(zone, names)
        if turns.enough:
            limits, n_workers = limits_of(x, turns, GENES), os.cpu_count() or 1
            profile = profile_about(x, turns, found.view, limits, n_workers=n_workers)
            own, gamma = _own_intervals(profile, depth), _gamma_intervals(profile, near, depth)
            interval |= {f"{zone}.{key}": ends for key, ends in zip(_OWN, own, strict=True)}
            interval |= {f"{zone}.gamma.{names[e]}": ends for e, ends in gamma.items()}
    spans = {name: _span(name) for name in interval}
    told = (found.effect_scores**2).sum(axis=0) > _NO_INFORMATION
    variances = np.where(told, np.diag(found.covariance), math.inf)
    for (name, key), variance in zip(found.free, variances, strict=True):
        low, high = bounds_of(name, key)
        half = depth * math.sqrt(variance) if variance > 0 else math.inf
        value = found.parameters.effects[name][key]
        spans[f"{name}.{key}"] = high - low
        interval[f"{name}.{key}"] = (max(low, value - half), min(high, value + half))
    return interval, spans


_NO_INFORMATION = 1e-9

_OWN = ("kappa_0", "kappa_f", "alpha")


def _span(name: str) -> float:
    return float(SCALES[_OWN.index(name.rsplit(".", 1)[1])]) if "gamma" not in name else 1.0


def _unknown(zone: str, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    own = {f"{zone}.{key}": (0.0, float(SCALES[k])) for k, key in enumerate(_OWN)}
    return own | {f"{zone}.gamma.{to}": (0.0, 1.0) for to in names}


def _own_intervals(profile: Profile, depth: float) -> list[tuple[float, float]]:
    made = []
    for p, weights in enumerate(np.eye(len(_OWN), profile.x.size)):
        low, high = profile.interval(weights, depth)
        # The least kappa that is looked for stands for none.
        low = low if low > profile.low[p] else 0.0
        made.append((float(low * SCALES[p]), float(high * SCALES[p])))
    return made


def _gamma_intervals(
    profile: Profile, reach: NDArray[np.bool_], depth: float
) -> dict[int, tuple[float, float]]:
    """Return the intervals of the gammas that the turns tell of, by the zone's place.

    Parameters
    ----------
    profile
        Of the zone.
    reach
        Which zones a step can lead to, shape (zone,). Where the turns do not tell of all of these,
        an unknown one may be the largest of the row.
    depth
        In standard normal units.
    """
    told, weights = profile.told, np.eye(profile.x.size)
    whole_row = not (reach & ~told).any()
    ratios = {e: {e: (0.0, 0.0)} for e in map(int, np.flatnonzero(told))}
    for e, to in itertools.combinations(ratios, 2):
        low, high = profile.interval(weights[3 + e] - weights[3 + to], depth)
        ratios[e][to], ratios[to][e] = (low, high), (-high, -low)
    # Over the largest of its row a gamma is what the least of its ratios is.
    ends = {e: tuple(map(min, zip(*row.values(), strict=True))) for e, row in ratios.items()}
    return {
        e: (math.exp(low) if whole_row and low > -LOG_GAMMA_SPAN else 0.0, math.exp(high))
        for e, (low, high) in ends.items()
    }
