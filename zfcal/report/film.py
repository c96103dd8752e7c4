"""A film of fish and model side by side: the last window as it was, and as the model has it."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.behaviour.located import Located
from zfcal.errors import StorageError
from zfcal.report.figures import theme
from zfcal.tracks import ROBOT

Frame = NDArray[np.uint8]

TIMES = 5
"""How many times as fast as in the tank."""

_PANEL_PX = 480
_HEAD_PX = 44
_MARGIN = 0.05
_TAIL = 6
"""Samples of the way that stays to be seen behind an animal."""

_GIF_EVERY = 2
"""A GIF shows every other sample: it would be large, and viewers slow down quick ones."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """What one half of the film shows.

    Parameters
    ----------
    title
        In letters of ASCII.
    colour
        Of fish, as ``#rrggbb``.
    located
        Where all agents are.
    """

    title: str
    colour: str
    located: Located


def film_of(sides: tuple[Side, Side], kind: str) -> bytes:
    """Return a film of two halves.

    Parameters
    ----------
    sides
        In one arena, with one step; each begins at its own first sample.
    kind
        ``mp4`` or ``gif``.

    Raises
    ------
    StorageError
        The film cannot be written.
    """
    step_s = sides[0].located.dt_s
    frames = list(frames_of(sides))
    return _gif(frames[::_GIF_EVERY], step_s) if kind == "gif" else _mp4(frames, step_s)


def frames_of(sides: tuple[Side, Side]) -> Iterator[Frame]:
    """Yield the frames, a sample each, shape (height, width, 3), blue first."""
    first = [int(side.located.k[0]) for side in sides]
    last = [int(side.located.k[-1]) for side in sides]
    grounds = [_ground(side) for side in sides]
    for step in range(min(b - a for a, b in zip(first, last, strict=True)) + 1):
        yield np.hstack(
            [
                _drawn(ground, side, k + step)
                for ground, side, k in zip(grounds, sides, first, strict=True)
            ]
        )


def _ground(side: Side) -> Frame:
    """Return the empty tank below its title."""
    arena = side.located.arena
    _, y0, _, y1 = arena.outline.bounds
    height = _HEAD_PX + round((y1 - y0 + 2 * _margin_m(arena)) / _m_per_px(arena))
    # Encoders want even sides.
    frame = np.full((height + height % 2, _PANEL_PX, 3), 255, dtype=np.uint8)
    rings = [arena.outline.exterior, *arena.outline.interiors]
    for ring in rings:
        corners = _pixels(arena, np.asarray(ring.coords)[:, :2])
        cv2.polylines(frame, [corners], True, _bgr(theme.INK), 2, cv2.LINE_AA)
    _write(frame, side.title, 20)
    return frame


def _drawn(ground: Frame, side: Side, k: int) -> Frame:
    frame, located = ground.copy(), side.located
    begin, end = np.searchsorted(located.k, [k - _TAIL, k + 1])
    recent = located.take(slice(int(begin), int(end)))
    for agent in np.unique(recent.agent):
        own = recent.take(recent.agent == agent)
        colour = _bgr(theme.ROBOT if own.kind[0] == ROBOT else side.colour)
        way = _pixels(located.arena, own.xy_m)
        cv2.polylines(frame, [way], False, colour, 1, cv2.LINE_AA)
        if own.k[-1] == k:
            # A robot is a square: no colour is the only mark.
            x, y = (int(each) for each in way[-1])
            if own.kind[0] == ROBOT:
                cv2.rectangle(frame, (x - 5, y - 5), (x + 5, y + 5), colour, -1)
            else:
                cv2.circle(frame, (x, y), 5, colour, -1, cv2.LINE_AA)
    _write(frame, f"{k * located.dt_s:.1f} s, {TIMES} times as fast", 38)
    return frame


def _write(frame: Frame, text: str, y: int) -> None:
    cv2.putText(
        frame, text, (10, y), cv2.FONT_HERSHEY_SIMPLEX, 0.5, _bgr(theme.INK), 1, cv2.LINE_AA
    )


def _margin_m(arena: Arena) -> float:
    return _MARGIN * arena.extent_m


def _m_per_px(arena: Arena) -> float:
    return (1 + 2 * _MARGIN) * arena.extent_m / _PANEL_PX


def _pixels(arena: Arena, xy_m: Floats) -> NDArray[np.int32]:
    """Return points of the tank in the frame, y down, shape (point, 2)."""
    x0, _, _, y1 = arena.outline.bounds
    margin_m, m_per_px = _margin_m(arena), _m_per_px(arena)
    x = (xy_m[:, 0] - x0 + margin_m) / m_per_px
    y = (y1 - xy_m[:, 1] + margin_m) / m_per_px + _HEAD_PX
    return np.round(np.column_stack([x, y])).astype(np.int32)


def _bgr(colour: str) -> tuple[int, int, int]:
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return blue, green, red


def _mp4(frames: list[Frame], step_s: float) -> bytes:
    height, width = frames[0].shape[:2]
    codec = cv2.VideoWriter.fourcc(*"mp4v")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        writer = cv2.VideoWriter(str(path), codec, TIMES / step_s, (width, height))
        for frame in frames:
            writer.write(frame)
        writer.release()
        if not path.is_file() or not path.stat().st_size:
            raise StorageError(
                "The film cannot be written: this OpenCV has no encoder for mp4.",
                hint="Take the other kind: --film gif.",
            )
        return path.read_bytes()


def _gif(frames: list[Frame], step_s: float) -> bytes:
    pictures: list[Any] = [
        Image.fromarray(frame[..., ::-1]).quantize(32, dither=Image.Dither.NONE) for frame in frames
    ]
    made = BytesIO()
    pictures[0].save(
        made,
        format="GIF",
        save_all=True,
        append_images=pictures[1:],
        duration=round(1000 * step_s * _GIF_EVERY / TIMES),
        loop=0,
    )
    return made.getvalue()
