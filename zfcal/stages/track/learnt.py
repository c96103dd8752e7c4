"""What a run of the tracker learnt of its animals: told, kept with each segment, taken up again."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from zfcal.artifacts.lineage import JSON
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.tables import read_extra
from zfcal.errors import DamagedError, InputError
from zfcal.stages.events import Note
from zfcal.tracking.background import DARK, EITHER, LIGHT, POLARITIES
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker

LEARNT_KEY = "learnt"
"""Extra metadata of a segment: polarity and size of the animals, and how they are known."""

_FILM, _OPTION, _BEFORE, _DEFAULT = "film", "option", "before", "default"
"""How a value is known: by the first images, by a person, by an earlier segment, or not at all."""

_SMALL_PX = 15.0
"""Bodies of fewer pixels are hardly more than a blurred point: their axis is that of the noise."""

_SAYS = {DARK: "darker than the tank", LIGHT: "lighter than the tank", EITHER: "of both kinds"}


def as_before(options: TrackerOptions, before: Mapping[str, JSON] | None) -> TrackerOptions:
    """Return options with what an earlier segment of the same recording knew and nobody said.

    Parameters
    ----------
    options
        As a person gave them.
    before
        From `learnt_before`.
    """
    found = before or {}
    polarity, smallest = found.get("polarity"), found.get("min_blob_px")
    if options.polarity is None and polarity in POLARITIES:
        options = dataclasses.replace(options, polarity=str(polarity))
    if options.min_blob_px is None and isinstance(smallest, int | float) and smallest > 0:
        options = dataclasses.replace(options, min_blob_px=float(smallest))
    return options


def learnt_before(root: Path) -> Mapping[str, JSON] | None:
    """Return what the last segment of a trial knew of its animals; None for nothing."""
    for start in reversed(segment_starts(root)):
        try:
            found = read_extra(segment_path(root, start)).get(LEARNT_KEY)
        except (DamagedError, InputError):
            continue
        if isinstance(found, dict) and found:
            return found
    return None


def learnt_by(tracker: FishTracker, asked: TrackerOptions) -> dict[str, JSON]:
    """Return what a tracker takes its animals for, and how that is known.

    Parameters
    ----------
    tracker
        Has looked at the first frames.
    asked
        What a person said.
    """
    learnt = tracker.learnt
    if learnt is None:
        return {}
    film = {"polarity": learnt.polarity, "min_blob_px": learnt.area_px > 0 or None}
    known = {
        name: _OPTION
        if getattr(asked, name) is not None
        else _BEFORE
        if getattr(tracker.options, name) is not None
        else _FILM
        if film[name]
        else _DEFAULT
        for name in ("polarity", "min_blob_px")
    }
    return {
        "polarity": tracker.polarity,
        "polarity_from": known["polarity"],
        "film_polarity": learnt.polarity,
        "light_share": _number(learnt.light_share),
        "min_blob_px": tracker.min_blob_px,
        "min_blob_from": known["min_blob_px"],
        "area_px": _number(learnt.area_px),
        "images": learnt.n_frames,
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def notes_of(source: str, learnt: Mapping[str, JSON]) -> Iterator[Note]:
    """Yield what a person should know of what was learnt.

    Parameters
    ----------
    source
        Name of the camera's images.
    learnt
        From `learnt_by`.
    """
    taken, film = str(learnt["polarity"]), learnt["film_polarity"]
    how = {
        _FILM: "as the film shows",
        _OPTION: "by the option",
        _BEFORE: "as before",
        _DEFAULT: "the default",
    }
    size = "" if learnt["area_px"] is None else f", about {learnt['area_px']:.0f} px large"
    yield Note(
        text=f"{source}: animals count as {_SAYS[taken]} "
        f"({how[str(learnt['polarity_from'])]}){size}; blobs below {learnt['min_blob_px']:.1f} px "
        f"are none ({how[str(learnt['min_blob_from'])]})."
    )
    if isinstance(film, str) and film != taken:
        light = float(str(learnt["light_share"]))
        yield Note(
            text=f"{source}: --{taken} was given, but the film shows animals that are "
            f"{_SAYS[film]}: {max(light, 1 - light):.0%} of what stands out of the first images. "
            f"Leave --{taken} out, or give --{film}.",
            warning=True,
        )
    if learnt["polarity_from"] == _DEFAULT:
        yield Note(
            text=f"{source}: the first images do not show whether animals are darker or lighter "
            "than the tank. Say it with --dark, --light or --either.",
            warning=True,
        )
    if isinstance(learnt["area_px"], float) and learnt["area_px"] < _SMALL_PX:
        yield Note(
            text=f"{source}: animals are {learnt['area_px']:.0f} px small; below {_SMALL_PX:.0f} "
            "px many are missed, and headings are a guess. Take images of a higher resolution.",
            warning=True,
        )


def remedy(learnt: Mapping[str, JSON]) -> str:
    """Return what to try where few animals were found.

    Parameters
    ----------
    learnt
        From `learnt_by`; empty where nothing was learnt.
    """
    if not learnt:
        return "Look at --contact-sheet; --start leaves out what comes before the fish."
    taken, film = str(learnt["polarity"]), learnt["film_polarity"]
    if isinstance(film, str) and film != taken:
        other = f"Try --{film}"
    else:
        other = f"Try {' or '.join(f'--{each}' for each in POLARITIES if each != taken)}"
    return (
        f"Fish count as {_SAYS[taken]}, and as {learnt['min_blob_px']:.0f} px or larger. {other} "
        "(with --force), or a smaller --min-blob-px, and look at --contact-sheet."
    )
