"""Packages that only some formats need: imported when a file asks for them."""

from __future__ import annotations

import importlib
import pickle
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zfcal.errors import InputError


def require(module: str, path: Path, *, extra: str = "formats") -> Any:
    """Return an optional module, or say what to install.

    Parameters
    ----------
    module
        Such as ``h5py``.
    path
        The file that needs it, named in the message.
    extra
        Of zfcal, which brings it.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.replace("_", "-")
        raise InputError(
            f"{path}: reading this format needs the package {package!r}, which is not installed.",
            hint=f"Install it with: pip install 'zfcal[{extra}]'",
        ) from error


_DAMAGE = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    pickle.UnpicklingError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What numpy, h5py and xarray raise, by experience, on files with wrong bytes."""


@contextmanager
def whole(path: Path, kind: str) -> Iterator[None]:
    """Turn what a library raises on a damaged file into an `InputError`.

    To be wrapped round the library's calls alone: an error of ours in here would
    pass for a damaged file.

    Parameters
    ----------
    path
        The file.
    kind
        What it should be, such as ``HDF5``.
    """
    try:
        yield
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise InputError(
            f"{path}: expected a whole {kind} file, got one that does not read ({reason}).",
            hint="Copy or export it again; it may have been cut short.",
        ) from error


@contextmanager
def open_hdf5(path: Path, *, under: str | None = "/", kind: str = "HDF5") -> Iterator[Any]:
    """Open an HDF5 file for reading; whatever is damaged in it is an `InputError`.

    Parameters
    ----------
    path
        The file.
    under
        The group that is read of it, in which nothing may lead to another file: the lineage
        would name this one alone. None to look at names only.
    kind
        What the file should be.
    """
    h5py = require("h5py", path)
    with whole(path, kind), h5py.File(path, "r") as file:
        if under is not None:
            _check_links(path, file, under)
        yield file


def _check_links(path: Path, file: Any, under: str) -> None:
    """Refuse links that lead out of a file, by themselves or through one of its own."""
    h5py = require("h5py", path)
    found = {} if under == "/" else {under: file.get(under, getlink=True)}
    if isinstance(found.get(under), h5py.HardLink | None) and under in file:
        inside = under.rstrip("/")
        file[under].visititems_links(lambda name, link: found.update({f"{inside}/{name}": link}))
    for name, link in found.items():
        if isinstance(link, h5py.ExternalLink):
            raise _elsewhere(path, name, Path(link.filename).name)
        if isinstance(link, h5py.SoftLink) and (node := file.get(name)) is not None:
            _check_home(path, name, node)


def _check_home(path: Path, name: str, node: Any) -> None:
    if node.file.filename != str(path):
        raise _elsewhere(path, name, Path(node.file.filename).name)


def _check_stored(path: Path, name: str, node: Any) -> None:
    """Refuse a data set whose numbers lie in other files."""
    parts = [part.file_name for part in node.virtual_sources()] if node.is_virtual else []
    parts += [part[0] for part in node.external or ()]
    if parts:
        raise _elsewhere(path, name, ", ".join(dict.fromkeys(Path(part).name for part in parts)))


def _elsewhere(path: Path, name: str, other: str) -> InputError:
    return InputError(
        f"{path}: expected a file that holds its data itself, got {name} in {other}.",
        hint="Export it again as one file, or copy the parts into it.",
    )


def alone(path: Path, kind: str) -> None:
    """Refuse an HDF5 file of which a library would read parts that lie in another file.

    Data sets of the root are looked at, and links everywhere.
    """
    with open_hdf5(path, kind=kind) as file:
        for name in file:
            if hasattr(node := file[name], "shape"):
                _check_stored(path, name, node)


def dataset(file: Any, name: str, path: Path) -> NDArray[Any]:
    """Return a data set of an open HDF5 file, read whole.

    Raises
    ------
    InputError
        There is none of that name; the message lists what there is. Or it lies in another file.
    """
    if name not in file or not hasattr(file[name], "shape"):
        there = ", ".join(sorted(file)) or "an empty file"
        raise InputError(f"{path}: expected a data set {name!r}, got {there}.")
    node = file[name]
    _check_home(path, name, node)
    _check_stored(path, name, node)
    return np.asarray(node[()])


def texts(values: NDArray[Any]) -> tuple[str, ...]:
    """Return names that HDF5 stores as bytes or as text."""
    return tuple(v.decode() if isinstance(v, bytes) else str(v) for v in np.ravel(values))
