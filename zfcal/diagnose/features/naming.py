"""Which effect a law lacks: the name whose features gain most, if that is more than chance."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.naming import SURE
from zfcal.diagnose.selection import LEVEL

_HELD_AGAINST_NOISE = 3
"""Names, those that gain most: the others have no chance to be the best."""

Noise = Callable[[Sequence[Gain]], Sequence[float]]
"""Of some gains: what noise of positions alone makes each of these features gain, in nats."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Told:
    """What features say that a law lacks.

    Parameters
    ----------
    gain
        Of the name's best feature.
    p
        Over the whole family.
    ties
        Of names that cannot be told from it, the best first.
    lead
        By how many standard errors it gains more than any other name; infinite without one.
    """

    gain: Gain
    p: float
    ties: tuple[Gain, ...]
    lead: float = math.inf


def tell(gains: Sequence[Gain], noise: Noise | None = None, *, level: float = LEVEL) -> Told | None:
    """Return which name it is; None where chance may have made all gains.

    Parameters
    ----------
    gains
        Of all features of all names.
    noise
        Asked of those alone that stand out; None for positions that are exact.
    level
        Of false alarms.
    """
    n_tried = sum(gain.n_tried for gain in once(gains))
    clear = [gain for gain in gains if gain.p * n_tried < level and gain.nats > 0]
    if noise is not None:
        ahead = {gain.name for gain in best_by_name(clear)[:_HELD_AGAINST_NOISE]}
        doubted = [g for g in clear if g.name in ahead and not g.without_noise]
        known = zip(doubted, noise(doubted) if doubted else (), strict=True)
        clear = [gain for gain in clear if gain.without_noise and gain.name in ahead]
        clear += [replace(gain, noise_nats=nats) for gain, nats in known]
        clear = [gain for gain in clear if gain.p * n_tried < level and gain.nats > 0]
    best = best_by_name(clear)
    if not best:
        return None
    first, *others = best
    ties = tuple(gain for gain in others if _lead(first, gain) <= SURE)
    lead = min(
        (_lead(first, g) for g in best_by_name(gains) if g.name != first.name), default=math.inf
    )
    return Told(gain=first, p=min(1.0, first.p * n_tried), ties=ties, lead=lead)


def without_names(told: Told, names: Collection[str]) -> Told:
    """Return what is told without some of the names that cannot be told from each other."""
    first, *ties = (gain for gain in (told.gain, *told.ties) if gain.name not in names)
    return replace(told, gain=first, ties=tuple(ties))


def best_by_name(gains: Sequence[Gain]) -> list[Gain]:
    """Return the best feature of each name, the best name first."""
    found: dict[str, Gain] = {}
    for gain in gains:
        if gain.name not in found or gain.nats > found[gain.name].nats:
            found[gain.name] = gain
    return sorted(found.values(), key=lambda gain: -gain.nats)


def once(gains: Sequence[Gain]) -> list[Gain]:
    """Return gains with one of those that are the best of the same features by the same law."""
    return list({(gain.key, gain.without_noise): gain for gain in gains}.values())


def _lead(one: Gain, other: Gain) -> float:
    """Return by how many standard errors a feature gains more than another one."""
    by = one.log_p - other.log_p
    error = float(by.std()) * math.sqrt(len(by))
    return (one.nats - other.nats) / max(error, 1e-12)
