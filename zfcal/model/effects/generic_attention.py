"""Generic effects on attention: neighbours count more or less by where they are."""

from __future__ import annotations

import math

from zfcal.model.effects.base import Effect, EffectParameter
from zfcal.model.effects.cues import REFERENCE, bearing, number, too_far
from zfcal.model.effects.forms import apart, needs_neighbour
from zfcal.model.kernels.compiled import hook
from zfcal.model.kernels.hooks import SIGHT
from zfcal.model.kernels.state import HX, HY


@hook(SIGHT)
def neighbour_side(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow the sine of a neighbour's bearing: 1 on the left, -1 on the right."""
    x, y = bearing(state, n, i, j)
    return math.exp(parameters[0] * (state[HX * n + i] * y - state[HY * n + i] * x))


@hook(SIGHT)
def neighbour_distance(state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Follow whether a neighbour is farther than a distance."""
    return math.exp(parameters[0] * too_far(apart(state, n, i, j), parameters[1], 0.03))


def _effect(
    cue: str, sight: object, sentences: tuple[str, str], *parameters: EffectParameter
) -> Effect:
    return Effect(
        name=f"generic:attention:{cue}",
        says=sentences[0],
        opposite=sentences[1],
        reference=REFERENCE,
        parameters=(
            number("strength", (-3.0, 3.0), 0.5, "Log of the attention gained with the whole cue."),
            *parameters,
        ),
        sight=sight,
        generic=True,
        lacks=needs_neighbour,
        shapes=(lambda _arena: tuple({"middle_m": m} for m in (0.06, 0.15)))
        if parameters
        else (lambda _arena: ({},)),
    )


EFFECTS = (
    _effect(
        "neighbour-side",
        neighbour_side,
        (
            "Fish attend more to neighbours on their left than to those on their right.",
            "Fish attend more to neighbours on their right than to those on their left.",
        ),
    ),
    _effect(
        "neighbour-distance",
        neighbour_distance,
        (
            "Fish attend more to far neighbours, and less to near ones, than the model has it.",
            "Fish attend more to near neighbours, and less to far ones, than the model has it.",
        ),
        number("middle_m", (0.02, 0.6), 0.1, "The distance between near and far, in metres."),
    ),
)
