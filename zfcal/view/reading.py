"""Reads files of a trial that is being written: each content once, and what is bad is named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, final

from zfcal.artifacts.reading.contents import Looks, looks_of, numbered_of
from zfcal.errors import ZfcalError

T = TypeVar("T")


@final
class Reader:
    """Reads the files of one trial.

    Parameters
    ----------
    root
        The trial's directory.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._known: dict[Path, tuple[Looks | None, Any]] = {}
        self._problems: dict[Path, str] = {}
        self._asked: set[Path] = set()

    def begin(self) -> None:
        """Begin a look at the trial: what is not asked for during it is forgotten at the next."""
        gone = self._known.keys() - self._asked
        for path in gone:
            del self._known[path]
        self._problems = {p: said for p, said in self._problems.items() if p in self._asked}
        self._asked = set()

    def read(self, path: Path, read: Callable[[Path], T]) -> T | None:
        """Return what a file says; None where it is not there or cannot be read.

        Parameters
        ----------
        path
            The file; it is read again only when it has changed.
        read
            Reads it, always the same for the same file.
        """
        self._asked.add(path)
        looks = looks_of(path)
        known = self._known.get(path)
        if known is not None and known[0] == looks:
            return known[1]
        value = None
        self._problems.pop(path, None)
        if looks is not None:
            try:
                value = read(path)
            except ZfcalError as error:
                self._problems[path] = self._short(str(error))
        self._known[path] = (looks, value)
        return value

    def files(self, folder: str, ending: str) -> dict[int, Path]:
        """Return the artifacts of a folder by their second, in order; see `numbered_of`."""
        place = self.root / folder
        self._asked.add(place)
        self._problems.pop(place, None)
        try:
            return numbered_of(place, ending)
        except ZfcalError as error:
            self._problems[place] = self._short(str(error))
            return {}

    @property
    def problems(self) -> list[str]:
        """What is wrong with the files that were asked for, a sentence each."""
        return [self._problems[path] for path in sorted(self._problems)]

    def _short(self, text: str) -> str:
        return text.replace(f"{self.root}/", "")
