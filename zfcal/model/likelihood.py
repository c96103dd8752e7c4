"""The estimate of a model's parameters from measured steps, and how well it is known.

The law is that of `zfcal.model.fitted`, the climb that of `zfcal.model.extended`, here within what
a genome can hold. The strengths of effects on headings are fitted along; all else of an effect
stays as the model has it. Intervals are by the observed information.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.effects import find_effect
from zfcal.model.effects.genome import spelt_out, strengths_of
from zfcal.model.extended import GENES, bounds_of, maximise
from zfcal.model.fitted import MIN_STEPS, SCALES, ZoneTurns, zone_scores, zone_turns
from zfcal.model.packing import check_model
from zfcal.model.scene import Scene
from zfcal.model.views import View
from zfcal.parameters import Parameters

_NO_INFORMATION = 1e-9
_DIFFERENCE = 1e-4
_QUANTILE = 1.959964

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
        ``alignment.strength``) its 95 % interval from the observed information; the whole range
        where the recording says nothing.
    identified : dict
        Whether the interval is shorter than 70 % of the range. The largest
        gamma of a row fixes the scale and has no interval of its own; a zone
        that no step can reach has the whole range.
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


def fit(scene: Scene, template: Parameters) -> Fit:
    """Return the most likely parameters of a model, and strengths of its effects on headings.

    Parameters
    ----------
    scene
        What was measured.
    template
        Gives all that is not calibrated (the speeds, the step, the field of view), and where the
        climb starts.

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
    interval: dict[str, tuple[float, float]] = {}
    lapse: dict[str, float] = {}
    names = scene.arena.zone_names
    for zone, x, turns in zip(names, found.x, found.turns, strict=True):
        if not turns.enough:
            interval |= _unknown(zone, names)
            continue
        interval |= _intervals(x, _information(x, turns, found.view), zone, names)
        lapse[zone] = float(x[-1])
    spans = {name: _span(name) for name in interval}
    told = (found.effect_scores**2).sum(axis=0) > _NO_INFORMATION
    variances = np.where(told, np.diag(found.covariance), math.inf)
    for (name, key), variance in zip(free, variances, strict=True):
        low, high = bounds_of(name, key)
        half = _QUANTILE * math.sqrt(variance) if variance > 0 else math.inf
        value = found.parameters.effects[name][key]
        spans[f"{name}.{key}"] = high - low
        interval[f"{name}.{key}"] = (max(low, value - half), min(high, value + half))
    n_steps = int(found.used.sum())
    return Fit(
        parameters=found.parameters,
        interval=interval,
        identified={n: high - low < IDENTIFIED * spans[n] for n, (low, high) in interval.items()},
        lapse=lapse,
        nats_per_step=found.nats / n_steps,
        n_steps=n_steps,
    )


def _information(x: Floats, turns: ZoneTurns, view: View) -> Floats:
    """Return the observed information, by differences of the exact slope."""
    matrix = np.empty((x.size, x.size))
    for p in range(x.size):
        up, down = x.copy(), x.copy()
        up[p] += _DIFFERENCE
        down[p] -= _DIFFERENCE
        if p < 3 or p == x.size - 1:
            # At a bound of zero the difference is one-sided.
            down[p] = max(down[p], 1e-9)
        slopes = (zone_scores(at, turns, view)[1].sum(axis=0) for at in (down, up))
        before, after = slopes
        matrix[p] = (before - after) / (up[p] - down[p])
    return (matrix + matrix.T) / 2


_OWN = ("kappa_0", "kappa_f", "alpha")


def _span(name: str) -> float:
    return float(SCALES[_OWN.index(name.rsplit(".", 1)[1])]) if "gamma" not in name else 1.0


def _unknown(zone: str, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    own = {f"{zone}.{key}": (0.0, float(SCALES[k])) for k, key in enumerate(_OWN)}
    return own | {f"{zone}.gamma.{to}": (0.0, 1.0) for to in names}


def _intervals(
    x: Floats, information: Floats, zone: str, names: tuple[str, ...]
) -> dict[str, tuple[float, float]]:
    """Return 95 % intervals; the scale of gamma is fixed by its largest value."""
    n = x.size
    told = np.diag(information)[3:-1] > _NO_INFORMATION
    top = 3 + int(np.argmax(np.where(told, x[3:-1], -np.inf)))
    free = [p for p in range(n) if p != top and information[p, p] > _NO_INFORMATION]
    error = np.full(n, np.inf)
    error[free] = np.sqrt(
        np.clip(np.diag(np.linalg.pinv(information[np.ix_(free, free)])), 0, None)
    )
    error[top] = 0.0
    half = _QUANTILE * error
    found = _unknown(zone, names)
    for k, key in enumerate(_OWN):
        low, high = (x[k] - half[k]) * SCALES[k], (x[k] + half[k]) * SCALES[k]
        found[f"{zone}.{key}"] = (max(0.0, float(low)), min(float(SCALES[k]), float(high)))
    for e, to in enumerate(names):
        with np.errstate(over="ignore"):
            low, high = np.exp(x[3 + e] - half[3 + e]), np.exp(x[3 + e] + half[3 + e])
        found[f"{zone}.gamma.{to}"] = (float(low), min(1.0, float(high)))
    return found
