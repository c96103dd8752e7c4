"""The mixture that an agent draws its heading from: its components, and effects' factors."""

from __future__ import annotations

import math

from zfcal.arrays import Floats, Ints
from zfcal.model.kernels.compiled import inlined, kernel
from zfcal.model.kernels.hooks import call_component, call_factor, call_rotation
from zfcal.model.kernels.perception import Sight
from zfcal.model.kernels.random import vonmises_r
from zfcal.model.kernels.state import (
    ALPHA,
    KAPPA_F,
    LATE_SHARE,
    TABLE,
    ZONE,
    Packed,
    Work,
    parameters_at,
    sight_row,
    splits,
)


@inlined
def _own_row(i: int, n: int, packed: Packed, sight: Sight) -> tuple[int, int]:
    """Return where the pairs of an agent start in `Sight`, and how many they are."""
    row = sight_row(n, packed)
    # Sight of all by all, or of this agent alone.
    if sight.angle_sr.size < n * row:
        return 0, n
    return i * row, row


@inlined
def weigh(i: int, state: Floats, model: int, packed: Packed, sight: Sight) -> float:
    """Return the sum of all weights of an agent's mixture, as `gather` does, without effects."""
    first, row = _own_row(i, state.shape[1], packed, sight)
    seen_sr = 0.0
    for k in range(first, first + row):
        seen_sr += sight.angle_sr[k]
    return 1.0 + packed.zones[model, int(state[ZONE, i]), ALPHA] * seen_sr


@inlined
def toward_one(
    i: int, level: float, state: Floats, model: int, packed: Packed, sight: Sight
) -> tuple[float, float]:
    """Return the direction of the neighbour at a level of the summed weights, without effects."""
    first, row = _own_row(i, state.shape[1], packed, sight)
    alpha = packed.zones[model, int(state[ZONE, i]), ALPHA]
    # No branch: which neighbour it is no processor can foresee.
    k, below = first, 0.0
    for other in range(first, first + row - 1):
        below += alpha * sight.angle_sr[other]
        k += level >= below
    return sight.dx_m[k] * sight.toward_per_m[k], sight.dy_m[k] * sight.toward_per_m[k]


@inlined
def gather(
    i: int, state: Floats, model: int, packed: Packed, sight: Sight, work: Work
) -> tuple[int, float]:
    """Write the components of an agent's heading mixture beyond the base.

    Parameters
    ----------
    work
        Its ``parts`` receive weight, unit vector x and y, kappa of each component, and the
        constant of its sampler, zero where the zone's table serves; the base has weight
        one and is not among them.

    Returns
    -------
    count : int
    total : float
        Sum of all weights, the base included.
    """
    zone = int(state[ZONE, i])
    alpha = packed.zones[model, zone, ALPHA]
    kappa, parts = packed.zones[model, zone, KAPPA_F], work.parts
    late = splits(model, packed)
    now = 1.0 - packed.lates[model, LATE_SHARE] if late else 1.0
    n = state.shape[1]
    first, row = _own_row(i, n, packed, sight)
    count, total = 0, 1.0
    for k in range(first, first + row):
        angle = sight.angle_sr[k]
        weight = now * alpha * angle
        if weight > 0.0:
            parts[count, 0] = weight
            parts[count, 1] = sight.dx_m[k] * sight.toward_per_m[k]
            parts[count, 2] = sight.dy_m[k] * sight.toward_per_m[k]
            parts[count, 3] = kappa
            parts[count, 4] = TABLE
            total += weight
            count += 1
    for k in range(i * n, (i + 1) * n if late else i * n):
        weight = alpha * work.late[k, 0]
        if weight > 0.0:
            parts[count, 0], parts[count, 3], parts[count, 4] = weight, kappa, TABLE
            parts[count, 1], parts[count, 2] = work.late[k, 1], work.late[k, 2]
            total += weight
            count += 1
    for k in range(packed.components.shape[0]):
        weight = call_component(
            packed.components[k, 0], state.ctypes.data, sight.angle_sr.ctypes.data, n, i,
            parameters_at(packed, model, packed.components[k, 1], state, sight.angle_sr, i, -1),
            parts[count, 1:].ctypes.data,
        )  # fmt: skip
        if weight > 0.0:
            parts[count, 0], parts[count, 4] = weight, vonmises_r(parts[count, 3])
            total += weight
            count += 1
    angle = 0.0
    if packed.whole_rotations.shape[0] > 0:
        angle = _turn(i, packed.whole_rotations, state, model, packed, sight)
        c, s = math.cos(angle), math.sin(angle)
        for k in range(count):
            x, y = parts[k, 1], parts[k, 2]
            parts[k, 1], parts[k, 2] = c * x - s * y, s * x + c * y
    if packed.rotations.shape[0] > 0:
        angle += _turn(i, packed.rotations, state, model, packed, sight)
    # Of none as well: the model before, of the same robot, may have had some.
    work.spin[0], work.spin[1] = math.cos(angle), math.sin(angle)
    return count, total


@inlined
def _turn(
    i: int, hooks: Ints, state: Floats, model: int, packed: Packed, sight: Sight
) -> float:  # fmt: skip
    """Return the angle by which some functions of effects turn an agent's directions."""
    angle = 0.0
    for k in range(hooks.shape[0]):
        angle += call_rotation(
            hooks[k, 0], state.ctypes.data, sight.angle_sr.ctypes.data, state.shape[1], i,
            parameters_at(packed, model, hooks[k, 1], state, sight.angle_sr, i, -1),
        )  # fmt: skip
    return angle


@inlined
def spun(x: float, y: float, work: Work) -> tuple[float, float]:
    """Return a base direction turned by the angle that `gather` wrote."""
    return work.spin[0] * x - work.spin[1] * y, work.spin[1] * x + work.spin[0] * y


@kernel
def tilt(
    i: int,
    move: tuple[float, float, float, int],
    state: Floats,
    model: int,
    packed: Packed,
    sight: Sight,
) -> float:
    """Return the product of the effects' factors for a heading, in [0, 1]."""
    ux, uy, speed, landing = move
    product = 1.0
    for k in range(packed.factors.shape[0]):
        product *= call_factor(
            packed.factors[k, 0], state.ctypes.data, sight.angle_sr.ctypes.data, state.shape[1], i,
            parameters_at(packed, model, packed.factors[k, 1], state, sight.angle_sr, i, -1),
            ux, uy, speed, landing,
        )  # fmt: skip
    return product
