"""Which effect a law lacks: the name whose features gain most, if that is more than chance."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from zfcal.diagnose.features.false_gains import NO_NOISE, ByNoise
from zfcal.diagnose.features.gains import Gain
from zfcal.diagnose.naming import SURE
from zfcal.diagnose.selection import LEVEL

_HELD_AGAINST_NOISE = 3
"""Names that are held against noise at a time, those that gain most first."""

Noise = Callable[[Sequence[Gain]], Sequence[ByNoise]]
"""Of some gains: what noise of positions alone makes each of these features gain."""


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
        By how many standard errors it gains more than any other name; infinite without one, 0 of a
        name that is not the best.
    others
        Names that gain more than chance as well, the best first.
    cause
        The one of these that explains it: see `explained`.
    """

    gain: Gain
    p: float
    ties: tuple[Gain, ...]
    lead: float = math.inf
    others: tuple[Told, ...] = ()
    cause: Told | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """A name that gains more than chance, and no more than noise of positions may make.

    Parameters
    ----------
    name
        Of the effect.
    nats
        What its best feature gains.
    noise_nats
        That it has to gain more than by exact positions.
    noise_share
        Share of this noise at which it would be told, if what noise makes goes by its size.
    """

    name: str
    nats: float
    noise_nats: float
    noise_share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answer:
    """What features say, and which names noise of positions hides.

    Parameters
    ----------
    told
        None where chance, or noise, may have made all gains.
    hidden
        By name.
    """

    told: Told | None
    hidden: tuple[Hidden, ...] = ()


def tell(gains: Sequence[Gain], noise: Noise | None = None, *, level: float = LEVEL) -> Told | None:
    """Return which name it is; None where chance may have made all gains.

    Parameters
    ----------
    gains, noise, level
        As of `answer`.
    """
    return answer(gains, noise, level=level).told


def answer(gains: Sequence[Gain], noise: Noise | None = None, *, level: float = LEVEL) -> Answer:
    """Return which name it is, and what noise hides.

    Parameters
    ----------
    gains
        Of all features of all names.
    noise
        Asked of those alone that stand out; None for positions that are exact.
    level
        Of false alarms.
    """
    n_tried = tried(gains)

    def beyond_chance(some: Sequence[Gain]) -> list[Gain]:
        return [gain for gain in some if gain.p * n_tried[gain.name] < level and gain.nats > 0]

    clear = beyond_chance(gains)
    lost: list[Gain] = []
    if noise is not None:
        held: list[Gain] = []
        doubtful, waiting, clear = clear, best_by_name(clear), []
        # Noise may hide those that gain most: then the next ones are asked.
        while waiting and not clear:
            ahead = {gain.name for gain in waiting[:_HELD_AGAINST_NOISE]}
            waiting = waiting[_HELD_AGAINST_NOISE:]
            held += _held([gain for gain in doubtful if gain.name in ahead], noise)
            clear = beyond_chance(held)
        known = {gain.name for gain in held}
        stand = {gain.name for gain in clear}
        lost = best_by_name([gain for gain in held if gain.name not in stand])
        gains = [*held, *(gain for gain in gains if gain.name not in known)]
    hidden = tuple(_hidden(gain, level / n_tried[gain.name]) for gain in lost)
    # What counts with a gain counts where that is more than chance, for the order of names alone.
    standing = {id(gain) for gain in clear}
    gains = [gain.whole if id(gain) in standing else gain for gain in gains]
    best = best_by_name([gain.whole for gain in clear])
    if not best:
        return Answer(told=None, hidden=hidden)
    first, *others = best
    others += [gain for gain in lost if gain.nats > first.nats]
    ties = tuple(gain for gain in others if lead_over(first, gain) <= SURE)
    lead = min(
        (lead_over(first, g) for g in best_by_name(gains) if g.name != first.name), default=math.inf
    )
    p = {gain.name: min(1.0, gain.p * n_tried[gain.name]) for gain in best}
    rest = tuple(Told(gain=gain, p=p[gain.name], ties=(), lead=0.0) for gain in best[1:])
    told = Told(gain=first, p=p[first.name], ties=ties, lead=lead, others=rest)
    return Answer(told=told, hidden=hidden)


def _held(gains: Sequence[Gain], noise: Noise) -> list[Gain]:
    """Return gains with what noise makes of them, but for those by the law of exact positions."""
    doubted = [gain for gain in gains if not gain.without_noise]
    known = zip(doubted, noise(doubted) if doubted else (), strict=True)
    exact = [gain for gain in gains if gain.without_noise]
    return exact + [replace(gain, noise=own) for gain, own in known]


def _hidden(gain: Gain, level: float) -> Hidden:
    raw, n = float(gain.log_p.sum()), gain.n_strengths
    exact, noisy = (noise.most(n, level / gain.n_tried) for noise in (NO_NOISE, gain.noise))
    share = (raw - exact) / (noisy - exact) if noisy > exact else 1.0
    return Hidden(
        name=gain.name,
        nats=raw - n,
        noise_nats=noisy - exact,
        noise_share=min(max(share, 0.0), 1.0),
    )


def best_by_name(gains: Sequence[Gain]) -> list[Gain]:
    """Return the best feature of each name, the best name first."""
    found: dict[str, Gain] = {}
    for gain in gains:
        if gain.name not in found or gain.nats > found[gain.name].nats:
            found[gain.name] = gain
    return sorted(found.values(), key=lambda gain: -gain.nats)


def tried(gains: Sequence[Gain]) -> dict[str, int]:
    """Return by how much the chance of a gain counts, by its name.

    Each name has the same share of the level, and each kind of feature the same share of its
    name's (a weighted inequality of Bonferroni): a name with many features takes from no other.
    """
    kinds = {(*gain.key, gain.without_noise) for gain in gains}
    n_kinds = Counter(name for name, *_ in kinds)
    return {name: n * len(n_kinds) for name, n in n_kinds.items()}


def lead_over(one: Gain, other: Gain) -> float:
    """Return by how many standard errors a feature gains more than another one."""
    by = one.log_p - other.log_p
    error = float(by.std()) * math.sqrt(len(by))
    return (one.nats - other.nats) / max(error, 1e-12)
