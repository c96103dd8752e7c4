"""Several trials at the same time, told of one after the other.

Rounds of one trial follow each other, since each starts from the last one's population;
trials do not know each other. On a cluster, one trial's pause is another's turn.
"""

from __future__ import annotations

import functools
import queue
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeAlias

from zfcal.errors import InputError
from zfcal.stages.events import Event, Tell

Job: TypeAlias = Callable[[Tell], None]
"""Something to do, such as a trial to calibrate; it tells what happens to who is handed in."""

Attempt: TypeAlias = Callable[[Callable[[], object]], None]
"""Does a part of the work and takes its errors that a person can mend."""

_MOST = 16


class StoppedError(BaseException):
    """The others have been stopped, so this job stops as well; nobody needs to hear of it."""


def at_once(n_jobs: int, n_threads: int) -> int:
    """Return how many jobs to do at the same time.

    Parameters
    ----------
    n_jobs
        How many there are.
    n_threads
        Simulations that a cluster does at the same time. Two jobs keep it busy
        where one pauses; more than sixteen only wait for this machine.
    """
    return max(1, min(n_jobs, max(2, n_threads), _MOST))


def side_by_side(jobs: Sequence[Job], tell: Tell, attempt: Attempt, *, n_at_once: int) -> None:
    """Do jobs at the same time; what is told is as if they were done in turn.

    Parameters
    ----------
    jobs
        None of them may touch another's files.
    tell
        Hears, in this thread, all events of the first job, then all of the second.
    attempt
        Does the telling of one job, which ends in the job's error if it has one.
    n_at_once
        So many threads.

    Notes
    -----
    When this thread is interrupted, each job ends the next time that it tells something.
    """
    if n_at_once < 1:
        raise InputError(f"At least one job must be done at a time, got {n_at_once}.")
    stop = threading.Event()
    pool = ThreadPoolExecutor(n_at_once, thread_name_prefix="zfcal-trial")
    started = [_start(pool, job, stop) for job in jobs]
    try:
        for future, heard in started:
            attempt(functools.partial(_follow, future, heard, tell))
    except BaseException:
        stop.set()
        raise
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


_Heard: TypeAlias = "queue.SimpleQueue[Event | None]"


def _start(
    pool: ThreadPoolExecutor, job: Job, stop: threading.Event
) -> tuple[Future[None], _Heard]:
    heard: _Heard = queue.SimpleQueue()

    def tell(event: Event) -> None:
        if stop.is_set():
            raise StoppedError
        heard.put(event)

    future = pool.submit(job, tell)
    future.add_done_callback(lambda _: heard.put(None))
    return future, heard


def _follow(future: Future[None], heard: _Heard, tell: Tell) -> None:
    """Tell what a job tells, until it is done; then raise its error if it has one."""
    while (event := heard.get()) is not None:
        tell(event)
    future.result()
