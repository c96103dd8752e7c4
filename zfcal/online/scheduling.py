"""Which window a stage takes next, when it cannot take them all.

::

    a window is due       60 s after its segments were there
    a stage that is free  takes the oldest window; those that are past due are passed
                          over as soon as one waits that came later
    a round               gets its budget, or what is left until it is due, less what the
                          rounds before it took beyond theirs

So a stage that overran first catches up by shorter rounds, then by skipping; what
waits never grows without bound. Of a recording that has ended all windows are made,
oldest first, each with its whole budget.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from zfcal.units import SEGMENT_S

SPARE_S = 5.0
"""A round is over so long before it is due: for what no budget covers."""

LEAST_S = 5.0
"""A round that starts late still gets so much."""

_MEMORY = 3
"""Rounds whose overruns count."""

_MARGIN = 1.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What a stage does next.

    Parameters
    ----------
    end_s
        End of the window to take; None for nothing to do.
    passed_over
        Ends of the windows that are left out for good.
    """

    end_s: int | None
    passed_over: tuple[int, ...] = ()


def choose(waiting: Mapping[int, float], *, now_s: float, due_after_s: float | None) -> Choice:
    """Return which of the waiting windows to take.

    Parameters
    ----------
    waiting
        By the window's end, when its data were there, in seconds on a clock.
    now_s
        The same clock.
    due_after_s
        How long a window may wait; None for as long as it takes.

    Examples
    --------
    The window to 120 s is 70 s old, and that to 180 s came later:

    >>> choose({120: 0.0, 180: 60.0}, now_s=70.0, due_after_s=60.0)
    Choice(end_s=180, passed_over=(120,))
    """
    ends = sorted(waiting)
    if not ends:
        return Choice(end_s=None)
    if due_after_s is None:
        return Choice(end_s=ends[0])
    newest_s = max(waiting.values())
    passed = tuple(
        end for end in ends[:-1] if now_s - waiting[end] > due_after_s and newest_s > waiting[end]
    )
    return Choice(end_s=next(end for end in ends if end not in passed), passed_over=passed)


@final
class Overruns:
    """By how much the last rounds overran their budgets.

    No budget shortens the first population, the confirmation and the ceiling: on a busy
    computer these take what the next round has to do without.
    """

    def __init__(self) -> None:
        self._lately: deque[float] = deque(maxlen=_MEMORY)

    def add(self, took_s: float, budget_s: float) -> None:
        """Note a round."""
        self._lately.append(took_s - budget_s)

    @property
    def reserve_s(self) -> float:
        """Seconds to be kept free at the end of the next round."""
        return max(SPARE_S, _MARGIN * max(self._lately, default=0.0))


def budget_of(asked_s: float, *, seen_s: float, now_s: float, reserve_s: float = SPARE_S) -> float:
    """Return the seconds that a round may take, so that the next one finds the stage free.

    Parameters
    ----------
    asked_s
        The budget of a round that starts in time.
    seen_s
        When its window's data were there.
    now_s
        When it starts, on the same clock.
    reserve_s
        What is kept free at its end.

    Examples
    --------
    >>> budget_of(50.0, seen_s=0.0, now_s=25.0)
    30.0
    """
    left_s = seen_s + SEGMENT_S - reserve_s - now_s
    return min(asked_s, max(left_s, LEAST_S))
