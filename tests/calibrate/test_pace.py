"""A clock that only goes on when it is told to."""

import math

from zfcal.calibrate.pace import MARGIN, Deadline, Pace


class Clock:
    """Seconds that a test sets."""

    now = 100.0

    def __call__(self):
        """Return the seconds so far."""
        return self.now


def test_time_left_by_hand():
    """From 100 to 110 there are 10 s; after the end less than none."""
    clock = Clock()
    deadline = Deadline(ends_s=110.0, clock=clock)
    assert deadline.left_s == 10.0
    clock.now = 112.0
    assert deadline.left_s == -2.0


def test_work_is_allowed_as_long_as_it_ends_in_time():
    """10 units took 2 s: with the margin of 1.25, 30 units want 7.5 s of the 8 left, 32 want 8."""
    clock = Clock()
    pace = Pace(Deadline(ends_s=110.0, clock=clock))
    pace.start()
    clock.now = 102.0
    pace.finish(10.0)
    assert MARGIN == 1.25
    assert pace.allows(30.0)
    assert not pace.allows(32.0)


def test_the_slowest_of_the_last_three_counts_and_older_ones_are_forgotten():
    """A slow start, such as a first call, does not hold up the rest."""
    clock = Clock()
    pace = Pace(Deadline(ends_s=120.0, clock=clock))
    for seconds in (8.0, 1.0, 1.0):
        pace.start()
        clock.now += seconds
        pace.finish(1.0)
    assert not pace.allows(1.0)
    pace.start()
    clock.now += 1.0
    pace.finish(1.0)
    assert pace.allows(7.0)


def test_without_a_deadline_all_is_allowed_and_with_none_timed_until_it_is_over():
    """The first generation may start as long as there is time at all."""
    assert Pace(None).allows(math.inf)
    clock = Clock()
    pace = Pace(Deadline(ends_s=101.0, clock=clock))
    assert pace.allows(1e9)
    clock.now = 101.0
    assert not pace.allows(1.0)
