"""The page of all effects for the documentation, from the effects themselves."""

from __future__ import annotations

from zfcal.model.effects import all_effects, generic_effects
from zfcal.model.effects.base import Effect, EffectParameter

_HEAD = """\
# Effects

What fish may do beyond the base model. Each effect can stand in a model file, with its parameters:

    [effects.wall-persistence]
    strength = 0.7

`zfcal diagnose` asks a recording for each of them, `zfcal extend` adds the one that is missing,
and `zfcal simulate` and `calibrate` swim by it. The parameter in bold is the strength: at 0 the
effect does nothing. Where it may be negative the second sentence holds. A parameter that the model
file leaves out has its default.

This page is made by `make effects-page` from the files in `zfcal/model/effects/`.
"""

_GENERIC = """
## The generic family

For what is on no list. None of these explains anything: each says to which cue the fish respond,
and in which direction. A model file names them in quotation marks:

    [effects."generic:heading:wall"]
    strength = 0.5
    reach_m = 0.05

Their strength tilts the heading toward the cue's direction or away from it, or it multiplies the
speed.
"""


def effects_page() -> str:
    """Return the page in Markdown: sentences, parameters with bounds and units, references."""
    listed = "".join(_section(effect) for effect in all_effects())
    generic = "".join(_section(effect) for effect in generic_effects())
    return _HEAD + listed + _GENERIC + generic


def _section(effect: Effect) -> str:
    level = "###" if ":" in effect.name else "##"
    opposite = f" *Negative:* {effect.opposite}" if effect.opposite else ""
    rows = "".join(_row(parameter, effect.strength) for parameter in effect.parameters)
    return (
        f"\n{level} `{effect.name}`\n\n{effect.says}{opposite}\n\n"
        "| parameter | range | default | what it is |\n|---|---|---|---|\n"
        f"{rows}\n{effect.reference}.\n"
    )


def _row(parameter: EffectParameter, strength: str) -> str:
    name = f"`{parameter.name}`"
    name = f"**{name}**" if parameter.name == strength else name
    return (
        f"| {name} | {parameter.low:g} to {parameter.high:g} | {parameter.default:g} "
        f"| {parameter.says} |\n"
    )
