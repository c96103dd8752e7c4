"""Several jobs at a time, heard as if they had been done in turn."""

import threading
import time

import pytest

from zfcal.errors import InputError, LockedError
from zfcal.stages.events import Note
from zfcal.stages.side_by_side import StoppedError, at_once, side_by_side


def attempt(errors):
    """Return what does a part of the work and keeps its errors."""

    def call(part):
        try:
            part()
        except (InputError, LockedError) as error:
            errors.append(str(error))

    return call


def job(number, *, before=None, after=None, notes=3):
    """Return a job that tells a few notes, after one event and before another."""

    def work(tell):
        if before is not None:
            assert before.wait(10)
        for note in range(notes):
            tell(Note(text=f"{number}.{note}"))
        if after is not None:
            after.set()

    return work


def texts(events):
    """Return what was told."""
    return [event.text for event in events]


def test_what_is_told_comes_in_the_order_of_the_jobs(heard):
    """Though the last job is done before the first begins to tell."""
    second, third = threading.Event(), threading.Event()
    jobs = [job(1, before=second), job(2, before=third, after=second), job(3, after=third)]
    side_by_side(jobs, heard.append, attempt([]), n_at_once=3)
    assert texts(heard) == [f"{number}.{note}" for number in (1, 2, 3) for note in range(3)]


def test_no_more_are_at_work_than_asked(heard):
    """Seven jobs, two at a time: never three at work."""
    at_work, most = [0], [0]
    guard = threading.Lock()

    def work(tell):
        with guard:
            at_work[0] += 1
            most[0] = max(most[0], at_work[0])
        time.sleep(0.02)
        tell(Note(text="done"))
        with guard:
            at_work[0] -= 1

    side_by_side([work] * 7, heard.append, attempt([]), n_at_once=2)
    assert most == [2]
    assert texts(heard) == ["done"] * 7


def test_events_are_heard_in_the_callers_thread():
    """Whoever writes to the terminal need not know of threads."""
    threads = set()
    side_by_side(
        [job(1), job(2)],
        lambda _: threads.add(threading.current_thread()),
        attempt([]),
        n_at_once=2,
    )
    assert threads == {threading.current_thread()}


def test_an_error_of_one_job_stands_at_its_place(heard):
    """After what it told before; the others go on."""

    def fails(tell):
        tell(Note(text="2.0"))
        raise InputError("Tracks are missing.")

    errors = []
    side_by_side([job(1), fails, job(3)], heard.append, attempt(errors), n_at_once=3)
    assert texts(heard) == ["1.0", "1.1", "1.2", "2.0", "3.0", "3.1", "3.2"]
    assert errors == ["Tracks are missing."]


def test_an_interrupt_stops_the_others():
    """Each the next time that it tells something; those that wait never begin."""
    stopped, begun = threading.Event(), []

    def endless(tell):
        try:
            while True:
                tell(Note(text="on and on"))
                time.sleep(0.001)
        except StoppedError:
            stopped.set()
            raise

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side(
            [job(1), endless, lambda _: begun.append(3)],
            interrupt,
            lambda part: part(),
            n_at_once=2,
        )
    assert stopped.wait(10)
    assert begun in ([], [3])


@pytest.mark.parametrize(
    ("n_jobs", "n_threads", "wanted"),
    [(1, 64, 1), (40, 1, 2), (40, 8, 8), (3, 8, 3), (40, 200, 16), (0, 4, 1)],
)
def test_how_many_jobs_keep_a_cluster_busy(n_jobs, n_threads, wanted):
    """At least two where there are two, at most sixteen."""
    assert at_once(n_jobs, n_threads) == wanted


def test_at_least_one_job_is_done_at_a_time(heard):
    """None at a time would never end."""
    with pytest.raises(InputError, match="At least one job"):
        side_by_side([job(1)], heard.append, attempt([]), n_at_once=0)
