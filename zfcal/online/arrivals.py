"""Which files of a trial are there, whole and settled: the truth behind every notification.

No time of a file is ever compared with a clock: whether a file has settled is told
by two looks at it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import TypeAlias, final

from zfcal.artifacts.freshness import relative_to
from zfcal.artifacts.lineage import first_line
from zfcal.artifacts.reading.opening import open_regular
from zfcal.artifacts.reading.places import check_inside
from zfcal.stages.segments import STEP_S
from zfcal.trial import CONFIG_NAME, second_of

SETTLED_S = 0.5
"""A file that looks the same for so long has been written to its end."""

FOLDERS = ("tracks", "stats", "scores", "models")
"""What is looked at; images and poses are followed by others, frame by frame."""

_MAGIC = b"PAR1"

Looks: TypeAlias = tuple[int, int, int]
"""Size, time of change in nanoseconds, and inode of a file."""

Signature: TypeAlias = frozenset[tuple[str, Looks, bool]]
"""Names of files, what they look like, and whether they are whole."""


@dataclass(slots=True, kw_only=True)
class _File:
    looks: Looks
    since_s: float
    problem: str | None = None
    is_whole: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrived:
    """A file is there, whole.

    Parameters
    ----------
    path
        Which one.
    """

    path: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Unfinished:
    """A file is not whole yet; it is passed over until it is.

    Parameters
    ----------
    path
        Which one.
    problem
        What is missing, in a sentence that names the file.
    """

    path: Path
    problem: str


@final
class Arrivals:
    """Looks again and again at the files of a trial.

    Parameters
    ----------
    root
        The trial's directory.
    clock
        Seconds, monotonic.

    Attributes
    ----------
    whole_s
        By segment start or, for statistics, by window end: when the file was first
        seen whole, on the clock.
    """

    def __init__(self, root: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._root = root
        self._clock = clock
        self._files: dict[str, _File] = {}
        self.whole_s: dict[str, dict[int, float]] = {"tracks": {}, "stats": {}}

    @property
    def signature(self) -> Signature:
        """What all files look like: while it stays, there is nothing new to do."""
        return frozenset((name, file.looks, file.is_whole) for name, file in self._files.items())

    @property
    def unsettled(self) -> bool:
        """Whether a file may still grow."""
        return any(not file.is_whole and file.problem is None for file in self._files.values())

    @property
    def unfinished(self) -> dict[str, str]:
        """What is wrong with the files that are not whole, by their names in the trial."""
        return {name: file.problem for name, file in self._files.items() if file.problem}

    def look(self) -> list[Arrived | Unfinished]:
        """Look at all files once, and return what is new.

        Raises
        ------
        FileNotFoundError
            The trial is gone.
        """
        found = dict(_files(self._root))
        # One time for all that one look finds: together they came.
        now_s = self._clock()
        for name in self._files.keys() - found.keys():
            self._forget(name)
        news = [self._see(name, looks, now_s) for name, looks in sorted(found.items())]
        return [each for each in news if each is not None]

    def trust(self, path: Path) -> None:
        """Take a file for whole that a stage of this very computer has just made."""
        name = relative_to(self._root, path)
        try:
            looks = _looks(path)
        except OSError:
            return
        now_s = self._clock()
        file = _File(looks=looks, since_s=now_s, is_whole=True)
        self._files[name] = file
        self._note_whole(name, now_s)

    def _see(self, name: str, looks: Looks, now_s: float) -> Arrived | Unfinished | None:
        file = self._files.get(name)
        if file is None or file.looks != looks:
            if file is not None:
                self._forget(name)
            file = self._files[name] = _File(looks=looks, since_s=now_s)
        if file.is_whole or now_s - file.since_s < _patience_s(name):
            return None
        path = self._root / name
        before, problem = file.problem, _problem(path)
        if problem and not _is_there(path):
            # It went while it was looked at, maybe with the whole trial: that says nothing of it.
            return None
        file.problem = problem
        if problem:
            told = Unfinished(path=path, problem=f"{path}: {problem}.")
            return None if problem == before else told
        file.is_whole = True
        self._note_whole(name, now_s)
        return Arrived(path=path)

    def _note_whole(self, name: str, now_s: float) -> None:
        folder = name.partition("/")[0]
        second = second_of(Path(name))
        if folder in self.whole_s and second is not None:
            self.whole_s[folder].setdefault(second, now_s)

    def _forget(self, name: str) -> None:
        del self._files[name]
        folder = name.partition("/")[0]
        second = second_of(Path(name))
        if folder in self.whole_s and second is not None:
            self.whole_s[folder].pop(second, None)


def segment_ends(whole: dict[int, float]) -> dict[int, float]:
    """Return when each window's segments were there, by the window's end, in order.

    Parameters
    ----------
    whole
        When each segment was there, by its start.
    """
    return {
        start + STEP_S: max(seen_s, whole[start - STEP_S])
        for start, seen_s in sorted(whole.items())
        if start % STEP_S == 0 and start - STEP_S in whole
    }


def _files(root: Path) -> Iterator[tuple[str, Looks]]:
    """Yield the files that bear on something, by their names in the trial.

    Raises
    ------
    FileNotFoundError
        The trial is gone.
    """
    yield CONFIG_NAME, _looks(root / CONFIG_NAME)
    for folder in FOLDERS:
        try:
            check_inside(root / folder)
            names = [each.name for each in (root / folder).iterdir()]
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError:
            # Named with what is wrong with it, as a file would be.
            yield folder, _looks(root / folder)
            continue
        for name in names:
            if not name.startswith("."):
                try:
                    yield f"{folder}/{name}", _looks(root / folder / name)
                except FileNotFoundError:
                    continue


def _looks(path: Path) -> Looks:
    """Return what a file looks like; where a link leads nowhere, the link."""
    try:
        status = path.stat()
    except OSError:
        status = path.lstat()
    return status.st_size, status.st_mtime_ns, status.st_ino


def _is_there(path: Path) -> bool:
    """Return whether there is a file, or a link that leads nowhere."""
    return os.path.lexists(path)


def _patience_s(name: str) -> float:
    return SETTLED_S if name.endswith(".parquet") else 0.0


def _problem(path: Path) -> str | None:
    """Return why a file is not whole or none at all; None for a whole one."""
    try:
        check_inside(path)
        if path.name in FOLDERS:
            os.listdir(path)  # noqa: PTH208 - only whether it can be
            return None
        with open_regular(path) as file:
            return _table_problem(file) if path.suffix == ".parquet" else None
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"


def _table_problem(file: BufferedReader) -> str | None:
    """Return why a Parquet file is not whole."""
    import pyarrow as pa  # slow to import
    import pyarrow.parquet as pq

    size = file.seek(0, 2)
    file.seek(max(0, size - len(_MAGIC)))
    if file.read() != _MAGIC:
        return f"is not whole: {size} bytes, and no footer"
    try:
        pq.read_metadata(file)
    except (OSError, ValueError, MemoryError, pa.ArrowException) as error:
        return f"cannot be read ({first_line(error)})"
    return None
