"""Effects that a model can have beyond the base, one file each.

Every module of this folder that defines ``EFFECT`` is found by itself.
"""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from functools import cache

from zfcal.errors import InputError
from zfcal.model.effects.base import MAX_PARAMETERS, Effect, EffectParameter

__all__ = ["MAX_PARAMETERS", "Effect", "EffectParameter", "all_effects", "find_effect"]


@cache
def all_effects() -> tuple[Effect, ...]:
    """Return every effect, in the order of their names."""
    modules = (
        importlib.import_module(f"{__name__}.{module.name}")
        for module in pkgutil.iter_modules(__path__)
    )
    found = (module.EFFECT for module in modules if hasattr(module, "EFFECT"))
    return tuple(sorted(found, key=lambda effect: effect.name))


def find_effect(name: str) -> Effect:
    """Return the effect of a name, or raise an `InputError` that lists the nearest ones."""
    known = {effect.name: effect for effect in all_effects()}
    if name not in known:
        near = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
        raise InputError(
            f"There is no effect {name!r}.",
            hint=f"Did you mean {' or '.join(near)}?" if near else f"Known: {', '.join(known)}.",
        )
    return known[name]
