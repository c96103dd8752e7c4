"""Pictures by which a person judges the tracking: an overlay on each frame, a sheet of the worst.

Nothing is decided here, and no file but the overlay video is written.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import cv2
import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.cameras.camera import Projection
from zfcal.cameras.frames import Frame, Image
from zfcal.errors import StorageError
from zfcal.tracks import GUESS, ROBOT, AgentPose, FramePoses

# Okabe and Ito's colours, which most people can tell apart; blue, green, red.
_FISH_BGR = ((178, 114, 0), (233, 180, 86), (115, 158, 0), (66, 228, 240), (167, 121, 204))
_ROBOT_BGR = (0, 94, 213)
_INK_BGR = (255, 255, 255)
_TRAIL_S = 2.0
_AHEAD_PX = 14
_AHEAD_M = 0.002
_BANNER_PX = 18
_FONT = cv2.FONT_HERSHEY_SIMPLEX

_SHEET_FRAMES = 12
_SHEET_COLUMNS = 4
_TILE_PX = 320
_ROOM_PX = 40
_LEAST_PX = 120
_SURE = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A frame and what was found in it.

    Parameters
    ----------
    frame
        The image.
    poses
        Who is where.
    outlines : sequence of ndarray of int32, shape (point, 2)
        Of the blobs, in pixels.
    bad
        What was wrong, in words.
    """

    frame: Frame
    poses: FramePoses
    outlines: Sequence[NDArray[np.int32]]
    bad: tuple[str, ...]


@final
class Painter:
    """Draws scenes one after the other, with the way that each agent came.

    Parameters
    ----------
    projection
        Of the camera.
    """

    def __init__(self, projection: Projection) -> None:
        self._projection = projection
        self._trails: deque[FramePoses] = deque()

    def follow(self, poses: FramePoses) -> None:
        """Take note of where everybody is, also in a frame that is not drawn."""
        self._trails.append(poses)
        while poses.time_s - self._trails[0].time_s > _TRAIL_S:
            self._trails.popleft()

    def paint(self, scene: Scene, *, close: bool = False) -> Image:
        """Return the frame with outlines, places, headings, ids, trails and a caption.

        Parameters
        ----------
        scene
            The frame.
        close
            Only the square around what is least sure, enlarged.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
        """
        window = self._window(scene) if close else _Window()
        canvas = window.cut(scene.frame.image)
        for outline in scene.outlines:
            points = window.place(outline.reshape(-1, 2).astype(np.float64))
            cv2.polylines(canvas, [_whole(points)], True, _INK_BGR, 1, cv2.LINE_AA)
        self._draw_trails(canvas, window)
        for agent in scene.poses.agents:
            self._draw_agent(canvas, agent, window)
        _draw_caption(canvas, scene)
        return np.asarray(canvas, np.uint8)

    def _window(self, scene: Scene) -> _Window:
        """Return the square around the agent that is least sure, or in which everybody is."""
        height, width = scene.frame.image.shape[:2]
        agents = scene.poses.agents
        unsure = [agent for agent in agents if agent.confidence < _SURE]
        shown = [min(unsure, key=lambda agent: agent.confidence)] if unsure else list(agents)
        places = self._projection.to_pixels(
            np.array([(a.x_m, a.y_m) for a in shown]).reshape(-1, 2)
        )
        places = places[np.isfinite(places).all(axis=1)]
        if not len(places):
            places = np.array([[0.0, 0.0], [width, height]])
        low, high = places.min(axis=0), places.max(axis=0)
        side = int(min(height, width, max((high - low).max() + 2 * _ROOM_PX, _LEAST_PX)))
        left, top = np.clip((low + high - side) / 2, 0, np.array([width, height]) - side)
        return _Window(left=int(left), top=int(top), side=side)

    def _draw_trails(self, canvas: cv2.typing.MatLike, window: _Window) -> None:
        ways: dict[int, list[AgentPose]] = {}
        for poses in self._trails:
            for agent in poses.agents:
                ways.setdefault(agent.agent, []).append(agent)
        for way in ways.values():
            xy_m = np.array([(agent.x_m, agent.y_m) for agent in way])
            points = _whole(window.place(self._projection.to_pixels(xy_m)))
            cv2.polylines(canvas, [points], False, colour_of(way[-1]), 1, cv2.LINE_AA)

    def _draw_agent(self, canvas: cv2.typing.MatLike, agent: AgentPose, window: _Window) -> None:
        colour = colour_of(agent)
        turn = agent.heading_rad if math.isfinite(agent.heading_rad) else 0.0
        ahead = (agent.x_m + _AHEAD_M * math.cos(turn), agent.y_m + _AHEAD_M * math.sin(turn))
        pixels = self._projection.to_pixels(np.array([(agent.x_m, agent.y_m), ahead]))
        if not np.isfinite(pixels).all():
            return
        places = window.place(pixels)
        way = (places[1] - places[0]) / max(float(np.hypot(*(places[1] - places[0]))), 1e-9)
        here = [round(value) for value in places[0].tolist()]
        there = [round(value) for value in (places[0] + _AHEAD_PX * way).tolist()]
        if math.isfinite(agent.heading_rad):
            cv2.line(canvas, here, there, colour, 1, cv2.LINE_AA)
        # A guess is a ring, what is known a disc.
        radius, filled = (6, 1) if agent.confidence < GUESS else (2, -1)
        cv2.circle(canvas, here, radius, colour, filled, cv2.LINE_AA)
        name = f"R{agent.agent}" if agent.kind == ROBOT else str(agent.agent)
        place = (here[0] + 6, here[1] - 6)
        cv2.putText(canvas, name, place, _FONT, 0.4, (0, 0, 0), 3, cv2.LINE_AA)
        cv2.putText(canvas, name, place, _FONT, 0.4, colour, 1, cv2.LINE_AA)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Window:
    """The part of an image that is shown; all of it where it has no side."""

    left: int = 0
    top: int = 0
    side: int = 0

    def place(self, points_px: Floats) -> Floats:
        """Return where pixels of the image lie in what is shown."""
        if not self.side:
            return points_px
        return (points_px + 0.5 - (self.left, self.top)) * (_TILE_PX / self.side) - 0.5

    def cut(self, image: Image) -> cv2.typing.MatLike:
        """Return what is shown, in colour, to be drawn on."""
        if self.side:
            part = image[self.top : self.top + self.side, self.left : self.left + self.side]
            image = np.asarray(cv2.resize(part, (_TILE_PX, _TILE_PX)), np.uint8)
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()


def _whole(points_px: Floats) -> NDArray[np.int32]:
    known = points_px[np.isfinite(points_px).all(axis=1)]
    return np.rint(known).astype(np.int32).reshape(-1, 1, 2)


def colour_of(agent: AgentPose) -> tuple[int, int, int]:
    """Return the colour of an agent, blue, green, red."""
    return _ROBOT_BGR if agent.kind == ROBOT else _FISH_BGR[agent.agent % len(_FISH_BGR)]


def _draw_caption(canvas: cv2.typing.MatLike, scene: Scene) -> None:
    cv2.rectangle(canvas, (0, 0), (canvas.shape[1], _BANNER_PX), (0, 0, 0), -1)
    text = f"frame {scene.frame.number}  {scene.frame.time_s:.2f} s  {', '.join(scene.bad)}"
    cv2.putText(canvas, text, (4, 13), _FONT, 0.4, _INK_BGR, 1, cv2.LINE_AA)


@final
class OverlayVideo:
    """A video of painted frames, which appears when it is closed.

    Parameters
    ----------
    path
        An ``.mp4``, ``.mkv`` or ``.avi`` file.
    fps
        Its frame rate.
    size_px
        Width and height.

    Raises
    ------
    StorageError
        It cannot be written.
    """

    def __init__(self, path: Path, *, fps: float, size_px: tuple[int, int]) -> None:
        self.path = path
        self._part = path.with_name(f".part-{path.name}")
        path.parent.mkdir(parents=True, exist_ok=True)
        code = cv2.VideoWriter.fourcc(*("mp4v" if path.suffix == ".mp4" else "MJPG"))
        self._writer = cv2.VideoWriter(str(self._part), code, fps, size_px)
        if not self._writer.isOpened():
            raise StorageError(
                f"{path}: cannot be written as a video.",
                hint="Name a file that ends in .mp4, .mkv or .avi, in a folder of yours.",
            )

    def add(self, image: Image) -> None:
        """Add a frame."""
        self._writer.write(image)

    def close(self) -> None:
        """Put the video in its place."""
        self._writer.release()
        self._part.replace(self.path)


@final
class WorstFrames:
    """Keeps the frames with which most is wrong.

    Parameters
    ----------
    number
        How many.
    """

    def __init__(self, number: int = _SHEET_FRAMES) -> None:
        self._number = number
        self._kept: dict[int, tuple[float, float, Image]] = {}

    def wants(self, badness: float, time_s: float) -> bool:
        """Return whether a frame of that badness would be kept: one of each second at most."""
        if int(time_s) in self._kept:
            return badness > self._kept[int(time_s)][0]
        full = len(self._kept) >= self._number
        return badness > 0 and not (
            full and badness <= min(kept[0] for kept in self._kept.values())
        )

    def add(self, badness: float, time_s: float, image: Image) -> None:
        """Keep a frame, painted close, in the place of the least bad one."""
        self._kept[int(time_s)] = (badness, -time_s, image)
        if len(self._kept) > self._number:
            del self._kept[min(self._kept, key=lambda second: self._kept[second][:2])]

    def sheet(self) -> Image | None:
        """Return them side by side, the worst first; None if nothing was wrong."""
        if not self._kept:
            return None
        kept = sorted(self._kept.values(), key=lambda entry: entry[:2], reverse=True)
        worst = [image for *_, image in kept]
        tiles = list(worst)
        while len(tiles) % _SHEET_COLUMNS and len(tiles) > _SHEET_COLUMNS:
            tiles.append(np.zeros_like(tiles[0]))
        rows = [
            np.hstack(tiles[k : k + _SHEET_COLUMNS]) for k in range(0, len(tiles), _SHEET_COLUMNS)
        ]
        return np.asarray(np.vstack(rows), np.uint8)


def badness(poses: FramePoses, bad: Sequence[str], n_agents: int) -> float:
    """Return how bad a frame is: agents missing or too many, guesses, and what else was wrong."""
    guesses = sum(1 - agent.confidence for agent in poses.agents)
    return abs(len(poses.agents) - n_agents) + guesses + 0.5 * len(bad)
