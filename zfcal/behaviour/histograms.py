"""Histograms, and how alike two of them are.

Bins are half-open, the last one closed and also holding what lies beyond; what
lies below the first edge goes into the first bin.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arena import N_BINS
from zfcal.arrays import Floats, Indices, Ints
from zfcal.errors import InputError


def bin_edges(limits: tuple[float, float]) -> Floats:
    """Return the edges of ten equal bins.

    Parameters
    ----------
    limits
        Lower and upper end of the range.

    Returns
    -------
    ndarray, shape (11,)
    """
    return np.linspace(*limits, N_BINS + 1)


def bin_of(values: ArrayLike, edges: ArrayLike) -> Indices:
    """Return the bin of each value.

    Parameters
    ----------
    values : array_like, shape (...)
        Finite numbers, in the unit of the edges.
    edges : array_like, shape (bin + 1,)
        Ascending.

    Returns
    -------
    ndarray of int, shape (...)
        From 0.
    """
    return np.searchsorted(np.asarray(edges)[1:-1], np.asarray(values), side="right")


def count_cells(cell: Indices, shape: tuple[int, int]) -> Ints:
    """Count how often each cell of a table occurs.

    Parameters
    ----------
    cell : ndarray of int, shape (value,)
        Flat index into the table, row by row.
    shape
        Rows and columns.

    Returns
    -------
    ndarray of int64, shape (row, column)
    """
    counts = np.bincount(cell, minlength=shape[0] * shape[1])
    return counts.astype(np.int64).reshape(shape)


def frequencies(counts: ArrayLike) -> Floats:
    """Return the share of each bin in its histogram.

    Parameters
    ----------
    counts : array_like, shape (..., bin)
        Counts, not negative.

    Returns
    -------
    ndarray, shape (..., bin)
        Each histogram sums to one; NaN where it has no count.
    """
    values = np.asarray(counts, dtype=np.float64)
    total = values.sum(axis=-1, keepdims=True)
    shares = values / np.where(total > 0, total, 1.0)
    return np.where(total > 0, shares, np.nan)


def similarity(p: ArrayLike, q: ArrayLike) -> Floats:
    r"""Return how alike histograms are: one minus their Hellinger distance.

    Parameters
    ----------
    p, q : array_like, shape (..., bin)
        Counts on the same bins, not negative; leading axes broadcast.

    Returns
    -------
    ndarray, shape (...)
        1 for the same distribution, 0 for disjoint ones and where only one of
        the two has a count, NaN where neither has.

    Notes
    -----
    :math:`I = 1 - \sqrt{\frac{1}{2} \sum_b (\sqrt{p_b} - \sqrt{q_b})^2}` with
    the frequencies p and q (Cazenille et al., data analysis). This form, not
    the one by the overlap, is exactly 1 for equal histograms.
    """
    counts_p, counts_q = np.asarray(p, dtype=np.float64), np.asarray(q, dtype=np.float64)
    if counts_p.shape[-1] != counts_q.shape[-1]:
        raise InputError(
            f"Histograms differ in bins: {counts_p.shape[-1]} and {counts_q.shape[-1]}.",
            hint="Both sides must come from the same arena.",
        )
    total_p, total_q = counts_p.sum(axis=-1), counts_q.sum(axis=-1)
    root_p, root_q = _root(counts_p, total_p), _root(counts_q, total_q)
    squares = np.square(root_p - root_q).sum(axis=-1)
    alike = 1.0 - np.sqrt(np.minimum(0.5 * squares, 1.0))
    alike = np.where((total_p > 0) & (total_q > 0), alike, 0.0)
    return np.where((total_p > 0) | (total_q > 0), alike, np.nan)


def _root(counts: Floats, total: Floats) -> Floats:
    return np.sqrt(counts / np.where(total > 0, total, 1.0)[..., None])
