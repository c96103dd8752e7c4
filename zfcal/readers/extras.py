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
def open_hdf5(path: Path) -> Iterator[Any]:
    """Open an HDF5 file for reading; whatever is damaged in it is an `InputError`."""
    h5py = require("h5py", path)
    with whole(path, "HDF5"), h5py.File(path, "r") as file:
        yield file


def dataset(file: Any, name: str, path: Path) -> NDArray[Any]:
    """Return a data set of an open HDF5 file, read whole.

    Raises
    ------
    InputError
        There is none of that name; the message lists what there is.
    """
    if name not in file or not hasattr(file[name], "shape"):
        there = ", ".join(sorted(file)) or "an empty file"
        raise InputError(f"{path}: expected a data set {name!r}, got {there}.")
    return np.asarray(file[name][()])


def texts(values: NDArray[Any]) -> tuple[str, ...]:
    """Return names that HDF5 stores as bytes or as text."""
    return tuple(v.decode() if isinstance(v, bytes) else str(v) for v in np.ravel(values))
