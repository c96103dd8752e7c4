"""How many pixels an image has, by the head of its file: it is not decoded for that."""

from __future__ import annotations

import struct
from pathlib import Path

from zfcal.artifacts.reading.limits import IMAGE_PIXELS
from zfcal.errors import DamagedError

_PNG_HEAD = 24
_MARKER = 0xFF
_JPEG_SIZES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
"""Segments of a JPEG that state its size (ITU-T T.81, table B.1)."""


def check_pixels(path: Path, data: bytes) -> None:
    """Refuse a PNG or JPEG that unpacks to more pixels than any camera has, by its head alone.

    Raises
    ------
    DamagedError
        It does.
    """
    width, height = _size_px(data)
    if width * height > IMAGE_PIXELS:
        raise DamagedError(
            f"{path}: an image claims {width} x {height} pixels, expected at most "
            f"{IMAGE_PIXELS:.0e} in all.",
            hint="Check that it is the right file, or make the image smaller.",
        )


def _size_px(data: bytes) -> tuple[int, int]:
    """Return width and height from the head of a PNG or JPEG; 0, 0 where there is none."""
    if data.startswith(b"\x89PNG\r\n\x1a\n") and len(data) >= _PNG_HEAD:
        width, height = struct.unpack_from(">II", data, 16)
        return width, height
    place = 2 if data.startswith(b"\xff\xd8") else len(data)
    while place + 9 <= len(data) and data[place] == _MARKER:
        kind, length = data[place + 1], int.from_bytes(data[place + 2 : place + 4])
        if kind in _JPEG_SIZES:
            height, width = struct.unpack_from(">HH", data, place + 5)
            return width, height
        # A marker may be filled up with more of the same byte.
        place += 1 if kind == _MARKER else 2 + length
    return 0, 0
