"""What agents see of each other, now or some steps ago, with what effects make of it."""

from __future__ import annotations

import math

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.hooks import call_sight
from zfcal.model.kernels.perception import Sight, in_vectors, see, see_first
from zfcal.model.kernels.state import (
    HX,
    HY,
    LATE_FELT_M,
    LATE_NEAR,
    LATE_SHARE,
    LATE_THEN,
    LATE_WHOLE,
    Packed,
    X,
    Y,
    goes_by_each,
    parameters_at,
    sight_row,
)


@kernel
def look_back(
    state: Floats, past: Floats, slot: int, model: int, packed: Packed, sight: Sight
) -> None:
    """Write what each agent sees of where each other one was, from where it is or was itself.

    Parameters
    ----------
    past : ndarray, shape (slot, 4, agent)
        x, y and the unit vector of the heading at former steps.
    slot
        The step that is seen.
    """
    n = state.shape[1]
    is_then = packed.lates[model, LATE_THEN] > 0.0
    for i in range(n):
        x, y, hx, hy = state[X, i], state[Y, i], state[HX, i], state[HY, i]
        if is_then:
            x, y, hx, hy = past[slot, 0, i], past[slot, 1, i], past[slot, 2, i], past[slot, 3, i]
        for j in range(n):
            k = i * n + j
            sight.dx_m[k] = past[slot, 0, j] - x if i != j else 0.0
            sight.dy_m[k] = past[slot, 1, j] - y if i != j else 0.0
            sight.hx[k], sight.hy[k] = past[slot, 2, j], past[slot, 3, j]
            sight.ahead_m[k] = sight.dx_m[k] * hx + sight.dy_m[k] * hy
    see(sight, packed.cos_fov[model])
    if packed.sights.shape[0] > 0:
        _attend(state, model, packed, sight)


@inlined
def note_late(
    state: Floats, past: Floats, slot: int, late: Floats, sight: Sight, out: Floats
) -> None:
    """Write the late share of what each agent sees, to be added to the rest of it.

    Parameters
    ----------
    late
        A row of ``packed.lates``. Where all is late, sight is of that time; else it is of
        now, and those that are near enough to be felt are headed for where they are.
    out
        ``work.late``.
    """
    n = state.shape[1]
    for k in range(n * n):
        i, j = k // n, k % n
        out[k, 0] = late[LATE_SHARE] * sight.angle_sr[k]
        out[k, 1] = sight.dx_m[k] * sight.toward_per_m[k]
        out[k, 2] = sight.dy_m[k] * sight.toward_per_m[k]
        away = math.hypot(sight.dx_m[k], sight.dy_m[k])
        is_late = sight.toward_per_m[k] > 0.0 or late[LATE_NEAR] > 0.0
        if late[LATE_WHOLE] == 0.0 and away > late[LATE_FELT_M] and is_late:
            is_then = late[LATE_THEN] > 0.0
            x, y = (past[slot, 0, i], past[slot, 1, i]) if is_then else (state[X, i], state[Y, i])
            dx, dy = past[slot, 0, j] - x, past[slot, 1, j] - y
            # Away from who is too near now. NaN for who was not there: as it is now, then.
            length = math.copysign(math.hypot(dx, dy), sight.toward_per_m[k])
            if abs(length) > 0.0:
                out[k, 1], out[k, 2] = dx / length, dy / length


@inlined
def look(state: Floats, model: int, packed: Packed, sight: Sight) -> None:
    """Write what each agent sees of each other one, in rows of `sight_row` pairs."""
    n = state.shape[1]
    row = sight_row(n, packed)
    for i in range(n):
        for place in range(row):
            k = i * row + place
            # An agent stands on itself, at distance zero, and does not see itself.
            j = place + 1 if row < n and place >= i else place
            sight.dx_m[k] = state[X, j] - state[X, i]
            sight.dy_m[k] = state[Y, j] - state[Y, i]
            sight.hx[k], sight.hy[k] = state[HX, j], state[HY, j]
            sight.ahead_m[k] = sight.dx_m[k] * state[HX, i] + sight.dy_m[k] * state[HY, i]
    see_first(min(in_vectors(n * row), sight.dx_m.size), sight, packed.cos_fov[model])
    if packed.sights.shape[0] > 0:
        _attend(state, model, packed, sight)


@kernel
def _attend(state: Floats, model: int, packed: Packed, sight: Sight) -> None:
    n = state.shape[1]
    for h in range(packed.sights.shape[0]):
        row = packed.sights[h, 1]
        each = goes_by_each(packed, model, row)
        for i in range(n):
            # Before any is changed: how many are seen does not depend on their order.
            own = parameters_at(packed, model, row, state, sight.angle_sr, i, -1)
            for j in range(n):
                k = i * n + j
                if sight.angle_sr[k] > 0.0:
                    if each:
                        own = parameters_at(packed, model, row, state, sight.angle_sr, i, j)
                    sight.angle_sr[k] *= call_sight(
                        packed.sights[h, 0], state.ctypes.data, sight.angle_sr.ctypes.data,
                        n, i, own, j,
                    )  # fmt: skip
