"""The computer that a trial lies on: versions, cores, disk, file system, and whether it is fit."""

from __future__ import annotations

import os
import platform
import shutil
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from zfcal.artifacts.findings import ERROR, OK, WARNING, Finding

_PACKAGES = ("zfcal", "numpy", "numba", "pyarrow", "pandas", "scipy", "shapely", "mcap")

_NETWORK_FILE_SYSTEMS = ("nfs", "cifs", "smb", "fuse", "9p", "afs", "ceph", "glusterfs", "lustre")
"""Starts of the names of file systems on which changes made elsewhere are not announced."""

_LOW_DISK_BYTES = 2**30
"""About what half an hour of camera images takes."""

_NO_DISK_BYTES = 50 * 2**20
"""Too little to finish a round."""

_THIS_WAS_WRITTEN_S = 1.7e9
"""Late in 2023: a clock before that has lost its battery."""

_MOUNTS = Path("/proc/self/mountinfo")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that bear on the numbers."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def free_bytes(path: Path) -> int:
    """Return how much this process may still write on the disk of a path."""
    return shutil.disk_usage(path).free


def file_system(path: Path, mounts: Path = _MOUNTS) -> str:
    """Return the type of the file system that a path lies on; empty where nobody says.

    Parameters
    ----------
    path
        Any existing path.
    mounts
        The kernel's table of mounts (Linux, proc(5)).
    """
    try:
        lines = mounts.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    place = str(path.resolve())
    best, kind = "", ""
    for line in lines:
        before, _, after = line.partition(" - ")
        fields = before.split()
        if len(fields) < 5 or not after:
            continue
        point = _unescape(fields[4])
        inside = place == point or place.startswith(point.rstrip("/") + "/")
        # The last of equal mounts lies on top of the others.
        if inside and len(point) >= len(best):
            best, kind = point, after.split()[0]
    return kind


def is_network(kind: str) -> bool:
    """Return whether a file system is one on which changes made elsewhere are not announced."""
    return kind.startswith(_NETWORK_FILE_SYSTEMS)


def check_computer(root: Path, now_s: float) -> Iterator[Finding]:
    """Yield what bears on a trial of the computer: versions, cores, disk, file system, clock.

    Parameters
    ----------
    root
        The trial's directory.
    now_s
        Seconds since 1970 by the clock that is looked at.
    """
    known = ", ".join(f"{name} {number}" for name, number in versions().items())
    yield Finding(level=OK, where="versions", says=known)
    yield Finding(level=OK, where="cores", says=str(cores()))
    yield from _disk(free_bytes(root))
    yield from _file_system(file_system(root))
    is_set = now_s > _THIS_WAS_WRITTEN_S
    says = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(now_s))
    hint = "" if is_set else "Set the clock, or the times of files mean nothing."
    yield Finding(level=OK if is_set else WARNING, where="clock", says=says, hint=hint)


def _disk(free_bytes: int) -> Iterator[Finding]:
    says = f"{free_bytes / 2**30:.1f} GiB free"
    level = OK
    if free_bytes < _LOW_DISK_BYTES:
        level = ERROR if free_bytes < _NO_DISK_BYTES else WARNING
    hint = "" if level == OK else "Make room before the next recording."
    yield Finding(level=level, where="disk", says=says, hint=hint)


def _file_system(kind: str) -> Iterator[Finding]:
    if is_network(kind):
        yield Finding(
            level=WARNING,
            where="file system",
            says=f"{kind}: changes made on other computers are not announced",
            hint="zfcal watch --poll looks for them, on such a file system without the option too.",
        )
    else:
        yield Finding(level=OK, where="file system", says=kind or "of unknown type")


def _unescape(text: str) -> str:
    for code, character in (("\\040", " "), ("\\011", "\t"), ("\\012", "\n"), ("\\134", "\\")):
        text = text.replace(code, character)
    return text
