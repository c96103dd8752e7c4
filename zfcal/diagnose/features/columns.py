"""What features add to the law of each step: numbers at the heading taken, and integrated."""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats

Columns = tuple[Floats, Floats]
"""Numbers of each step and weight: at the heading taken, and integrated."""


def weighed(columns: Columns, weights: Floats) -> Columns:
    """Return columns of sources, weighed and added up, shape (step, weight).

    Parameters
    ----------
    columns
        Of each source, shape (step, source).
    weights : ndarray, shape (step, source, weight)
    """
    at, over = (np.asarray(np.einsum("sj,sjb->sb", each, weights)) for each in columns)
    return at, over


def less(one: Columns, other: Columns) -> Columns:
    """Return the difference of columns.

    Parameters
    ----------
    one, other
        Of one shape.
    """
    return one[0] - other[0], one[1] - other[1]
