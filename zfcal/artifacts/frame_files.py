"""Camera images in MCAP files: ``frames/CAMERA/000060.mcap``, named by the second they start at.

Each image is a message of Foxglove's well-known schema ``foxglove.CompressedImage`` (JPEG,
or PNG where nothing may be lost) in a chunk of its own, which is flushed at once: a file
that grows can be read, and one that was cut short loses its last image at most. Images are
not decoded here.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedWriter
from pathlib import Path
from typing import Any, Self, final

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, Message
from mcap.summary import Summary
from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from zfcal.artifacts.atomic import storage_error
from zfcal.artifacts.lineage import LINEAGE_KEY, Lineage, package_version
from zfcal.artifacts.mcap_files import BROKEN, Overview, read_messages, records_of
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.limits import CHUNK_BYTES, largest
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.artifacts.reading.pixels import check_pixels
from zfcal.artifacts.reading.places import check_inside
from zfcal.errors import DamagedError, InputError
from zfcal.trial import second_of

FRAMES = "zfcal.frames/1"
_IMAGE_SCHEMA = "foxglove.CompressedImage"

JPEG, PNG = "jpeg", "png"
_MAGIC = {b"\xff\xd8\xff": JPEG, b"\x89PNG\r\n\x1a\n": PNG}

_NS = 10**9


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """What a viewer is told of a camera, in the words of ``foxglove.CameraCalibration``.

    Parameters
    ----------
    size_px
        Width and height.
    distortion_model
        ``plumb_bob``, ``rational_polynomial`` or ``kannala_brandt``.
    distortion
        Its coefficients: 5, 8 or 4.
    matrix : tuple of 9
        Focal lengths and principal point, row by row.
    """

    size_px: tuple[int, int]
    distortion_model: str
    distortion: tuple[float, ...]
    matrix: tuple[float, ...]


def _image_topic(camera: str) -> str:
    """Return the topic of a camera's images."""
    return f"/{camera}/image"


@final
class FrameWriter:
    """Writes an MCAP file of images, one chunk an image, flushed at once.

    Parameters
    ----------
    path
        A new file; its folder is made when missing.
    camera
        Name of the camera, such as ``overhead``.
    lineage
        Where the images come from.
    calibration
        Of the camera, if it is known and Foxglove has a word for it.

    Raises
    ------
    InputError
        The file exists already.
    StorageError
        It cannot be written.
    """

    def __init__(
        self,
        path: Path,
        camera: str,
        *,
        lineage: Lineage | None = None,
        calibration: Calibration | None = None,
    ) -> None:
        self._path, self._camera, self._calibration = path, camera, calibration
        self._last_ns = 0
        self._n_frames = 0
        try:
            check_inside(path.parent)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._new(path)
            # A chunk ends as soon as it holds anything; JPEG and PNG are as small as they get.
            self._writer = Writer(self._file, chunk_size=0, compression=CompressionType.NONE)
            self._writer.start(profile="", library=f"zfcal {package_version()}")
            if lineage is not None:
                self._writer.add_metadata(LINEAGE_KEY, lineage.as_text())
            self._file.flush()
        except OSError as error:
            raise storage_error(path, error) from error
        self._image_channel: int | None = None

    @staticmethod
    def _new(path: Path) -> BufferedWriter:
        try:
            return path.open("xb")
        except FileExistsError:
            raise InputError(
                f"{path}: exists already, and images are not written over others.",
                hint="Move it away, or record into another trial.",
            ) from None

    @property
    def n_frames(self) -> int:
        """Images written so far."""
        return self._n_frames

    def add(self, time_s: float, data: bytes) -> None:
        """Add an image and flush it.

        Parameters
        ----------
        time_s
            The camera's time stamp, in seconds since the start of the trial; not
            before that of the last image.
        data
            A whole JPEG or PNG file.

        Raises
        ------
        InputError
            The time runs backwards, or the data are neither JPEG nor PNG.
        StorageError
            The disk is full.
        """
        form = _form_of(data)
        if form is None:
            raise InputError(f"{self._path}: an image must be JPEG or PNG, got {data[:8]!r}.")
        if not (math.isfinite(time_s) and time_s >= 0):
            raise InputError(f"{self._path}: a time must be 0 s or later, got {time_s!r}.")
        time_ns = round(time_s * _NS)
        if time_ns < self._last_ns:
            raise InputError(
                f"{self._path}: an image of {time_s:.6f} s follows one of "
                f"{self._last_ns / _NS:.6f} s; time must not run backwards.",
                hint="Check the clock of the camera.",
            )
        self._last_ns = time_ns
        try:
            if self._image_channel is None:
                self._begin(time_ns)
            message = CompressedImage(frame_id=self._camera, data=data, format=form)
            message.timestamp.FromNanoseconds(time_ns)
            self._put(self._image_channel, time_ns, message)
            self._file.flush()
        except OSError as error:
            raise storage_error(self._path, error) from error
        self._n_frames += 1

    def _begin(self, time_ns: int) -> None:
        if self._calibration is not None:
            topic = f"/{self._camera}/calibration"
            channel = self._channel(topic, CameraCalibration)
            message = _calibration_message(self._calibration, self._camera, time_ns)
            self._put(channel, time_ns, message)
        self._image_channel = self._channel(_image_topic(self._camera), CompressedImage)

    def _channel(self, topic: str, kind: type[Any]) -> int:
        schema = register_schema(self._writer, kind)
        return self._writer.register_channel(topic, MessageEncoding.Protobuf, schema)

    def _put(self, channel: int | None, time_ns: int, message: Any) -> None:
        self._writer.add_message(
            channel_id=channel or 0,
            log_time=time_ns,
            data=message.SerializeToString(deterministic=True),
            publish_time=time_ns,
            sequence=self._n_frames,
        )

    def close(self) -> None:
        """Write the index and close the file; a second time does nothing.

        Raises
        ------
        StorageError
            The disk is full.
        """
        if self._file.closed:
            return
        try:
            with self._file:
                self._writer.finish()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise storage_error(self._path, error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_frames(
    path: Path, *, start_s: float = 0.0, found: Overview | None = None
) -> Iterator[tuple[float, bytes]]:
    """Yield the images of a file in file order, as far as it can be read.

    Parameters
    ----------
    path
        An MCAP file with the images of one camera; it may have been cut short, or
        still grow. A folder of them is read in the order of their names.
    start_s
        Images before this second are left out; a whole file is not read up to there.
    found
        A new overview, which afterwards says whether all was whole, and what was
        lost. Of a folder it is that of the last file that was not whole.

    Yields
    ------
    time_s : float
        The image's time stamp, in seconds since the start of the trial.
    data : bytes
        A JPEG or PNG file.

    Raises
    ------
    InputError
        The file is missing, or has no images or those of several cameras.
    DamagedError
        It is no MCAP file.
    """
    if path.is_dir():
        yield from _read_folder(path, start_s, found)
        return
    found = Overview() if found is None else found
    messages = _indexed(path, start_s, found) if start_s > 0 else None
    topic = ""
    for channel, message in messages or read_messages(path, found):
        if found.schemas.get(channel.topic) != _IMAGE_SCHEMA:
            continue
        topic = topic or channel.topic
        if channel.topic != topic:
            raise InputError(
                f"{path}: holds images of several cameras: {topic} and {channel.topic}.",
                hint="Give a file for each camera.",
            )
        time_s, data = _decoded(path, message.data)
        if time_s >= start_s - 0.5 / _NS:
            yield time_s, data
    if found.whole and _IMAGE_SCHEMA not in found.schemas.values():
        topics = ", ".join(found.schemas) or "nothing"
        raise InputError(
            f"{path}: holds no camera images ({_IMAGE_SCHEMA}), but {topics}.",
            hint=f"See what it is with: zfcal inspect {path}",
        )


def frame_segments(folder: Path) -> list[Path]:
    """Return the image files of a folder by the second at which they start."""
    return list(numbered_of(folder, ".mcap").values())


def _read_folder(
    folder: Path, start_s: float, found: Overview | None
) -> Iterator[tuple[float, bytes]]:
    paths = frame_segments(folder)
    if not paths:
        raise InputError(
            f"{folder}: holds no images.", hint="They lie in files such as 000000.mcap."
        )
    starts = [second_of(path, ".mcap") or 0 for path in paths]
    first = max(bisect.bisect_right(starts, start_s) - 1, 0)
    for path in paths[first:]:
        of_file = Overview()
        yield from read_frames(path, start_s=start_s, found=of_file)
        if found is not None and (of_file.problem or not found.problem):
            _copy(of_file, found)


def _copy(here: Overview, there: Overview) -> None:
    for name in Overview.__slots__:
        setattr(there, name, getattr(here, name))


def _indexed(
    path: Path, start_s: float, found: Overview
) -> Iterator[tuple[Channel, Message]] | None:
    """Return the messages from a second on by the file's index; None if it has none."""
    try:
        with open_regular(path) as file:
            summary = SeekingReader(file, record_size_limit=largest(CHUNK_BYTES)).get_summary()
    except OSError as error:
        raise unreadable(path, error) from error
    except (EndOfFile, *BROKEN):
        return None
    if summary is None or not summary.chunk_indexes:
        return None
    for channel in summary.channels.values():
        schema = summary.schemas.get(channel.schema_id)
        found.schemas[channel.topic] = schema.name if schema else ""
    found.whole = True
    return _seek(path, summary, round(start_s * _NS), found)


def _seek(
    path: Path, summary: Summary, start_ns: int, found: Overview
) -> Iterator[tuple[Channel, Message]]:
    try:
        with open_regular(path) as file:
            for index in summary.chunk_indexes:
                if index.message_end_time < start_ns:
                    continue
                # Behind the kind and the length of the record.
                file.seek(index.chunk_start_offset + 9)
                for record in records_of(Chunk.read(ReadDataStream(file))):
                    if isinstance(record, Message) and record.log_time >= start_ns:
                        yield _counted(record, summary, found), record
    except (EndOfFile, *BROKEN) as error:
        found.whole = False
        found.problem = f"a damaged record ({error})"


def _counted(message: Message, summary: Summary, found: Overview) -> Channel:
    channel = summary.channels.get(message.channel_id)
    if channel is None:
        text = f"a message of the unknown channel {message.channel_id}"
        raise McapError(text)
    found.counts[channel.topic] += 1
    return channel


def _decoded(path: Path, data: bytes) -> tuple[float, bytes]:
    try:
        message = CompressedImage.FromString(data)
    except Exception as error:
        # Protobuf's own kind, whose package zfcal does not ask for.
        raise DamagedError(
            f"{path}: an image's message cannot be decoded ({error}).",
            hint=f"See how much of it can be read with: zfcal inspect {path}",
        ) from error
    check_pixels(path, message.data)
    stamp = message.timestamp
    return stamp.seconds + stamp.nanos / _NS, message.data


def _form_of(data: bytes) -> str | None:
    return next((form for magic, form in _MAGIC.items() if data.startswith(magic)), None)


def _calibration_message(known: Calibration, camera: str, time_ns: int) -> CameraCalibration:
    matrix = known.matrix
    message = CameraCalibration(
        frame_id=camera,
        width=known.size_px[0],
        height=known.size_px[1],
        distortion_model=known.distortion_model,
        D=known.distortion,
        K=matrix,
        R=(1, 0, 0, 0, 1, 0, 0, 0, 1),
        P=(*matrix[:3], 0, *matrix[3:6], 0, *matrix[6:], 0),
    )
    message.timestamp.FromNanoseconds(time_ns)
    return message
