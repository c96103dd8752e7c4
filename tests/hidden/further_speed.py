"""Further forms of effects on speeds: a factor, a share of a past speed, a shifted score.

A speed is ``scale`` times the raw draw plus ``shift``, and the raw draw's normal score has
a mean and a spread that may depend on what came before.
"""

from __future__ import annotations

import math

from numba import njit

from hidden.states import (
    AFTER_TURN,
    COMPANYS_PACE,
    GLIDE,
    JOSTLE,
    NEAR_ANOTHER,
    NEARESTS_PACE,
    RHYTHM,
    SUDDEN_FATIGUE,
    UNEVEN_FATIGUE,
)
from hidden.surroundings import clock_s, company, mean_speed, nearest_of


@njit(cache=True)
def further_factor(i, t, past, plan):
    """Return the factor of further forms on the drawn speed."""
    s, c, factor = plan.strength[i], plan.constants, 1.0
    if s[COMPANYS_PACE] > 0 and t > 0:
        pace, n = mean_speed(i, t, past, c[COMPANYS_PACE, 0])
        if n > 0:
            factor *= min(2.0, max(0.5, pace / 0.08)) ** s[COMPANYS_PACE]
    if s[NEAR_ANOTHER] > 0:
        away = nearest_of(i, t, past)[1]
        factor *= max(0.1, 1 - s[NEAR_ANOTHER] * math.exp(-away / c[NEAR_ANOTHER, 0]))
    if s[JOSTLE] > 0 and company(i, t, past, c[JOSTLE, 0])[2] >= 2:
        factor *= 1 + s[JOSTLE]
    if s[AFTER_TURN] > 0 and t > 0:
        wide = (abs(past.turn[t - 1, i]) - c[AFTER_TURN, 0]) / 0.15
        factor *= 1 - s[AFTER_TURN] / (1 + math.exp(-wide))
    if s[SUDDEN_FATIGUE] > 0 and clock_s(t, past) > c[SUDDEN_FATIGUE, 0]:
        factor *= 1 - s[SUDDEN_FATIGUE]
    if s[UNEVEN_FATIGUE] > 0 and plan.bold[i] < 0:
        factor *= 1 - s[UNEVEN_FATIGUE] * (1 - math.exp(-clock_s(t, past) / c[UNEVEN_FATIGUE, 0]))
    return factor


@njit(cache=True)
def glide(i, t, past, plan):
    """Return the share of the speed that is left of the last one, and that speed.

    Only a fast fish glides.
    """
    c = plan.constants
    if plan.strength[i, GLIDE] <= 0 or t == 0 or past.speed[t - 1, i] < c[GLIDE, 0]:
        return 0.0, 0.0
    return plan.strength[i, GLIDE], c[GLIDE, 1] * past.speed[t - 1, i]


@njit(cache=True)
def score_law(i, t, past, plan):
    """Return mean and standard deviation of the normal score of the raw draw.

    All scores together stay standard normal: the rhythm is a second-order autoregression
    of unit variance, given by its two partial correlations.
    """
    s, c = plan.strength[i], plan.constants
    mean, sd = 0.0, 1.0
    if s[NEARESTS_PACE] > 0 and t > 0:
        nearest = nearest_of(i, t, past)[0]
        if nearest >= 0:
            mean = s[NEARESTS_PACE] * past.score[t - 1, nearest]
            sd = math.sqrt(1 - s[NEARESTS_PACE] ** 2)
    if s[RHYTHM] > 0 and t > 1:
        once = s[RHYTHM] * math.cos(c[RHYTHM, 0])
        twice = -s[RHYTHM] * math.sin(c[RHYTHM, 0])
        mean += once * (1 - twice) * past.score[t - 1, i] + twice * past.score[t - 2, i]
        sd *= math.sqrt((1 - once**2) * (1 - twice**2))
    return mean, sd
