"""What a person says about a foreign file: rate, scale, axes, and who is a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal, TypeAlias

from zfcal.errors import InputError

SPECIAL = frozenset({"columns", "keypoint", "body_axis", "box", "first_frame"})
"""Options that only some formats can make use of."""

Idle: TypeAlias = Mapping[str, InputError]
"""Given options that take no effect in a file, and what is said where they do in no other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """What the file itself does not tell, or tells wrongly.

    Parameters
    ----------
    fps
        Frame rate in hertz; a file that states another one is refused.
    m_per_px
        Metres per pixel; needed for formats in pixels, an error for the others.
    origin
        The point ``(x, y)`` that becomes (0, 0), in the file's own unit and axes
        (pixels, for most formats).
    flip_y
        The file's y counts downwards, as in an image: turn it up, about `origin`.
    noise_m
        The source's position noise, standard deviation per coordinate, in metres.
        Kept for the diagnosis; reading does not use it.
    n_fish, n_robots
        Agents of the trial: more of them at once than this is an error.
    robots
        Agents that are robots, by name or number as the file has them.
    columns
        Pairs ``(ours, theirs)``: names that columns of a CSV file have.
    keypoint
        The body part taken as the position: a name of the file, or ``mean``
        for the mean of all parts where all are known.
    body_axis
        Two body parts ``(back, front)`` that give the heading.
    box
        Whether x and y of a MOT box are its upper left corner or its centre.
    first_frame
        Number that the file gives to the first frame (MOT: 1, else 0).
    min_confidence
        Positions below it are taken as missing.
    """

    fps: float
    m_per_px: float | None = None
    origin: tuple[float, float] | None = None
    flip_y: bool = False
    noise_m: float | None = None
    n_fish: int | None = None
    n_robots: int | None = None
    robots: tuple[str, ...] = ()
    columns: tuple[tuple[str, str], ...] = ()
    keypoint: str | None = None
    body_axis: tuple[str, str] | None = None
    box: Literal["corner", "centre"] | None = None
    first_frame: int | None = None
    min_confidence: float = 0.0

    def __post_init__(self) -> None:
        _require(0 < self.fps < math.inf, "fps", "a positive rate in hertz", self.fps)
        if self.m_per_px is not None:
            expected = "a positive number of metres per pixel"
            _require(0 < self.m_per_px < math.inf, "m_per_px", expected, self.m_per_px)
        if self.noise_m is not None:
            _require(0 <= self.noise_m < math.inf, "noise_m", "a length in metres", self.noise_m)
        if self.origin is not None:
            finite = all(map(math.isfinite, self.origin))
            _require(finite, "origin", "two finite numbers", self.origin)
        for name in ("n_fish", "n_robots"):
            count = getattr(self, name)
            _require(count is None or count >= 0, name, "a number of agents", count)
        _require(0 <= self.min_confidence <= 1, "min_confidence", "0 to 1", self.min_confidence)
        _require(self.box in {None, "corner", "centre"}, "box", "corner or centre", self.box)
        if self.flip_y and self.origin is None:
            raise InputError(
                "Turning y up needs an origin: the point of the image that becomes (0, 0).",
                hint="For the lower left corner of an image 1024 high: --origin 0,1024",
            )


def given(options: ImportOptions) -> frozenset[str]:
    """Return which of the `SPECIAL` options are given.

    >>> sorted(given(ImportOptions(fps=15.0, keypoint="head")))
    ['keypoint']
    """
    special = (field for field in fields(options) if field.name in SPECIAL)
    return frozenset(f.name for f in special if getattr(options, f.name) != f.default)


def without_confidence(path: Path, options: ImportOptions) -> Idle:
    """Return that ``min_confidence``, if given, is idle: the file states no confidence."""
    least = options.min_confidence
    if not least > 0:
        return {}
    problem = InputError(
        f"{path}: min_confidence = {least:g} cannot take effect: expected a confidence for some "
        "position, got none.",
        hint="Leave --min-confidence out. Of a CSV whose column has another name: "
        "--columns confidence=NAME",
    )
    return {"min_confidence": problem}


def refuse_idle(*files: Idle) -> None:
    """Refuse options that take effect in none of the files that are imported together.

    Raises
    ------
    InputError
        There is one.
    """
    for name in files[0]:
        if all(name in idle for idle in files):
            raise files[0][name]


def _require(holds: bool, name: str, expected: str, got: object) -> None:  # noqa: FBT001
    if not holds:
        raise InputError(f"Import option {name} must be {expected}, got {got!r}.")
