"""What `zfcal --version` says; with `--json` what a bug report needs, and nothing of a person."""

from __future__ import annotations

import json
import os
import platform
import re
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_PLACES = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")


def number() -> str:
    """Return the version."""
    return version("zfcal")


def version_text() -> str:
    """Return the version as a line."""
    return f"zfcal {number()}"


def about() -> str:
    """Return versions, platform, threads and where kernels are kept, as a JSON document."""
    found = {
        "zfcal": number(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "platform": platform.platform(),
        "libraries": _libraries(),
        "threads": {
            "processors": os.cpu_count(),
            "usable": _usable(),
            **{name: os.environ[name] for name in _THREADS if name in os.environ},
        },
        "kernels": _kernels(),
    }
    return json.dumps(found, indent=2)


def _libraries() -> dict[str, str]:
    """Return the versions of what zfcal depends on, as far as it is there."""
    names = {re.split(r"[^A-Za-z0-9._-]", line, maxsplit=1)[0] for line in requires("zfcal") or []}
    found = {}
    for name in sorted(names - {"zfcal"}):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            # Of an extra, or for another system.
            continue
    return found


def _usable() -> int | None:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def _kernels() -> dict[str, object]:
    from zfcal.model.kernels.compiled import KEPT, cache_folder, is_warm

    folder = cache_folder()
    return {
        "kept": KEPT,
        "compiled": is_warm(),
        "folder": None if folder is None else _without_person(folder),
    }


def _without_person(folder: Path) -> str:
    """Return a path: the home is ``~``, a place from the environment its variable."""
    for name in _PLACES:
        place = os.environ.get(name)
        if place and folder.is_relative_to(place):
            return f"${name}/{folder.relative_to(place).as_posix()}"
    home = Path.home()
    return (
        f"~/{folder.relative_to(home).as_posix()}" if folder.is_relative_to(home) else folder.name
    )
