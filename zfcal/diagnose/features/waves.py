"""Von Mises laws as Fourier series, for integrals over cells of headings."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import i0e, ive

from zfcal.arrays import Floats, Ints

WAVES = 96
"""Terms of a series: as many as a kappa of 150 needs."""

_LEAST = 1e-12
"""A smaller share of the first term is left out."""


def series_of(kappa: Floats) -> tuple[Ints, Floats]:
    """Return the Fourier series of von Mises laws, times exp(-kappa) and not scaled.

    Parameters
    ----------
    kappa : ndarray, shape (step,)

    Returns
    -------
    order : ndarray of int64, shape (step,)
        Row of each step's series.
    series : ndarray, shape (kappa, wave)
        exp(-kappa) I_m(kappa), twice that from the first wave on; zeros where it ends (Abramowitz
        and Stegun 1964, 9.6.34).
    """
    known, order = np.unique(kappa, return_inverse=True)
    m = np.arange(WAVES)
    series = np.asarray(ive(m, known[:, None]) * np.where(m > 0, 2.0, 1.0), dtype=np.float64)
    series[series < _LEAST * series[:, :1]] = 0.0
    return np.asarray(order, dtype=np.int64), series


def concentrated(kappa: Floats | float, n_steps: int) -> tuple[Floats, Ints, Floats, Floats]:
    """Return kappa at each step, its series, and what makes a law of it whole.

    Parameters
    ----------
    kappa : float or ndarray, shape (step,)
    n_steps

    Returns
    -------
    kappa : ndarray, shape (step,)
    order, series
        As of `series_of`.
    scale : ndarray, shape (step, 1)
    """
    known = np.atleast_1d(np.asarray(kappa, dtype=np.float64))
    order, series = series_of(known)
    scale = 1 / (2 * math.pi * i0e(known))
    if len(known) == n_steps:
        return known, order, series, scale[:, None]
    if len(known) != 1:
        raise ValueError(f"Expected one kappa, or one for each of {n_steps} steps: {len(known)}.")
    # One for all steps, of which none is looked up by itself.
    return np.full(n_steps, known[0]), np.zeros(n_steps, dtype=np.int64), series, scale[:, None]


def waves_of(weight: Floats) -> Floats:
    """Return sums over cells of weight times cosine and sine of so many times the cell's angle.

    Parameters
    ----------
    weight : ndarray, shape (step, cell)
        Of cells of headings all round, the first at 0.

    Returns
    -------
    ndarray, shape (step, wave, 2)
    """
    n = weight.shape[1]
    whole, m = np.fft.rfft(weight, axis=1), np.arange(WAVES) % n
    # From half of the cells on waves are those before it again, the other way round.
    own, sign = np.minimum(m, n - m), np.where(m <= n // 2, -1.0, 1.0)
    made = np.empty((len(weight), WAVES, 2))
    made[..., 0] = whole.real[:, own]
    made[..., 1] = whole.imag[:, own] * sign
    return made
