"""A trial's camera images as plain video files, for programs that read no MCAP.

The images are decoded and written again: lossless (FFV1) in .avi and .mkv, so that a
program that reads the video sees the very same pixels; .mp4 is for looking at.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np

from zfcal.artifacts.atomic import write_text_whole, write_whole
from zfcal.artifacts.frame_files import frame_segments, read_frames
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.reading.contents import hold_steady
from zfcal.artifacts.settings import read_trial
from zfcal.cameras.frames import Image
from zfcal.errors import DamagedError, InputError, StorageError
from zfcal.stages.camera.rig import BELOW
from zfcal.stages.events import Made, Planned, Progress, Tell, UpToDate
from zfcal.stages.making import settled
from zfcal.stages.trial_context import Task
from zfcal.virtual.film import camera_names, frames_folder

_SCHEMA = "zfcal.video/1"

_CODECS = {".avi": "FFV1", ".mkv": "FFV1", ".mp4": "mp4v"}

_TOLD_EVERY = 50


def exported_paths(video: Path, cameras: Iterable[str]) -> dict[str, Path]:
    """Return the video file of each camera: the one below gets ``-below`` to its name.

    Raises
    ------
    InputError
        The name ends in none of .avi, .mkv and .mp4.
    """
    if video.suffix not in _CODECS:
        raise InputError(
            f"{video}: is no video file that can be written.",
            hint=f"Let its name end in {', '.join(_CODECS)}; the first two are lossless.",
        )
    below = video.with_name(f"{video.stem}-below{video.suffix}")
    return {camera: below if camera == BELOW else video for camera in cameras}


def export_video(root: Path, video: Path, tell: Tell, *, task: Task | None = None) -> None:
    """Write a trial's camera images as plain video files, at the trial's frame rate.

    Parameters
    ----------
    root
        A trial with images.
    video
        Where the overhead camera's go; beside it lies a file that says what it was
        made from.
    tell
        Hears of every file.
    task
        How to go about it.

    Raises
    ------
    InputError
        There are no images, or the file's ending is unknown.
    DamagedError
        An image cannot be decoded.
    StorageError
        The disk is full, or OpenCV has no such codec.
    """
    settled(lambda: _export(root, video, tell, task=task or Task()), tell)


def _export(root: Path, video: Path, tell: Tell, *, task: Task) -> None:
    trial = read_trial(root)
    for camera, path in exported_paths(video, camera_names(trial.n_robots)).items():
        segments = frame_segments(frames_folder(root, camera))
        if not segments:
            raise InputError(
                f"{frames_folder(root, camera)}: holds no images.", hint="Draw them with --video."
            )
        for segment in segments:
            # Its images are read one by one while the video is written.
            hold_steady(segment)
        lineage = Lineage(
            schema=_SCHEMA,
            command="simulate",
            options={"camera": camera, "fps": trial.fps, "codec": _CODECS[path.suffix]},
            inputs=hash_inputs(root, segments),
        )
        note = path.with_name(path.name + ".json")
        reason = "missing" if not path.is_file() else stale_reason([note], lineage)
        reason = reason or ("forced" if task.force else None)
        if reason is None:
            tell(UpToDate(path=path))
        elif task.dry_run:
            tell(Planned(path=path, reason=reason))
        else:
            _write(path, segments, trial.fps, tell)
            document = {"schema": _SCHEMA, "lineage": lineage.as_dict()}
            write_text_whole(note, json.dumps(document, indent=1) + "\n")
            tell(Made(path=path, reason=reason))


def _write(path: Path, segments: list[Path], fps: float, tell: Tell) -> None:
    def write(part: Path) -> None:
        with tempfile.TemporaryDirectory() as folder:
            # OpenCV knows a format by the end of a name, which a dot-file's is not.
            named = Path(folder) / f"video{path.suffix}"
            named.symlink_to(part.absolute())
            n_frames = _encode(named, path, segments, fps, tell)
            if _count(named) != n_frames:
                raise StorageError(
                    f"{path}: only a part of its {n_frames} images could be written.",
                    hint="Is the disk full?",
                )

    write_whole(path, write)


def _encode(named: Path, path: Path, segments: list[Path], fps: float, tell: Tell) -> int:
    writer: cv2.VideoWriter | None = None
    n_frames = 0
    try:
        for image, share in _images(segments):
            if writer is None:
                size, coloured = (image.shape[1], image.shape[0]), image.ndim == 3
                codec = cv2.VideoWriter.fourcc(*_CODECS[path.suffix])
                writer = cv2.VideoWriter(str(named), codec, fps, size, coloured)
                if not writer.isOpened():
                    raise StorageError(
                        f"{path}: OpenCV cannot write {_CODECS[path.suffix]} into {path.suffix}.",
                        hint=f"Try another of {', '.join(_CODECS)}.",
                    )
            writer.write(image)
            n_frames += 1
            if n_frames % _TOLD_EVERY == 0:
                tell(Progress(stage=path.name, done=round(100 * share), total=100))
    finally:
        if writer is not None:
            writer.release()
    tell(Progress(stage=path.name, done=100, total=100))
    return n_frames


def _images(segments: list[Path]) -> Iterator[tuple[Image, float]]:
    """Yield each image, as it was taken, and the share of the segments that is done before it."""
    for number, segment in enumerate(segments):
        for time_s, data in read_frames(segment):
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
            if image is None:
                raise DamagedError(
                    f"{segment}: the image of {time_s:.3f} s cannot be decoded.",
                    hint=f"See how much of it can be read with: zfcal inspect {segment}",
                )
            yield np.asarray(image, np.uint8), number / len(segments)


def _count(path: Path) -> int:
    found = cv2.VideoCapture(str(path))
    try:
        return int(found.get(cv2.CAP_PROP_FRAME_COUNT))
    finally:
        found.release()
