"""Everything that can go wrong and that a person can mend.

::

    ZfcalError            exit 1
    ├── InputError        what a person gave is wrong: a value, a file, an option
    │   ├── OptionError   options contradict each other, or have another form; exit 2
    │   └── SchemaError   an artifact of another schema or version
    ├── DamagedError      a file that cannot be read whole; the rest goes on, exit 3
    ├── StorageError      the disk is full, or a place cannot be written
    │   └── TakenError    a folder stands where one file is to go; others can be written
    ├── ChangedError      an input has changed while something was made from it
    └── LockedError       the same command is at work on the same trial, exit 75

A message says what, where, expected and got; the hint says what to do. The
command line alone turns these into text. Anything else that escapes is a bug.

`ZfcalWarning` is no error: the work goes on.
"""

from __future__ import annotations

import copyreg
from pathlib import Path
from typing import Any


class ZfcalError(Exception):
    """Base class; the command line prints it without a traceback.

    Parameters
    ----------
    message
        What is wrong and where, with the value that was found.
    hint
        What to do about it.
    """

    exit_code = 1

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self._hint = ""
        self.hint = hint

    @property
    def hint(self) -> str:
        """What to do about it; empty where nobody knows. A reader may know more later."""
        return self._hint

    @hint.setter
    def hint(self, hint: str) -> None:
        # Who calls zfcal from Python sees it below the message, as a note.
        last = f"hint: {self._hint}"
        notes = [note for note in getattr(self, "__notes__", []) if note != last]
        self._hint = hint
        self.__notes__ = [*notes, f"hint: {hint}"] if hint else notes

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what makes it again in another process: not all take a message alone."""
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class InputError(ZfcalError):
    """Something that a person gave is wrong."""


class OptionError(InputError):
    """An option has another form, or could not take effect beside the others.

    Options have their names of the command line: ``--held-out`` is ``held_out`` in Python.
    """

    exit_code = 2


class SchemaError(InputError):
    """An artifact was written with another schema, or another version of it."""

    def __init__(self, path: Path | str, *, found: str, wanted: str) -> None:
        super().__init__(
            f"{path}: schema is {found!r}, expected {wanted!r}.",
            hint="See what the file is with: zfcal inspect FILE",
        )


class DamagedError(ZfcalError):
    """A file cannot be read whole; it is left out and the rest goes on."""

    exit_code = 3


class StorageError(ZfcalError):
    """A file cannot be written: the disk is full or the place is closed."""


class TakenError(StorageError):
    """A folder stands where a file is to go: work on many files goes on with the others."""


class ChangedError(ZfcalError):
    """An input has changed while something was made from it; nothing is published."""


class LockedError(ZfcalError):
    """The same command is already at work on the same trial."""

    exit_code = 75


class ZfcalWarning(UserWarning):
    """Something was left out and the rest went on, or a result is to be read with care."""
