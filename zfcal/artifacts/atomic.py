"""Files that appear whole or not at all.

What a file holds is the business of the other modules here; this one knows
about disks: names, flushing, renaming, and the ways in which they fail.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import platform
import re
import zlib
from collections.abc import Callable
from pathlib import Path

from zfcal.artifacts.reading.contents import check_contents, forget_content
from zfcal.artifacts.reading.opening import open_to_write
from zfcal.artifacts.reading.places import check_inside, way_back
from zfcal.errors import StorageError, TakenError

_COUNTER = itertools.count()
_IN_USE: set[str] = set()
"""Names of the dot-files that this process is writing."""

_HINTS = {
    errno.ENOSPC: "The disk is full: make room and run the same command again.",
    errno.EDQUOT: "Your quota is used up: make room and run the same command again.",
    errno.EFBIG: "Raise the limit on file sizes (ulimit -f), or use a file system that has none.",
    errno.EROFS: "The file system is mounted read-only: copy the trial to a disk of your own.",
    errno.EACCES: "You may not write there: change its permissions, or copy the trial.",
    errno.EPERM: "You may not write there: change its permissions, or copy the trial.",
    errno.ENOTDIR: "A file stands where a folder is needed: move it away.",
    errno.EEXIST: "A file stands where a folder is needed: move it away.",
    errno.ELOOP: "A symbolic link stands where the file is to go: move it away.",
    errno.EISDIR: "A folder stands where the file is to go: move it away.",
}
_FOLDER_SAYS = {errno.EPERM, errno.EACCES}
"""What macOS and Windows say where a folder is to be removed, or replaced, as if it were a file."""

# What a directory that cannot be flushed says: some network file systems have no such call.
_NO_FLUSH = {errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES, errno.EPERM}


def write_whole(path: Path, write: Callable[[Path], None], *, parents: bool = True) -> None:
    """Make a file that at every instant is absent, the old one, or the new one whole.

    Parameters
    ----------
    path
        Where the file goes; its folder is made when missing.
    write
        Writes the content to the path that it is given: a dot-file in the same
        folder, whose ending says nothing about the format.
    parents
        Whether all that its folder lies in is made as well. Not so in a trial: one that
        was moved away just now must not come into being again where it was.

    Raises
    ------
    StorageError
        The disk is full, or the place cannot be written. What was there stays,
        and the dot-file is removed.
    ChangedError
        Something that it was made from has changed meanwhile (`reading.one_content`);
        the same holds.
    """
    part = _part_of(path)
    _IN_USE.add(part.name)
    try:
        check_inside(path.parent)
        path.parent.mkdir(parents=parents, exist_ok=True)
        _remove_orphans(path)
        # What stands there by chance or by intent, such as a link, is not written through.
        part.unlink(missing_ok=True)
        write(part)
        _flush(part)
        check_contents()
        part.replace(path)
        forget_content(path)
        _flush_folder(path.parent)
    except OSError as error:
        raise storage_error(path, error) from error
    finally:
        # After the rename there is nothing left to remove.
        with contextlib.suppress(OSError):
            part.unlink()
        _IN_USE.discard(part.name)


def write_text_whole(path: Path, text: str, *, parents: bool = True) -> None:
    """Make a UTF-8 text file with `write_whole`, its line ends as they stand in ``text``."""
    write_bytes_whole(path, text.encode(), parents=parents)


def write_bytes_whole(path: Path, data: bytes, *, parents: bool = True) -> None:
    """Make a file of these bytes with `write_whole`."""

    def write(part: Path) -> None:
        part.write_bytes(data)

    write_whole(path, write, parents=parents)


def append_bytes(path: Path, data: bytes) -> None:
    """Add to the end of a file and wait until the disk has it.

    Whoever reads the file must know an end that was cut: a process that is killed may
    leave one.

    Raises
    ------
    StorageError
        The disk is full, or the place cannot be written.
    """
    try:
        with open_to_write(path, append=True) as file:
            file.write(data)
        forget_content(path)
        _flush(path)
    except OSError as error:
        raise storage_error(path, error) from error


def remove(path: Path) -> None:
    """Remove a file, which need not be there.

    Raises
    ------
    TakenError
        A folder stands there: nobody knows what for, and it stays.
    StorageError
        It cannot be removed.
    """
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise storage_error(path, error, what="removed") from error


def discard(path: Path) -> None:
    """Remove a file of no more use; a folder in its place is somebody else's, and stays.

    Raises
    ------
    StorageError
        It cannot be removed.
    """
    with contextlib.suppress(TakenError):
        remove(path)


def check_free(path: Path) -> None:
    """Refuse a place where a folder stands, before work is done for the file that is to go there.

    Raises
    ------
    TakenError
        One does.
    """
    if path.is_dir() and not path.is_symlink():
        raise storage_error(path, IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR)))


def storage_error(path: Path, error: OSError, *, what: str = "written") -> StorageError:
    """Return the error for a place that cannot be written, with what to do about it.

    Parameters
    ----------
    path
        The place.
    error
        What the system says.
    what
        What cannot be done with it.
    """
    is_taken = error.errno == errno.EISDIR or (error.errno in _FOLDER_SAYS and path.is_dir())
    kind = TakenError if is_taken else StorageError
    return kind(
        f"{path}: cannot be {what} ({error.strerror or error}). What was there is kept.",
        hint=(
            way_back(path)
            if error.errno == errno.EXDEV
            else _HINTS.get(error.errno or 0, "Check the disk, and the connection to it.")
        ),
    )


def is_part(name: str) -> bool:
    """Return whether a file name is that of a write under way, or of one that was killed."""
    return name.startswith(".") and ".part-" in name


def is_orphan(path: Path) -> bool:
    """Return whether a dot-file is what a process of this computer left when it was killed."""
    match = re.search(rf"\.part-{_host()}-(\d+)-\d+$", path.name)
    if match is None:
        return False
    process = int(match.group(1))
    # In a container the next run may well get the number of the one that was killed.
    return path.name not in _IN_USE if process == os.getpid() else not _is_alive(process)


def _host() -> str:
    return f"{zlib.crc32(platform.node().encode()):08x}"


def _part_of(path: Path) -> Path:
    """Name the dot-file after host, process and count: nobody else writes to it."""
    return path.with_name(f".{path.name}.part-{_host()}-{os.getpid()}-{next(_COUNTER)}")


def _remove_orphans(path: Path) -> None:
    """Remove what processes of this computer left of the same file when they were killed."""
    start = f".{path.name}.part-"
    for part in path.parent.iterdir():
        if part.name.startswith(start) and is_orphan(part):
            part.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    try:
        if os.name == "nt":
            # There the signal that asks ends the process. Elsewhere it sees those of other people
            # as well, which a system may hide from whoever lists them.
            import psutil

            return psutil.pid_exists(process)
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def _flush(path: Path) -> None:
    # Windows flushes only what may be written, and knows no such thing of a folder (EACCES).
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _flush_folder(folder: Path) -> None:
    """Make the rename itself last through a loss of power."""
    try:
        _flush(folder)
    except OSError as error:
        if error.errno not in _NO_FLUSH:
            raise
