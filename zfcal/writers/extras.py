"""Packages that only some formats need: imported when a file is to be written in them."""

from __future__ import annotations

import importlib
from typing import Any

from zfcal.errors import InputError


def require(module: str, name: str) -> Any:
    """Return an optional module, or say what to install.

    Parameters
    ----------
    module
        Such as ``h5py``.
    name
        The format that needs it.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"Writing the format {name!r} needs the package {module!r}, which is not installed.",
            hint="Install it with: pip install 'zfcal[formats]'",
        ) from error
