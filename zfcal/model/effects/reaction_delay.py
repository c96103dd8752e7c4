"""Reaction delay: fish respond to where others were a moment ago."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.circumstances import by_circumstances
from zfcal.model.effects.forms import needs_neighbour
from zfcal.model.features import LAGS, SOON, Component, Feature, OneOf, Seen, Weights
from zfcal.model.kernels.hats import hats_where


def _late(
    label: str,
    toward: Weights | Literal["soon_toward", "half_toward"],
    attention: Callable[[Seen], Floats],
    high: float = 1.0,
) -> Component:
    """Return a share of the attention that goes to where others were, not to where they are."""
    return Component(
        label=label,
        toward=toward,
        weights=lambda seen: attention(seen)[..., None],
        instead=True,
        high=high,
    )


def _ago(steps: int) -> Component:
    """Return where others were some steps ago, from where the fish is; near ones are felt."""
    return _late(f"{steps} steps", lambda seen: _if_far(seen, steps), lambda seen: seen.attention)


def _of_all_ago(steps: float) -> Component:
    """Return the same of near ones too: away from where they were."""
    return _late(
        f"{steps:g} steps, near ones too",
        lambda seen: seen.ago_toward(steps),
        lambda seen: seen.attention,
    )


def _away_ago(steps: int) -> Component:
    """Return the same, away from who was too near then, wherever that one is now."""
    return _late(
        f"{steps} steps, by where they were",
        lambda seen: seen.shortly_ago_toward(steps),
        lambda seen: seen.attention,
    )


def _if_far(seen: Seen, steps: int) -> Floats:
    """Return where others were, and of near ones where they are, shape (step, other, 2)."""
    return np.where(seen.too_near[..., None], seen.toward, seen.ago_toward(steps))


def _then(steps: int) -> Component:
    """Return where others were some steps ago, from where the fish was."""
    return _late(
        f"{steps} steps, from there",
        lambda seen: seen.then_toward(steps),
        lambda seen: seen.attention,
    )


_NEAR_M = (0.05, 0.15, 0.3)

_QUICK = (0.5, 1, 2, 3)
"""Steps by which responses to who is next to the fish may be late too: they are quick."""


def _by_distance(steps: int) -> Component:
    """Return a response that is late by a share of its own for each distance."""

    def weights(seen: Seen) -> Floats:
        return seen.attention[..., None] * hats_where(seen.here, seen.distance_m, _NEAR_M)

    return Component(
        label=f"{steps} steps, by distance",
        toward=lambda seen: _if_far(seen, steps),
        weights=weights,
        instead=weights,
        high=1.0,
    )


_SOON_M = (0.03, 0.06, 0.15, 0.4)
_FAR_M = 0.06


def _soon(
    label: str,
    by: Callable[[Seen], Floats],
    toward: Literal["soon_toward", "soon_ago_toward"] = "soon_toward",
) -> Component:
    """Return a response that is late by tenths of a step, of weights of each other one."""

    def weights(seen: Seen) -> Floats:
        return seen.attention[..., None] * by(seen)

    return Component(
        label=f"a tenth of a step, {label}", toward=toward,
        weights=weights, instead=weights, high=3.0,
    )  # fmt: skip


_FAR_SOON = Component(
    label="a tenth of a step, sight, far ones",
    toward="soon_toward",
    weights=lambda seen: seen.attention_ago(SOON)[..., None] * _far(seen),
    instead=lambda seen: seen.attention[..., None] * _far(seen),
    high=1.0,
)
"""Of whom the fish sees as well: others come into view and leave it late."""

_FAR_LATER = replace(
    _FAR_SOON,
    label="half a step, sight, far ones",
    toward="half_toward",
    weights=lambda seen: seen.attention_ago(0.5)[..., None] * _far(seen),
)


_BEYOND_M = (0.06, 0.1, 0.14, 0.2)


def _beyond(reach_m: float, lag: Literal["half a step", "a step"]) -> Component:
    """Return that those beyond a distance are seen late, and all others at once."""
    is_half = lag == "half a step"

    def far(seen: Seen) -> Floats:
        return (seen.here & (seen.distance_m > reach_m))[..., None].astype(np.float64)

    def late(seen: Seen) -> Floats:
        return seen.attention_ago(0.5 if is_half else 1.0)[..., None] * far(seen)

    return Component(
        label=f"{lag}, sight, beyond {reach_m:g} m",
        toward="half_toward" if is_half else lambda seen: seen.sight_ago(1.0),
        weights=late,
        instead=lambda seen: seen.attention[..., None] * far(seen),
        high=1.0,
    )


def _in_sight(word: str, steps: float) -> Component:
    """Return that whom the fish sees, and where, is late by some steps."""
    return _late(
        f"{word}, sight",
        lambda seen: seen.sight_ago(steps),
        lambda seen: seen.attention_ago(steps),
    )


def _all(seen: Seen) -> Floats:
    return seen.here[..., None].astype(np.float64)


def _soon_by_distance(seen: Seen) -> Floats:
    return hats_where(seen.here, seen.distance_m, _SOON_M)


def _far(seen: Seen) -> Floats:
    """Return one for those that are not next to the fish, shape (step, other, 1)."""
    return (seen.here & (seen.distance_m > _FAR_M))[..., None].astype(np.float64)


_ALL_SOON = _soon("near ones too", _all, "soon_ago_toward")
"""Of who is too near as well: the fish swims away from where that one was."""


_FEATURES: tuple[Feature, ...] = (
    _late("a tenth of a step", "soon_toward", lambda seen: seen.attention, 3.0),
    _late("half a step", "half_toward", lambda seen: seen.attention),
    _late("half a step, sight", "half_toward", lambda seen: seen.attention_ago(0.5)),
    _in_sight("a step", 1.0),
    _in_sight("two steps", 2.0),
    *map(_ago, LAGS),
    *map(_of_all_ago, _QUICK),
    *map(_away_ago, (1, 2, 3)),
    _ALL_SOON,
    by_circumstances(_ALL_SOON, of_each=True),
    *map(_then, LAGS),
    *map(_by_distance, LAGS),
    _soon("by distance", _soon_by_distance),
    by_circumstances(_soon("far ones", _far), of_each=True),
    _FAR_SOON,
    by_circumstances(_FAR_SOON, of_each=True),
    OneOf(
        kind="sight, beyond a distance",
        features=tuple(
            _beyond(reach_m, lag) for lag in ("half a step", "a step") for reach_m in _BEYOND_M
        ),
    ),
    by_circumstances(_FAR_LATER, of_each=True),
)


EFFECT = Effect(
    name="reaction-delay",
    says="Fish respond to where their neighbours were a moment ago.",
    reference="Nagy et al. 2010, Nature 464: 890-893",
    parameters=(
        EffectParameter(
            name="share",
            low=0.0,
            high=1.0,
            default=1.0,
            says="Share of the attention to others that goes to where they were.",
        ),
        EffectParameter(
            name="delay_s",
            low=0.0,
            high=2.0,
            default=0.6,
            says="Age of what fish see of the others, in seconds; between steps all swim straight.",
        ),
        EffectParameter(
            name="felt_m",
            low=0.0,
            high=0.2,
            default=0.0,
            says="Neighbours as near as that are felt at once, in metres.",
        ),
        EffectParameter(
            name="whole",
            low=0.0,
            high=1.0,
            default=1.0,
            says="1: whom fish see, and how large, is of that moment; 0: the direction alone, and "
            "near ones are felt at once unless near is 1.",
        ),
        EffectParameter(
            name="then",
            low=0.0,
            high=1.0,
            default=0.0,
            says="0: from where the fish is; 1: from where it was at that moment.",
        ),
        EffectParameter(
            name="near",
            low=0.0,
            high=1.0,
            default=0.0,
            says="With whole 0: 1 swims away from where those that are too near were, 0 from where "
            "they are.",
        ),
    ),
    strength="share",
    lag="delay_s",
    shapes=lambda _arena: tuple(
        {"delay_s": delay_s, "felt_m": felt_m, "whole": whole}
        for felt_m, whole in ((0.0, 1.0), (0.05, 0.0))
        for delay_s in (0.2, 0.4, 0.6, 1.0, 1.6)
    ),
    further_shapes=lambda _arena: (
        *(
            {"delay_s": delay_s, "felt_m": 0.0, "whole": 1.0}
            for delay_s in (0.02, 0.035, 0.06, 0.1, 0.15, 0.3)
        ),
        *({"delay_s": delay_s, "felt_m": 0.05, "whole": 0.0} for delay_s in (0.02, 0.05, 0.1)),
        *(
            {"delay_s": delay_s, "felt_m": 0.0, "whole": 0.0, "near": 1.0}
            for delay_s in (0.01, 0.02, 0.05)
        ),
    ),
    lacks=needs_neighbour,
    identity_s=2.4,
    fixed=("delay_s", "felt_m", "whole", "then", "near"),
    features=lambda _arena: _FEATURES,
)
