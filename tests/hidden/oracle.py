"""What an oracle would know: nats of the true density over the base law at its best fit.

The base law's headings are fitted by maximum likelihood, its speeds are the
shares of bins in each zone.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numba import njit
from scipy.special import i0e, i1e

from hidden import kernels, speeds, states
from hidden.effects import BOTH, HEADING, SPEED
from hidden.further import FORMS
from hidden.law import Base, law_of, no_plan

N_ANGLES = 72
_ENOUGH_NATS = 0.01


@njit(cache=True)
def _log_likelihood(values, ratio, walls, base, toward, sr, land, theta, landed):
    """Return the log likelihood of headings in one zone, and each step's scores.

    ``values``: kappa_0, kappa_f, alpha, their two scales, then gamma by zone id;
    ``ratio``: I1 / I0 of both kappas. The scores are for the logarithms of the gammas.
    """
    k0, kf, alpha, c0, cf = values[:5]
    gamma = values[5:]
    n, angles = land.shape
    step = 2 * math.pi / angles
    cosine = np.cos(-math.pi + (np.arange(angles) + 0.5) * step)
    sine = np.sin(-math.pi + (np.arange(angles) + 0.5) * step)
    scores, total = np.zeros((n, 3 + gamma.size)), 0.0
    z, parts = np.zeros(3 + gamma.size), np.zeros(4)
    for m in range(n):
        z[:] = 0.0
        weight = 0.0
        base_c, base_s = math.cos(base[m]), math.sin(base[m])
        to_c, to_s = np.cos(toward[m]), np.sin(toward[m])
        for k in range(angles + 1):
            if k < angles:
                c, s, to = cosine[k], sine[k], land[m, k]
            else:
                c, s, to = math.cos(theta[m]), math.sin(theta[m]), landed[m]
            if gamma[to] <= 0:
                continue
            parts[:] = 0.0
            u = c * base_c + s * base_s
            if walls:
                a, b = math.exp(k0 * (u - 1)), math.exp(k0 * (-u - 1))
                parts[0] = 0.5 * c0 * (a + b)
                parts[1] = 0.5 * c0 * (a * (u - ratio[0]) + b * (-u - ratio[0]))
            else:
                parts[0] = c0 * math.exp(k0 * (u - 1))
                parts[1] = parts[0] * (u - ratio[0])
            for j in range(sr.shape[1]):
                if sr[m, j] > 0:
                    u = c * to_c[j] + s * to_s[j]
                    bell = sr[m, j] * cf * math.exp(kf * (u - 1))
                    parts[2] += bell
                    parts[3] += bell * (u - ratio[1])
            density = parts[0] + alpha * parts[2]
            if k < angles:
                weight += gamma[to] * density
                z[0] += gamma[to] * parts[1]
                z[1] += gamma[to] * alpha * parts[3]
                z[2] += gamma[to] * alpha * parts[2]
                z[3 + to] += gamma[to] * density
            else:
                total += math.log(max(gamma[to] * density, 1e-300)) - math.log(weight * step)
                scores[m, 0] += parts[1] / density
                scores[m, 1] += alpha * parts[3] / density
                scores[m, 2] += alpha * parts[2] / density
                scores[m, 3 + to] += 1.0
                scores[m] -= z / weight
    return total, scores


def _fit_zone(base: Base, zone: int, table: tuple, *, free: tuple[int, ...]):
    """Return a zone's parameters at their maximum likelihood: kappa_0, kappa_f, alpha, gammas.

    ``free`` are the zones whose gamma is sought; the zone's own stays as it is. Steps
    are those of Berndt, Hall, Hall and Hausman (1974): the information is that of the
    scores' outer products.
    """

    def unfold(p):
        kappa_0, kappa_f, alpha = np.exp(p[:3])
        gamma = np.zeros(4)
        gamma[zone] = base.gamma[zone, zone]
        gamma[list(free)] = np.exp(p[3:])
        return kappa_0, kappa_f, alpha, gamma

    def climb(p):
        k0, kf, alpha, gamma = unfold(p)
        values = np.array([k0, kf, alpha, *(1 / (2 * math.pi * i0e([k0, kf]))), *gamma])
        ratio = np.array([i1e(k) / i0e(k) for k in (k0, kf)])
        value, scores = _log_likelihood(values, ratio, zone != 3, *table)
        scores = scores[:, [0, 1, 2, *(3 + z for z in free)]]
        scores = scores * np.array([k0, kf, alpha, *(1.0 for _ in free)])
        return value, scores.sum(axis=0), scores.T @ scores

    first = np.log([base.kappa_0[zone], base.kappa_f[zone], base.alpha[zone]])
    low = np.log([1e-2, 1e-2, 1e-4] + [1e-4] * len(free))
    high = np.log([200.0, 200.0, 1e4] + [1e4] * len(free))
    p = np.concatenate([first, np.log(base.gamma[zone, list(free)])])
    best, slope, information = climb(p)
    ridge = 1e-3
    for _ in range(60):
        eased = information + ridge * (np.diag(np.diag(information)) + np.eye(len(p)))
        move = np.linalg.solve(eased, slope)
        q = np.clip(p + np.clip(move, -0.7, 0.7), low, high)
        value, *other = climb(q)
        if not value > best:
            ridge *= 10
            if ridge > 1e4:
                break
            continue
        gain, best, p, (slope, information), ridge = value - best, value, q, other, ridge / 10
        if gain < _ENOUGH_NATS:
            break
    return unfold(p)


def fit_base(base: Base, world, past, steps) -> Base:
    """Return the base law at its maximum likelihood of the headings of a run.

    Parameters
    ----------
    base
        Where the search starts; its speeds and field of view are kept.
    world, past
        The tank and the run, as the loops take them.
    steps : tuple of ndarray, shape (step,)
        Which steps count: their times and agents.
    """
    step, agent = steps
    found = replace(
        base, kappa_0=base.kappa_0.copy(), kappa_f=base.kappa_f.copy(),
        alpha=base.alpha.copy(), gamma=base.gamma.copy(),
    )  # fmt: skip
    zones = past.zone[step, agent]
    for zone in (1, 2, 3):
        rows = zones == zone
        if rows.sum() < 50:
            continue
        a, b = step[rows], agent[rows]
        *where, land, landed = kernels.contexts(a, b, world, law_of(base), past, N_ANGLES)
        theta = states.ANGLE[cells_of(past.heading[a + 1, b])]
        # A landing at the cell's middle may lie just outside.
        landed = np.where(landed == 0, past.zone[a + 1, b], landed)
        free = tuple(z for z in np.unique(landed) if z != zone)
        table = (*where, land, theta, landed)
        k0, kf, alpha, gamma = _fit_zone(base, zone, table, free=free)
        found.kappa_0[zone], found.kappa_f[zone], found.alpha[zone] = k0, kf, alpha
        found.gamma[zone] = gamma
    return found


def cells_of(theta):
    """Return the cells of headings."""
    return np.clip(((theta + math.pi) / states.CELL_RAD).astype(int), 0, states.N_CELLS - 1)


def log_base_speed(speed, zone):
    """Return the log share of each speed's bin among the speeds in its zone."""
    bins, value = np.array([speeds.speed_bin(v) for v in speed]), np.empty(len(speed))
    for z in np.unique(zone):
        rows = zone == z
        value[rows] = np.log(np.bincount(bins[rows])[bins[rows]] / rows.sum())
    return value


def usable_steps(past, n_fish):
    """Return times and agents of fish's steps with a heading before and after."""
    long = past.speed * states.DT_S >= states.SHORT_M
    fine = np.isfinite(past.log_heading) & long
    fine[1:] &= long[:-1]
    fine[: past.first] = False
    fine[:, n_fish:] = False
    return np.nonzero(fine)


def with_lapse(log_p):
    """Return log densities with the best share of headings from anywhere, the same for all.

    Without it a heading that a law all but excludes is worth as many nats as one likes, and a
    diagnosis knows better than to believe a single heading.
    """
    p = np.exp(log_p)
    shares = np.concatenate([[0.0], np.geomspace(1e-5, 0.1, 30)])
    with np.errstate(divide="ignore"):
        made = [np.log((1 - share) * p + share / (2 * math.pi)) for share in shares]
    return max(made, key=np.nansum)


def oracle_nats(base: Base, world, past, *, n_fish, on=BOTH):
    """Return the nats that an oracle has over the base law's best fit, and that fit.

    Parameters
    ----------
    on
        What the hidden effects act on.

    Returns
    -------
    tuple of dict and Base
        ``heading`` and ``speed`` are sums over the usable steps, of headings each law with its
        best lapse; ``total`` counts what
        the hidden effects act on; ``steps`` is the number of usable headings.
    """
    steps = usable_steps(past, n_fish)
    fitted = fit_base(base, world, past, steps)
    log_base = kernels.log_base(*steps, world, law_of(fitted), past, no_plan(past.xy.shape[1]))
    known = ~np.isnan(log_base) & ~np.isnan(past.log_heading[steps])
    true, base_law = (with_lapse(each[known]) for each in (past.log_heading[steps], log_base))
    heading = float((true - base_law).sum())
    told = np.isfinite(past.log_speed)
    told[: past.first], told[:, n_fish:] = False, False
    zone = past.zone[:-1][told]
    speed = float((past.log_speed[told] - log_base_speed(past.speed[told], zone)).sum())
    total = {HEADING: heading, SPEED: speed, BOTH: heading + speed}[on]
    nats = {"heading": heading, "speed": speed, "total": total, "steps": len(steps[0])}
    return nats, fitted


def acts_on(names):
    """Return what effects act on together."""
    on = {FORMS[name].on for name in names}
    return on.pop() if len(on) == 1 else BOTH
