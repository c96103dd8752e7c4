"""How kernels are compiled, and where they are kept between runs.

Numba looks only at a function's own file to see whether a kept version still
holds, so a change in a file that it calls would go unnoticed. Here the place
itself is named after all sources of the model. It is in the user's cache
folder, since an installed package may not be writable. ``NUMBA_CACHE_DIR``
overrules it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import njit

F = TypeVar("F", bound=Callable[..., Any])

_config: Any = numba.config


def cache_folder() -> Path:
    """Return the folder that belongs to this very version of the model's sources."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "zfcal" / f"kernels-{digest.hexdigest()[:16]}"


def is_warm() -> bool:
    """Tell whether kernels were compiled before, so that a start takes no half minute."""
    return any(Path(_config.CACHE_DIR).rglob("*.nbi"))


if not _config.CACHE_DIR:
    _config.CACHE_DIR = str(cache_folder())


def kernel(function: F) -> F:
    """Compile a function by itself."""
    compiled: Any = njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


def lean(function: F) -> F:
    """Compile without reference counts, hence without new arrays, in all that it calls.

    Arrays that travel in tuples are otherwise counted at every call, which made
    a step three times as slow. Products and sums may be fused.
    """
    options: dict[str, Any] = {"fastmath": {"contract"}, "_nrt": False}
    compiled: Any = njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    return compiled


def inlined(function: F) -> F:
    """Make a function a part of its callers."""
    compiled: Any = njit(inline="always")(function)
    return compiled
