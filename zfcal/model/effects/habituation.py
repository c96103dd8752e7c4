"""Habituation: social attraction drifts over the trial."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances, each_fish
from zfcal.model.effects.forms import cut, needs_neighbour
from zfcal.model.effects.weights import (
    ATTENTION,
    every_step,
    factor_on_attention,
    own_shares,
    own_ways,
    precision_of_attention,
)
from zfcal.model.features import Along, Component, Feature, Seen
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hats import hats
from zfcal.model.kernels.hooks import SIGHT
from zfcal.model.kernels.state import KIND, TIME

_MOST = 3.0


@hook(SIGHT)
def sight(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Weigh every neighbour by an exponential of time, or robots alone."""
    if parameters[2] > 0.0 and not state[KIND * n + j] > 0.0:
        return 1.0
    later = (state[TIME * n + i] - parameters[1]) / 3600.0
    return math.exp(cut(-parameters[0] * later, -_MOST, _MOST))


_FEW = (0.0, 0.5, 1.0)
_KNOTS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


def _attention(seen: Seen) -> Floats:
    return np.broadcast_to(
        hats(seen.time, _KNOTS)[:, None, 1:], (*seen.here.shape, len(_KNOTS) - 1)
    )


def _by_time(seen: Seen) -> Floats:
    by = hats(seen.time, _FEW)[:, None, 1:]
    return np.broadcast_to(by, (*seen.here.shape, by.shape[-1]))


def _steadily(seen: Seen) -> Floats:
    return np.broadcast_to(seen.time[:, None, None], (*seen.here.shape, 1))


def _change(seen: Seen, knots: tuple[float, ...], counts: Floats) -> Floats:
    """Return hat functions of the time, less their mean where it counts, shape (step, weight).

    What some attend to, or is attended to, more or less all the time is another effect.

    Parameters
    ----------
    counts : ndarray, shape (step,)
        How much each step does; they are zero where it does not.
    """
    by, total = hats(seen.time, knots)[:, 1:], max(float(counts.sum()), 1e-9)
    return np.asarray((by - counts @ by / total) * (counts > 0)[:, None])


def _attention_of_each(seen: Seen) -> Floats:
    """Return a change for each fish: some may habituate, others not."""
    paid = seen.attention.sum(axis=1)
    by = [_change(seen, _FEW, paid * fish) for fish in seen.once(each_fish).T]
    each = np.concatenate(by, axis=1)[:, None]
    return np.broadcast_to(each, (*seen.here.shape, each.shape[2]))


def _attention_to_robots(seen: Seen) -> Floats:
    paid = (seen.attention * seen.is_robot).sum(axis=1)
    return np.asarray(_change(seen, _KNOTS, paid)[:, None] * seen.is_robot[..., None])


def _heeding_nobody(seen: Seen, by: Floats) -> Floats:
    """Return the weight of the own ways in steps in which a fish heeds nobody.

    A share of all headings has as much weight as all that draws the fish, by which the mixture is
    divided: by the base law's attention. Components of other effects do not count.

    Shape (step, way, weight).

    Parameters
    ----------
    by : ndarray, shape (step, weight)
        The share.
    """
    whole = 1 + seen.attention.sum(axis=1)
    return np.asarray(own_shares(seen) * (whole[:, None] * by)[:, None])


_NOBODY = Component(
    label="heeding nobody",
    toward=own_ways,
    weights=lambda seen: _heeding_nobody(seen, every_step(seen)),
    kappa="own",
)

_BY_TIME = Along(cue="share of the recording that has passed", knots=_KNOTS[1:], none_at=_KNOTS[0])

_FEATURES: tuple[Feature, ...] = (
    factor_on_attention(_attention, along=_BY_TIME),
    factor_on_attention(_attention_of_each, label="attention, each fish"),
    factor_on_attention(_attention_to_robots, label="attention to robots", along=_BY_TIME),
    precision_of_attention(_by_time, "precision"),
    # More than what they heed nobody in all minutes, which is another mixture.
    replace(
        _NOBODY,
        label="heeding nobody, by the time",
        weights=lambda seen: _heeding_nobody(seen, hats(seen.time, _FEW)),
        over=_NOBODY,
    ),
    by_circumstances(
        factor_on_attention(_steadily, label="attention, steadily"),
        alone=ATTENTION,
        without=("the time", "whether it is a robot"),
        of_each=True,
    ),
)


EFFECT = Effect(
    name="habituation",
    says="Fish attend less and less to each other in the course of the trial.",
    opposite="Fish attend more and more to each other in the course of the trial.",
    reference="Rankin et al. 2009, Neurobiology of Learning and Memory 92: 135-138",
    parameters=(
        EffectParameter(
            name="per_hour",
            low=-60.0,
            high=60.0,
            default=3.0,
            says="Loss of attention, as a log per hour.",
        ),
        EffectParameter(
            name="usual_at_s",
            low=0.0,
            high=1e5,
            default=900.0,
            says="When attention is as the base model has it, in seconds of the trial.",
        ),
        EffectParameter(
            name="robots",
            low=0.0,
            high=1.0,
            default=0.0,
            says="1: attention to robots changes, and no other.",
        ),
    ),
    strength="per_hour",
    probe=0.05,
    sight=sight,
    lacks=needs_neighbour,
    further_shapes=lambda _arena: ({"robots": 1.0},),
    fixed=("usual_at_s", "robots"),
    per_hour=True,
    shown_against="time",
    features=lambda _arena: _FEATURES,
)
