"""Two virtual cameras over and under a virtual tank, and the tracker that looks through them."""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import final

import cv2
import numpy as np

from zfcal.online.film import encoded
from zfcal.online.opening import OpenTrial
from zfcal.tracks import FramePoses, tracks_of
from zfcal.vision.background import background_of
from zfcal.vision.bodies import Bodies
from zfcal.vision.frames import Frame, Image
from zfcal.vision.fusing import Fuser
from zfcal.vision.hindsight import Hindsight
from zfcal.vision.look import USUAL, look_of
from zfcal.vision.region import region_of
from zfcal.vision.render import OverheadPainter
from zfcal.vision.render_below import BelowPainter
from zfcal.vision.rig import below_camera, overhead_camera
from zfcal.vision.robot import LedOptions, RobotFinder
from zfcal.vision.seen import TrackerOptions
from zfcal.vision.swimming import Moment, swimming
from zfcal.vision.tracker import FishTracker

_PAST = 12
"""Frames from which a posture follows: a fish turns within four."""


@final
class Drawn:
    """Draws each frame as both cameras would take it.

    Parameters
    ----------
    opened
        The trial: its arena, frame rate and seed.

    Attributes
    ----------
    nobody
        Both images of the tank without anybody, as JPEG files.
    empty
        The one from above.
    """

    def __init__(self, opened: OpenTrial) -> None:
        trial, arena = opened.trial, opened.arena
        self._fps, self._seed, self._look = trial.fps, trial.seed, look_of(USUAL)
        self._above = OverheadPainter(arena, overhead_camera(arena), self._look, seed=trial.seed)
        self._under = BelowPainter(arena, below_camera(arena), self._look, seed=trial.seed)
        self._past: deque[FramePoses] = deque(maxlen=_PAST)
        self.nobody = (self._encoded(self._above, _nobody()), self._encoded(self._under, _nobody()))
        self.empty = decoded(self.nobody[0])

    def images(self, truth: FramePoses) -> tuple[bytes, bytes]:
        """Return the images of a frame from above and from below, as JPEG files."""
        moment = self.moment(truth)
        return self.above(moment), self.below(moment)

    def moment(self, truth: FramePoses) -> Moment:
        """Return how everybody lies in a frame; frames come in their order."""
        self._past.append(truth)
        swum = swimming(tracks_of(self._past), self._look, fps=self._fps, seed=self._seed)
        return swum.at(len(swum) - 1)

    def above(self, moment: Moment) -> bytes:
        """Return the image from above, as a JPEG file."""
        return self._encoded(self._above, moment)

    def below(self, moment: Moment) -> bytes:
        """Return the image from below, as a JPEG file."""
        return self._encoded(self._under, moment)

    def _encoded(self, painter: OverheadPainter | BelowPainter, moment: Moment) -> bytes:
        return encoded(painter.paint(moment), self._look.jpeg_quality)


def decoded(data: bytes) -> Image:
    """Return an image from its file."""
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), np.uint8)


@final
class VirtualEyes:
    """Draws each frame as both cameras would take it, and tracks what they show.

    Parameters
    ----------
    opened
        The trial: its arena, agents, frame rate and seed.
    """

    def __init__(self, opened: OpenTrial) -> None:
        trial, arena = opened.trial, opened.arena
        above, under = overhead_camera(arena), below_camera(arena)
        self._drawn = Drawn(opened)
        self._tracker = FishTracker(
            TrackerOptions(n_agents=trial.n_agents),
            above,
            background=background_of(self._drawn.empty),
            region=region_of(arena, above),
        )
        mask = (region_of(arena, under) * np.uint8(255)).astype(np.uint8)
        self._finder = RobotFinder(LedOptions(), under, mask=mask)
        # Both cameras have nothing to do with each other, and OpenCV lets others run.
        self._beside = ThreadPoolExecutor(1, "camera-below")
        self._fuser = Fuser(keeps=True, break_s=trial.longest_step_s)
        self._hindsight = Hindsight(trial.longest_step_s)

    @property
    def next_agent(self) -> int:
        """The first id that is free."""
        return self._fuser.next_agent

    def see(self, truth: FramePoses) -> FramePoses:
        """Return what the tracker makes of the images of a frame."""
        moment = self._drawn.moment(truth)
        robot = self._beside.submit(
            lambda: self._finder.step(_frame(truth, self._drawn.below(moment)))
        )
        seen = self._tracker.step(_frame(truth, self._drawn.above(moment)))
        self._hindsight.exchange(self._fuser.named(self._tracker.take_exchanges()), truth.time_s)
        agents = self._fuser.step(seen, robot.result(), truth.time_s)
        self._hindsight.note(truth.frame, truth.time_s, self._fuser.agents)
        return FramePoses(time_s=truth.time_s, frame=truth.frame, agents=agents)

    def revise(self, frames: list[FramePoses]) -> list[FramePoses]:
        """Return frames as they are known by now."""
        return self._hindsight.revise(frames)

    def take_bad(self) -> tuple[str, ...]:
        """Return what was wrong with the last frame."""
        return tuple(bad.reason for bad in self._tracker.take_bad_frames())


def _frame(truth: FramePoses, data: bytes) -> Frame:
    return Frame(number=truth.frame, time_s=truth.time_s, image=decoded(data))


def _nobody() -> Moment:
    none = np.empty(0)
    places = np.empty((0, 2))
    bodies = Bodies(
        xy_m=places, heading_rad=none, length_m=none, bend_rad=none, wave_rad=none, phase_rad=none
    )
    return Moment(
        number=0, time_s=0.0, is_robot=np.empty(0, bool), bodies=bodies, velocity_m_s=places
    )
