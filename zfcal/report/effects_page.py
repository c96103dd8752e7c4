"""The page of all effects for the documentation, from the effects themselves."""

from __future__ import annotations

from collections.abc import Sequence

from zfcal.model.effects import all_effects, generic_effects
from zfcal.model.effects.base import Effect, EffectParameter

_HEAD = """\
# Effects

What fish may do beyond the base model. Each effect can stand in a model file, with its parameters:

{example}
`zfcal diagnose` tests a recording for each of them, `zfcal extend` adds the one that is missing,
and `zfcal simulate` and `calibrate` swim by it. The parameter in bold is the strength: at 0 the
effect does nothing. Where it may be negative the second sentence holds. A parameter that the model
file leaves out has its default.

This page is made by `make effects-page` from the files in `zfcal/model/effects/`.
"""

_GENERIC = """
## The generic family

For what is on no list. None of these explains anything: each says to which cue the fish respond,
and in which direction. A model file names them in quotation marks:

{example}
Their strength tilts the heading toward the cue's direction or away from it, or it multiplies the
speed.
"""


def effects_page() -> str:
    """Return the page in Markdown: sentences, parameters with bounds and units, references."""
    return _part(_HEAD, all_effects()) + _part(_GENERIC, generic_effects())


def _part(head: str, effects: Sequence[Effect]) -> str:
    plainest = min(reversed(effects), key=lambda effect: len(effect.parameters))
    sections = "".join(_section(effect) for effect in effects)
    return head.format(example=_example(plainest)) + sections


def _example(effect: Effect) -> str:
    """Return the lines of a model file that give an effect its parameters' defaults."""
    name = f'"{effect.name}"' if effect.generic else effect.name
    rows = "".join(f"    {each.name} = {each.default:g}\n" for each in effect.parameters)
    return f"    [effects.{name}]\n{rows}"


def _section(effect: Effect) -> str:
    level = "###" if effect.generic else "##"
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
