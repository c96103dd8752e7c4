"""Effects that a model can have beyond the base, one file each.

Every module of this folder that defines ``EFFECT`` is found by itself; it is named after
its effect, so that a model compiles only what it has.
"""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from functools import cache

from zfcal.errors import InputError
from zfcal.model.effects.base import (
    MAX_PARAMETERS,
    NEIGHBOURS,
    Company,
    Effect,
    EffectParameter,
)

__all__ = [
    "MAX_PARAMETERS",
    "NEIGHBOURS",
    "PREFIX",
    "Company",
    "Effect",
    "EffectParameter",
    "all_effects",
    "find_effect",
    "generic_effects",
    "less_attention_to_robots",
]


PREFIX = "generic:"
"""Begins the names of the generic family."""


@cache
def all_effects() -> tuple[Effect, ...]:
    """Return every listed effect, in the order of their names; the generic ones stand apart."""
    found = (_effect_of(module.name) for module in _modules())
    return tuple(sorted((effect for effect in found if effect), key=lambda effect: effect.name))


@cache
def generic_effects() -> tuple[Effect, ...]:
    """Return every effect of the generic family, in the order of their names.

    Named ``generic:heading:CUE``, ``generic:speed:CUE`` and ``generic:attention:CUE``. None of
    them is an explanation; each says to what the fish respond, and in which direction, so that an
    effect that nobody listed is still located, described and added.
    """
    from zfcal.model.effects.generic_attention import EFFECTS as ON_ATTENTION
    from zfcal.model.effects.generic_heading import EFFECTS as ON_HEADING
    from zfcal.model.effects.generic_speed import EFFECTS as ON_SPEED

    return tuple(sorted((*ON_ATTENTION, *ON_HEADING, *ON_SPEED), key=lambda effect: effect.name))


def find_effect(name: str) -> Effect:
    """Return the effect of a name, or raise an `InputError` that lists the nearest ones.

    Those of the generic family are found as well: ``generic:heading:wall``.
    """
    if name.startswith(PREFIX):
        effect = next((one for one in generic_effects() if one.name == name), None)
    else:
        modules = {found.name.replace("_", "-"): found.name for found in _modules()}
        effect = _effect_of(modules[name]) if name in modules else None
    if effect:
        return effect
    known = [one.name for one in (*all_effects(), *generic_effects())]
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
    raise InputError(
        f"There is no effect {name!r}.",
        hint=f"Did you mean {' or '.join(near)}?" if near else f"Known: {', '.join(known)}.",
    )


def less_attention_to_robots(lost: float) -> dict[str, dict[str, float]]:
    """Return the effect by which fish attend to a robot less than to a fish, at its parameters.

    Parameters
    ----------
    lost
        Log of the attention that the robot loses.
    """
    # Only here: an import compiles the effect, and a model has few of them.
    from zfcal.model.effects.robot_avoidance import less_attention

    return less_attention(lost)


def _modules() -> list[pkgutil.ModuleInfo]:
    return list(pkgutil.iter_modules(__path__))


@cache
def _effect_of(module: str) -> Effect | None:
    found: Effect | None = getattr(importlib.import_module(f"{__name__}.{module}"), "EFFECT", None)
    return found
