"""Large groups without the solid angles of all pairs: exact all the same, by thinning.

Each neighbour's weight is first taken too large, by a bound that costs next to
nothing, and a component of the heading mixture is drawn. If it is a neighbour,
its true solid angle is computed, alone; it is taken with the ratio of the true
weight to the assumed one, or else a component is drawn anew. So components come
with the probabilities of the model: nothing is cut off, only the random numbers
are others. (Thinning is of Lewis and Shedler 1979, Naval Research Logistics
Quarterly 26, for point processes.) The bounds are those of `crowd_cells`.
"""

from __future__ import annotations

import math

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, lean
from zfcal.model.kernels.crowd_cells import CLOSE_M, Crowd, in_ring, look_near, sort, weigh_rings
from zfcal.model.kernels.geometry import Tank, best_within, zone_of
from zfcal.model.kernels.heading import (
    REDRAWS,
    REJECTIONS,
    apply_move,
    draw_from_grid,
    draw_speed,
    stay,
)
from zfcal.model.kernels.perception import in_vectors, most_sr, see_first
from zfcal.model.kernels.placing import settle
from zfcal.model.kernels.random import State as Random
from zfcal.model.kernels.random import next_word, uniform
from zfcal.model.kernels.staircase import staircase_turn
from zfcal.model.kernels.state import (
    ALPHA,
    CLEAR,
    HX,
    HY,
    KAPPA_BASE,
    KAPPA_F,
    LAW_BASE,
    LAW_F,
    TAU_X,
    TAU_Y,
    TIME,
    ZONE,
    Packed,
    Work,
    X,
    Y,
)


@inlined
def _see_one(
    i: int, place: int, asked_sr: float, state: Floats, cos_fov: float, crowd: Crowd
) -> bool:
    """Tell whether one of the sorted agents covers more than asked; ``crowd.one`` holds it."""
    one = crowd.one
    one.dx_m[0], one.dy_m[0] = crowd.x_m[place] - state[X, i], crowd.y_m[place] - state[Y, i]
    one.hx[0], one.hy[0] = crowd.hx[place], crowd.hy[place]
    one.ahead_m[0] = one.dx_m[0] * state[HX, i] + one.dy_m[0] * state[HY, i]
    see_first(1, one, cos_fov)
    return asked_sr < one.angle_sr[0]


@inlined
def _choose(
    i: int, level_sr: float, sums_sr: tuple[float, float], found: int, cell: tuple[int, int],
    state: Floats, cos_fov: float, random: Random, crowd: Crowd,
) -> bool:  # fmt: skip
    """Choose a neighbour by the bounds; tell whether its true weight lets it be the component.

    If so, ``crowd.one`` holds it.
    """
    near_sr, far_sr = sums_sr
    # Without far agents rounding can lead just past the near ones.
    if level_sr < near_sr or not far_sr > 0.0:
        k = 0
        while k < found - 1 and level_sr >= crowd.near_sr[k]:
            level_sr -= crowd.near_sr[k]
            k += 1
        asked_sr = 0.0
        # The weight of a close one is the true one.
        if crowd.away_m[k] >= CLOSE_M:
            asked_sr = uniform(random) * crowd.near_sr[k]
        place = crowd.near[k]
    else:
        level_sr -= near_sr
        ring, last = 0, crowd.weight_sr.size - 1
        while ring < last and level_sr >= crowd.weight_sr[ring]:
            level_sr -= crowd.weight_sr[ring]
            ring += 1
        place = in_ring(ring, int(level_sr / crowd.most_sr[ring]), cell[0], cell[1], crowd)
        asked_sr = uniform(random) * crowd.most_sr[ring]
        # Rounding can lead just past the last agent: then there is none.
        if place >= 0:
            dx, dy = crowd.x_m[place] - state[X, i], crowd.y_m[place] - state[Y, i]
            away = math.sqrt(dx * dx + dy * dy)
            if asked_sr >= most_sr(away) or dx * state[HX, i] + dy * state[HY, i] < away * cos_fov:
                place = -1
    return place >= 0 and _see_one(i, place, asked_sr, state, cos_fov, crowd)


@inlined
def _draw_turn(
    i: int, cell: tuple[int, int], state: Floats, model: int, packed: Packed, tank: Tank,
    random: Random, crowd: Crowd, found: int, sums_sr: tuple[float, float],
) -> tuple[float, float]:  # fmt: skip
    """Return the unit vector of a heading drawn from the whole mixture."""
    zone = int(state[ZONE, i])
    alpha, cos_fov = packed.zones[model, zone, ALPHA], packed.cos_fov[model]
    social = alpha * (sums_sr[0] + sums_sr[1])
    law, column = LAW_F, KAPPA_F
    while True:
        level = uniform(random) * (1.0 + social) - 1.0
        if not level >= 0.0:
            law, column = LAW_BASE, KAPPA_BASE
            cx, cy = state[HX, i], state[HY, i]
            if tank.follows[zone]:
                side = 1.0 if next_word(random) >> np.uint64(63) else -1.0
                cx, cy = side * state[TAU_X, i], side * state[TAU_Y, i]
            break
        if _choose(i, level / alpha, sums_sr, found, cell, state, cos_fov, random, crowd):
            cx = crowd.one.dx_m[0] * crowd.one.toward_per_m[0]
            cy = crowd.one.dy_m[0] * crowd.one.toward_per_m[0]
            break
    kappa = packed.zones[model, zone, column]
    cosine, sine = staircase_turn(kappa, packed.turns, (model, zone, law), random)
    return cx * cosine - cy * sine, cx * sine + cy * cosine


@lean
def _draw_by_grid(
    i: int, speed: float, state: Floats, model: int, packed: Packed, tank: Tank,
    random: Random, work: Work, crowd: Crowd,
) -> bool:  # fmt: skip
    """Look at everybody after all, and draw from the numeric density."""
    row = crowd.row
    for j in range(state.shape[1]):
        row.dx_m[j], row.dy_m[j] = state[X, j] - state[X, i], state[Y, j] - state[Y, i]
        row.hx[j], row.hy[j] = state[HX, j], state[HY, j]
        row.ahead_m[j] = row.dx_m[j] * state[HX, i] + row.dy_m[j] * state[HY, i]
    see_first(in_vectors(state.shape[1]), row, packed.cos_fov[model])
    return draw_from_grid(i, speed, state, model, packed, tank, row, random, work)


@inlined
def _draw_heading(
    i: int, speed: float, cell: tuple[int, int], state: Floats, model: int, packed: Packed,
    tank: Tank, random: Random, work: Work, crowd: Crowd, found: int,
    sums_sr: tuple[float, float],
) -> bool:  # fmt: skip
    """Draw a heading by rejection as `heading.draw_exact` does."""
    zone = int(state[ZONE, i])
    reach = speed * packed.dt_s
    sure = reach < state[CLEAR, i]
    best = packed.gamma[model, zone, zone]
    if not sure:
        best = best_within(state[X, i], state[Y, i], reach, packed.gamma[model, zone], tank)
    if best == 0.0:
        return False
    for _ in range(REJECTIONS):
        ux, uy = _draw_turn(i, cell, state, model, packed, tank, random, crowd, found, sums_sr)
        landing, accept = zone, best
        if not sure:
            landing = zone_of(state[X, i] + reach * ux, state[Y, i] + reach * uy, tank)
            accept = packed.gamma[model, zone, landing]
        if accept >= best or uniform(random) * best < accept:
            work.moves[i, 0], work.moves[i, 1], work.moves[i, 2] = ux, uy, landing
            return True
    return _draw_by_grid(i, speed, state, model, packed, tank, random, work, crowd)


@inlined
def _draw_move(
    i: int, cell: tuple[int, int], state: Floats, model: int, packed: Packed, tank: Tank,
    random: Random, work: Work, crowd: Crowd, far_sr: float,
) -> None:  # fmt: skip
    """Write an agent's next move as `heading.draw_move` does."""
    found, near_sr = look_near(i, cell[0], cell[1], state, packed.cos_fov[model], crowd)
    sums_sr = (near_sr, far_sr)
    for _ in range(1 + REDRAWS):
        speed = draw_speed(i, state, model, packed, tank, random)
        work.moves[i, 3] = speed
        if _draw_heading(
            i, speed, cell, state, model, packed, tank, random, work, crowd, found, sums_sr
        ):
            return
    stay(i, state, work)


@lean
def advance_crowd(
    state: Floats, model: int, packed: Packed, tank: Tank, random: Random, work: Work, crowd: Crowd
) -> None:
    """Move all agents at once by one step; models without effects only."""
    sort(state, crowd)
    columns = crowd.before.shape[1] - 1
    for cell in range(crowd.start.size - 1):
        if crowd.start[cell + 1] > crowd.start[cell]:
            at = (cell // columns, cell % columns)
            far_sr = weigh_rings(at[0], at[1], crowd)
            for place in range(crowd.start[cell], crowd.start[cell + 1]):
                i = crowd.agent[place]
                _draw_move(i, at, state, model, packed, tank, random, work, crowd, far_sr)
    for i in range(state.shape[1]):
        apply_move(i, work, packed.dt_s, state)
        settle(i, state, tank)
        state[TIME, i] += packed.dt_s * packed.clock_s[1]
