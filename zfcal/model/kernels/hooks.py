"""Calls from the kernel into the compiled functions of effects.

An effect's functions are compiled by themselves and reach the kernel as
addresses, so that the kernel is compiled once, whatever effects there are.
`zfcal.model.effects.base` says what each kind of function is given.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_F8 = types.float64
_I8 = types.int64
_POINTER: Any = types.CPointer(_F8)  # type: ignore[no-untyped-call]

COMPONENT = _F8(_POINTER, _POINTER, _I8, _I8, _POINTER, _POINTER)
"""``weight(state, sight, n, i, parameters, out)``; out: unit vector x, y and kappa."""

FACTOR = _F8(_POINTER, _POINTER, _I8, _I8, _POINTER, _F8, _F8, _F8, _I8)
"""``factor(state, sight, n, i, parameters, ux, uy, speed_m_s, landing_zone)`` in [0, 1]."""

SPEED = _F8(_POINTER, _POINTER, _I8, _I8, _POINTER, _F8)
"""``factor(state, sight, n, i, parameters, chance)`` on the drawn speed.

``chance`` is uniform in [0, 1) and new for each step; at a factor of zero the agent
stays and keeps its heading.
"""

ROTATION = _F8(_POINTER, _POINTER, _I8, _I8, _POINTER)
"""``angle(state, sight, n, i, parameters)`` by which directions turn left: the base's, or all."""

SIGHT = _F8(_POINTER, _POINTER, _I8, _I8, _POINTER, _I8)
"""``factor(state, sight, n, i, parameters, j)`` on the solid angle of neighbour j."""


def _llvm(kind: types.Type) -> ir.Type:
    if kind is _F8:
        return ir.DoubleType()
    return ir.IntType(64)


def _call(signature: Any) -> Any:
    """Return code that calls a C function of this signature at an address."""
    own = types.float64(
        _I8, *(_I8 if isinstance(arg, types.CPointer) else arg for arg in signature.args)
    )

    def emit(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        # Pointers travel as integers: on every platform numba knows they are passed alike.
        function = ir.FunctionType(ir.DoubleType(), [_llvm(arg) for arg in own.args[1:]])
        return builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])

    return own, emit


@intrinsic
def call_component(_context, at, state, sight, n, i, parameters, out):  # type: ignore[no-untyped-def]
    """Call a function of kind `COMPONENT` at an address."""
    return _call(COMPONENT)


@intrinsic
def call_factor(_context, at, state, sight, n, i, parameters, ux, uy, speed, landing):  # type: ignore[no-untyped-def]
    """Call a function of kind `FACTOR` at an address."""
    return _call(FACTOR)


@intrinsic
def call_speed(_context, at, state, sight, n, i, parameters, chance):  # type: ignore[no-untyped-def]
    """Call a function of kind `SPEED` at an address."""
    return _call(SPEED)


@intrinsic
def call_rotation(_context, at, state, sight, n, i, parameters):  # type: ignore[no-untyped-def]
    """Call a function of kind `ROTATION` at an address."""
    return _call(ROTATION)


@intrinsic
def call_sight(_context, at, state, sight, n, i, parameters, j):  # type: ignore[no-untyped-def]
    """Call a function of kind `SIGHT` at an address."""
    return _call(SIGHT)
