"""The page of all effects for the documentation, from the effects themselves."""

from __future__ import annotations

from collections.abc import Sequence

from zfcal.model.effects import all_effects, generic_effects
from zfcal.model.effects.base import Effect, EffectParameter, curve_of
from zfcal.model.kernels.curves import BY_NEAREST

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

_CURVES = """
## Curves

The strength of any effect that is no delay and no rest may go by something, such as the distance to
the nearest:

    [effects.{name}]
    {strength} = 0.1
    by = {by}
    knot_1 = 0.03
    knot_2 = 0.1
    knot_3 = 0.25
    more_1 = 0.9
    more_3 = -0.7

So it is 1 where the nearest is within 3 cm (0.1 + 0.9), 0.1 at 10 cm, and -0.6 from 25 cm on
(0.1 - 0.7); between the knots it changes evenly, in 16 steps. It stays within the range that it has
without a curve. `zfcal diagnose` gives a curve to what it names where features gain more than any
plain form does, and the curve gains more than its two further parameters cost.

| parameter | default | what it is |
|---|---|---|
{rows}
What is of the other goes by whom the fish attends to, where an effect changes attention, and by the
nearest elsewhere. `calibrate` moves the strength, and so the whole curve with it.
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
    rows = "".join(
        f"| `{each.name}` | {each.default:g} | {each.says} |\n" for each in curve_of(0.0, 1.0)
    )
    signed = _plainest([effect for effect in all_effects() if effect.opposite])
    curves = _CURVES.format(name=signed.name, strength=signed.strength, by=BY_NEAREST, rows=rows)
    return _part(_HEAD, all_effects()) + curves + _part(_GENERIC, generic_effects())


def _part(head: str, effects: Sequence[Effect]) -> str:
    sections = "".join(_section(effect) for effect in effects)
    return head.format(example=_example(_plainest(effects))) + sections


def _plainest(effects: Sequence[Effect]) -> Effect:
    return min(reversed(effects), key=lambda effect: len(effect.parameters))


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
