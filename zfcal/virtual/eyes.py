"""Two virtual cameras over and under a virtual tank, and the tracker that looks through them."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import final

import cv2
import numpy as np

from zfcal.cameras.frames import Frame, Image
from zfcal.cameras.rig import below_camera, overhead_camera
from zfcal.online.worker import Worker
from zfcal.stages.events import Tell, say_nothing
from zfcal.stages.trial_context import OpenTrial, open_trial
from zfcal.tracking.background import background_of
from zfcal.tracking.fusing import Fuser
from zfcal.tracking.identity_revision import IdentityRevision
from zfcal.tracking.region import region_of
from zfcal.tracking.robot import LedOptions, RobotFinder, RobotSeen
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker
from zfcal.tracks import FramePoses, tracks_of
from zfcal.virtual.film import encoded
from zfcal.virtual.images._painting import prepare
from zfcal.virtual.images.bodies import Bodies
from zfcal.virtual.images.look import USUAL, look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.render_below import BelowPainter
from zfcal.virtual.images.swimming import Moment, swimming

_PAST = 12
"""Frames from which a posture follows: a fish turns within four."""


@final
class _Postures:
    """How everybody lies in each frame.

    Parameters
    ----------
    opened
        The trial: its frame rate and seed.
    """

    def __init__(self, opened: OpenTrial) -> None:
        self._fps, self._seed, self._look = opened.trial.fps, opened.trial.seed, look_of(USUAL)
        self._past: deque[FramePoses] = deque(maxlen=_PAST)

    def moment(self, truth: FramePoses) -> Moment:
        """Return how everybody lies in a frame; frames come in their order."""
        self._past.append(truth)
        swum = swimming(tracks_of(self._past), self._look, fps=self._fps, seed=self._seed)
        return swum.at(len(swum) - 1)


def _above_of(opened: OpenTrial) -> OverheadPainter:
    """Return what draws for the camera over the tank of a trial."""
    arena, seed = opened.arena, opened.trial.seed
    return OverheadPainter(arena, overhead_camera(arena), look_of(USUAL), seed=seed)


def _below_of(opened: OpenTrial) -> BelowPainter:
    """Return what draws for the camera under the tank of a trial."""
    arena, seed = opened.arena, opened.trial.seed
    return BelowPainter(arena, below_camera(arena), look_of(USUAL), seed=seed)


def _photo_of(painter: OverheadPainter | BelowPainter, moment: Moment) -> bytes:
    """Return a moment as a camera would take it, as a JPEG file."""
    return encoded(painter.paint(moment), look_of(USUAL).jpeg_quality)


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
        # In real time no frame has to wait for a compiler.
        prepare()
        self._postures = _Postures(opened)
        self._above, self._under = _above_of(opened), _below_of(opened)
        self.nobody = (_photo_of(self._above, _nobody()), _photo_of(self._under, _nobody()))
        self.empty = _decoded(self.nobody[0])

    def images(self, truth: FramePoses) -> tuple[bytes, bytes]:
        """Return the images of a frame from above and from below, as JPEG files."""
        moment = self._postures.moment(truth)
        return _photo_of(self._above, moment), _photo_of(self._under, moment)


def _decoded(data: bytes) -> Image:
    """Return an image from its file."""
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), np.uint8)


@final
class _EyeBelow:
    """Draws each frame as the camera below would take it, and finds the robot in it.

    It is the job of a `Worker`: both cameras have nothing to do with each other.

    Parameters
    ----------
    root
        The trial's directory.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._ready: tuple[BelowPainter, RobotFinder] | None = None

    def __call__(self, moment: Moment | None, tell: Tell) -> RobotSeen | None:  # noqa: ARG002 - the signature of jobs
        """Return the robot in a moment, frames in their order; None: get ready for the first."""
        painter, finder = self._ready = self._ready or self._prepared()
        if moment is None:
            return None
        image = _decoded(_photo_of(painter, moment))
        return finder.step(Frame(number=moment.number, time_s=moment.time_s, image=image))

    def _prepared(self) -> tuple[BelowPainter, RobotFinder]:
        opened = open_trial(self._root)
        under = below_camera(opened.arena)
        mask = (region_of(opened.arena, under) * np.uint8(255)).astype(np.uint8)
        return _below_of(opened), RobotFinder(LedOptions(), under, mask=mask)


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
        self._beside = Worker("camera-below", _EyeBelow(trial.root))
        self._beside.order(None)
        above = overhead_camera(arena)
        self._postures, self._above = _Postures(opened), _above_of(opened)
        self._tracker = FishTracker(
            TrackerOptions(n_agents=trial.n_agents),
            above,
            background=background_of(_decoded(_photo_of(self._above, _nobody()))),
            region=region_of(arena, above),
        )
        self._fuser = Fuser(keeps=True, break_s=trial.longest_step_s)
        self._revision = IdentityRevision(trial.longest_step_s)
        self._beside.answer(say_nothing)

    @property
    def next_agent(self) -> int:
        """The first id that is free."""
        return self._fuser.next_agent

    def see(self, truth: FramePoses) -> FramePoses:
        """Return what the tracker makes of the images of a frame."""
        moment = self._postures.moment(truth)
        self._beside.order(moment)
        image = _decoded(_photo_of(self._above, moment))
        seen = self._tracker.step(Frame(number=truth.frame, time_s=truth.time_s, image=image))
        self._revision.exchange(self._fuser.named(self._tracker.take_exchanges()), truth.time_s)
        robot: RobotSeen = self._beside.answer(say_nothing)
        agents = self._fuser.step(seen, robot, truth.time_s)
        self._revision.note(truth.frame, truth.time_s, self._fuser.agents)
        return FramePoses(time_s=truth.time_s, frame=truth.frame, agents=agents)

    def revise(self, frames: list[FramePoses]) -> list[FramePoses]:
        """Return frames as they are known by now."""
        return self._revision.revise(frames)

    def take_bad(self) -> tuple[str, ...]:
        """Return what was wrong with the last frame."""
        return tuple(bad.reason for bad in self._tracker.take_bad_frames())

    def close(self) -> None:
        """End the process of the camera below."""
        self._beside.stop()


def _nobody() -> Moment:
    none = np.empty(0)
    places = np.empty((0, 2))
    bodies = Bodies(
        xy_m=places, heading_rad=none, length_m=none, bend_rad=none, wave_rad=none, phase_rad=none
    )
    return Moment(
        number=0, time_s=0.0, is_robot=np.empty(0, bool), bodies=bodies, velocity_m_s=places
    )
