"""Fits of features to the steps of a law: what each gains in likelihood.

Components and turns are fitted with the base's parameters and the lapses (Wilks 1938, Annals of
Mathematical Statistics 9: 60-62); tilts and leaving with the lapse, against the base as it is. A
tilt that may be named has the base's parameters fitted beside it, unless it is counted over what
all have alike, for which they do the same (counted whole it gains a little less than it might).
These are taken as linear: where 30 % of all headings had a cause of their own, fits about where the
parameters had gone gained no more (513.5 nats, for 514.7).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zfcal.arrays import Floats
from zfcal.diagnose.features.climbing import (
    Bounds,
    Fit,
    Objective,
    Peak,
    climb,
    lapses_alone,
    scaled,
)
from zfcal.diagnose.features.columns import Columns
from zfcal.diagnose.features.first_look import (
    LOOKED_AT,
    ONE_IN,
    FirstLook,
    Null,
    best_of,
    has_many,
    thinned,
)
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.features.kernels import tilted
from zfcal.diagnose.features.landings import Landings, leaned
from zfcal.diagnose.features.law import SHARPER, Law
from zfcal.diagnose.features.leavings import Leavings
from zfcal.diagnose.features.score_kernels import sums_of, write_slopes
from zfcal.diagnose.features.ways import ways_of, ways_of_cells
from zfcal.model.features import (
    Choosable,
    Feature,
    Landing,
    Leaving,
    Mixed,
    OneOf,
    Sharper,
    Single,
    Tilt,
    Turned,
)

_LEAST = 1e-9
"""Share of the base's density at the heading taken below which a mixture cannot be pushed."""

_OWN = 0.3
"""Share of the own stimulus' integral below which that of a mixture cannot be pushed: whatever
fish attend to, their own way is never gone. Columns that are derivatives do not know."""

_MOST_TILT = 4.0
_MOST_TURN = 0.3

_AS_IT_IS, _NONE = np.ones(1), np.zeros(0)

_FITTED = 2
"""Of features of which the most promising are fitted, so many."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Fits of features to the steps of a law.

    Parameters
    ----------
    law
        Of the steps.
    also
        Features that are fitted with the base's parameters, because their effects are there.
    beyond : ndarray, shape (step,), optional
        Log densities that are to be gained over, where the base alone has higher ones by another
        law: that of noisy positions, say.
    off_walls
        Whether landings are beside what all walls have in common: see `beside_walls`.
    """

    law: Law
    also: tuple[Mixed, ...] = ()
    beyond: Floats | None = None
    off_walls: bool = False

    @cached_property
    def _own(self) -> tuple[list[Columns], list[Bounds]]:
        """Columns that are always there, and the bounds of their strengths."""
        columns, bounds = self.law.own_parameters
        added = [self._columns(feature) for feature in self.also]
        return (
            [*columns, *(each for each, _ in added)],
            [*bounds, *(pair for _, pairs in added for pair in pairs)],
        )

    def _columns(self, feature: Mixed) -> tuple[Columns, list[Bounds]]:
        """Return the columns of a feature, and the bounds of its strengths."""
        if isinstance(feature, Turned):
            columns = self.law.turned(feature)
            return columns, [(_low(feature, _MOST_TURN), _MOST_TURN)] * columns[0].shape[1]
        if isinstance(feature, Sharper):
            columns = self.law.sharper(feature)
            return columns, [SHARPER] * columns[0].shape[1]
        columns = self.law.component(feature)
        return columns, [(feature.low, feature.high)] * columns[0].shape[1]

    @cached_property
    def _null(self) -> Fit:
        """Log densities with the base's own columns alone, and where that fit ended."""
        return self._linear([], [], None)

    def prepare(self, features: Sequence[Feature] = ()) -> None:
        """Work out what all features need, before they are asked side by side.

        Parameters
        ----------
        features
            These.
        """
        _ = (self.law.own_parameters, self.law.cells)
        _ = (self._null, self._untilted, self.first_look.prepared, self.landings.prepared)
        if any(isinstance(each, OneOf) and has_many(each) for each in features):
            _ = self._few.prepared

    @property
    def n_beside(self) -> int:
        """Strengths of the features that are fitted with the base's parameters."""
        return len(self._own[1]) - len(self.law.own_parameters[1])

    @property
    def null_log_p(self) -> Floats:
        """Log density of each step by the base alone, its parameters and the lapse refitted."""
        return self._null.log_p

    def gain(self, name: str, feature: Single) -> Gain:
        """Return what a feature of an effect adds."""
        fit = self.fit(feature)
        made, n = fit.log_p, len(fit.strengths)
        common, n_common = None, 0
        over = getattr(feature, "over", None)
        if over is not None and n:
            alike, n_alike = self._common(over)
            made = made - alike
            # What a landing has to gain more than is no part of it: all its strengths are its own.
            n -= 0 if isinstance(feature, Landing) else min(n, n_alike)
            # What noise makes of what all do alike is not known: then it does not count.
            if getattr(feature, "counts_whole", False) and not self.law.noise_m > 0:
                common, n_common = alike, n_alike
        if self.beyond is not None:
            made = made + self.null_log_p - self.beyond
        return Gain(
            name=name, label=feature.label, log_p=made, n_strengths=n, common=common,
            n_common=n_common, without_noise=not self.law.noise_m > 0,
            forms=getattr(feature, "forms", ()),
        )  # fmt: skip

    def _common(self, over: Single) -> tuple[Floats, int]:
        """Return what has to be gained more than adds to each step, and its strengths."""
        if over not in self._commons:
            fit = self.fit(over)
            self._commons[over] = fit.log_p, len(fit.strengths)
        return self._commons[over]

    @cached_property
    def _commons(self) -> dict[Single, tuple[Floats, int]]:
        """These, by feature: several share one."""
        return {}

    def may_gain(self, feature: Single) -> bool:
        """Return whether a first look says that a feature is worth a fit.

        One without any strength promises exactly nothing. It is fitted, and then left out.
        """
        return not isinstance(feature, Choosable) or self.first_look.nats(feature) >= 0

    def nothing(self, name: str, feature: Single) -> Gain:
        """Return that a feature of an effect adds nothing, without a fit."""
        made = np.zeros(len(self.law.rows))
        if self.beyond is not None:
            made = self.null_log_p - self.beyond
        return Gain(
            name=name, label=feature.label, log_p=made, n_strengths=1,
            without_noise=not self.law.noise_m > 0, is_idle=True,
        )  # fmt: skip

    def fit(self, feature: Single) -> Fit:
        """Return a feature at the maximum, and what it adds to each step."""
        if isinstance(feature, Tilt):
            return self.tilt(feature)
        if isinstance(feature, Leaving):
            return self.leavings.fit(feature)
        if isinstance(feature, Landing):
            return self.landings.fit(feature)
        columns, bounds = self._columns(feature)
        made = self._linear([columns], bounds, self._null.x)
        return replace(made, log_p=made.log_p - self.null_log_p)

    @cached_property
    def leavings(self) -> Leavings:
        """Fits of features of leaving."""
        return Leavings(law=self.law)

    @cached_property
    def landings(self) -> Landings:
        """Fits of features of landing."""
        made = Landings(law=self.law)
        return made.beyond_walls() if self.off_walls else made

    @property
    def beside_walls(self) -> Fits:
        """These with landings beside what all walls have in common, or themselves without that."""
        return self if self._further is None else self._further

    @cached_property
    def _further(self) -> Fits | None:
        landings = self.landings.beyond_walls()
        if landings is self.landings:
            return None
        made = replace(self, off_walls=True)
        kept = ("_own", "_null", "_at_null", "_untilted")
        made.__dict__.update({name: getattr(self, name) for name in kept}, landings=landings)
        return made

    def refitted(self, feature: Tilt, gain: Gain) -> Gain:
        """Return what a tilt adds with the base's parameters fitted once more beside it."""
        bent = leaned(self.law, feature, self.tilt(feature).factor)
        beside = Fits(law=self.law.absorbing(bent=bent), also=self.also)
        made = beside.null_log_p - (self.null_log_p if self.beyond is None else self.beyond)
        return replace(gain, log_p=made) if made.sum() > gain.log_p.sum() else gain

    def most_promising(self, choice: OneOf, n: int = _FITTED) -> list[Single]:
        """Return the features that a first look says most of, more than their strengths cost."""
        sought, found = self._promising.get(choice, (0, []))
        if sought < n:
            found = self._looked_for(choice, n)
            self._promising[choice] = n, found
        return found[:n]

    @cached_property
    def _promising(self) -> dict[OneOf, tuple[int, list[Single]]]:
        """These, and how many were asked for: who draws a curve asks again."""
        return {}

    def _looked_for(self, choice: OneOf, n: int) -> list[Single]:
        every = range(len(choice.features))
        looked_at: Sequence[int] = every
        if has_many(choice):
            looked_at = best_of(self._few, choice, every)[:LOOKED_AT]
        order = best_of(self.first_look, choice, looked_at, least=0.0)[:n]
        if choice.near is None:
            return [choice.features[k] for k in order]
        return [max(choice.near(k), key=self.first_look.nats) for k in order]

    @cached_property
    def _few(self) -> FirstLook:
        """A look at a few of the steps, beside the same as all of them."""
        law, kept = thinned(self.law, ONE_IN)
        few = replace(self, law=law, beyond=None)
        few.__dict__["_at_null"] = self._at_null.take(kept)
        walls = self.landings.walls
        few.__dict__["landings"] = Landings(
            law=law, walls=walls and (walls[0][kept], walls[1][kept])
        )
        return replace(few.first_look, one_in=ONE_IN)

    @cached_property
    def first_look(self) -> FirstLook:
        """What features may gain, before any is fitted."""
        return FirstLook(
            law=self.law, null=self._at_null, own=self._own[0],
            landing_scores=self.landings.scores, leaving_scores=self.leavings.scores,
        )  # fmt: skip

    @cached_property
    def _at_null(self) -> Null:
        """The mixture at the null's maximum."""
        columns, _ = self._own
        at, over = (np.concatenate([column[side] for column in columns], axis=1) for side in (0, 1))
        x, n = self._null.x, at.shape[1]
        (base_at, base_over), least = self.law.base, _OWN * self.law.own[1]
        pairs = (
            (base_at + at @ x[:n, None], _LEAST * base_at),
            (base_over + over @ x[:n, None], least),
        )
        top, whole = (np.maximum(mixed, floor) for mixed, floor in pairs)
        free_top, free_whole = (np.where(mixed > floor, mixed, np.inf) for mixed, floor in pairs)
        return Null(
            base=(top, whole),
            changing=(free_top, free_whole),
            lapse=self.law.lapses.shares(x[n:]),
        )

    def _linear(
        self, added: Sequence[Columns], bounds: Sequence[Bounds], start: Floats | None
    ) -> Fit:
        """Return the log densities at the best strengths of columns."""
        own, limits = self._own
        at = np.concatenate([c[0] for c in (*own, *added)], axis=1)
        over = np.concatenate([c[1] for c in (*own, *added)], axis=1)
        base_at, base_over = (column[:, 0] for column in self.law.base)
        scale = np.maximum(sums_of(np.abs(at)) / len(at) / base_at.mean(), 1e-9)
        at, over = at / scale, over / scale
        here, least = np.exp(self.law.log_here), _OWN * self.law.own[1][:, 0]
        n, lapses = at.shape[1], self.law.lapses

        def densities(x: Floats) -> tuple[Floats, Floats, Floats]:
            top = np.maximum(base_at + at @ x[:n], _LEAST * base_at)
            whole = np.maximum(base_over + over @ x[:n], least)
            return here * top / whole, top, whole

        def objective(x: Floats) -> tuple[float, Callable[[], Floats]]:
            density, top, whole = densities(x)
            value, share, slopes = lapses.mixed(density, x[n:])

            def scores() -> Floats:
                # At a floor the law does not change.
                nothing = np.zeros_like(share)
                by_top = np.divide(share, top, out=nothing.copy(), where=top > _LEAST * base_at)
                by_whole = np.divide(share, whole, out=nothing, where=whole > least)
                made = np.empty((len(share), n + slopes.shape[1]))
                write_slopes(at, over, by_top, by_whole, made)
                made[:, n:] = slopes
                return made

            return value, scores

        x0 = np.append(np.zeros(n), lapses.start)
        k = len(x0) - n
        if start is not None:
            x0[: len(start) - k], x0[n:] = start[:-k] * scale[: len(start) - k], start[-k:]
        ranges = [scaled(pair, s) for pair, s in zip([*limits, *bounds], scale, strict=True)]
        peak = climb(objective, x0, ranges)
        log_p = lapses.log_mixed(densities(peak.x)[0], peak.x[n:])
        return self._as_fit(log_p, peak, len(bounds), scale=np.append(scale, np.ones(k)))

    def tilt(self, feature: Tilt) -> Fit:
        """Return what a tilt adds to each step."""
        vectors = np.mean([feature.vectors(d.seen) for d in self.law.draws], axis=0)
        taken, base = ways_of(self.law.turns.taken, axial=feature.axial), self._untilted
        ways = ways_of_cells(axial=feature.axial)
        n, lapses = vectors.shape[1], self.law.lapses
        whole, mean = np.empty(len(taken)), np.empty((len(taken), 2))
        cells, at = self.law.cells, np.exp(self.law.log_here) * self.law.base[0][:, 0]

        def density(x: Floats) -> Floats:
            vector = np.ascontiguousarray(np.einsum("sbd,b->sd", vectors, x[:n]))
            tilted(cells, ways, vector, whole, mean)
            return np.asarray(at * np.exp((vector * taken).sum(axis=1)) / whole)

        def objective(x: Floats) -> tuple[float, Callable[[], Floats]]:
            value, share, slopes = lapses.mixed(density(x), x[n:])
            ahead = share[:, None] * (taken - mean)
            return value, lambda: np.column_stack([np.einsum("sbd,sd->sb", vectors, ahead), slopes])

        peak = self._climb_from_null(objective, [(_low(feature, _MOST_TILT), _MOST_TILT)] * n)
        log_p = lapses.log_mixed(density(peak.x), peak.x[n:]) - base
        factor = np.einsum("sbd,b->sd", vectors, peak.x[:n])
        return self._as_fit(log_p, peak, n, factor)

    @cached_property
    def _untilted(self) -> Floats:
        """Log densities by the law on cells, the lapses fitted alone."""
        at = np.exp(self.law.log_here) * self.law.base[0][:, 0] / self.law.cells.sum(axis=1)

        return self.law.lapses.log_mixed(at, lapses_alone(self.law.lapses, at))

    def _climb_from_null(self, objective: Objective, bounds: Sequence[tuple[float, float]]) -> Peak:
        return climb(objective, np.append(np.zeros(len(bounds)), self.law.lapses.start), bounds)

    def _as_fit(
        self, log_p: Floats, peak: Peak, n: int, factor: Floats = _NONE, scale: Floats = _AS_IT_IS
    ) -> Fit:
        n_lapses = len(self.law.lapses.start)
        return Fit(log_p=log_p, peak=peak, n=n, n_lapses=n_lapses, scale=scale, factor=factor)


def _low(feature: Tilt | Turned, most: float) -> float:
    return -most if feature.low is None else feature.low
