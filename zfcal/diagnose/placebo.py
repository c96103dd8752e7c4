"""A wrong effect, to show that more parameters alone do not close a gap."""

from __future__ import annotations

from collections.abc import Collection

from zfcal.model.effects import Effect, all_effects, find_effect
from zfcal.model.effects.base import Company


def placebo_for(name: str, company: Company, *, without: Collection[str]) -> Effect | None:
    """Return the placebo of an effect; None where there is none.

    The rule looks at no data: of the effects that change the same (heading or speed) and
    that the recording could show, those with the number of fitted parameters nearest to
    the effect's; of these the next one in the order of names, from the effect's on.

    Parameters
    ----------
    name
        The effect.
    company
        Whom and what the recording holds.
    without
        Effects that the model has, that are missing, or that cannot be told from these.
    """
    right = find_effect(name)
    n_free = count_free(right)
    fitting = [
        effect
        for effect in all_effects()
        if effect.on_speed == right.on_speed
        and effect.name not in {name, *without}
        and effect.lacks(company) is None
        and effect.may_be_placebo
    ]
    if not fitting:
        return None
    names = sorted({effect.name for effect in fitting})
    after = [each for each in names if each > name] + [each for each in names if each < name]
    turn = {each: number for number, each in enumerate(after)}
    return min(fitting, key=lambda e: (abs(count_free(e) - n_free), turn[e.name]))


def count_free(effect: Effect) -> int:
    """Return how many parameters of an effect a fit moves, at least one."""
    return max(1, len(effect.free({})))
