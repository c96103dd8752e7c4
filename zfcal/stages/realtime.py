"""What keeps other work from holding up a stage that must be in time: priority and garbage."""

from __future__ import annotations

import contextlib
import errno
import gc
import os
import sys
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def ahead_of_others(niceness: int) -> Iterator[OSError | None]:
    """Ask for a high priority, for every thread: who holds the interpreter holds up the others.

    Threads that are begun meanwhile have that of the one that begins them.

    Parameters
    ----------
    niceness
        Negative for ahead of what has none.

    Yields
    ------
    OSError or None
        Why it is not allowed; then everything goes on as it was.
    """
    if sys.platform == "win32":
        yield OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
        return
    with contextlib.ExitStack() as stack:
        problem = None
        try:
            for thread in threading.enumerate():
                number = thread.native_id or 0
                before = os.getpriority(os.PRIO_PROCESS, number)
                os.setpriority(os.PRIO_PROCESS, number, niceness)
                stack.callback(_lower, number, before)
        except OSError as error:
            problem = error
        yield problem


def _lower(thread: int, niceness: int) -> None:
    """Take back the priority of a thread, if it is still there."""
    if sys.platform == "win32":
        return
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, thread, niceness)


@contextlib.contextmanager
def garbage_left_alone() -> Iterator[None]:
    """Keep the collector of garbage away from what is there."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
