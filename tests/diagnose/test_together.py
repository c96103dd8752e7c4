"""Two things at the same time, or one after the other."""

import threading

import pytest

from zfcal.diagnose.together import together


def test_two_workers_work_at_the_same_time():
    """Each waits for the other to have begun, which one thread never would."""
    both = threading.Barrier(2, timeout=10)
    assert sorted(together(both.wait, both.wait, n_workers=2)) == [0, 1]


def test_one_worker_does_one_after_the_other():
    """The first one first, in the thread that asks; the answers stand in the same order."""
    order = []

    def work(name):
        order.append((name, threading.current_thread()))
        return name

    assert together(lambda: work("a"), lambda: work(2), n_workers=1) == ("a", 2)
    here = threading.current_thread()
    assert order == [("a", here), (2, here)]


@pytest.mark.parametrize("n_workers", [1, 2])
@pytest.mark.parametrize("which", [0, 1])
def test_what_fails_in_either_fails(which, n_workers):
    """Nothing is swallowed in a thread."""

    def fail():
        raise ArithmeticError("of one of the two")

    tasks = [lambda: 1, lambda: 2]
    tasks[which] = fail
    with pytest.raises(ArithmeticError, match="of one of the two"):
        together(*tasks, n_workers=n_workers)
