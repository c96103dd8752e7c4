"""The law of each step as features change it: at the heading taken, and its integral.

A mixture's density and its integral over all headings that land inside are linear in what is added
to the mixture. So a feature is two numbers for each step and weight, and all else is algebra.

Where positions are measured with an error the law of a step is averaged over draws of where all
were: the fish before, now and after, the others before and now. What is seen of others changes by
jumps, and the own error is in the heading and in all bearings at once, so that the law at the
measured positions is not the law of what was measured. Each draw is divided by the weight of its
mixture before it is added, as the law is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0e

from zfcal.arrays import Floats
from zfcal.diagnose.features.columns import Columns, both, less
from zfcal.diagnose.features.draws import Draw, Steps, draw_of, drawn, errors_of
from zfcal.diagnose.features.kernels import attractions, bells, bells_on_cells
from zfcal.diagnose.features.lapses import Lapses
from zfcal.diagnose.features.score_kernels import weighed
from zfcal.diagnose.features.waves import concentrated, waves_of
from zfcal.model.directions import turned_by
from zfcal.model.features import MOST_SHARPER, Component, Sharper, Turned
from zfcal.model.fitted import SCALES, Fitted
from zfcal.model.kernels.landing import ANGLES, PER_CELL
from zfcal.model.kernels.rooms import find_rooms, open_zone
from zfcal.model.scene import Scene, Turns

DRAWS = 8

_TURN_RAD = 0.02
"""Half of the angle between the two laws whose difference stands for the derivative."""

SHARPER = (-MOST_SHARPER, MOST_SHARPER)
"""Bounds of what is added to a concentration, in tenths of it."""

_WEIGHT = (-0.98, 6.0)
"""Bounds of what is added to the weight of the model's components, as a share of it."""

_MORE = 1.1
"""By this factor a concentration is changed for the law's derivative."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Law:
    """The fitted law of the steps of a scene.

    Parameters
    ----------
    scene, fitted
        The recording, and the model at its maximum likelihood there.
    noise_m
        Standard deviation of a position per coordinate; 0 for positions that are exact.
    seed
        Of the draws.
    n_draws
        Of where all were; where positions are exact they are the only one.
    every
        One of so many steps counts.
    bent
        Log of a further factor on the density of each cell, (step, cell), and at headings taken.
    leaving
        Zones, and the log of a factor on landing there, shape (step,), likewise.
    """

    scene: Scene
    fitted: Fitted
    noise_m: float = 0.0
    seed: int = 0
    n_draws: int = DRAWS
    every: int = 1
    bent: Columns | None = None
    leaving: tuple[tuple[int, Floats], ...] = ()

    def absorbing(
        self, bent: Columns | None = None, leaving: tuple[int, Floats] | None = None
    ) -> Law:
        """Return the law with a further factor of either sort.

        What was seen is taken along: it is the same, and takes long to draw.
        """
        made = replace(
            self,
            bent=both(self.bent, bent),
            leaving=self.leaving if leaving is None else (*self.leaving, leaving),
        )
        kept = ("rows", "turns", "draws", "_weights")
        made.__dict__.update({key: getattr(self, key) for key in kept})
        return made

    @cached_property
    def beside(self) -> dict[tuple[str, ...], Any]:
        """Fits beside effects, by their names: see `fits_beside`."""
        return {}

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Turns in zones that were fitted."""
        return np.flatnonzero(self.fitted.used)[:: self.every]

    @cached_property
    def turns(self) -> Turns:
        """These."""
        return self.scene.turns.take(self.rows)

    @cached_property
    def _x(self) -> Floats:
        return np.stack(self.fitted.x)[self.turns.zone - 1]

    @cached_property
    def kappa_own(self) -> Floats:
        """Concentration of the base law, shape (step,)."""
        return np.asarray(self._x[:, 0] * SCALES[0])

    @cached_property
    def kappa_f(self) -> Floats:
        """Concentration about neighbours, shape (step,)."""
        return np.asarray(self._x[:, 1] * SCALES[1])

    @cached_property
    def alpha(self) -> Floats:
        """Weight of neighbours per steradian, shape (step,)."""
        return np.asarray(self._x[:, 2] * SCALES[2])

    @cached_property
    def lapses(self) -> Lapses:
        """Shares of headings drawn from anywhere."""
        return Lapses(usual=self._x[:, -1], zone=self.turns.zone)

    @cached_property
    def weight(self) -> Floats:
        """Attraction of what each cell of headings lands in, tilts included, shape (step, cell)."""
        per = 2 * math.pi / ANGLES / PER_CELL
        made = per * attractions(self.turns.share, self._gamma, 0)[0]
        tilt = self.fitted.view.tilt
        made = made * tilt[self.rows] if len(tilt) else made
        if self.bent is not None:
            made = made * np.exp(self.bent[0])
        return np.ascontiguousarray(made)

    @cached_property
    def _waves(self) -> Floats:
        """Fourier sums of the weights, shape (step, wave, 2)."""
        return waves_of(self.weight)

    @cached_property
    def _gamma(self) -> Floats:
        """Attraction of each zone to who is where a step begins, shape (step, zone)."""
        made = np.exp(self._x[:, 3:-1])
        for zone, log_factor in self.leaving:
            made[:, zone - 1] *= np.exp(log_factor)
        return made

    @cached_property
    def between(self) -> int:
        """Id of the zone between the rooms; 0 without rooms."""
        return find_rooms(self.scene.arena)[0]

    def zone_into(self, into: str) -> int:
        """Return the id of a zone that fish may leave into, as `Leaving` has it; 0 without one."""
        return open_zone(self.scene.arena) if into == "open" else self.between

    def share_of(self, zone: int) -> Floats:
        """Share of each cell's attraction that is of landing in a zone, shape (step, cell)."""
        whole, own = attractions(self.turns.share, self._gamma, zone - 1)
        return np.asarray(own / np.maximum(whole, 1e-300))

    @cached_property
    def log_here(self) -> Floats:
        """Log attraction of where the step landed, tilts included, shape (step,)."""
        gamma = np.log(self._gamma[np.arange(len(self.rows)), self.turns.landing - 1])
        taken = self.fitted.view.tilt_taken
        if len(taken):
            gamma = gamma + np.log(np.maximum(taken[self.rows], 1e-300))
        if self.bent is not None:
            gamma = gamma + self.bent[1]
        return np.asarray(gamma)

    @cached_property
    def draws(self) -> tuple[Draw, ...]:
        """Of where all were; the measured positions alone where these are exact."""
        steps = Steps(
            scene=self.scene,
            parameters=self.fitted.parameters,
            rows=self.rows,
            turns=self.turns,
            follows=self.follows,
            alpha=self.alpha,
        )
        if not self.noise_m > 0:
            return (draw_of(steps, self.scene.states, self.fitted.view),)
        errors = errors_of(self.n_draws, self.scene, np.random.default_rng([self.seed, 7]))
        return tuple(drawn(steps, self.noise_m * each) for each in errors)

    @cached_property
    def _weights(self) -> list[Floats]:
        """Return one over the weight of each draw's mixture, shape (step,), over their mean."""
        parts = self.fitted.view.parts
        extra = parts[self.rows, :, 0].sum(axis=1) if parts.shape[1] else 0.0
        made = [1 / (1 + self.alpha * draw.angle_sr.sum(axis=1) + extra) for draw in self.draws]
        mean = np.mean(made, axis=0)
        return [each / mean / len(made) for each in made]

    def mean(self, parts: list[Columns]) -> Columns:
        """Return the average of columns over the draws, or over the first ones."""
        if len(self.draws) == 1:
            return parts[0]
        at, over = (np.zeros(each.shape) for each in parts[0])
        for weight, own in zip(self._weights[: len(parts)], parts, strict=True):
            at += len(self.draws) / len(parts) * weight[:, None] * own[0]
            over += len(self.draws) / len(parts) * weight[:, None] * own[1]
        return at, over

    def bells(self, toward: Floats, kappa: Floats | float) -> Columns:
        """Return von Mises laws about directions, shape (step, source)."""
        shape = toward.shape[:2]
        at, over = np.empty(shape), np.empty(shape)
        k, order, series, scale = concentrated(kappa, shape[0])
        bells(
            np.ascontiguousarray(toward), k, order, series, self._waves, self.weight,
            self.turns.taken, at, over,
        )  # fmt: skip
        return np.multiply(at, scale, out=at), np.multiply(over, scale, out=over)

    def component(self, feature: Component, *, first: bool = False) -> Columns:
        """Return the columns of a component, shape (step, weight); of the first draw, if asked."""

        def of(draw: Draw) -> Columns:
            weights = feature.weights(draw.seen)
            made = weighed(self._bells_of(feature, draw), weights)
            if not feature.instead:
                return made
            usual = "neighbours" if feature.kappa == "sharper" else feature.kappa
            present = self._kept_bells(draw, "toward", usual)
            attention = draw.seen.attention[..., None]
            taken = attention if feature.instead is True else feature.instead(draw.seen)
            return less(made, weighed(present, taken))

        return self.mean([of(draw) for draw in (self.draws[:1] if first else self.draws)])

    def _bells_of(self, feature: Component, draw: Draw) -> Columns:
        if not isinstance(feature.toward, str):
            return self.bells(draw.as_drawn(feature.toward(draw.seen)), self._kappa(feature.kappa))
        return self._kept_bells(draw, feature.toward, feature.kappa)

    def _kept_bells(self, draw: Draw, toward: str, kappa: float | str) -> Columns:
        key = (id(draw), toward, kappa)
        if key not in self._kept:
            ways = draw.as_drawn(getattr(draw.seen, toward))
            self._kept[key] = self.bells(ways, self._kappa(kappa))
        return self._kept[key]

    @cached_property
    def _kept(self) -> dict[tuple[int, str, float | str], Columns]:
        return {}

    def _kappa(self, kappa: float | str) -> Floats | float:
        if not isinstance(kappa, str):
            return kappa
        more = _MORE if kappa == "sharper" else 1.0
        return self.kappa_own if kappa == "own" else more * self.kappa_f

    def sharper(self, feature: Sharper) -> Columns:
        """Return what a tenth more of the own concentration adds, shape (step, weight)."""
        at, over = self._own_sharper
        by = feature.by(self.draws[0].seen)
        return by * at, by * over

    @cached_property
    def _own_sharper(self) -> Columns:
        return less(self.mean([self._own(draw.base, _MORE) for draw in self.draws]), self.own)

    def turned(self, feature: Turned) -> Columns:
        """Return the derivative of the law by a turn of its directions, shape (step, weight)."""

        def of(draw: Draw) -> Columns:
            by = feature.by(draw.seen).reshape(len(draw.seen.zone), -1)
            slope = self._slope(draw, neighbours=feature.neighbours)
            return by * slope[0], by * slope[1]

        return self.mean([of(draw) for draw in self.draws])

    def _slope(self, draw: Draw, *, neighbours: bool) -> Columns:
        """Return the derivative of the mixture by a turn of its directions, shape (step, 1)."""
        key = (id(draw), "turned", float(neighbours))
        if key not in self._kept:
            left, right = (
                self._mixture(draw, angle, neighbours=neighbours)
                for angle in (_TURN_RAD, -_TURN_RAD)
            )
            at, over = less(left, right)
            self._kept[key] = at / (2 * _TURN_RAD), over / (2 * _TURN_RAD)
        return self._kept[key]

    def _mixture(self, draw: Draw, angle: float, *, neighbours: bool) -> Columns:
        parts = [self._own(turned_by(draw.base, angle))]
        if neighbours:
            parts.append(self._social(turned_by(draw.toward, angle), draw.angle_sr))
        return sum(p[0] for p in parts), sum(p[1] for p in parts)  # type: ignore[return-value]

    def _own(self, base: Floats, more: float = 1.0) -> Columns:
        at, over = self.bells(base, more * self.kappa_own)
        half = np.where(self.follows, 0.5, 1.0)[:, None]
        return half * at.sum(axis=1, keepdims=True), half * over.sum(axis=1, keepdims=True)

    def _social(self, toward: Floats, angle_sr: Floats, more: float = 1.0) -> Columns:
        at, over = self.bells(toward, more * self.kappa_f)
        weight = self.alpha[:, None] * angle_sr
        return (
            (weight * at).sum(axis=1, keepdims=True),
            (weight * over).sum(axis=1, keepdims=True),
        )

    @cached_property
    def follows(self) -> NDArray[np.bool_]:
        """Whether a step begins in a zone that follows walls, shape (step,)."""
        known = np.array([zone.follows_walls for zone in self.scene.arena.zones])
        return np.asarray(known[self.turns.zone - 1])

    @cached_property
    def own(self) -> Columns:
        """The own stimulus alone, shape (step, 1)."""
        return self.mean([self._own(draw.base) for draw in self.draws])

    @cached_property
    def base(self) -> Columns:
        """The law as it is, shape (step, 1)."""
        made = [self.own, self._neighbours(), *self._components]
        return sum(m[0] for m in made), sum(m[1] for m in made)  # type: ignore[return-value]

    @cached_property
    def _components(self) -> list[Columns]:
        """Components of effects that the model has, each of shape (step, 1)."""
        parts, made = self.fitted.view.parts, []
        for c in range(parts.shape[1]):
            own = parts[self.rows, c]
            at, over = self.bells(own[:, None, 1:3], own[:, 3])
            made.append((own[:, :1] * at, own[:, :1] * over))
        return made

    def _neighbours(self, more: float = 1.0) -> Columns:
        return self.mean([self._social(d.toward, d.angle_sr, more) for d in self.draws])

    @cached_property
    def own_parameters(self) -> tuple[list[Columns], list[tuple[float, float]]]:
        """Columns of the model's own parameters, and bounds of what they may change by.

        Those of the base in each zone; and of all components of its effects together, how heavy
        they are.
        """
        social, social_more = self._neighbours(), self._neighbours(_MORE)
        changes = (
            (self._own_sharper, SHARPER),
            (social, (-0.9, 6.0)),
            (less(social_more, social), SHARPER),
        )
        columns, bounds = [], []
        for zone in np.unique(self.turns.zone):
            here = (self.turns.zone == zone)[:, None]
            for (at, over), limits in changes:
                if np.abs(at * here).max(initial=0.0) > 0:
                    columns.append((at * here, over * here))
                    bounds.append(limits)
        if self._components:
            columns.append(
                tuple(np.sum(each, axis=0) for each in zip(*self._components, strict=True))
            )
            bounds.append(_WEIGHT)
        return columns, bounds

    @cached_property
    def cells(self) -> Floats:
        """The law on cells of headings, attraction included, shape (step, cell)."""
        whole = np.zeros(self.weight.shape)
        own_scale, scale = (1 / (2 * math.pi * i0e(k)) for k in (self.kappa_own, self.kappa_f))
        half = np.where(self.follows, 0.5, 1.0)
        for draw, weight in zip(self.draws, self._weights, strict=True):
            some = np.zeros(whole.shape)
            modes = np.broadcast_to((half * own_scale)[:, None], draw.base.shape[:2])
            there = modes * (np.abs(draw.base).sum(axis=2) > 0)
            bells_on_cells(np.ascontiguousarray(draw.base), self.kappa_own, there, some)
            social = (self.alpha * scale)[:, None] * draw.angle_sr
            bells_on_cells(np.ascontiguousarray(draw.toward), self.kappa_f, social, some)
            whole += weight[:, None] * some
        parts = self.fitted.view.parts
        for c in range(parts.shape[1]):
            own = np.ascontiguousarray(parts[self.rows, c])
            k = own[:, 3].copy()
            scaled = (own[:, 0] / (2 * math.pi * i0e(k)))[:, None]
            bells_on_cells(np.ascontiguousarray(own[:, None, 1:3]), k, scaled, whole)
        return np.asarray(whole * self.weight)
