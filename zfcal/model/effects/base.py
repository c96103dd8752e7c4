"""What an effect is: the shape that each file of this folder fills in.

An effect adds to a step, by compiled C functions, any of:

``component``
    a von Mises component of the heading mixture, with its weight beside the
    base's weight of one;
``factor``
    a factor in [0, 1] on the density of a heading and its landing zone;
``speed``
    a factor on the drawn speed;
``sight``
    a factor on the solid angle at which a neighbour is seen.

Each gets the agents' state as numbers in rows of n, one row for each name in
`zfcal.model.kernels.world` (``state[X * n + i]``), the solid angles that agent
i sees as ``sight[i * n + j]``, and its parameters in their order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from zfcal.errors import InputError

MAX_PARAMETERS = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectParameter:
    """One number of an effect.

    Parameters
    ----------
    name
        As in the model file.
    low, high
        Bounds within which it is calibrated.
    default
        Used where the model file is silent.
    says
        What it means, with its unit.
    """

    name: str
    low: float
    high: float
    default: float
    says: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Something that fish do and that the base model lacks.

    Parameters
    ----------
    name
        As in the model file and in the findings.
    says
        One sentence for a biologist.
    reference
        Where it was described.
    parameters
        At most eight.
    component, factor, speed, sight
        Compiled functions (`numba.cfunc`), None for what it does not touch.
    """

    name: str
    says: str
    reference: str
    parameters: tuple[EffectParameter, ...]
    component: Any = None
    factor: Any = None
    speed: Any = None
    sight: Any = None

    def values(self, given: Mapping[str, float]) -> tuple[float, ...]:
        """Return the parameters in their order, with defaults for those not given.

        Raises
        ------
        InputError
            A name that the effect does not have, or a value out of bounds.
        """
        known = {parameter.name: parameter for parameter in self.parameters}
        for name, value in given.items():
            if name not in known:
                raise InputError(
                    f"Effect {self.name!r} has no parameter {name!r}; it has {list(known)}."
                )
            low, high = known[name].low, known[name].high
            if not (low <= value <= high and math.isfinite(value)):
                raise InputError(
                    f"Effect {self.name!r}: {name} must be in [{low:g}, {high:g}], got {value!r}."
                )
        return tuple(given.get(name, parameter.default) for name, parameter in known.items())
