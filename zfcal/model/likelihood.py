"""Maximum likelihood of the model's parameters from measured steps.

The density of a heading, given where everybody was and the speed of the step,
is explicit, so no simulation is needed. The parameters of a zone bear on the
steps that start in it and on no others: each zone is a small problem of its own.

``log p = log(b + alpha f) - log sum_e (gamma_e / gamma_landing) (B_e + alpha F_e)``

with b and f the base's and the neighbours' density at the heading taken (f
weighted by solid angle) and B_e, F_e their integrals over headings that land in
zone e. With a lapse, a heading is drawn from the uniform law with a small
probability, so that a tracking error does not weigh ten nats.
"""

from __future__ import annotations

import dataclasses
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize
from scipy.special import i0e, i1e

from zfcal.arena import Arena
from zfcal.errors import InputError
from zfcal.model.kernels.likelihood import BASE, BASE_SLOPE, SOCIAL, SOCIAL_SLOPE, SUMS, sums
from zfcal.model.packing import check_model
from zfcal.model.steps import Steps
from zfcal.parameters import ALPHA_MAX, KAPPA_0_MAX, KAPPA_F_MAX, Parameters, ZoneParameters

Floats = NDArray[np.float64]

_SCALES = np.array([KAPPA_0_MAX, KAPPA_F_MAX, ALPHA_MAX])
_LEAST_GENE = 1e-3
_LOG_GAMMA_SPAN = 7.0
"""An attraction below e^-7 of the largest one is not told from zero."""

_LAPSE = 0.01
_NO_INFORMATION = 1e-9
MIN_STEPS = 30
"""With fewer steps in a zone nothing is estimated there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """The estimate and how well it is known.

    Parameters
    ----------
    parameters
        The most likely ones; a zone with fewer than 30 steps keeps the template's.
    interval : dict
        For each parameter (``walls.kappa_0``, ``walls.gamma.centre``) its 95 %
        interval from the observed information; the whole range where the
        recording says nothing.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _ZoneSteps:
    """The steps that start in one zone, as the kernel wants them."""

    base: Floats
    toward: Floats
    angle_sr: Floats
    taken: Floats
    share: NDArray[np.uint8]
    landing: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.taken)


def _zone_steps(steps: Steps, zone_id: int, *, follows_walls: bool) -> _ZoneSteps:
    chosen = steps.take(steps.zone == zone_id)
    along = chosen.along_wall if follows_walls else chosen.heading
    modes = [along, -along] if follows_walls else [along]
    # What nobody sees is left out of the arrays: the loops are over neighbours.
    order = np.argsort(chosen.angle_sr == 0, axis=1, kind="stable")
    most = int((chosen.angle_sr > 0).sum(axis=1).max(initial=0))
    order = order[:, :most]
    return _ZoneSteps(
        base=np.ascontiguousarray(np.stack(modes, axis=1)),
        toward=np.ascontiguousarray(np.take_along_axis(chosen.toward, order[..., None], axis=1)),
        angle_sr=np.ascontiguousarray(np.take_along_axis(chosen.angle_sr, order, axis=1)),
        taken=chosen.taken,
        share=chosen.share,
        landing=chosen.landing,
    )


def log_density(
    zone_steps: _ZoneSteps, kappa: tuple[float, float], alpha: float, log_gamma: Floats
) -> tuple[Floats, Floats]:
    """Return each step's log density per radian, and its gradient.

    Parameters
    ----------
    kappa
        kappa of the base and of the neighbours.
    alpha
        Weight of the neighbours, per steradian.
    log_gamma : ndarray, shape (zone,)

    Returns
    -------
    log_p : ndarray, shape (step,)
    gradient : ndarray, shape (step, 3 + zone)
        By kappa of the base, kappa of the neighbours, alpha and log gamma.
    """
    kappa_0, kappa_f = kappa
    at_taken = np.empty((len(zone_steps), SUMS))
    over = np.empty((len(zone_steps), log_gamma.size, SUMS))
    logs = (math.log(2 * math.pi * i0e(kappa_0)), math.log(2 * math.pi * i0e(kappa_f)))
    sums(
        zone_steps.base, zone_steps.toward, zone_steps.angle_sr, zone_steps.taken,
        zone_steps.share, (kappa_0, logs[0], kappa_f, logs[1]), at_taken, over,
    )  # fmt: skip
    # The density's derivative is density times (cos - I1/I0).
    for column, slope, value in ((BASE, BASE_SLOPE, kappa_0), (SOCIAL, SOCIAL_SLOPE, kappa_f)):
        mean_cosine = i1e(value) / i0e(value)
        at_taken[:, slope] -= mean_cosine * at_taken[:, column]
        over[..., slope] -= mean_cosine * over[..., column]
    gamma = np.exp(log_gamma)
    here = at_taken[:, BASE] + alpha * at_taken[:, SOCIAL]
    by_zone = gamma * (over[..., BASE] + alpha * over[..., SOCIAL])
    whole = by_zone.sum(axis=1)
    landing = zone_steps.landing - 1
    log_p = np.log(here) + log_gamma[landing] - np.log(whole)
    gradient = np.empty((len(zone_steps), 3 + log_gamma.size))
    gradient[:, 0] = at_taken[:, BASE_SLOPE] / here - over[..., BASE_SLOPE] @ gamma / whole
    gradient[:, 1] = alpha * (
        at_taken[:, SOCIAL_SLOPE] / here - over[..., SOCIAL_SLOPE] @ gamma / whole
    )
    gradient[:, 2] = at_taken[:, SOCIAL] / here - over[..., SOCIAL] @ gamma / whole
    gradient[:, 3:] = -by_zone / whole[:, None]
    gradient[np.arange(len(landing)), 3 + landing] += 1.0
    return log_p, gradient


def _unpack(x: Floats) -> tuple[tuple[float, float], float, Floats, float]:
    """Return kappas, alpha, log gamma and lapse of an optimiser's point."""
    own = x[:3] * _SCALES
    return (float(own[0]), float(own[1])), float(own[2]), x[3:-1], float(x[-1])


def _objective(x: Floats, zone_steps: _ZoneSteps) -> tuple[float, Floats]:
    """Return minus the log likelihood per step, and its gradient."""
    kappa, alpha, log_gamma, lapse = _unpack(x)
    log_p, slopes = log_density(zone_steps, kappa, alpha, log_gamma)
    density = np.exp(log_p)
    uniform = 1 / (2 * math.pi)
    mixed = (1 - lapse) * density + lapse * uniform
    weight = (1 - lapse) * density / mixed
    gradient = np.empty(x.size)
    gradient[:3] = (weight @ slopes[:, :3]) * _SCALES
    gradient[3:-1] = weight @ slopes[:, 3:]
    gradient[-1] = ((uniform - density) / mixed).sum()
    n = len(zone_steps)
    return -float(np.log(mixed).sum()) / n, -gradient / n


def _fit_zone(zone_steps: _ZoneSteps) -> tuple[Floats, Floats] | None:
    """Return the most likely point of a zone and its observed information; None with few steps."""
    if len(zone_steps) < MIN_STEPS:
        return None
    reachable = np.asarray(zone_steps.share.any(axis=(0, 1)))
    limits = [(0.0, 1.0)] * 3
    limits[0] = limits[1] = (_LEAST_GENE, 1.0)
    limits += [(-_LOG_GAMMA_SPAN, 0.0) if open_ else (0.0, 0.0) for open_ in reachable]
    limits += [(1e-6, 0.2)]
    start = np.concatenate([[0.3, 0.4, 0.4], np.where(reachable, -0.5, 0.0), [_LAPSE]])
    found = optimize.minimize(
        _objective, start, args=(zone_steps,), jac=True, method="L-BFGS-B", bounds=limits,
        options={"maxiter": 200, "ftol": 1e-10, "gtol": 1e-7},
    )  # fmt: skip
    x = np.asarray(found.x)
    x[3:-1][reachable] -= x[3:-1][reachable].max()
    return x, _information(x, zone_steps)


def _information(x: Floats, zone_steps: _ZoneSteps) -> Floats:
    """Return the observed information, by differences of the exact gradient."""
    step = 1e-4
    matrix = np.empty((x.size, x.size))
    for p in range(x.size):
        up, down = x.copy(), x.copy()
        up[p] += step
        # At a bound of zero the difference is one-sided.
        down[p] = max(down[p] - step, 1e-9) if p < 3 or p == x.size - 1 else down[p] - step
        slope = _objective(up, zone_steps)[1] - _objective(down, zone_steps)[1]
        matrix[p] = slope / (up[p] - down[p])
    return (matrix + matrix.T) / 2 * len(zone_steps)


def fit(steps: Steps, arena: Arena, template: Parameters) -> Fit:
    """Return the most likely parameters of the base model.

    Parameters
    ----------
    steps
        From `zfcal.model.steps.steps_of`, with the template's field of view.
    template
        Gives all that is not calibrated: the speeds, the step, the field of view.

    Raises
    ------
    InputError
        No zone has 30 usable steps.
    """
    check_model(template, arena)
    zones, total, used = list(template.zones), 0.0, 0
    interval: dict[str, tuple[float, float]] = {}
    lapse: dict[str, float] = {}
    parts = [
        _zone_steps(steps, z, follows_walls=zone.follows_walls)
        for z, zone in enumerate(arena.zones, start=1)
    ]
    # The kernel lets go of the interpreter, so zones are fitted side by side.
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        fits = list(pool.map(_fit_zone, parts))
    for z, (zone, zone_steps, fitted) in enumerate(zip(arena.zones, parts, fits, strict=True)):
        if fitted is None:
            interval |= _unknown(zone.name, arena.zone_names)
            continue
        x, information = fitted
        zones[z] = _zone_parameters(x, zones[z], arena.zone_names)
        interval |= _intervals(x, information, zone.name, arena.zone_names)
        lapse[zone.name] = float(x[-1])
        total -= _objective(x, zone_steps)[0] * len(zone_steps)
        used += len(zone_steps)
    if used == 0:
        raise InputError(
            f"No zone has {MIN_STEPS} steps with a heading; {len(steps)} steps in all.",
            hint="A likelihood needs agents that move and keep their track for three samples.",
        )
    spans = {name: _span(name) for name in interval}
    return Fit(
        parameters=dataclasses.replace(template, zones=tuple(zones)),
        interval=interval,
        identified={n: high - low < 0.7 * spans[n] for n, (low, high) in interval.items()},
        lapse=lapse,
        nats_per_step=total / used,
        n_steps=used,
    )


def _zone_parameters(x: Floats, zone: ZoneParameters, names: tuple[str, ...]) -> ZoneParameters:
    (kappa_0, kappa_f), alpha, log_gamma, _ = _unpack(x)
    gamma = np.exp(np.minimum(log_gamma, 0.0))
    return dataclasses.replace(
        zone,
        kappa_0=kappa_0,
        kappa_f=kappa_f,
        alpha=alpha,
        gamma=dict(zip(names, map(float, gamma), strict=True)),
    )


_OWN = ("kappa_0", "kappa_f", "alpha")


def _span(name: str) -> float:
    return float(_SCALES[_OWN.index(name.rsplit(".", 1)[1])]) if "gamma" not in name else 1.0


def _unknown(zone: str, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    own = {f"{zone}.{key}": (0.0, float(_SCALES[k])) for k, key in enumerate(_OWN)}
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
    half = 1.959964 * error
    found = _unknown(zone, names)
    for k, key in enumerate(_OWN):
        low, high = (x[k] - half[k]) * _SCALES[k], (x[k] + half[k]) * _SCALES[k]
        found[f"{zone}.{key}"] = (max(0.0, float(low)), min(float(_SCALES[k]), float(high)))
    for e, to in enumerate(names):
        with np.errstate(over="ignore"):
            low, high = np.exp(x[3 + e] - half[3 + e]), np.exp(x[3 + e] + half[3 + e])
        found[f"{zone}.gamma.{to}"] = (float(low), min(1.0, float(high)))
    return found
