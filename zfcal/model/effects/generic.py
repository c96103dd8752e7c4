"""The generic family: what draws headings, speed or attention, cue by cue, for what is unlisted.

Named ``generic:heading:CUE``, ``generic:speed:CUE`` and ``generic:attention:CUE``. None of them
is an explanation; each
says to what the fish respond, and in which direction, so that an effect that nobody listed
is still located, described and added.
"""

from __future__ import annotations

from functools import cache

from zfcal.model.effects.base import Effect

PREFIX = "generic:"


@cache
def generic_effects() -> tuple[Effect, ...]:
    """Return every effect of the family, in the order of their names."""
    from zfcal.model.effects.generic_attention import EFFECTS as ON_ATTENTION
    from zfcal.model.effects.generic_heading import EFFECTS as ON_HEADING
    from zfcal.model.effects.generic_speed import EFFECTS as ON_SPEED

    return tuple(sorted((*ON_ATTENTION, *ON_HEADING, *ON_SPEED), key=lambda effect: effect.name))
