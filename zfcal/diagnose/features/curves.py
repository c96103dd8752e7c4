"""The curve of a feature: how strong an effect is by what it goes by, whatever its form.

It has no point where no step asks for a strength: nothing is known of it there.

Beside it stands what the same feature shows of the form that the model has: of headings drawn from
that model, where all were when each step began.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats, Ints
from zfcal.diagnose.features.asking import best_feature, fits_beside
from zfcal.diagnose.features.climbing import Fit
from zfcal.diagnose.features.fits import Fits
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.findings import FeatureCurve
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import Effect
from zfcal.model.effects.circumstances import along_under
from zfcal.model.features import Component, Landing, Leaving, Single, Tilt
from zfcal.model.kernels.landing import ANGLES

_REDRAWN = 3
"""Times that headings are drawn from the model with the effect."""


def curve_of(
    law: Law, effect: Effect, with_it: Screen, *, nats: float, beside: Sequence[Effect] = ()
) -> FeatureCurve | None:
    """Return what an effect's best feature says of a recording; None where none gains anything.

    Parameters
    ----------
    law
        Of the model without the effect.
    effect
        Has features.
    with_it
        The same recording under the model with it, in a form of ours.
    nats
        What that form gains.
    beside
        Effects on headings that the model without it has.
    """
    fits = fits_beside(law, beside)
    found = best_feature(fits, effect)
    if found is None:
        return None
    feature, gain = found
    made = FeatureCurve(label=feature.label, nats=gain.nats, form_nats=nats)
    if isinstance(feature, Landing):
        fits = fits.beside_walls
    fit = fits.fit(feature)
    along = feature.along or along_under(feature.label, _n_own(fits, feature, fit))
    if along is None:
        return made
    n = len(along.knots)
    known = np.asarray(np.isfinite(fit.interval[:n]).all(axis=1))
    shown = _Knots(none_at=along.none_at, known=known)
    besides = fit.strengths[n:], fit.interval[n:]
    return replace(
        made,
        cue=along.cue,
        strength_name=_name_of(feature),
        at=shown.knots(along.knots),
        strength=shown.values(fit.strengths[:n]),
        low=shown.values(fit.interval[:n, 0]),
        high=shown.values(fit.interval[:n, 1]),
        form=shown.values(_of_the_form(fits, feature, with_it)[:n]),
        besides={
            name: (float(value), float(low), float(high))
            for name, value, (low, high) in zip(along.besides, *besides, strict=bool(along.besides))
        },
    )


def _n_own(fits: Fits, feature: Single, fit: Fit) -> int:
    """Return how many strengths are a feature's own, those of what it has to exceed put aside."""
    over = getattr(feature, "over", None)
    return len(fit.strengths) - (0 if over is None else len(fits.fit(over).strengths))


@dataclass(frozen=True, slots=True, eq=False)
class _Knots:
    """Puts a knot at which there is nothing to fit before those of which anything is known."""

    none_at: float | None
    known: NDArray[np.bool_]

    def knots(self, values: Sequence[float]) -> Floats:
        kept = np.array(values)[self.known]
        return kept if self.none_at is None else np.append(self.none_at, kept)

    def values(self, values: Floats) -> Floats:
        kept = values[self.known]
        return kept if self.none_at is None else np.append(0.0, kept)


def _of_the_form(fits: Fits, feature: Single, with_it: Screen) -> Floats:
    """Return the strengths where headings are drawn from the model with the effect, their mean."""
    random = np.random.default_rng([fits.law.seed, 11])
    laws = [redrawn(fits.law, with_it, random) for _ in range(_REDRAWN)]
    return np.mean([replace(fits, law=law).fit(feature).strengths for law in laws], axis=0)


def redrawn(law: Law, screen: Screen, random: np.random.Generator) -> Law:
    """Return a law of the same steps with other headings, drawn from a model.

    Parameters
    ----------
    law
        Of the steps.
    screen
        The same recording under the model that headings are drawn from. Within a cell of headings
        the zones in which these land are drawn by the attractions of the base alone.
    random
        Draws them.
    """
    scene, view, rows = law.scene, law.fitted.view, law.rows
    chosen = _chosen(screen.probability[rows], random)
    angle = 2 * math.pi * (chosen + random.uniform(-0.5, 0.5, len(rows))) / ANGLES
    x = np.stack(screen.fitted.x)[scene.turns.zone[rows] - 1]
    zones = np.exp(x[:, 3:-1]) * scene.turns.share[rows, chosen].astype(np.float64)
    taken, landing = scene.turns.taken.copy(), scene.turns.landing.copy()
    taken[rows] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    landing[rows] = 1 + _chosen(zones, random)
    if len(view.tilt):
        tilt_taken = view.tilt_taken.copy()
        tilt_taken[rows] = view.tilt[rows, chosen]
        view = replace(view, tilt_taken=tilt_taken)
    bent = law.bent
    if bent is not None:
        bent = bent[0], bent[0][np.arange(len(rows)), chosen]
    made = replace(
        law,
        bent=bent,
        scene=replace(scene, turns=replace(scene.turns, taken=taken, landing=landing)),
        fitted=replace(law.fitted, view=view),
    )
    # Where everybody was stays as it was, and so does what a heading is drawn from.
    kept = ("draws", "_weights", "weight", "_waves", "cells")
    made.__dict__.update({name: getattr(law, name) for name in kept})
    return made


def _chosen(weights: Floats, random: np.random.Generator) -> Ints:
    """Return a column for each row, drawn by the weights."""
    sums = np.cumsum(weights, axis=1)
    return np.asarray((sums < (random.uniform(size=len(sums)) * sums[:, -1])[:, None]).sum(axis=1))


def _name_of(feature: Single) -> str:
    """Return what the strengths of a feature are, with their unit."""
    if isinstance(feature, Component):
        if feature.toward == "toward":
            return "change of the attention (share)"
        return "weight (own way: 1)"
    if isinstance(feature, Tilt | Landing):
        return "preference (nats)"
    if isinstance(feature, Leaving):
        return "log of the factor on leaving"
    return "turn (rad)"
