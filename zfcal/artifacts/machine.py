"""The computer that a trial lies on: versions, cores, disk, file system."""

from __future__ import annotations

import os
import platform
import shutil
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("zfcal", "numpy", "numba", "pyarrow", "pandas", "scipy", "shapely", "mcap")

NETWORK_FILE_SYSTEMS = ("nfs", "cifs", "smb", "fuse", "9p", "afs", "ceph", "glusterfs", "lustre")
"""Starts of the names of file systems on which changes made elsewhere are not announced."""

_MOUNTS = Path("/proc/self/mountinfo")


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that bear on the numbers."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
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
    return kind.startswith(NETWORK_FILE_SYSTEMS)


def _unescape(text: str) -> str:
    for code, character in (("\\040", " "), ("\\011", "\t"), ("\\012", "\n"), ("\\134", "\\")):
        text = text.replace(code, character)
    return text
