"""One command of a kind at a time on one trial."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import BaseFileLock, FileLock, Timeout

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
    # The file stays: removing it would let two processes hold locks on two files of one name. And
    # where the file system has no locks that end with their process, there is none at all.
    held = FileLock(
        path,
        blocking=False,
        thread_local=False,
        preserve_lock_file=True,
        fallback_to_soft=False,
    )
    _take(held, path, command)
    try:
        yield
    finally:
        held.release()


def is_locked(root: Path, command: str) -> bool:
    """Return whether a command is at work on the trial; none has been where no lock file lies.

    To know it the lock is taken for an instant.

    Parameters
    ----------
    root
        The trial's directory.
    command
        As `lock` has it.

    Raises
    ------
    StorageError
        The lock file cannot be opened.
    """
    if not (root / f".lock-{command}").exists():
        return False
    try:
        with lock(root, command):
            return False
    except LockedError:
        return True


def _take(held: BaseFileLock, path: Path, command: str) -> None:
    try:
        if not path.parent.is_dir():
            # The library would make the folder: a trial that was moved away must not come back.
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
        held.acquire()
    except Timeout as error:
        raise LockedError(
            f"{path.parent}: another zfcal {command} is at work on this trial.",
            hint="Wait until it is done; the lock frees itself when that process ends.",
        ) from error
    except OSError as error:
        raise storage_error(path, error) from error
