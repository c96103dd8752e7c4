"""What features add to the law of each step: numbers at the heading taken, and integrated."""

from __future__ import annotations

from zfcal.arrays import Floats

Columns = tuple[Floats, Floats]
"""Numbers of each step and weight: at the heading taken, and integrated."""


def both(one: Columns | None, other: Columns | None) -> Columns | None:
    """Return the sum of columns; None for none.

    Parameters
    ----------
    one, other
        Of one shape.
    """
    if one is None or other is None:
        return other if one is None else one
    return one[0] + other[0], one[1] + other[1]


def less(one: Columns, other: Columns) -> Columns:
    """Return the difference of columns.

    Parameters
    ----------
    one, other
        Of one shape.
    """
    return one[0] - other[0], one[1] - other[1]
