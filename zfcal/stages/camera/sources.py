"""The images of a trial: whatever `zfcal.cameras.video` opens, and MCAP image segments."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import final

from zfcal.artifacts.atomic import check_free
from zfcal.artifacts.frame_files import FrameWriter, frame_segments, read_frames
from zfcal.artifacts.freshness import relative_to
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.mcap_files import Overview
from zfcal.cameras.live import ArrivalClock
from zfcal.cameras.sequence import images_of
from zfcal.cameras.stamps import Problem, Shot, Source
from zfcal.cameras.video import decoded, encoded, is_live, open_source
from zfcal.errors import InputError
from zfcal.stages.events import Tell
from zfcal.stages.recording import hash_sources
from zfcal.stages.segments import STEP_S
from zfcal.stages.taken import unless_taken
from zfcal.trial import second_of

_EPOCH_S = 1e8
"""Later than this since the start of a trial: the times count from 1970."""


def source_of(text: str, *, fps: float, clock: ArrivalClock) -> Source:
    """Return the source that words name: as `open_source`, or MCAP files."""
    path = Path(text)
    if not is_live(text) and (path.suffix == ".mcap" or any(path.glob("*.mcap"))):
        return _RecordedFrames(path)
    return open_source(text, fps=fps, clock=clock)


def files_of(root: Path, text: str) -> dict[str, str]:
    """Return the hashes of a source's files as lineage states them; empty for a live camera."""
    if is_live(text):
        return {}
    images = images_of(text)
    paths = [Path(text)] if images is None or Path(text).is_dir() else images
    found: dict[str, str] = {}
    for path in paths:
        hashes = hash_sources(root, path)
        if relative_to(root, path).startswith(".."):
            # A name with a folder would be looked for in the trial.
            hashes = {name.replace("/", ":"): digest for name, digest in hashes.items()}
        found |= hashes
    return found


@final
class _RecordedFrames:
    """Camera images in an MCAP file, or in a folder of them such as ``frames/overhead``.

    Parameters
    ----------
    path
        The file or folder.

    Raises
    ------
    InputError
        It holds no images.
    DamagedError
        It is no MCAP file.
    """

    is_live = False

    def __init__(self, path: Path) -> None:
        self.name = str(path)
        self.rate_hz: float | None = None
        self.length_s: float | None = None
        self.notes: list[str] = []
        self.problems: list[Problem] = []
        self._path = path
        first = next(iter(read_frames(path)), None)
        if first is None:
            raise InputError(f"{path}: holds no images.", hint=f"See: zfcal inspect {path}")
        self._zero_s = first[0] if first[0] >= _EPOCH_S else 0.0

    def shots(self) -> Iterator[Shot]:
        """Yield the images; what cannot be read goes to `problems`."""
        paths = frame_segments(self._path) if self._path.is_dir() else [self._path]
        for path, later in itertools.zip_longest(paths, paths[1:]):
            found = Overview()
            yield from self._shots_of(path, found)
            if found.problem:
                # Before the next image: who has enough with that one has heard of it.
                ends = math.inf if later is None else second_of(later, ".mcap") or 0
                self.problems.append(
                    Problem(
                        says=f"{path}: {found.problem}; {found.lost_bytes} bytes are lost.",
                        hint="Copy it again from where it was recorded; what could be read is "
                        "tracked.",
                        end_s=ends - self._zero_s,
                    )
                )

    def _shots_of(self, path: Path, found: Overview) -> Iterator[Shot]:
        for time_s, data in read_frames(path, found=found):
            image = decoded(data)
            if image is None:
                self.problems.append(
                    Problem(
                        says=f"{path}: the image of {time_s:.3f} s cannot be decoded.",
                        hint="Copy the file again from where it was recorded.",
                        end_s=math.nextafter(time_s - self._zero_s, math.inf),
                    )
                )
                continue
            yield Shot(time_s=time_s - self._zero_s, image=image)


@final
class Recorder:
    """Writes the images of a live camera as ``frames/CAMERA/NNNNNN.mcap``, minute by minute.

    A minute in whose place a folder stands is left out.

    Parameters
    ----------
    root
        The trial's directory.
    camera
        ``overhead`` or ``below``.
    form
        ``jpeg`` or ``png``.
    lineage
        Where the images come from.
    tell
        Hears of minutes that are left out.
    """

    def __init__(self, root: Path, camera: str, form: str, lineage: Lineage, tell: Tell) -> None:
        self.paths: list[Path] = []
        self._folder = root / "frames" / camera
        self._camera = camera
        self._form = form
        self._lineage = lineage
        self._tell = tell
        self._writer: FrameWriter | None = None
        self._start_s = -1

    def keep(self, shot: Shot) -> Shot:
        """Record an image and return it as the recording will give it back."""
        start_s = int((shot.time_s + 1e-6) // STEP_S) * STEP_S
        if start_s != self._start_s:
            self.close()
            self._start_s = start_s
            path = self._folder / f"{start_s:06d}.mcap"
            with unless_taken(path, self._tell):
                check_free(path)
                self._begin(path)
        data = encoded(shot.image, self._form)
        if self._writer is not None:
            self._writer.add(shot.time_s, data)
        image = decoded(data)
        return shot if image is None else Shot(time_s=shot.time_s, image=image)

    def _begin(self, path: Path) -> None:
        """Open the file of a minute; what an interrupted run left of it comes first."""
        part = path.with_name(f".{path.name}.taken-up")
        part.unlink(missing_ok=True)
        self._writer = FrameWriter(part, self._camera, lineage=self._lineage)
        if path.exists():
            for time_s, data in read_frames(path):
                self._writer.add(time_s, data)
        part.replace(path)
        self.paths.append(path)

    def close(self) -> None:
        """Close the file that is written."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None
