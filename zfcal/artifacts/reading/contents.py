"""What files of a trial hold: each has one content for one piece of work.

An artifact states the SHA-256 of what it was made from. That is the hash of the bytes that
were read, not of those that lie there later: within `one_content` every look at a file,
be it a hash or the bytes themselves, must show the same content, and `check_contents` looks
once more before something is published. What the bytes mean is the business of others.
"""

from __future__ import annotations

import errno
import hashlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias, final

from zfcal.artifacts.reading.opening import open_regular, read_limited, unreadable
from zfcal.artifacts.reading.places import numbered
from zfcal.errors import ChangedError, InputError

Looks: TypeAlias = tuple[int, ...]
"""What tells one content of a place from the next without reading it."""

_HASHES: dict[Looks, tuple[Looks, str]] = {}
"""For each inode what its file looked like when it was hashed, and the hash."""

_TICK_NS = 50_000_000
"""Files are stamped by a clock that ticks every few milliseconds. Two contents that are written
within a tick look the same: a hash is kept only of a file that has been left alone longer."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What files held when they were looked at during one piece of work.

    Parameters
    ----------
    digests
        SHA-256 by absolute path.
    steady
        The looks of files that must not be written to, by absolute path.
    values
        What files say of which only the values count, not their comments, by absolute path.
    outer
        Of the work that this is a part of.
    """

    digests: dict[str, str] = field(default_factory=dict)
    steady: dict[str, Looks] = field(default_factory=dict)
    values: dict[str, str] = field(default_factory=dict)
    outer: Contents | None = None

    def take(self, other: Contents) -> None:
        """Note all that other work has seen.

        Raises
        ------
        ChangedError
            It has seen another content of a file.
        """
        for place, digest in other.digests.items():
            self.note(place, digest)
        for place, looks in other.steady.items():
            self.note_steady(place, looks)
        for place, values in other.values.items():
            self.note_values(place, values)

    def note(self, path: Path | str, digest: str) -> None:
        """Note the hash of a file that was looked at.

        Raises
        ------
        ChangedError
            It was another one before.
        """
        place = os.path.abspath(path)  # noqa: PTH100 - asked so often that a Path would cost
        if self.digests.setdefault(place, digest) != digest:
            raise _changed(place)

    def note_steady(self, path: Path | str, looks: Looks) -> None:
        """Note a file that a library reads by its name: nobody may write to it."""
        place = os.path.abspath(path)  # noqa: PTH100 - as above
        if self.steady.setdefault(place, looks) != looks:
            raise _changed(place)

    def note_values(self, path: Path | str, values: str) -> None:
        """Note what a file says of which comments and order do not count.

        It is not looked at again at the end: what is made states the values that it was made
        with among its options.
        """
        place = os.path.abspath(path)  # noqa: PTH100 - as above
        if self.values.setdefault(place, values) != values:
            raise _changed(place)

    def forget(self, path: Path) -> None:
        """Let a file change that this work itself writes."""
        place = os.path.abspath(path)  # noqa: PTH100 - as above
        self.digests.pop(place, None)
        self.steady.pop(place, None)
        self.values.pop(place, None)
        if self.outer is not None:
            self.outer.forget(path)

    def check(self) -> None:
        """Look at every file once more.

        Raises
        ------
        ChangedError
            One is gone, or holds something else than when it was read.
        """
        for place, looks in self.steady.items():
            if _written(looks_of(place)) != looks:
                raise _changed(place)
        for place, digest in self.digests.items():
            try:
                found = _digest_of(place)
            except InputError as error:
                raise _changed(place) from error
            if found != digest:
                raise _changed(place)


_CONTENTS: ContextVar[Contents | None] = ContextVar("contents", default=None)


@contextmanager
def one_content(known: Contents | None = None) -> Iterator[Contents]:
    """Hold every file that is read within this context to one content.

    A context within another one is a part of its work: what it has seen counts there as well,
    unless it failed.

    Parameters
    ----------
    known
        What was seen before on whose results this work builds, such as a trial's settings.
    """
    outer = _CONTENTS.get()
    seen = Contents(outer=outer)
    if known is not None:
        seen.take(known)
    token = _CONTENTS.set(seen)
    try:
        yield seen
    finally:
        _CONTENTS.reset(token)
    if outer is not None:
        outer.take(seen)


@contextmanager
def values_alone() -> Iterator[None]:
    """Read files of which the values count, which `note_values` then notes."""
    token = _CONTENTS.set(None)
    try:
        yield
    finally:
        _CONTENTS.reset(token)


def note_values(path: Path, values: str) -> None:
    """Note what a file says, for the current piece of work.

    Raises
    ------
    ChangedError
        It said something else before.
    """
    seen = _CONTENTS.get()
    if seen is not None:
        seen.note_values(path, values)


def check_contents() -> None:
    """Look once more at all that was read within the current `one_content`, if there is one.

    Raises
    ------
    ChangedError
        A file has changed since it was read.
    """
    seen = _CONTENTS.get()
    if seen is not None:
        seen.check()


def forget_content(path: Path) -> None:
    """Let a file change that the current work itself writes."""
    seen = _CONTENTS.get()
    if seen is not None:
        seen.forget(path)


def read_bytes(path: Path) -> bytes:
    """Return what a regular file holds, all at once; the hash of these very bytes is noted.

    Raises
    ------
    InputError
        The file is missing, no regular one, or cannot be read.
    DamagedError
        It is too large.
    ChangedError
        The current piece of work has seen another content of it.
    """
    try:
        data = read_limited(path)
    except OSError as error:
        raise unreadable(path, error) from error
    seen = _CONTENTS.get()
    if seen is not None:
        seen.note(path, hashlib.sha256(data).hexdigest())
    return data


def hash_of(path: Path | str) -> str:
    """Return the SHA-256 of a file, which is read only if it has changed since; noted as well.

    Raises
    ------
    InputError
        The file is missing, no regular one, or cannot be read.
    ChangedError
        The current piece of work has seen another content of it.
    """
    digest = _digest_of(path)
    seen = _CONTENTS.get()
    if seen is not None:
        seen.note(path, digest)
    return digest


def hold_steady(path: Path) -> None:
    """Note a file that a library is about to read by its name: until the end it stays as it is.

    The time of its last writing tells, since nobody sees the bytes that the library reads. A link
    that is made to it, or other permissions, change nothing.

    Raises
    ------
    InputError
        The file is missing, no regular one, or cannot be read.
    ChangedError
        It was written to since the current piece of work has seen it.
    """
    seen = _CONTENTS.get()
    if seen is not None:
        looks = _written(looks_of(path))
        if looks is None:
            raise unreadable(path, FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT)))
        seen.note_steady(path, looks)
        seen.note(path, _digest_of(path))


def numbered_of(folder: Path, ending: str) -> dict[int, Path]:
    """Return the artifacts of a folder by their number, in order; see `places.numbered`.

    Raises
    ------
    InputError
        The folder leads outside its trial, or cannot be listed.
    """
    try:
        return numbered(folder, ending)
    except OSError as error:
        raise unreadable(folder, error) from error


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal.

    Raises
    ------
    InputError
        The file is missing, no regular one, or cannot be read.
    """
    try:
        with open_regular(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise unreadable(path, error) from error


def looks_of(path: Path | str) -> Looks | None:
    """Return what tells a file from another of the same name; None if there is none."""
    try:
        status = os.stat(path)  # noqa: PTH116 - asked so often that making a Path would tell
    except (OSError, ValueError):
        return None
    times = (status.st_mtime_ns, status.st_ctime_ns)
    return (status.st_dev, status.st_ino, *times, status.st_size)


def _digest_of(path: Path | str) -> str:
    looks = looks_of(path)
    if looks is None:
        return sha256_of(Path(path))
    known = _HASHES.get(looks[:2])
    if known is not None and known[0] == looks:
        return known[1]
    asked_ns = time.time_ns()
    digest = sha256_of(Path(path))
    # The second of the times is that of the last change; on Windows, of the making.
    if looks == looks_of(path) and abs(asked_ns - max(looks[2:4])) > _TICK_NS:
        _HASHES[looks[:2]] = (looks, digest)
    return digest


def _written(looks: Looks | None) -> Looks | None:
    """Return what tells one writing of a file from the next: all but the time of its status."""
    return None if looks is None else (*looks[:3], *looks[4:])


def _changed(place: str) -> ChangedError:
    return ChangedError(
        f"{place}: has changed while it was being used.",
        hint="Run the command again when no other process writes there.",
    )
