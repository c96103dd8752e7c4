"""Frames of the Aseba network: to bytes and back, however the bytes arrive.

A frame is three little-endian words of 16 bits (length of the payload in bytes, source
node, type) and the payload. There is no checksum and no mark between frames: after a
byte is lost nothing can be told from noise, but that a length is impossible.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import final

from zfcal.errors import InputError

HOST = 0
"""Node number of the computer."""

LONGEST_PAYLOAD = 516
"""Bytes."""

SYSTEM = 0x8000
"""Types from here on are messages of the network itself; below are users' events."""

_HEAD = struct.Struct("<HHH")
_WORD = 2**16


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One message.

    Parameters
    ----------
    type
        An event's number, or that of a system message.
    payload
        At most 516 bytes.
    source
        The node that sent it; 0 is the host.
    """

    type: int
    payload: bytes = b""
    source: int = HOST

    def __post_init__(self) -> None:
        for name in ("type", "source"):
            value = getattr(self, name)
            if not 0 <= value < _WORD:
                raise InputError(f"A frame's {name} must be a word of 16 bits, got {value!r}.")
        if len(self.payload) > LONGEST_PAYLOAD:
            raise InputError(
                f"A frame carries at most {LONGEST_PAYLOAD} bytes, got {len(self.payload)}."
            )

    def encode(self) -> bytes:
        """Return the frame as it goes over the line."""
        return _HEAD.pack(len(self.payload), self.source, self.type) + self.payload

    @property
    def arguments(self) -> tuple[int, ...]:
        """The payload as signed words; an odd last byte is left out."""
        count = len(self.payload) // 2
        return struct.unpack_from(f"<{count}h", self.payload)


@final
class Decoder:
    """Takes bytes as they come and gives the frames that are whole.

    Attributes
    ----------
    n_dropped
        Bytes that belonged to no frame: where a length is impossible, bytes are dropped
        until one is possible.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.n_dropped = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that these bytes complete."""
        self._buffer += data
        frames = []
        while (frame := self._next()) is not None:
            frames.append(frame)
        return frames

    def reset(self) -> None:
        """Forget a frame that has begun: its end will not come over a new connection."""
        self._buffer.clear()

    def _next(self) -> Frame | None:
        while len(self._buffer) >= _HEAD.size:
            length, source, kind = _HEAD.unpack_from(self._buffer)
            if length > LONGEST_PAYLOAD:
                del self._buffer[0]
                self.n_dropped += 1
                continue
            end = _HEAD.size + length
            if len(self._buffer) < end:
                return None
            payload = bytes(self._buffer[_HEAD.size : end])
            del self._buffer[:end]
            return Frame(type=kind, payload=payload, source=source)
        return None
