"""Weights of features, each for each circumstance."""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.model.kernels.compiled import kernel


@kernel
def write_products(own: Floats, by: Floats, made: Floats) -> None:
    """Write each weight of a source times each of its circumstances.

    Parameters
    ----------
    own : ndarray, shape (step, source, weight)
    by : ndarray, shape (step, source or 1, circumstance)
    made : ndarray, shape (step, source, weight, circumstance)
    """
    apart = by.shape[1] > 1
    for s in range(own.shape[0]):
        for j in range(own.shape[1]):
            source = j if apart else 0
            for w in range(own.shape[2]):
                for c in range(by.shape[2]):
                    made[s, j, w, c] = own[s, j, w] * by[s, source, c]


@kernel
def write_vector_products(own: Floats, by: Floats, made: Floats) -> None:
    """Write each vector times each circumstance of its step.

    Parameters
    ----------
    own : ndarray, shape (step, weight, 2)
    by : ndarray, shape (step, circumstance)
    made : ndarray, shape (step, weight, circumstance, 2)
    """
    for s in range(own.shape[0]):
        for w in range(own.shape[1]):
            for c in range(by.shape[1]):
                made[s, w, c, 0] = own[s, w, 0] * by[s, c]
                made[s, w, c, 1] = own[s, w, 1] * by[s, c]


def products(own: Floats, by: Floats) -> Floats:
    """Return each weight of a source times each of its circumstances.

    Parameters
    ----------
    own : ndarray, shape (step, source, weight)
    by : ndarray, shape (step, source or 1, circumstance)

    Returns
    -------
    ndarray, shape (step, source, weight times circumstance)
        The circumstances of the first weight come first.
    """
    n_steps, n_sources, n_weights = own.shape
    if by.shape[:2] not in {(n_steps, n_sources), (n_steps, 1)}:
        raise ValueError(f"Circumstances {by.shape} are of other sources than {own.shape}.")
    made = np.empty((n_steps, n_sources, n_weights, by.shape[2]))
    write_products(_plain(own), _plain(by), made)
    return made.reshape(n_steps, n_sources, n_weights * by.shape[2])


def vector_products(own: Floats, by: Floats) -> Floats:
    """Return each vector times each circumstance of its step.

    Parameters
    ----------
    own : ndarray, shape (step, weight, 2)
    by : ndarray, shape (step, circumstance)

    Returns
    -------
    ndarray, shape (step, weight times circumstance, 2)
        As of `products`.
    """
    made = np.empty((len(own), own.shape[1], by.shape[1], 2))
    write_vector_products(_plain(own), _plain(by), made)
    return made.reshape(len(own), own.shape[1] * by.shape[1], 2)


def _plain(values: Floats) -> Floats:
    return np.ascontiguousarray(values, dtype=np.float64)
