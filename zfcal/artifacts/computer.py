"""Whether the computer that a trial lies on is fit for it: room, file system, clock."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from zfcal.artifacts import machine
from zfcal.artifacts.findings import ERROR, OK, WARNING, Finding

LOW_DISK_BYTES = 2**30
"""About what half an hour of camera images takes."""

NO_DISK_BYTES = 50 * 2**20
"""Too little to finish a round."""

_THIS_WAS_WRITTEN_S = 1.7e9
"""Late in 2023: a clock before that has lost its battery."""


def check_computer(root: Path, now_s: float) -> Iterator[Finding]:
    """Yield what bears on a trial of the computer: versions, cores, disk, file system, clock.

    Parameters
    ----------
    root
        The trial's directory.
    now_s
        Seconds since 1970 by the clock that is looked at.
    """
    versions = ", ".join(f"{name} {number}" for name, number in machine.versions().items())
    yield Finding(level=OK, where="versions", says=versions)
    yield Finding(level=OK, where="cores", says=str(machine.cores()))
    yield from _disk(machine.free_bytes(root))
    yield from _file_system(machine.file_system(root))
    is_set = now_s > _THIS_WAS_WRITTEN_S
    says = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(now_s))
    hint = "" if is_set else "Set the clock, or the times of files mean nothing."
    yield Finding(level=OK if is_set else WARNING, where="clock", says=says, hint=hint)


def _disk(free_bytes: int) -> Iterator[Finding]:
    says = f"{free_bytes / 2**30:.1f} GiB free"
    level = OK
    if free_bytes < LOW_DISK_BYTES:
        level = ERROR if free_bytes < NO_DISK_BYTES else WARNING
    hint = "" if level == OK else "Make room before the next recording."
    yield Finding(level=level, where="disk", says=says, hint=hint)


def _file_system(kind: str) -> Iterator[Finding]:
    if machine.is_network(kind):
        yield Finding(
            level=WARNING,
            where="file system",
            says=f"{kind}: changes made on other computers are not announced",
            hint="zfcal watch --poll looks for them; it does so by itself on such a file system.",
        )
    else:
        yield Finding(level=OK, where="file system", says=kind or "of unknown type")
