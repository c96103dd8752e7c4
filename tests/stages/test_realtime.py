"""A stage that must be in time goes ahead of others while it runs, and not a moment longer."""

import contextlib
import gc
import os
import threading

from zfcal.stages.realtime import ahead_of_others, garbage_left_alone


def niceness_of(thread=0):
    """Return the niceness of a thread by its number; of this one without."""
    return os.getpriority(os.PRIO_PROCESS, thread)


def test_threads_that_are_begun_meanwhile_go_ahead_too(granted):
    """Such as those that read the cameras; one that has ended is not asked for.

    Who lacks the right is told, and all stay as they were.
    """
    before, seen, wanted = niceness_of(), [], granted(-5)
    with ahead_of_others(-5) as problem:
        reader = threading.Thread(target=lambda: seen.append(niceness_of()))
        reader.start()
        reader.join()
        assert (problem is None) == (wanted == -5)
        assert (niceness_of(), seen) == (wanted, [wanted])
    assert niceness_of() == before


def test_a_failure_takes_the_priority_back(granted):
    """Whoever handles it goes on as before."""
    before, meanwhile = niceness_of(), []
    with contextlib.suppress(ValueError), ahead_of_others(-5):
        meanwhile.append(niceness_of())
        raise ValueError
    assert (meanwhile, niceness_of()) == ([granted(-5)], before)


def test_who_may_not_go_ahead_goes_on(monkeypatch):
    """The reason is handed out, the work is done."""

    def refuses(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "setpriority", refuses)
    before = niceness_of()
    with ahead_of_others(-5) as problem:
        assert problem.strerror == "Permission denied"
        assert niceness_of() == before


def test_what_is_there_is_no_garbage_meanwhile():
    """Frozen within, and given back at the end, also of a failure."""
    gc.unfreeze()
    with contextlib.suppress(ValueError), garbage_left_alone():
        assert gc.get_freeze_count() > 1000
        assert gc.isenabled()
        raise ValueError
    assert gc.get_freeze_count() == 0
