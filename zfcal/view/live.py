"""Where everybody is now, and what befalls the robot: what grows frame by frame, followed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, final

from zfcal.artifacts.drive_files import drive_files
from zfcal.artifacts.pose_files import PoseFollower
from zfcal.artifacts.reading.contents import looks_of
from zfcal.artifacts.reading.parsing import json_of
from zfcal.artifacts.tailing import Tail
from zfcal.errors import ZfcalError
from zfcal.tracks import GUESS, KINDS, AgentPose, FramePoses

_MOST_FAULTS = 50
_DIGITS = 4


@final
class Live:
    """Follows the poses of a trial.

    Parameters
    ----------
    root
        The trial's directory.
    """

    def __init__(self, root: Path) -> None:
        self._poses = PoseFollower(root, newest=True)
        self._drive = DriveLog(root)

    def poll(self) -> dict[str, Any] | None:
        """Return the newest frame since the last question; None where there is none.

        Returns
        -------
        dict or None
            ``time_s``; ``agents``, rows of id, kind, metres, metres, radians (or null) and
            whether the position is a guess; ``target``, metres and metres, or null.
        """
        frames: list[FramePoses] = []
        try:
            frames = self._poses.poll()
        except ZfcalError:
            # Whoever drives or tracks says what is wrong; here the good ones are shown.
            self._poses.take_problems()
        self._drive.poll()
        if not frames:
            return None
        newest = frames[-1]
        return {
            "time_s": round(newest.time_s, 3),
            "agents": [_row(agent) for agent in newest.agents],
            "target": self._drive.target_at(newest.time_s),
        }

    @property
    def faults(self) -> list[dict[str, Any]]:
        """What befell the robot, the newest last: ``time_s``, ``fault``, ``says``, ``ended``."""
        return self._drive.faults


@final
class DriveLog:
    """Follows targets and faults in the log of a driver, from its first minute on.

    Parameters
    ----------
    root
        The trial's directory.
    """

    _STALE_S = 2.0

    def __init__(self, root: Path) -> None:
        self._root = root
        self._tail: Tail | None = None
        self._inode: tuple[int, ...] = ()
        self._start_s = -1
        self._target: tuple[float, float, float] | None = None
        self.faults: list[dict[str, Any]] = []

    def poll(self) -> None:
        """Read what was added; of earlier minutes one at a time, since those of now wait."""
        self._read()
        if self._go_on():
            self._read()

    def target_at(self, time_s: float) -> list[float] | None:
        """Return the target, unless it is an old one."""
        if self._target is None or abs(time_s - self._target[0]) > self._STALE_S:
            return None
        return list(self._target[1:])

    def _later(self) -> dict[int, Path]:
        try:
            files = drive_files(self._root)
        except ZfcalError:
            return {}
        return {start: path for start, path in files.items() if start > self._start_s}

    def _go_on(self) -> bool:
        later = self._later()
        if not later:
            return False
        self._start_s = min(later)
        self._tail = Tail(later[self._start_s], "/targets", "/faults")
        self._inode = _inode(self._tail.path)
        return True

    def _read(self) -> None:
        if self._tail is None:
            return
        if _inode(self._tail.path) != self._inode:
            # A driver that was killed goes on in a new file with all that the old one held.
            self._tail = Tail(self._tail.path, "/targets", "/faults")
            self._inode = _inode(self._tail.path)
            self.faults = [each for each in self.faults if each["time_s"] < self._start_s]
        try:
            for _, data in self._tail.messages():
                self._take(data)
        except ZfcalError:
            return

    def _take(self, data: bytes) -> None:
        try:
            said = json_of(data)
            time_s = float(said["time_s"])
            if said["what"] == "target":
                x_m, y_m = (round(float(said[key]), _DIGITS) for key in ("x_m", "y_m"))
                self._target = (time_s, x_m, y_m)
            elif said["what"] == "fault":
                words = {key: str(said[key]) for key in ("fault", "says")}
                fault = {"time_s": time_s, **words, "ended": said.get("ended") is True}
                self.faults = [*self.faults, fault][-_MOST_FAULTS:]
        except (ValueError, KeyError, TypeError):
            return


def _inode(path: Path) -> tuple[int, ...]:
    looks = looks_of(path)
    return () if looks is None else looks[:2]


def _row(agent: AgentPose) -> list[Any]:
    heading = round(agent.heading_rad, 3) if math.isfinite(agent.heading_rad) else None
    place = (round(agent.x_m, _DIGITS), round(agent.y_m, _DIGITS))
    return [agent.agent, KINDS[agent.kind], *place, heading, agent.confidence < GUESS]
