"""A live camera: a thread of its own keeps the newest images, with the time of their arrival."""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Iterator
from typing import final

import cv2
import numpy as np

from zfcal.cameras.stamps import Problem, Shot
from zfcal.errors import InputError

# FFmpeg and OpenCV talk to standard error by themselves; what is wrong is told in one line.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

QUEUE = 45
"""Images that wait at most: three seconds at 15 Hz; then the oldest go."""

_PATIENCE_S = 30.0
"""How long a camera that has gone is waited for."""

_RETRY_S = 0.5
_TIMEOUT_MS = 3000


@final
class ArrivalClock:
    """Seconds since the start of the trial, by this computer; several cameras share one.

    Parameters
    ----------
    started_unix_s
        When the trial began, for one that goes on; None to begin with the first image.
    """

    def __init__(self, started_unix_s: float | None = None) -> None:
        self._lock = threading.Lock()
        self._zero_s: float | None = None
        self.started_unix_s = started_unix_s
        if started_unix_s is not None:
            # The wall clock is asked once: it may be set while the trial runs.
            self._zero_s = time.monotonic() - (time.time() - started_unix_s)

    def now(self) -> float:
        """Return the seconds since the trial began; the first question begins it."""
        with self._lock:
            if self._zero_s is None:
                self._zero_s = time.monotonic()
                self.started_unix_s = time.time()
            return time.monotonic() - self._zero_s


@final
class LiveCamera:
    """A camera by number, device or address.

    Parameters
    ----------
    address
        Such as ``0``, ``/dev/video2``, ``http://...`` or ``rtsp://...``.
    clock
        Gives images their times as they arrive.
    fps
        Frame rate of the trial: asked of a device, and the unit of its gaps.
    patience_s
        How long to wait for a camera that has gone.

    Raises
    ------
    InputError
        The camera cannot be opened when `shots` begins.
    """

    is_live = True

    def __init__(
        self, address: str, *, clock: ArrivalClock, fps: float, patience_s: float = _PATIENCE_S
    ) -> None:
        self.name = address
        self.rate_hz: float | None = None
        self.length_s: float | None = None
        self.notes: list[str] = []
        self.problems: list[Problem] = []
        self.dropped = 0
        self._clock = clock
        self._fps = fps
        self._patience_s = patience_s
        self._waiting: deque[Shot] = deque()
        self._changed = threading.Condition()
        self._ended = False
        self._stop = threading.Event()
        self._reader: threading.Thread | None = None

    def shots(self) -> Iterator[Shot]:
        """Yield images as they come, until the camera is gone for good or `stop` is called."""
        capture = self._open()
        if capture is None:
            raise InputError(
                f"{self.name}: no camera answers there.",
                hint="Check the cable, the address, and who else uses it (fuser /dev/video0).",
            )
        self._reader = threading.Thread(target=self._read, args=(capture,), daemon=True)
        self._reader.start()
        try:
            while (shot := self._next()) is not None:
                yield shot
        finally:
            self.stop()

    def newest(self, *, patience_s: float = 0.0) -> list[Shot]:
        """Return what has arrived since; where nothing has, what comes within a moment."""
        with self._changed:
            if patience_s > 0 and not self._waiting:
                self._changed.wait(timeout=patience_s)
            found = list(self._waiting)
            self._waiting.clear()
        return found

    def stop(self) -> None:
        """End the reading, and wait for it: a thread must not be inside OpenCV at the end."""
        self._stop.set()
        if self._reader is not None and self._reader is not threading.current_thread():
            self._reader.join(timeout=2 * _TIMEOUT_MS / 1000)

    def _next(self) -> Shot | None:
        with self._changed:
            while not self._waiting and not self._ended:
                # A timeout lets signals through.
                self._changed.wait(timeout=0.2)
            return self._waiting.popleft() if self._waiting else None

    def _read(self, capture: cv2.VideoCapture | None) -> None:
        while capture is not None and not self._stop.is_set():
            found, image = capture.read()
            if found:
                self._keep(Shot(time_s=self._clock.now(), image=np.asarray(image, np.uint8)))
            else:
                capture.release()
                capture = self._wait_for_return()
        if capture is not None:
            capture.release()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _keep(self, shot: Shot) -> None:
        with self._changed:
            if len(self._waiting) >= QUEUE:
                self._waiting.popleft()
                self.dropped += 1
            self._waiting.append(shot)
            self._changed.notify_all()

    def _wait_for_return(self) -> cv2.VideoCapture | None:
        gone_s = self._clock.now()
        while not self._stop.is_set():
            if self._clock.now() - gone_s > self._patience_s:
                self.problems.append(
                    Problem(
                        says=f"{self.name}: the camera went away at {gone_s:.1f} s and did not "
                        f"return within {self._patience_s:g} s.",
                        hint="Run the same command again when it is back: the trial goes on.",
                    )
                )
                return None
            capture = self._open()
            if capture is not None:
                self.notes.append(
                    f"{self.name}: the camera went away at {gone_s:.1f} s and came back after "
                    f"{self._clock.now() - gone_s:.1f} s."
                )
                return capture
            self._stop.wait(_RETRY_S)
        return None

    def _open(self) -> cv2.VideoCapture | None:
        capture = (
            cv2.VideoCapture(
                self.name,
                cv2.CAP_FFMPEG,
                [
                    cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
                    _TIMEOUT_MS,
                    cv2.CAP_PROP_READ_TIMEOUT_MSEC,
                    _TIMEOUT_MS,
                ],
            )
            if "://" in self.name
            else cv2.VideoCapture(int(self.name) if self.name.isdigit() else self.name)
        )
        if not capture.isOpened():
            return None
        if "://" not in self.name:
            capture.set(cv2.CAP_PROP_FPS, self._fps)
            # The newest image, not one that has waited in the driver.
            capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        return capture
