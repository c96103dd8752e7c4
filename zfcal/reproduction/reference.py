"""Published scores, and the contrasts that were fixed before anything is computed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from zfcal.artifacts.validation import check, read_toml, written_by_people
from zfcal.errors import InputError

_MARGIN = 0.05

Scoring = Literal["paper", "legacy"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contrast:
    """One number of a trial that is held against a published one.

    Parameters
    ----------
    name
        What it is called.
    feature
        D, W, O, T or S.
    from_s, to_s
        Ends of the first and of the last window whose values are averaged, in seconds; the
        trial's last window where `to_s` is infinite.
    value
        The published mean over trials.
    sd
        Its standard deviation over trials; NaN where it was not published.
    """

    name: str
    feature: str
    from_s: float
    to_s: float = math.inf
    value: float
    sd: float = math.nan

    def __post_init__(self) -> None:
        if not self.from_s <= self.to_s:
            raise InputError(
                f"Contrast {self.name!r} ends at {self.to_s:g} s, before it begins at "
                f"{self.from_s:g} s."
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """What was published.

    Parameters
    ----------
    source
        Where.
    n_trials
        How many trials the means are of.
    scoring
        By which scoring.
    margin
        Differences up to this count as agreement.
    contrasts
        What the verdict is made of.
    intervals
        Published means by feature and second, for the table and the picture.
    """

    source: str
    n_trials: int
    scoring: Scoring = "paper"
    margin: float = _MARGIN
    contrasts: tuple[Contrast, ...]
    intervals: Mapping[tuple[str, int], float] = field(default_factory=lambda: MappingProxyType({}))

    def published(self, feature: str, end_s: int) -> float:
        """Return the published value of a window; NaN where there is none.

        A contrast that runs to the trial's end is the value of all its windows.
        """
        known = self.intervals.get((feature, end_s))
        if known is not None:
            return known
        for contrast in self.contrasts:
            if contrast.feature == feature and contrast.from_s <= end_s <= contrast.to_s:
                return contrast.value
        return math.nan


def read_reference(path: Path | None = None) -> Reference:
    """Return the published scores of a file; those that come with zfcal without one.

    Raises
    ------
    InputError
        There is no such file, it is not TOML, or a value is unknown, missing or wrong.
    """
    if path is not None:
        with written_by_people():
            return _reference(read_toml(path), path)
    with as_file(files("zfcal.reproduction") / "published.toml") as place:
        return _reference(read_toml(place), place)


def _reference(document: dict[str, Any], path: Path) -> Reference:
    check(document, "reference", path)
    contrasts = tuple(
        Contrast(**{"to_s": math.inf, "sd": math.nan, **each}) for each in document["contrasts"]
    )
    names = [contrast.name for contrast in contrasts]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{path}: two contrasts are called {twice[0]!r}.")
    return Reference(
        source=document["source"],
        n_trials=document["n_trials"],
        scoring=document.get("scoring", "paper"),
        margin=document.get("margin", _MARGIN),
        contrasts=contrasts,
        intervals=MappingProxyType(
            {
                (feature, row["end_s"]): value
                for row in document["intervals"]
                for feature, value in row.items()
                if feature != "end_s"
            }
        ),
    )
