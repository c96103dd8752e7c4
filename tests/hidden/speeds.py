"""The law of the next speed, and the probability of its bin.

Lengths are metres, times seconds, angles radians.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hidden.further_speed import further_factor, glide, score_law
from hidden.states import BURST_AND_COAST, CROWDING, DT_S, FATIGUE, LIT_ROOM, SPEED_MATCHING
from hidden.surroundings import company, room_of


@njit(cache=True)
def speed_factor(i, t, past, plan):
    """Return the factor on the drawn speed: neighbours, time, light."""
    s, factor = plan.strength[i], 1.0
    x, y = past.xy[t, i, 0], past.xy[t, i, 1]
    if s[CROWDING] != 0:
        factor *= min(3.0, max(0.2, 1 + s[CROWDING] * company(i, t, past, 0.10)[2]))
    if s[FATIGUE] > 0:
        factor *= math.exp(-s[FATIGUE] * max(0, t - past.first) * DT_S / 1800)
    if s[LIT_ROOM] > 0 and past.zone[t, i] != 1 and room_of(x, y) == 0:
        factor *= 1 + s[LIT_ROOM]
    if plan.further:
        factor *= further_factor(i, t, past, plan)
    return factor


@njit(cache=True)
def pace_of_nearest(i, t, past):
    """Return the mean last speed of the two nearest others."""
    n = past.xy.shape[1]
    away = np.full(n, np.inf)
    for j in range(n):
        if j != i:
            away[j] = math.hypot(
                past.xy[t, j, 0] - past.xy[t, i, 0], past.xy[t, j, 1] - past.xy[t, i, 1]
            )
    near = np.argsort(away)[: min(2, n - 1)]
    total = 0.0
    for j in near:
        total += past.speed[t - 1, j]
    return total / len(near)


@njit(cache=True)
def normal_share(score):
    """Return the share of a normal law below a score."""
    return 0.5 * (1 + math.erf(score / math.sqrt(2)))


@njit(cache=True)
def normal_score(share):
    """Return the score below which a share of a normal law lies, by halving."""
    low, high = -9.0, 9.0
    for _ in range(40):
        middle = (low + high) / 2
        if normal_share(middle) < share:
            low = middle
        else:
            high = middle
    return (low + high) / 2


@njit(cache=True)
def speed_terms(i, t, past, plan):
    """Return what the effects make of the raw draw: the speed is scale times it plus shift."""
    s = plan.strength[i]
    scale, shift = speed_factor(i, t, past, plan), 0.0
    if s[SPEED_MATCHING] > 0 and t > 0:
        scale *= 1 - s[SPEED_MATCHING]
        shift = s[SPEED_MATCHING] * pace_of_nearest(i, t, past)
    if plan.further:
        kept, last = glide(i, t, past, plan)
        scale *= 1 - kept
        shift = (1 - kept) * shift + kept * last
    return scale, shift


@njit(cache=True)
def draw_speed(i, t, law, past, plan, rng):
    """Return a speed, its normal score, and what the effects made of the raw draw."""
    s, shares = plan.strength[i], law.speed[past.zone[t, i]]
    score = rng.normal(0.0, 1.0)
    if s[BURST_AND_COAST] > 0 and t > 0:
        r = s[BURST_AND_COAST]
        score = r * past.score[t - 1, i] + math.sqrt(1 - r * r) * score
    if plan.further:
        mean, sd = score_law(i, t, past, plan)
        score = mean + sd * score
    u, b = normal_share(score), 0
    while b < 9 and u > shares[b]:
        u -= shares[b]
        b += 1
    scale, shift = speed_terms(i, t, past, plan)
    return scale * 0.02 * (b + min(1.0, u / shares[b])) + shift, score, scale, shift


@njit(cache=True)
def speed_bin(v):
    """Return the bin of a speed: below 2.5 mm/s, up to 2 cm/s, and every 2 cm/s from there."""
    if v < 0.02:
        return 0 if v < 0.0025 else 1
    return 1 + min(38, int(v / 0.02))


@njit(cache=True)
def share_below(v, i, t, scale, shift, law, past, plan):
    """Return the probability of a lower speed, given all that came before."""
    shares, raw = law.speed[past.zone[t, i]], (v - shift) / scale / 0.02
    below = 0.0
    for b in range(10):
        below += shares[b] * min(1.0, max(0.0, raw - b))
    r = plan.strength[i, BURST_AND_COAST]
    if plan.further and 0 < below < 1:
        mean, sd = score_law(i, t, past, plan)
        if sd < 1:
            below = normal_share((normal_score(below) - mean) / sd)
    if r > 0 and t > 0 and 0 < below < 1:
        below = (normal_score(below) - r * past.score[t - 1, i]) / math.sqrt(1 - r * r)
        return normal_share(below)
    return below


@njit(cache=True)
def note_speed(i, t, scale, shift, law, past, plan):
    """Add the log probability of the bin that a speed is in.

    Of the bin, not of the speed: the edges of the speeds' histogram are sharp, and what
    an effect does to them could be seen by nobody.
    """
    b = speed_bin(past.speed[t, i])
    low = 0.0 if b == 0 else (0.0025 if b == 1 else 0.02 * (b - 1))
    high = 0.0025 if b == 0 else 0.02 * b
    mass = share_below(high, i, t, scale, shift, law, past, plan)
    mass -= share_below(low, i, t, scale, shift, law, past, plan)
    past.log_speed[t, i] += math.log(max(mass, 1e-4))
