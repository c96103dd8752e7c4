"""How large a file may be that is read as a whole.

A file that was mixed up, or made to do harm, must not take the memory or the time of the
robot's computer. The limits lie far above what zfcal writes; ``ZFCAL_MAX_FILE_MB``
raises them. It is a variable and not an option, since it must hold in each process of a
pipe and in the stages of a watch alike, and bears on no result.
"""

from __future__ import annotations

import os
from pathlib import Path

from zfcal.errors import DamagedError, InputError

VARIABLE = "ZFCAL_MAX_FILE_MB"
"""Megabytes that a file of any kind may have; it raises limits and never lowers them."""

_MB = 10**6
_MOST_MB = {
    ".toml": 1,
    ".json": 64,
    ".geojson": 16,
    ".parquet": 512,
    ".checkpoint": 512,
    ".png": 256,
    ".jpg": 256,
    ".jpeg": 256,
}
_OTHERS_MB = 1024

CHUNK_BYTES = 2**28
"""Bytes of the longest record of an MCAP file, and of what a chunk unpacks to."""

TABLE_ROWS = 20_000_000
"""Rows of a table: a minute of 1,000 agents at 60 Hz has 3.6 million."""

TABLE_BYTES = 2 * 10**9
"""Bytes that a table unpacks to."""

IMAGE_PIXELS = 10**8
"""Pixels of an image, such as 10,000 x 10,000."""


def most_bytes(path: Path | str) -> int:
    """Return how many bytes a file of this kind may have.

    Raises
    ------
    InputError
        The variable holds no positive number.
    """
    return max(_MOST_MB.get(Path(path).suffix, _OTHERS_MB) * _MB, _raised())


def check_size(path: Path, size: int) -> None:
    """Refuse a file that is too large to be read.

    Parameters
    ----------
    path
        Which one; its ending says of what kind it is.
    size
        Its bytes.

    Raises
    ------
    DamagedError
        It is too large.
    """
    most = most_bytes(path)
    if size > most:
        raise too_large(path, size, most)


def too_large(path: Path, size: int, most: int, *, unpacked: bool = False) -> DamagedError:
    """Return the error for a file that has, or unpacks to, more bytes than it may have."""
    what = "unpacks to too much" if unpacked else "is too large"
    # Whoever unpacks stops at the limit.
    more = "more than " if unpacked else ""
    return DamagedError(
        f"{path}: {what} ({more}{size / _MB:.1f} MB, expected at most {most / _MB:.1f} MB).",
        hint=f"Check that it is the right file; if it is, set {VARIABLE} to a larger number.",
    )


def largest(standard: int) -> int:
    """Return a limit in bytes, or what the variable raises it to."""
    return max(standard, _raised())


def _raised() -> int:
    text = os.environ.get(VARIABLE)
    if not text:
        return 0
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < 1e9:
        raise InputError(
            f"{VARIABLE} must be a positive number of megabytes, got {text[:40]!r}.",
            hint=f"Such as {VARIABLE}=2000.",
        )
    return int(number * _MB)
