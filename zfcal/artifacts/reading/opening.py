"""Opening files of a trial: regular ones only.

A file that a symbolic link leads out of its trial is not opened (`places`), and one that is
too large is not read (`limits`).
"""

from __future__ import annotations

import errno
import io
import os
import stat
from pathlib import Path

from zfcal.artifacts.reading.limits import check_size, most_bytes, too_large
from zfcal.artifacts.reading.places import KINDS, check_inside, way_back
from zfcal.errors import InputError

_NO_FOLLOW = getattr(os, "O_NOFOLLOW", 0)
_NO_WAIT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
"""How a link is refused and a pipe keeps nobody waiting; Windows has neither flags nor need."""

_PIECE_BYTES = 2**16


def open_regular(path: Path) -> io.BufferedReader:
    """Open a regular file for reading; a pipe, a device or a folder keeps nobody waiting.

    Raises
    ------
    OSError
        It is missing, no regular file, lies outside the trial that its path names, or
        cannot be opened; see `unreadable`.
    """
    descriptor = _descriptor(path, os.O_RDONLY)
    return os.fdopen(descriptor, "rb")


def open_to_write(path: Path, *, append: bool = False) -> io.BufferedWriter:
    """Open a file of a trial that grows in its place: a new one, or one that is a regular file.

    Parameters
    ----------
    path
        Its place. A symbolic link there is refused: what it leads to is another file.
    append
        Whether what is there stays.

    Raises
    ------
    OSError
        The place cannot be written, is no regular file, or lies outside the trial.
    """
    how = os.O_APPEND if append else os.O_TRUNC
    descriptor = _descriptor(path, os.O_WRONLY | os.O_CREAT | _NO_FOLLOW | how)
    return os.fdopen(descriptor, "ab" if append else "wb")


def _descriptor(path: Path, flags: int) -> int:
    if "\0" in str(path):
        raise OSError(errno.EINVAL, "a name cannot hold a zero byte", str(path))
    check_inside(path)
    descriptor = os.open(path, flags | _NO_WAIT, 0o666)
    kind = stat.S_IFMT(os.fstat(descriptor).st_mode)
    if kind != stat.S_IFREG:
        os.close(descriptor)
        number = errno.EISDIR if kind == stat.S_IFDIR else errno.EINVAL
        text = f"expected a regular file, got {KINDS.get(kind, 'something else')}"
        raise OSError(number, text, str(path))
    if _NO_WAIT and hasattr(os, "set_blocking"):
        os.set_blocking(descriptor, True)
    return descriptor


def read_limited(path: Path) -> bytes:
    """Return what a regular file holds, unless that is more than a file of its kind may have.

    Nothing is noted of it: see `contents.read_bytes`.

    Raises
    ------
    OSError
        As `open_regular`.
    DamagedError
        It is too large.
    """
    most = most_bytes(path)
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        check_size(path, size)
        # Somebody may be writing on. Reading sets aside what it is asked for: not all it may have.
        pieces = [file.read(size + 1)]
        while pieces[-1] and sum(map(len, pieces)) <= most:
            pieces.append(file.read(_PIECE_BYTES))
    data = b"".join(pieces)
    if len(data) > most:
        raise too_large(path, len(data), most)
    return data


def unreadable(path: Path, error: OSError) -> InputError:
    """Return the error for a file that cannot be opened for reading."""
    if isinstance(error, FileNotFoundError):
        return InputError(f"{path}: no such file.", hint="Check the path, and where you stand.")
    hint = "Check that it is a file, and its permissions."
    if error.errno == errno.EXDEV:
        hint = way_back(path)
    return InputError(f"{path}: cannot be read ({error.strerror or error}).", hint=hint)
