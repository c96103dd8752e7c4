"""A fitted model: the density of each heading, zone by zone, and its derivatives.

The density of a heading, given where everybody was and the speed of the step, is explicit, so
no simulation is needed. The parameters of a zone bear on the steps that start in it and on no
others: each zone is a small problem of its own.

``log p = log(b + alpha f) - log sum_e (gamma_e / gamma_landing) (B_e + alpha F_e)``

with b and f the base's and the neighbours' density at the heading taken (f weighted by solid
angle) and B_e, F_e their integrals over headings that land in zone e; components, factors and
changes of perception of a model's effects come in beside them. With a lapse, a heading is drawn
from the uniform law with a small probability, so that a tracking error does not weigh ten nats.

How the maximum is found stands in `zfcal.model.extended`.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0e, i1e

from zfcal.arrays import Floats
from zfcal.model.blocks import in_blocks
from zfcal.model.kernels.extended import (
    BASE,
    BASE_SLOPE,
    COLUMNS,
    EXTRA,
    SOCIAL,
    SOCIAL_SLOPE,
    cell_table,
    extended_density,
    extended_sums,
)
from zfcal.model.kernels.landing import ANGLES
from zfcal.model.scene import Scene
from zfcal.model.views import View
from zfcal.parameters import ALPHA_MAX, KAPPA_0_MAX, KAPPA_F_MAX, Parameters

Rows = NDArray[np.intp]

Free = tuple[tuple[str, str], ...]
"""Parameters of effects that are fitted: name of the effect, name of the parameter."""

SCALES = np.array([KAPPA_0_MAX, KAPPA_F_MAX, ALPHA_MAX])
"""Units of kappa of the base, kappa of the neighbours, and alpha in a fit."""

_UNIFORM = 1 / (2 * math.pi)

MIN_STEPS = 30
"""With fewer steps in a zone nothing is estimated there."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ZoneTurns:
    """The turns that start in one zone.

    Parameters
    ----------
    rows : ndarray of int, shape (step,)
        Their places among the scene's turns.
    base : ndarray, shape (step, mode, 2)
        Modes of the base law.
    taken, share, landing
        As in `zfcal.model.scene.Turns`.
    """

    rows: Rows
    base: Floats
    taken: Floats
    share: NDArray[np.uint8]
    landing: NDArray[np.int64]

    def base_of(self, view: View) -> Floats:
        """Return the modes of the base law as a view's effects turn them."""
        if not len(view.spin):
            return self.base
        c, s = view.spin[self.rows, 0, None], view.spin[self.rows, 1, None]
        x, y = self.base[..., 0], self.base[..., 1]
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)

    @property
    def enough(self) -> bool:
        """Whether there are enough of them to fit anything to."""
        return len(self.rows) >= MIN_STEPS

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Zones in which a heading lands, shape (zone,)."""
        # Over both axes at once numpy takes twenty times as long.
        return np.asarray(self.share.any(axis=0).any(axis=0))


def zone_turns(scene: Scene) -> tuple[ZoneTurns, ...]:
    """Return the turns of each zone of the arena, in its order."""
    made = []
    for number, zone in enumerate(scene.arena.zones, start=1):
        rows = np.flatnonzero(scene.turns.zone == number)
        chosen = scene.turns.take(rows)
        along = chosen.along_wall if zone.follows_walls else chosen.heading
        modes = [along, -along] if zone.follows_walls else [along]
        made.append(
            ZoneTurns(
                rows=rows,
                base=np.ascontiguousarray(np.stack(modes, axis=1)),
                taken=chosen.taken,
                share=chosen.share,
                landing=chosen.landing,
            )
        )
    return tuple(made)


def constants(kappas: Floats) -> tuple[float, float]:
    """Return one over ``2 pi I0(kappa) exp(-kappa)`` of both laws."""
    first, second = (float(1 / (2 * math.pi * i0e(kappa))) for kappa in kappas)
    return first, second


def zone_scores(
    x: Floats, turns: ZoneTurns, view: View, *, n_workers: int = 1
) -> tuple[Floats, Floats, Floats]:
    """Return log densities of a zone's turns and their scores.

    Parameters
    ----------
    x : ndarray, shape (4 + zone,)
        kappa of the base, kappa of the neighbours and alpha in units of `SCALES`, log
        gamma of each zone, and the lapse.
    view
        Of all turns of the scene.
    n_workers
        Threads; the numbers do not depend on them.

    Returns
    -------
    log_p : ndarray, shape (step,)
        Per radian, the lapse included.
    scores : ndarray, shape (step, 4 + zone)
        Their derivatives by ``x``.
    weight : ndarray, shape (step,)
        Probability that a turn was no lapse.
    """
    own = x[:3] * SCALES
    n, n_zones = len(turns.rows), turns.share.shape[2]
    at_taken, over = np.empty((n, COLUMNS)), np.empty((n, n_zones, COLUMNS))
    base, scales = turns.base_of(view), constants(own[:2])

    def ask(block: slice) -> None:
        rows = turns.rows[block]
        extended_sums(
            base[block], view.toward[rows], view.angle_sr[rows], turns.taken[block],
            turns.share[block], view.parts[rows], view.tilt[rows] if len(view.tilt) else view.tilt,
            (own[0], own[1]), scales, at_taken[block], over[block],
        )  # fmt: skip

    in_blocks(n, n_workers, ask)
    for column, slope, value in ((BASE, BASE_SLOPE, own[0]), (SOCIAL, SOCIAL_SLOPE, own[1])):
        mean_cosine = i1e(value) / i0e(value)
        at_taken[:, slope] -= mean_cosine * at_taken[:, column]
        over[..., slope] -= mean_cosine * over[..., column]
    gamma = np.exp(x[3:-1])
    here = at_taken[:, BASE] + own[2] * at_taken[:, SOCIAL] + at_taken[:, EXTRA]
    by_zone = gamma * (over[..., BASE] + own[2] * over[..., SOCIAL] + over[..., EXTRA])
    whole = by_zone.sum(axis=1)
    landing = turns.landing - 1
    log_p = np.log(here) + x[3:-1][landing] - np.log(whole)
    if len(view.tilt):
        log_p += np.log(np.maximum(view.tilt_taken[turns.rows], 1e-300))
    scores = np.empty((n, x.size))
    for p, (slope, times) in enumerate(((BASE_SLOPE, 1.0), (SOCIAL_SLOPE, own[2]), (SOCIAL, 1.0))):
        change = at_taken[:, slope] / here - over[..., slope] @ gamma / whole
        scores[:, p] = times * change * SCALES[p]
    scores[:, 3:-1] = -by_zone / whole[:, None]
    scores[np.arange(n), 3 + landing] += 1.0
    return _with_lapse(log_p, scores, float(x[-1]))


def zone_log_p(x: Floats, turns: ZoneTurns, view: View, *, n_workers: int = 1) -> Floats:
    """Return the first that `zone_scores` does, in less than half of the time."""
    own, gamma = x[:3] * SCALES, np.exp(x[3:-1])
    n, base = len(turns.rows), turns.base_of(view)
    here, whole = np.empty(n), np.empty(n)
    first, second = constants(own[:2])

    def ask(block: slice) -> None:
        rows = turns.rows[block]
        extended_density(
            base[block], view.toward[rows], view.angle_sr[rows], turns.taken[block],
            turns.share[block], view.parts[rows], view.tilt[rows] if len(view.tilt) else view.tilt,
            (own[0], own[1]), (first, own[2] * second), gamma, here[block], whole[block],
        )  # fmt: skip

    in_blocks(n, n_workers, ask)
    density = gamma[turns.landing - 1] * here / whole
    if len(view.tilt):
        density *= np.maximum(view.tilt_taken[turns.rows], 1e-300)
    return np.asarray(np.log((1 - x[-1]) * density + x[-1] * _UNIFORM))


def _with_lapse(log_p: Floats, scores: Floats, lapse: float) -> tuple[Floats, Floats, Floats]:
    density = np.exp(log_p)
    mixed = (1 - lapse) * density + lapse * _UNIFORM
    weight = (1 - lapse) * density / mixed
    scores[:, :-1] *= weight[:, None]
    scores[:, -1] = (_UNIFORM - density) / mixed
    return np.log(mixed), scores, weight


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """A model at its maximum likelihood on the turns of a scene.

    Parameters
    ----------
    parameters
        With its effects.
    x : tuple of ndarray
        Per zone, as `zone_scores` takes it; a zone with few turns is left as it was.
    turns
        Per zone.
    view
        What the model says of all turns.
    log_p : ndarray, shape (turn,)
        Log density per radian of each heading taken; NaN in zones that were not fitted.
    weight : ndarray, shape (turn,)
        Probability that it was no lapse.
    scores : tuple of ndarray, shape (turn of the zone, parameter)
        Derivatives by the zone's own parameters.
    effect_scores : ndarray, shape (turn, free)
        Derivatives by the effects' parameters that were fitted.
    free
        Which these are.
    covariance : ndarray, shape (free, free)
        Of the effects' parameters, the base's fitted along.
    """

    parameters: Parameters
    x: tuple[Floats, ...]
    turns: tuple[ZoneTurns, ...]
    view: View
    log_p: Floats
    weight: Floats
    scores: tuple[Floats, ...]
    effect_scores: Floats
    free: Free = ()
    covariance: Floats = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def nats(self) -> float:
        """Log likelihood of all turns that were used."""
        return float(np.nansum(self.log_p))

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Turns in zones that were fitted, shape (turn,)."""
        return ~np.isnan(self.log_p)

    def tables(self) -> tuple[Floats, Floats, Floats]:
        """Return the mixture and the probability of each cell, and the mixture at the heading.

        Returns
        -------
        mixture, probability : ndarray, shape (turn, cell)
        mixture_taken : ndarray, shape (turn,)
        """
        n = len(self.log_p)
        mixture, probability = np.zeros((n, ANGLES)), np.zeros((n, ANGLES))
        taken = np.ones(n)
        view = self.view
        for x, turns in zip(self.x, self.turns, strict=True):
            rows, own = turns.rows, x[:3] * SCALES
            if not len(rows):
                continue
            size = (len(rows), ANGLES)
            some, share = np.empty(size), np.empty(size)
            tilt = view.tilt[rows] if len(view.tilt) else view.tilt
            here = np.empty(len(rows))
            cell_table(
                turns.base_of(view), view.toward[rows], view.angle_sr[rows], turns.taken,
                turns.share, view.parts[rows], tilt, (own[0], own[1]), constants(own[:2]), own[2],
                np.exp(x[3:-1]), some, share, here,
            )  # fmt: skip
            mixture[rows], probability[rows], taken[rows] = some, share, here
        return mixture, probability, taken
