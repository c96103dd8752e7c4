"""What a trial is, and where its files lie. No file is opened here."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from zfcal.errors import InputError

CONFIG_NAME = "trial.toml"
FIRST_MODEL = "models/000000.toml"
"""The starting model of a trial that is made, relative to it."""

LOOP_NAME = "closed-loop.json"
"""What a virtual closed loop was asked for, written when it has ended."""

LARGEST_SEED = 2**63 - 1
"""TOML holds whole numbers of 64 bits, one of them the sign."""

LONGEST_STEP_S = 2.0
"""A step is one decision of a fish, 0.1 to 1 s long. Whether others follow a robot is looked for at
lags of up to two seconds: of longer steps there is none."""

_DIGITS = 6

NUMBER = "(?:[0-9]{6}|[1-9][0-9]{6,8})"
"""How artifacts are numbered: each second has one name, up to thirty years."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """The settings of a trial, as ``trial.toml`` states them.

    Parameters
    ----------
    root
        The trial's directory.
    arena
        Name of an arena that comes with zfcal, or the path of a GeoJSON file,
        relative to the trial.
    n_fish, n_robots
        Agents in the tank.
    fps
        Frame rate of the tracks, in hertz.
    dt_s
        The model's step in seconds: a whole number of frames, at most `LONGEST_STEP_S`.
    seed
        All random numbers of the trial derive from it.
    model
        The starting model, relative to the trial.
    source
        Where the data come from, in words.
    cameras
        For each camera (``overhead``, ``below``) its ``file`` and ``source``.
    """

    root: Path
    arena: str
    n_fish: int
    n_robots: int
    fps: float
    dt_s: float
    seed: int
    model: str = FIRST_MODEL
    source: str = ""
    cameras: dict[str, dict[str, str]] | None = None

    def __post_init__(self) -> None:
        where = str(self.root / CONFIG_NAME)
        if not 0 < self.fps < math.inf:
            raise InputError(f"{where}: fps must be a positive rate in hertz, got {self.fps!r}.")
        if self.n_fish < 0 or self.n_robots < 0 or self.n_fish + self.n_robots < 1:
            raise InputError(
                f"{where}: needs at least one agent, got n_fish = {self.n_fish} and "
                f"n_robots = {self.n_robots}."
            )
        if self.seed < 0:
            raise InputError(f"{where}: seed must be a whole number from 0 on, got {self.seed!r}.")
        if self.seed > LARGEST_SEED:
            raise InputError(f"{where}: seed must be at most {LARGEST_SEED}, got {self.seed!r}.")
        frames = self.dt_s * self.fps
        if not (
            math.isfinite(frames) and round(frames) >= 1 and abs(frames - round(frames)) < 1e-3
        ):
            raise InputError(
                f"{where}: dt_s must be a whole number of frames, got {self.dt_s!r} s "
                f"at {self.fps!r} Hz ({frames:.4g} frames).",
                hint=f"One frame is {1 / self.fps:.6g} s.",
            )
        if not self.dt_s <= LONGEST_STEP_S:
            raise InputError(
                f"{where}: dt_s must be at most {LONGEST_STEP_S:g} s, got {self.dt_s!r} s.",
                hint="It is the model's step, in seconds: 0.2 is usual.",
            )

    @property
    def config(self) -> Path:
        """The settings file."""
        return self.root / CONFIG_NAME

    @property
    def n_agents(self) -> int:
        """Fish and robots."""
        return self.n_fish + self.n_robots

    @property
    def longest_step_s(self) -> float:
        """Two neighbouring samples lie less apart, in seconds: each is half a frame off at most."""
        return self.dt_s + 1 / self.fps

    def path(self, folder: str, second: int, ending: str) -> Path:
        """Return the place of an artifact, such as ``tracks/000060.parquet``.

        Parameters
        ----------
        folder
            ``tracks``, ``stats``, ``scores``, ``models``, ...
        second
            Seconds since trial start: a segment's start or a window's end.
        ending
            What follows the number, such as ``.parquet`` or ``-model.parquet``.
        """
        return self.root / folder / f"{second:0{_DIGITS}d}{ending}"


def second_of(path: Path, ending: str = ".parquet") -> int | None:
    """Return the number in an artifact's name; None if it is not named so.

    >>> second_of(Path("tracks/000060.parquet"))
    60
    """
    match = re.fullmatch(f"({NUMBER}){re.escape(ending)}", path.name)
    return int(match.group(1)) if match else None
