"""The formats that can be imported, and what each needs to be told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from zfcal.artifacts.reading.limits import check_size
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.errors import InputError
from zfcal.readers.assemble import Imported
from zfcal.readers.cats import read_cats
from zfcal.readers.csv import check_csv, read_csv
from zfcal.readers.deeplabcut import read_deeplabcut
from zfcal.readers.fishmodel import read_fishmodel
from zfcal.readers.guess import guess_format
from zfcal.readers.idtracker import read_idtracker
from zfcal.readers.mot import read_mot
from zfcal.readers.movement import read_movement
from zfcal.readers.nwb import read_nwb
from zfcal.readers.options import Idle, ImportOptions, given, refuse_idle
from zfcal.readers.robofish import read_robofish
from zfcal.readers.sleap import read_sleap
from zfcal.readers.text import check_unpacked
from zfcal.readers.trajectorytools import read_trajectorytools
from zfcal.readers.trex import check_trex, read_trex
from zfcal.tracks import Tracks

Reader = Callable[[Path, ImportOptions], Imported]
Check = Callable[[Path, ImportOptions], Idle]


def _unseen(_path: Path, _options: ImportOptions) -> Idle:
    """Return nothing, for formats of which little is to be seen before all is read."""
    return {}


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A foreign format; what its files hold stands in ``docs/formats.md``.

    Parameters
    ----------
    name
        As in ``--format``.
    reader
        Reads a file.
    check
        Looks at what is read at once, such as a header, and returns the options that are seen
        to take no effect.
    options
        The `SPECIAL` import options that it can make use of.
    folder
        Whether it reads a folder of files.
    """

    name: str
    reader: Reader
    check: Check = _unseen
    options: frozenset[str] = field(default_factory=frozenset)
    folder: bool = False


_POSES = frozenset({"keypoint", "body_axis"})

_ALL = (
    Format(
        name="csv",
        reader=read_csv,
        check=check_csv,
        options=frozenset({"columns", "first_frame"}),
    ),
    Format(name="cats", reader=read_cats),
    Format(
        name="trex",
        reader=read_trex,
        check=check_trex,
        options=frozenset({"keypoint"}),
        folder=True,
    ),
    Format(name="idtracker", reader=read_idtracker),
    Format(name="trajectorytools", reader=read_trajectorytools),
    Format(name="mot", reader=read_mot, options=frozenset({"box", "first_frame"})),
    Format(name="sleap", reader=read_sleap, options=_POSES),
    Format(name="deeplabcut", reader=read_deeplabcut, options=_POSES),
    Format(name="movement", reader=read_movement, options=_POSES),
    Format(name="nwb", reader=read_nwb, options=_POSES),
    Format(name="robofish", reader=read_robofish),
    Format(name="fishmodel", reader=read_fishmodel),
)

_SHARED = {"idtracker", "trajectorytools"}
"""Two formats with files in common."""

FORMATS: dict[str, Format] = {known.name: known for known in _ALL}
"""Every format by the name that ``--format`` takes."""


def read_foreign(path: Path, name: str, options: ImportOptions) -> Tracks:
    """Return the tracks of a foreign file, in metres.

    Parameters
    ----------
    path
        A file, or a folder where the format has one.
    name
        A key of `FORMATS`.
    options
        What the file does not tell.

    Raises
    ------
    InputError
        The format is unknown, an option cannot take effect, or the file is
        wrong: the message says where, what was expected and what was found.
    """
    return import_foreign(path, name, options).tracks


def import_foreign(path: Path, name: str, options: ImportOptions) -> Imported:
    """Return the tracks of a foreign file with notes on what a person should know.

    Parameters
    ----------
    path, name, options
        As for `read_foreign`.
    """
    found = import_part(path, name, options)
    refuse_idle(found.idle)
    return found


def import_part(path: Path, name: str, options: ImportOptions) -> Imported:
    """Return what `import_foreign` does, for one of several files that are imported together.

    An option that takes no effect in it may do so in another one: see `refuse_idle`.

    Parameters
    ----------
    path, name, options
        As for `read_foreign`.
    """
    chosen = _asked(path, name, options)
    if not path.is_dir():
        check_unpacked(path)
    with _guessing(path, name):
        return chosen.reader(path, options)


def check_part(path: Path, name: str, options: ImportOptions) -> Idle:
    """Refuse what is seen to be wrong before all of a file is read, which may take minutes.

    Parameters
    ----------
    path, name, options
        As for `read_foreign`.

    Returns
    -------
    Idle
        The options that are seen to take no effect in this file.

    Raises
    ------
    InputError
        As of `read_foreign`.
    """
    chosen = _asked(path, name, options)
    with _guessing(path, name):
        return chosen.check(path, options)


def _asked(path: Path, name: str, options: ImportOptions) -> Format:
    """Return the format, which must have a use for the options."""
    chosen = _chosen(path, name)
    useless = given(options) - chosen.options
    if useless:
        takes = ", ".join(sorted(chosen.options)) or "none such"
        raise InputError(
            f"{path}: {', '.join(sorted(useless))} cannot take effect: format {name!r} takes "
            f"{takes}."
        )
    return chosen


@contextmanager
def _guessing(path: Path, name: str) -> Iterator[None]:
    """Say of a file that is wrong if it looks like one of another format."""
    try:
        yield
    except InputError as error:
        other = guess_format(path)
        if other not in {None, name} and {other, name} != _SHARED:
            error.hint = f"{error.hint} The file looks like --format {other}.".lstrip()
        raise


def _chosen(path: Path, name: str) -> Format:
    if not path.exists():
        raise InputError(f"{path}: no such file.")
    if name not in FORMATS:
        other = guess_format(path)
        raise InputError(
            f"Format {name!r} is unknown, expected one of {', '.join(FORMATS)}.",
            hint=f"{path} looks like --format {other}" if other else "",
        )
    chosen = FORMATS[name]
    if path.is_dir() and not chosen.folder:
        raise InputError(f"{path}: expected a file for format {name!r}, got a folder.")
    if not path.is_dir():
        _check_file(path)
    return chosen


def _check_file(path: Path) -> None:
    """Refuse what the readers, which take names, would wait for or be drowned by."""
    try:
        with open_regular(path) as file:
            check_size(path, file.seek(0, 2))
    except OSError as error:
        raise unreadable(path, error) from error
