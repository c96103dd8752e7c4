"""Von Mises laws for the kernels: one over their integral, and an exponential for vectors."""

from __future__ import annotations

import math

from zfcal.model.kernels.compiled import inlined, kernel

_HALVINGS = 10
LEAST = -250.0
"""Below, `exponential` is not one."""


@kernel
def one_over_integral(kappa: float) -> float:
    """Return one over ``2 pi I0(kappa) exp(-kappa)``.

    Source: Abramowitz and Stegun 1964, 9.8.1 and 9.8.2 (relative error below 2e-7).
    """
    if kappa < 3.75:
        t = (kappa / 3.75) ** 2
        i0 = 1.0 + t * (
            3.5156229
            + t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))
        )
        return math.exp(kappa) / (2.0 * math.pi * i0)
    t = 3.75 / kappa
    scaled = 0.39894228 + t * (
        0.01328592
        + t
        * (
            0.00225319
            + t
            * (
                -0.00157565
                + t
                * (
                    0.00916281
                    + t * (-0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))
                )
            )
        )
    )
    return math.sqrt(kappa) / (2.0 * math.pi * scaled)


@inlined
def exponential(x: float) -> float:
    """Return ``exp(x)`` for x in [-250, 0]: a series at x / 1024, squared ten times.

    Nothing but products and sums, so that the compiler makes vectors of loops of it. The
    relative error is below 2e-6 at -120, and next to nothing near zero.
    """
    y = x * (1.0 / (1 << _HALVINGS))
    value = 1.0 + y * (
        1.0 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * (1 / 720)))))
    )
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    value *= value
    return value * value
