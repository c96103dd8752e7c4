"""One command of a kind at a time on one trial."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from zfcal.artifacts.atomic import storage_error
from zfcal.errors import LockedError


@contextmanager
def lock(root: Path, command: str) -> Iterator[None]:
    """Hold the trial for one command; the operating system frees it however the process ends.

    Parameters
    ----------
    root
        The trial's directory.
    command
        Commands of different names do not hinder each other.

    Raises
    ------
    LockedError
        The same command is at work on the trial.
    StorageError
        The lock file cannot be made.
    """
    path = root / f".lock-{command}"
    try:
        # A link is not followed: the file would come into being wherever it leads.
        how = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
        descriptor = os.open(path, how, 0o666)
    except OSError as error:
        raise storage_error(path, error) from error
    try:
        _take(descriptor, path, command)
        yield
    finally:
        # The file stays: removing it would let two processes hold locks on two files of one name.
        os.close(descriptor)


def _take(descriptor: int, path: Path, command: str) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise LockedError(
            f"{path.parent}: another zfcal {command} is at work on this trial.",
            hint="Wait until it is done; the lock frees itself when that process ends.",
        ) from error
    except OSError as error:
        raise storage_error(path, error) from error
