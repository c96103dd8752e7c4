"""``drive/NNNNNN.mcap``: what the robot was told, by which poses and which model, a minute a file.

JSON channels (``zfcal.drive/1``) are what zfcal reads back; ``/scene`` (``foxglove.SceneUpdate``)
shows the target and ``/log`` (``foxglove.Log``) the faults to viewers. Messages that belong
together lie in one chunk, which is flushed at once.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias, final

from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.records import Channel, Message
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from zfcal.artifacts.atomic import storage_error
from zfcal.artifacts.lineage import LINEAGE_KEY, Lineage, to_json
from zfcal.artifacts.mcap_files import Overview, read_messages
from zfcal.artifacts.pose_files import LIBRARY
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.opening import open_to_write
from zfcal.artifacts.reading.parsing import json_of
from zfcal.artifacts.reading.places import check_inside
from zfcal.errors import DamagedError, InputError

DRIVE = "zfcal.drive/1"
LATENCY_KEY = "zfcal.latency"
"""Metadata record: how quick the driver was, when its run ended."""

_TOPICS = {
    "target": "/targets",
    "command": "/commands",
    "pose": "/robot",
    "model": "/models",
    "fault": "/faults",
}
"""Topic of each kind of message."""

_SCENE, _LOG = "/scene", "/log"
_TARGET_M = 0.015
_TARGET_COLOUR = (0.9, 0.6, 0.0, 0.8)

Item: TypeAlias = dict[str, Any]


@final
class DriveWriter:
    """Writes one file of a drive.

    Parameters
    ----------
    path
        Where it goes. What is there already is kept: a driver that was killed goes on.
    lineage
        Where it comes from.

    Raises
    ------
    StorageError
        The place cannot be written, here or later.
    """

    def __init__(self, path: Path, lineage: Lineage) -> None:
        self.path = path
        self._last_ns = 0
        self._whole = 0
        earlier = _earlier(path)
        # Whoever looks finds a file with a head, and with all that it held before.
        part = path.with_name(f".{path.name}.taken-up")
        try:
            # Not the trial itself: one that was moved away must not come into being again.
            check_inside(path.parent)
            path.parent.mkdir(exist_ok=True)
            self._file = open_to_write(part)
            self._writer = Writer(self._file, chunk_size=2**22)
            self._writer.start(profile="", library=LIBRARY)
            self._writer.add_metadata(LINEAGE_KEY, lineage.as_text())
            self._channels = _register(self._writer)
            for topic, time_ns, data in earlier:
                self._put(topic, time_ns, data)
            self._writer.flush()  # type: ignore[no-untyped-call]
            part.replace(path)
            self._whole = self._file.tell()
        except OSError as error:
            self.abandon()
            part.unlink(missing_ok=True)
            raise storage_error(path, error) from error

    def add(self, item: Item) -> None:
        """Take a message; it is on its way with the next `flush`.

        Parameters
        ----------
        item
            Of the schema ``zfcal.drive/1``.
        """
        time_ns = round(item["time_s"] * 1e9)
        self._put(_TOPICS[item["what"]], time_ns, to_json(item).encode())
        if item["what"] == "target":
            self._put(_SCENE, time_ns, _scene(item, time_ns))
        elif item["what"] == "fault":
            self._put(_LOG, time_ns, _log(item, time_ns))

    def flush(self) -> None:
        """Hand all that was added to the operating system, as one chunk."""
        try:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._whole = self._file.tell()
        except OSError as error:
            raise storage_error(self.path, error) from error

    def abandon(self) -> None:
        """Leave the file, after an error, with what was flushed before.

        Of a flush that failed the chunk itself may be there: whoever writes it again would
        find it twice.
        """
        with contextlib.suppress(OSError, AttributeError):
            self._file.close()
        with contextlib.suppress(OSError):
            if self._whole:
                os.truncate(self.path, self._whole)

    def close(self, measured: Mapping[str, str] | None = None) -> None:
        """Write the footer and close the file.

        Parameters
        ----------
        measured
            How quick the driver was, for the record `LATENCY_KEY`.
        """
        if self._file.closed:
            return
        try:
            if measured:
                self._writer.add_metadata(LATENCY_KEY, dict(measured))
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
        except OSError as error:
            raise storage_error(self.path, error) from error

    def _put(self, topic: str, time_ns: int, data: bytes) -> None:
        # A frame is older than the tick before it by as long as it was on its way.
        self._last_ns = max(self._last_ns, time_ns)
        try:
            self._writer.add_message(self._channels[topic], self._last_ns, data, time_ns)
        except OSError as error:
            raise storage_error(self.path, error) from error


def read_drive(path: Path, found: Overview | None = None) -> Iterator[Item]:
    """Yield the messages of a file in its order; of one that was cut short, those before the cut.

    Parameters
    ----------
    path
        The file.
    found
        A new overview, which afterwards says whether the file is whole, and what was lost.

    Raises
    ------
    InputError
        It is missing or cannot be opened.
    DamagedError
        It is no such file.
    """
    topics = set(_TOPICS.values())
    for channel, message in read_messages(path, Overview() if found is None else found):
        if channel.topic in topics:
            yield _item(path, channel, message)


def drive_files(root: Path) -> dict[int, Path]:
    """Return the files of a trial's drive by the second at which they start, in order."""
    return numbered_of(root / "drive", ".mcap")


def _item(path: Path, channel: Channel, message: Message) -> Item:
    try:
        found = json_of(message.data)
        if _TOPICS[found["what"]] == channel.topic:
            return dict(found)
    except (ValueError, KeyError, TypeError):
        pass
    raise DamagedError(
        f"{path}: a message of {channel.topic} is not of {DRIVE}.",
        hint="It was not made by zfcal, or by another version of it.",
    )


def _earlier(path: Path) -> list[tuple[str, int, bytes]]:
    """Return what a file holds already."""
    if not path.exists() or path.stat().st_size == 0:
        return []
    known = {*_TOPICS.values(), _SCENE, _LOG}
    try:
        return [
            (channel.topic, message.log_time, message.data)
            for channel, message in read_messages(path, Overview())
            if channel.topic in known
        ]
    except (DamagedError, InputError):
        return []


def _register(writer: Writer) -> dict[str, int]:
    own = writer.register_schema(DRIVE, "jsonschema", _schema())
    channels = {topic: writer.register_channel(topic, "json", own) for topic in _TOPICS.values()}
    for topic, kind in ((_SCENE, SceneUpdate), (_LOG, Log)):
        schema = register_schema(writer, kind)
        channels[topic] = writer.register_channel(topic, "protobuf", schema)
    return channels


@cache
def _schema() -> bytes:
    return (files("zfcal.schemas") / "drive.schema.json").read_bytes()


def _scene(target: Mapping[str, Any], time_ns: int) -> bytes:
    message = SceneUpdate()
    entity = message.entities.add(id="target", frame_id="arena")
    entity.timestamp.FromNanoseconds(time_ns)
    ball = entity.spheres.add()
    ball.pose.position.x, ball.pose.position.y = target["x_m"], target["y_m"]
    ball.pose.orientation.w = 1.0
    ball.size.x = ball.size.y = ball.size.z = _TARGET_M
    ball.color.r, ball.color.g, ball.color.b, ball.color.a = _TARGET_COLOUR
    return message.SerializeToString(deterministic=True)


def _log(fault: Mapping[str, Any], time_ns: int) -> bytes:
    level = Log.INFO if fault.get("ended") else Log.WARNING
    message = Log(level=level, message=fault["says"], name=fault["fault"])
    message.timestamp.FromNanoseconds(time_ns)
    return message.SerializeToString(deterministic=True)
