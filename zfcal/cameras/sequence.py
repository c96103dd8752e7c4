"""Images in files, one a frame: a folder of them, or a pattern.

Their times stand in their names, or they have none.
"""

from __future__ import annotations

import glob
import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import final

import cv2
import numpy as np

from zfcal.cameras.stamps import Problem, Shot
from zfcal.errors import InputError

_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp")

_DATE = re.compile(
    r"(20\d\d)-?(\d\d)-?(\d\d)[T_ -]?(\d\d)[-:.]?(\d\d)[-:.]?(\d\d)(?:[._-](\d{1,9}))?"
)
_UNIX = re.compile(r"(?<!\d)(1\d{9})(?:[._](\d{1,9})|(\d{3}|\d{6}|\d{9}))?(?!\d)")


def images_of(text: str) -> list[Path] | None:
    """Return the images of a folder or a pattern, in order; None if it is neither.

    Raises
    ------
    InputError
        A pattern that no file answers to.
    """
    path = Path(text)
    if path.is_dir():
        found = [part for part in path.iterdir() if part.suffix.lower() in _ENDINGS]
        found = [part for part in found if not part.name.startswith(".")]
        return sorted(found, key=_natural) or None
    if path.exists() or not glob.has_magic(text):
        return None
    found = [Path(part) for part in glob.glob(text)]  # noqa: PTH207 - a pattern may be absolute
    if not found:
        raise InputError(
            f"{text}: no file answers to this pattern.", hint="Put it in quotes: 'day3/*.png'."
        )
    wrong = [part for part in found if part.suffix.lower() not in _ENDINGS]
    if wrong:
        raise InputError(
            f"{wrong[0]}: is no image, and {text} names it.",
            hint=f"Images end in {', '.join(_ENDINGS)}; videos are given one at a time.",
        )
    return sorted(found, key=_natural)


@final
class ImageSequence:
    """Images in files.

    Parameters
    ----------
    name
        For messages.
    paths
        The files, in order.
    fps
        Frame rate of the trial, for names without times.

    Raises
    ------
    InputError
        Some names have a time and others have none.
    """

    is_live = False

    def __init__(self, name: str, paths: Sequence[Path], *, fps: float) -> None:
        self.name = name
        self.rate_hz: float | None = None
        self.notes: list[str] = []
        self.problems: list[Problem] = []
        self.paths = list(paths)
        self._times_s = self._times(fps)
        self.length_s: float | None = self._times_s[-1] + 1 / fps

    def _times(self, fps: float) -> list[float]:
        found = [time_in(path.stem) for path in self.paths]
        times = [time_s for time_s in found if time_s is not None]
        if not times:
            self.notes.append(
                f"{self.name}: the names of the images hold no times; image k is taken to be of "
                f"k / {fps:g} s, by fps of trial.toml."
            )
            return [number / fps for number in range(len(self.paths))]
        if len(times) < len(found):
            without = self.paths[found.index(None)]
            raise InputError(
                f"{without}: its name holds no time, those of {len(times)} other images do.",
                hint="Move it away, or rename all of them alike.",
            )
        return [time_s - times[0] for time_s in times]

    def shots(self) -> Iterator[Shot]:
        """Yield the images; those that cannot be read go to `problems`."""
        for path, time_s in zip(self.paths, self._times_s, strict=True):
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if image is None:
                self.problems.append(
                    Problem(says=f"{path}: cannot be read as an image.", hint="Copy it again.")
                )
                continue
            yield Shot(time_s=time_s, image=np.asarray(image, np.uint8))


def time_in(name: str) -> float | None:
    """Return the time that a file's name holds, in seconds since 1970; None if it holds none.

    >>> time_in("overhead_1700000000.250")
    1700000000.25
    >>> time_in("2026-11-21T10-00-00.5")
    1795255200.5
    """
    unix = _UNIX.search(name)
    if unix:
        whole, fraction, glued = unix.groups()
        return int(whole) + float(f"0.{fraction or glued or 0}")
    date = _DATE.search(name)
    if not date:
        return None
    *fields, fraction = date.groups()
    try:
        moment = datetime(*map(int, fields), tzinfo=UTC)  # type: ignore[misc,arg-type]
    except ValueError:
        return None
    return moment.timestamp() + float(f"0.{fraction or 0}")


def _natural(path: Path) -> tuple[object, ...]:
    """Order frame2 before frame10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((int(p), p) if p.isdigit() else (-1, p) for p in parts)
