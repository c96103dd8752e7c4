"""Where images come from: video files here, sequences and live cameras beside it.

Every source yields its images with the camera's time stamps (see `stamps`). MCAP image
segments are artifacts: `zfcal.stages.camera.sources` makes a source of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import final

import cv2
import numpy as np

from zfcal.cameras.frames import Image
from zfcal.cameras.live import ArrivalClock, LiveCamera
from zfcal.cameras.sequence import ImageSequence, images_of
from zfcal.cameras.stamps import Problem, Shot, Source
from zfcal.errors import DamagedError, InputError

_ADDRESS = re.compile(r"\d+|/dev/video\d+|[a-z][a-z0-9+.-]*://.+")


def is_live(text: str) -> bool:
    """Return whether words name a camera: a number, ``/dev/videoN`` or an address."""
    return _ADDRESS.fullmatch(text) is not None


def open_source(text: str, *, fps: float, clock: ArrivalClock | None = None) -> Source:
    """Return the source that words name.

    Parameters
    ----------
    text
        A camera's number, device or address; a video file; a folder of images, or a
        pattern of them such as ``day3/*.png``.
    fps
        Frame rate of the trial, for images that carry no times.
    clock
        Of live cameras: what several share.

    Raises
    ------
    InputError
        There is no such file, or nothing that can be opened.
    DamagedError
        It is a video that cannot be opened.
    """
    if is_live(text):
        return LiveCamera(text, clock=clock or ArrivalClock(), fps=fps)
    images = images_of(text)
    if images is not None:
        return ImageSequence(text, images, fps=fps)
    return VideoFile(Path(text))


@final
class VideoFile:
    """A video file, with the time stamps that it holds.

    Parameters
    ----------
    path
        Any file that OpenCV's FFmpeg opens.

    Raises
    ------
    InputError
        There is no such file.
    DamagedError
        It cannot be opened as a video.
    """

    is_live = False

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self.notes: list[str] = []
        self.problems: list[Problem] = []
        capture = _opened(path)
        rate = capture.get(cv2.CAP_PROP_FPS)
        self.rate_hz: float | None = rate if rate > 0 else None
        count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self._count = int(count) if count > 0 else None
        self._has_stamps = _has_stamps(capture)
        capture.release()
        self.length_s = self._count / rate if self._count and rate > 0 else None
        if not self._has_stamps:
            self._say_without_stamps()

    def _say_without_stamps(self) -> None:
        if self.rate_hz is None:
            raise InputError(
                f"{self.name}: has neither time stamps nor a frame rate.",
                hint="Convert it, for example: ffmpeg -r 15 -i OLD -c copy NEW.mkv",
            )
        self.notes.append(
            f"{self.name}: has no time stamps; its frame k is taken to be of k / "
            f"{self.rate_hz:g} s, as its header states."
        )

    def shots(self) -> Iterator[Shot]:
        """Yield the images; what is missing at the end goes to `problems`."""
        capture = _opened(Path(self.name))
        count, start_s, last_s = 0, 0.0, 0.0
        while True:
            found, image = capture.read()
            if not found:
                break
            stamp_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            if not self._has_stamps:
                stamp_s = count / (self.rate_hz or 1.0)
            start_s = stamp_s if count == 0 else start_s
            last_s = stamp_s - start_s
            count += 1
            yield Shot(time_s=last_s, image=_as_image(image))
        capture.release()
        self._check_end(count, last_s)

    def _check_end(self, count: int, last_s: float) -> None:
        """Compare with the header: some count frames, some know the length alone."""
        if self._count is None or count >= self._count - 1:
            return
        if self.length_s and self.rate_hz and last_s + 1.5 / self.rate_hz >= self.length_s:
            return
        self.problems.append(
            Problem(
                says=f"{self.name}: was cut short or is damaged: {count} of {self._count} frames "
                "can be read.",
                hint="Copy it again from where it was recorded; what could be read is tracked.",
            )
        )


def _opened(path: Path) -> cv2.VideoCapture:
    if not path.is_file():
        what = "is a folder without images" if path.is_dir() else "no such file"
        raise InputError(
            f"{path}: {what}.",
            hint="Give a video file, a folder or pattern of images, MCAP segments, a camera's "
            "number such as 0, or an address.",
        )
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened() or not capture.grab():
        size = path.stat().st_size
        what = "the file is empty (0 bytes)" if size == 0 else "no video that can be opened"
        raise DamagedError(
            f"{path}: {what}; it is damaged, was cut short before its index, or is no video.",
            hint="Copy it again from where it was recorded; record to .mkv or .avi, which survive "
            "a loss of power.",
        )
    capture.release()
    return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)


def _has_stamps(capture: cv2.VideoCapture) -> bool:
    """Tell whether the stamps of the first frames advance."""
    stamps: list[float] = []
    while len(stamps) < 3 and capture.grab():
        stamps.append(capture.get(cv2.CAP_PROP_POS_MSEC))
    return len(stamps) < 2 or bool(np.all(np.diff(stamps) > 0))


def _as_image(image: object) -> Image:
    return np.asarray(image, np.uint8)


def decoded(data: bytes) -> Image | None:
    """Return the image of a JPEG or PNG file, blue, green, red; None if it is damaged."""
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    return None if image is None else _as_image(image)


def encoded(image: Image, form: str) -> bytes:
    """Return an image as a file of a form, ``jpeg`` or ``png``."""
    # PNG at its quickest: a frame must not take longer than the camera.
    how = [cv2.IMWRITE_PNG_COMPRESSION, 1] if form == "png" else [cv2.IMWRITE_JPEG_QUALITY, 95]
    done, data = cv2.imencode(f".{form}", image, how)
    if not done:
        raise InputError(f"An image of shape {image.shape} cannot be written as {form}.")
    return data.tobytes()
