"""The pictures of a run: an overlay video and a sheet of the worst frames, if they are wanted."""

from __future__ import annotations

from typing import final

import cv2

from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.stages.camera.rig import Feed
from zfcal.stages.events import Note, Tell
from zfcal.stages.track.plan import Plan
from zfcal.tracking.overlay import OverlayVideo, Painter, Scene, WorstFrames, badness

_SHOWS_NOTHING = {"black", "no background", "size"}
"""A sheet of black frames would help nobody."""


@final
class Drawing:
    """Paints what was asked for, and nothing where nothing was.

    Parameters
    ----------
    plan
        What is asked for.
    feed
        The camera overhead.
    """

    def __init__(self, plan: Plan, feed: Feed) -> None:
        wanted, self._n_agents = plan.options.pictures, plan.opened.trial.n_agents
        fps = plan.opened.trial.fps
        self._sheet_path = wanted.contact_sheet
        self._painter = Painter(feed.projection)
        self._worst = WorstFrames()
        self._video = (
            OverlayVideo(wanted.overlay, fps=fps, size_px=feed.size_px) if wanted.overlay else None
        )

    def add(self, scene: Scene) -> None:
        """Take the next frame."""
        if self._video is None and self._sheet_path is None:
            return
        self._painter.follow(scene.poses)
        bad = badness(scene.poses, scene.bad, self._n_agents)
        for_sheet = (
            self._sheet_path is not None
            and not _SHOWS_NOTHING & set(scene.bad)
            and self._worst.wants(bad, scene.frame.time_s)
        )
        if self._video is not None:
            self._video.add(self._painter.paint(scene))
        if for_sheet:
            image = self._painter.paint(scene, close=True)
            self._worst.add(bad, scene.frame.time_s, image)

    def finish(self, tell: Tell) -> None:
        """Put the pictures in their places."""
        if self._video is not None:
            self._video.close()
            tell(Note(text=f"{self._video.path}: overlay drawn."))
        sheet = self._worst.sheet()
        if self._sheet_path is None:
            return
        if sheet is None:
            tell(Note(text=f"{self._sheet_path}: not drawn, since no frame shows a tank."))
            return
        _, data = cv2.imencode(".png", sheet)
        write_bytes_whole(self._sheet_path, data.tobytes())
        tell(Note(text=f"{self._sheet_path}: the worst frames drawn."))
