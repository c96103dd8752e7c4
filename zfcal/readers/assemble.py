"""From what a file holds to tracks: metres, y up, no missing rows, kinds, and checks.

Every reader ends here, so scale, axes and missing positions are handled once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Bools, Floats, Ints
from zfcal.errors import InputError
from zfcal.readers.options import Idle, ImportOptions, without_confidence
from zfcal.readers.raw import Rows
from zfcal.tracks import FISH, KINDS, ROBOT, Tracks
from zfcal.units import M_PER_CM, M_PER_MM

EXTENT_LIMIT_M = 20.0
"""Positions that span more than this are no tank: the scale is wrong."""

_MIRRORED = (
    "In this format y counts downwards, so the tracks are mirrored: "
    "--flip-y with --origin turns them up."
)

METRES_PER = {"m": 1.0, "cm": M_PER_CM, "mm": M_PER_MM}

UNITS = {"px": "px", "pixel": "px", "pixels": "px"} | {unit: unit for unit in METRES_PER}
UNITS |= {"metre": "m", "metres": "m", "meter": "m", "meters": "m"}
"""Units by the names that files have for them."""

_INT32 = np.iinfo(np.int32)


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """Tracks from a foreign file, and what a person should know of it.

    Parameters
    ----------
    tracks
        In metres, sorted by frame, then agent.
    notes
        A sentence each: columns left out, missing positions, agents renamed.
    warnings
        A sentence each: what was taken without the file being sure of it.
    idle
        Given options that take no effect in this file.
    """

    tracks: Tracks
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    idle: Idle = field(default_factory=dict)


def assemble(path: Path, rows: Rows, options: ImportOptions) -> Imported:
    """Return tracks in metres from the rows of a file.

    Parameters
    ----------
    path
        The file, named in messages.
    rows
        What it holds, in its own unit.
    options
        Scale, axes and agents.

    Raises
    ------
    InputError
        No scale for pixels or one for metres, nothing to see, positions that
        no tank can span, infinite values, an agent twice in a frame, or more
        agents at once than the trial has.
    """
    scale_m = scale_of(path, rows.unit, options)
    kind, kind_notes = _kinds(path, rows, options)
    keep, notes = _present(path, rows, options)
    x_m, y_m, heading_rad = _place(rows, scale_m, options)
    confidence = _confidence(rows)
    tracks = Tracks(
        time_s=rows.time_s[keep],
        frame=rows.frame[keep],
        agent=_narrow(path, rows.agent[keep]),
        kind=kind[keep],
        x_m=x_m[keep],
        y_m=y_m[keep],
        heading_rad=heading_rad[keep].astype(np.float32),
        confidence=confidence[keep].astype(np.float32),
    )
    tracks = tracks.take(np.lexsort((tracks.agent, tracks.frame)))
    _check_extent(path, tracks, rows.unit, scale_m)
    _check_once(path, tracks)
    _check_counts(path, tracks, options)
    return Imported(
        tracks=tracks,
        notes=(*rows.notes, *kind_notes, *notes, *_axes(rows, options)),
        idle={**rows.idle, **_idle(path, rows, options)},
    )


def scale_of(path: Path, unit: str, options: ImportOptions) -> float:
    """Return metres per unit of the file.

    Raises
    ------
    InputError
        No scale for pixels, or one for a unit of length.
    """
    if unit == "px":
        if options.m_per_px is None:
            raise InputError(
                f"{path}: positions are in pixels, expected a scale, got none.",
                hint="Give millimetres per pixel, such as --mm-per-px 0.98; "
                "measure a known length in the image.",
            )
        return options.m_per_px
    if options.m_per_px is not None:
        raise InputError(
            f"{path}: positions are in {unit}, and a scale of {options.m_per_px / M_PER_MM:.6g} mm "
            "per pixel cannot take effect.",
            hint="Leave --mm-per-px out, or import the columns that are in pixels.",
        )
    return METRES_PER[unit]


def _kinds(
    path: Path, rows: Rows, options: ImportOptions
) -> tuple[NDArray[np.int8], tuple[str, ...]]:
    """Return the kind of each row: the file's own, and robots that a person names."""
    kind = np.full(len(rows.frame), FISH, dtype=np.int8)
    if rows.kind is not None:
        kind = rows.kind.astype(np.int8)
    known = {int(agent) for agent in np.unique(rows.agent)}
    by_name = {rows.names[agent]: agent for agent in known if agent in rows.names}
    by_name |= {str(agent): agent for agent in known if str(agent) not in by_name}
    unknown = [name for name in options.robots if name not in by_name]
    if unknown:
        raise InputError(
            f"{path}: no agent is called {unknown[0]!r}, expected one of "
            f"{', '.join(sorted(rows.names.get(agent, str(agent)) for agent in known)[:20])}."
        )
    _check_one_each(path, known, rows, options)
    robots = [by_name[name] for name in options.robots]
    kind[np.isin(rows.agent, robots)] = ROBOT
    renamed = {agent: name for agent, name in rows.names.items() if name != str(agent)}
    listed = ", ".join(f"{name} = {agent}" for agent, name in sorted(renamed.items())[:20])
    return kind, (f"Agents are numbered: {listed}.",) if renamed else ()


def _check_one_each(path: Path, known: Iterable[int], rows: Rows, options: ImportOptions) -> None:
    """Refuse a name of a robot that several agents have."""
    named = Counter(rows.names[agent] for agent in known if agent in rows.names)
    for name in options.robots:
        if named[name] > 1:
            raise InputError(
                f"{path}: {named[name]} agents are called {name!r}, expected the name of one "
                "robot.",
                hint="Give each its own name in the program that made the file.",
            )


def _present(path: Path, rows: Rows, options: ImportOptions) -> tuple[Bools, tuple[str, ...]]:
    """Return which rows hold a position that is to be kept."""
    infinite = np.isinf(rows.x) | np.isinf(rows.y)
    if infinite.any():
        row = int(np.argmax(infinite))
        raise InputError(
            f"{path}: agent {rows.agent[row]} in frame {rows.frame[row]}: expected a finite "
            f"position, got ({rows.x[row]}, {rows.y[row]}).",
            hint="A missing position is NaN or empty.",
        )
    seen = ~(np.isnan(rows.x) | np.isnan(rows.y))
    # Written so that a confidence of NaN, which is certain, stays.
    unsure = seen & (_confidence(rows) < options.min_confidence)
    notes = []
    if not seen.all():
        notes.append(f"{int((~seen).sum())} of {len(seen)} positions are missing.")
    if unsure.any():
        notes.append(
            f"{int(unsure.sum())} of {len(seen)} positions have a confidence below "
            f"{options.min_confidence:g} and are taken as missing."
        )
    keep: Bools = seen & ~unsure
    if not keep.any():
        raise InputError(
            f"{path}: expected positions, got none: all {len(seen)} are missing"
            + (" or not trusted." if unsure.any() else "."),
        )
    return keep, tuple(notes)


def _confidence(rows: Rows) -> Floats:
    if rows.confidence is None:
        return np.ones(len(rows.frame))
    return np.where(np.isnan(rows.confidence), 1.0, rows.confidence)


def _idle(path: Path, rows: Rows, options: ImportOptions) -> Idle:
    if rows.confidence is not None and not np.isnan(rows.confidence).all():
        return {}
    return without_confidence(path, options)


def _place(rows: Rows, scale_m: float, options: ImportOptions) -> tuple[Floats, Floats, Floats]:
    """Return positions in metres and headings counter-clockwise, y up if that is asked for."""
    x0, y0 = options.origin or (0.0, 0.0)
    up = -1.0 if options.flip_y else 1.0
    heading_rad = np.full(len(rows.frame), np.nan)
    if rows.heading_rad is not None:
        # A mirror reverses the sense of angles.
        heading_rad = (up * rows.heading_rad + np.pi) % (2 * np.pi) - np.pi
    return (rows.x - x0) * scale_m, up * (rows.y - y0) * scale_m, heading_rad


def _axes(rows: Rows, options: ImportOptions) -> tuple[str, ...]:
    if rows.y_down and not options.flip_y:
        return (_MIRRORED,)
    return ()


def _narrow(path: Path, agent: Ints) -> NDArray[np.int32]:
    if agent.size and not (agent.min() >= 0 and agent.max() <= _INT32.max):
        raise InputError(
            f"{path}: agent numbers must be 0 to {_INT32.max}, got {int(agent.min())} to "
            f"{int(agent.max())}.",
            hint="Number the agents from 0, or give them names.",
        )
    return agent.astype(np.int32)


def _check_extent(path: Path, tracks: Tracks, unit: str, scale_m: float) -> None:
    extent_m = max(float(np.ptp(tracks.x_m)), float(np.ptp(tracks.y_m)))
    if not extent_m <= EXTENT_LIMIT_M:
        raise InputError(
            f"{path}: positions span {extent_m:.4g} m (at {scale_m:.6g} m per {unit}), "
            f"expected a tank of at most {EXTENT_LIMIT_M:g} m.",
            hint="Check the scale: --mm-per-px is in millimetres per pixel.",
        )


def _check_once(path: Path, tracks: Tracks) -> None:
    twice = (np.diff(tracks.frame) == 0) & (np.diff(tracks.agent) == 0)
    if twice.any():
        row = int(np.argmax(twice))
        raise InputError(
            f"{path}: agent {tracks.agent[row]} is twice in frame {tracks.frame[row]}, at "
            f"({tracks.x_m[row]:.4g}, {tracks.y_m[row]:.4g}) m and "
            f"({tracks.x_m[row + 1]:.4g}, {tracks.y_m[row + 1]:.4g}) m; expected once.",
            hint="Each agent needs its own number; --fps must be the rate of the file.",
        )


def _check_counts(path: Path, tracks: Tracks, options: ImportOptions) -> None:
    """Refuse more agents at once than the trial has; fewer may be hidden or lost."""
    for kind, limit in ((FISH, options.n_fish), (ROBOT, options.n_robots)):
        frames, counts = np.unique(tracks.frame[tracks.kind == kind], return_counts=True)
        if limit is None or not counts.size or counts.max() <= limit:
            continue
        at = int(np.argmax(counts > limit))
        # One word for one fish and for many.
        many = "" if kind == FISH else "s"
        raise InputError(
            f"{path}: frame {frames[at]} has {counts[at]} {KINDS[kind]}{many} at once, "
            f"expected at most {limit}.",
            hint="Set n_fish and n_robots in trial.toml, and name the robots with --robots.",
        )
