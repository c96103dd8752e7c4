"""MCAP files that grow: what was added since the last look, record by whole record.

A file that was cut short gives all that lies before the cut.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import final

from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Metadata

from zfcal.artifacts.mcap_files import BROKEN, unpacked
from zfcal.artifacts.reading.limits import CHUNK_BYTES, check_size, largest
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.errors import DamagedError

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")


@final
class Tail:
    """Follows one MCAP file while it grows.

    Parameters
    ----------
    path
        It need not be there yet.
    topics
        The channels that are read.

    Attributes
    ----------
    metadata
        The metadata records by name, as far as they were read.
    is_closed
        Whether the footer was reached: nothing more will come.
    lost_bytes
        Bytes behind the last whole record, at the last look.
    """

    def __init__(self, path: Path, *topics: str) -> None:
        self.path = path
        self.metadata: dict[str, dict[str, str]] = {}
        self.is_closed = False
        self.lost_bytes = 0
        self._topics = topics
        self._offset = 0
        self._channels: set[int] = set()

    @property
    def is_begun(self) -> bool:
        """Whether a record of it was read: it is an MCAP file."""
        return self._offset > 0 or self.is_closed

    @property
    def cut(self) -> DamagedError | None:
        """What to say of a file to which nothing more will be added; None if it is closed."""
        if self.is_closed:
            return None
        return DamagedError(
            f"{self.path}: was cut short, or its writer was stopped: it is not closed, and "
            f"{self.lost_bytes} bytes behind the last whole record are lost.",
            hint="Copy it again from where it was recorded; what lies before is read.",
        )

    def poll(self) -> list[tuple[int, bytes]]:
        """Return what was added: the log time in nanoseconds, and the data of each message.

        Raises
        ------
        InputError
            The file cannot be opened; one that is not there has nothing to give.
        DamagedError
            It is no MCAP file, or a record is damaged.
        """
        return list(self.messages())

    def messages(self) -> Iterator[tuple[int, bytes]]:
        """Yield what `poll` returns: what lies before a damaged record, and then the error."""
        if self.is_closed:
            return
        whole = self._take()
        try:
            yield from self._messages(whole)
        except BROKEN as error:
            raise DamagedError(
                f"{self.path}: a record is damaged ({error}).",
                hint=f"See how much of it can be read with: zfcal inspect {self.path}",
            ) from error

    def _take(self) -> bytes:
        """Read the whole records that were added."""
        try:
            with open_regular(self.path) as file:
                size = file.seek(0, io.SEEK_END)
                if size < self._offset:
                    # Written anew: the one that was read is gone.
                    self._offset = 0
                    self._channels.clear()
                check_size(self.path, size - self._offset)
                file.seek(self._offset)
                added = file.read(size - self._offset)
        except FileNotFoundError:
            return b""
        except OSError as error:
            raise unreadable(self.path, error) from error
        skipped = 0
        if self._offset == 0:
            if not _MAGIC.startswith(added[:8]):
                raise DamagedError(
                    f"{self.path}: is not an MCAP file (it starts with {added[:8]!r}).",
                    hint="Move it out of the trial, or copy the right file there.",
                )
            skipped = min(8, len(added))
        end = self._end_of_records(added, skipped)
        self.lost_bytes = 0 if self.is_closed else len(added) - end
        if end > 8 or self._offset:
            self._offset += end
            return added[skipped:end]
        return b""

    def _end_of_records(self, added: bytes, place: int) -> int:
        while place + _HEAD.size <= len(added):
            opcode, length = _HEAD.unpack_from(added, place)
            if length > largest(CHUNK_BYTES):
                raise DamagedError(
                    f"{self.path}: a record is damaged (it claims {length} bytes).",
                    hint=f"See how much of it can be read with: zfcal inspect {self.path}",
                )
            if opcode == Opcode.FOOTER:
                self.is_closed = True
                return place
            if place + _HEAD.size + length > len(added):
                break
            place += _HEAD.size + length
        return place

    def _messages(self, whole: bytes) -> Iterator[tuple[int, bytes]]:
        try:
            for record in unpacked(io.BytesIO(whole), skip_magic=True):
                if isinstance(record, Channel) and record.topic in self._topics:
                    self._channels.add(record.id)
                elif isinstance(record, Metadata):
                    self.metadata[record.name] = dict(record.metadata)
                elif isinstance(record, Message) and record.channel_id in self._channels:
                    yield record.log_time, record.data
        except EndOfFile:
            return
