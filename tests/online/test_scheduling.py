"""Which window is taken next, and how long its round may last."""

import doctest

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.online import scheduling
from zfcal.online.scheduling import LEAST_S, SPARE_S, Choice, Overruns, budget_of, choose


def test_examples_of_the_module_hold():
    """Those in the docstrings."""
    assert doctest.testmod(scheduling).failed == 0


def test_nothing_waits():
    """Then nothing is taken, nor passed over."""
    assert choose({}, now_s=0.0, due_after_s=60.0) == Choice(end_s=None)


def test_the_oldest_goes_first():
    """Also when all of them came at once and are past due: nobody is kept waiting by them."""
    waiting = {240: 0.0, 120: 0.0, 180: 0.0}
    assert choose(waiting, now_s=1000.0, due_after_s=60.0) == Choice(end_s=120)


def test_a_stage_that_overran_goes_on_with_the_newest():
    """Windows came while it worked; those that waited for more than a minute are passed over."""
    waiting = {180: 0.0, 240: 60.0, 300: 120.0}
    assert choose(waiting, now_s=125.0, due_after_s=60.0) == Choice(
        end_s=300, passed_over=(180, 240)
    )
    assert choose(waiting, now_s=115.0, due_after_s=60.0) == Choice(end_s=240, passed_over=(180,))


def test_one_that_is_late_but_alone_is_taken():
    """There is nothing newer to go on with."""
    assert choose({180: 0.0}, now_s=500.0, due_after_s=60.0) == Choice(end_s=180)


def test_without_hurry_nothing_is_passed_over():
    """A recording that has ended is made as offline."""
    waiting = {180: 0.0, 240: 60.0, 300: 120.0}
    assert choose(waiting, now_s=1e6, due_after_s=None) == Choice(end_s=180)


def test_one_that_came_late_does_not_keep_its_successors():
    """Segments out of order: an old window that came last is not newer than the others."""
    waiting = {120: 100.0, 180: 20.0}
    assert choose(waiting, now_s=90.0, due_after_s=60.0).passed_over == ()


@given(
    waiting=st.dictionaries(st.integers(2, 60).map(lambda n: 60 * n), st.floats(0, 1e4)),
    now_s=st.floats(1e4, 2e4),
)
def test_what_waits_is_taken_passed_over_or_waits_on(waiting, now_s):
    """No window is both; the newest is never passed over; what still waits is not past due."""
    choice = choose(waiting, now_s=now_s, due_after_s=60.0)
    if not waiting:
        return
    rest = set(waiting) - set(choice.passed_over)
    assert choice.end_s == min(rest)
    assert max(waiting) in rest
    newest_s = max(waiting.values())
    late = [end for end in rest if now_s - waiting[end] > 60 and waiting[end] < newest_s]
    assert set(late) <= {max(waiting)}


@pytest.mark.parametrize(
    ("now_s", "expected_s"),
    [(0.0, 50.0), (5.0, 50.0), (5.001, 49.999), (30.0, 25.0), (54.0, LEAST_S), (500.0, LEAST_S)],
)
def test_a_round_is_over_before_the_next_one_is_due(now_s, expected_s):
    """It has its budget, or what is left of its minute but for a reserve, or a least time."""
    budget_s = budget_of(50.0, seen_s=0.0, now_s=now_s)
    assert budget_s == pytest.approx(expected_s)
    assert now_s + budget_s <= 60 - SPARE_S or budget_s == LEAST_S


def test_what_rounds_overran_is_kept_free_in_the_next_ones():
    """The worst of the last three, and a tenth more; never less than the reserve."""
    overruns = Overruns()
    assert overruns.reserve_s == SPARE_S
    overruns.add(took_s=49.0, budget_s=50.0)
    assert overruns.reserve_s == SPARE_S
    overruns.add(took_s=68.0, budget_s=48.0)
    assert overruns.reserve_s == pytest.approx(22.0)
    assert budget_of(50.0, seen_s=0.0, now_s=3.0, reserve_s=22.0) == pytest.approx(35.0)
    for _ in range(3):
        overruns.add(took_s=40.0, budget_s=38.0)
    assert overruns.reserve_s == SPARE_S


@given(fixed_s=st.floats(0, 40), slower=st.floats(1.0, 1.09))
def test_rounds_come_back_into_their_minute(fixed_s, slower):
    """Whatever takes up to 40 s beyond each budget: after the first rounds none misses it."""
    overruns, now_s, late = Overruns(), 0.0, []
    for number in range(10):
        seen_s = 60.0 * number
        now_s = max(now_s, seen_s)
        budget_s = budget_of(50.0, seen_s=seen_s, now_s=now_s, reserve_s=overruns.reserve_s)
        took_s = budget_s + fixed_s * (slower if number % 2 else 1.0)
        overruns.add(took_s, budget_s)
        now_s += took_s
        late.append(now_s > seen_s + 60.0)
    assert not any(late[5:])


def test_a_stage_that_is_too_slow_never_falls_farther_behind():
    """Rounds of 150 s and a window a minute: it always works on one of the last three."""
    waiting, now_s, behind = {}, 0.0, []
    for _ in range(50):
        newest = int(now_s // 60) * 60
        made = behind[-1][0] if behind else -60
        waiting = {end: float(end) for end in range(made + 60, newest + 1, 60)}
        choice = choose(waiting, now_s=now_s, due_after_s=60.0)
        behind.append((choice.end_s, newest - choice.end_s))
        assert len(waiting) <= 4
        now_s += 150.0
    assert max(late for _, late in behind) <= 60
