"""Whether the time that is left allows another generation."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

MARGIN = 1.25
"""Work to come is taken to be slower by this than the slowest of the last generations."""

_MEMORY = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadline:
    """When a round has to be over.

    Parameters
    ----------
    ends_s
        On the clock.
    clock
        Seconds, monotonic, such as `time.monotonic`.
    """

    ends_s: float
    clock: Callable[[], float]

    @property
    def left_s(self) -> float:
        """Seconds that are left; negative after the end."""
        return self.ends_s - self.clock()


class Pace:
    """Seconds per unit of work, as the last generations took them.

    Parameters
    ----------
    deadline
        None for no limit.
    """

    def __init__(self, deadline: Deadline | None) -> None:
        self._deadline = deadline
        self._rates: deque[float] = deque(maxlen=_MEMORY)
        self._since = deadline.clock() if deadline else 0.0

    def start(self) -> None:
        """Take the time from here."""
        self._since = self._deadline.clock() if self._deadline else 0.0

    def finish(self, work: float) -> None:
        """Note that some work has been done since `start`."""
        if self._deadline:
            self._rates.append((self._deadline.clock() - self._since) / work)

    def allows(self, work: float) -> bool:
        """Return whether so much more work ends in time.

        Before anything has been timed it does, unless the time is over.
        """
        if self._deadline is None:
            return True
        expected_s = MARGIN * max(self._rates, default=0.0) * work
        return self._deadline.left_s > expected_s
