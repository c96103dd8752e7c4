"""The driver's loop: it waits for frames and for ticks, and knows when nothing more comes."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from typing import final

from zfcal.artifacts.drive_files import drive_files
from zfcal.artifacts.pose_files import PoseFollower
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.ending import can_no_tracker_come, is_recorded
from zfcal.drive.events import DriveTell
from zfcal.drive.options import DriveOptions
from zfcal.drive.plan import no_poses_hint
from zfcal.errors import DamagedError, InputError
from zfcal.robot.plausible import is_frame
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.events import LeftOut, Note
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import FramePoses
from zfcal.units import SEGMENT_S

_LOOK_S = 0.003
_FOLDER_S = 0.02
"""How often the folder is searched for the next minute; a file that grows is seen at once."""

_STATUS_S = 0.5
_ANSWER_S = 2.0
_WAIT_S = 3.0
"""Until it is said that no poses have come; a tracker that is started by the same hand is there."""

_END_S = 2.0
"""On the poses' clock: when so long after the last file's end none follows, that was it."""

_CUT_S = 60.0
"""The same for a last file that was cut short, or whose writer is busy compiling."""

_OVER_S = 10.0
"""After so long without any poses the trial is looked at: can they come at all?"""


@final
class Loop:
    """Waits for frames and for ticks, whichever comes first."""

    def __init__(  # noqa: PLR0913, PLR0917 - everything that a run consists of
        self,
        opened: OpenTrial,
        options: DriveOptions,
        driver: Driver,
        crew: Crew,
        follower: PoseFollower,
        virtual: VirtualProcess | None,
        tell: DriveTell,
    ) -> None:
        self._opened, self._options = opened, options
        self._driver, self._crew = driver, crew
        self._follower, self._virtual = follower, virtual
        # A wait by the monotonic clock, as all that is timed here.
        self._nothing = threading.Event()
        self._size = (-1, -1)
        self._searched_s = 0.0
        self._looked_s = self._before_s = time.monotonic()
        self._first_s: float | None = None
        self._tell, self._told_s = tell, 0.0
        self._quiet_since_s = time.monotonic()
        self._asked_s = time.monotonic()
        self._is_waited_for = False
        self._is_unsound = False
        self._n_batches = 0
        self._is_looked_at = False

    def run(self) -> str:
        """Go on until it is over, and return why it is."""
        for batch in self._batches():
            self._driver.listen()
            self._greet()
            self._wait()
            if batch and self._first_s is None:
                self._check_logs(batch[-1].time_s)
            # On the poses' clock each frame has its own ticks; a live one has the newest frame's.
            for frames in [batch] if self._crew.clock.is_live else [[f] for f in batch]:
                age_s = self._age_s() if frames else None
                since_s = self._before_s if self._crew.clock.is_live else None
                self._driver.take(frames, age_s=age_s, since_s=since_s)
                self._driver.tick()
                self._crew.log.flush()
                self._step_virtual()
                if frames and self._is_over(frames[-1].time_s):
                    self._tell_cuts(is_over=False)
                    return "the duration is over"
            self._show()
        self._tell_cuts(is_over=True)
        return "the poses have ended"

    def _tell_cuts(self, *, is_over: bool) -> None:
        """Say which files of poses were cut short."""
        for path, problem in self._follower.cuts(is_over=is_over).items():
            self._crew.tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))

    def _show(self) -> None:
        """Tell how it goes, now and then."""
        if time.monotonic() - self._told_s >= _STATUS_S:
            self._tell(self._driver.status(self._options.duration_s))
            self._told_s = time.monotonic()

    def _batches(self) -> Iterator[list[FramePoses]]:
        """Yield what has come, again and again; often nothing."""
        while True:
            frames = self._poll()
            if frames:
                self._quiet_since_s = time.monotonic()
                self._n_batches += 1
            elif self._is_finished():
                return
            yield frames
            if not frames:
                self._nothing.wait(min(_LOOK_S, self._crew.clock.rest_s()))

    def _poll(self) -> list[FramePoses]:
        """Read on where the file has grown; the folder is searched now and then."""
        now_s = time.monotonic()
        self._before_s, self._looked_s = self._looked_s, now_s
        size = self._stat()
        if size == self._size and now_s - self._searched_s < _FOLDER_S:
            return []
        self._size, self._searched_s = size, now_s
        frames: list[FramePoses] = []
        problems: list[DamagedError] = []
        try:
            frames = self._sound(self._follower.poll())
        except DamagedError as error:
            problems.append(error)
        path = self._follower.path or self._opened.trial.root / "poses"
        for problem in problems + self._follower.take_problems():
            self._crew.tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))
        return frames

    def _sound(self, frames: list[FramePoses]) -> list[FramePoses]:
        """Return the frames that can be of a trial; of the others the first is told."""
        fps = self._opened.trial.fps
        found = [poses for poses in frames if is_frame(poses.time_s, poses.frame, fps)]
        if len(found) < len(frames) and not self._is_unsound:
            self._is_unsound = True
            path = self._follower.path or self._opened.trial.root / "poses"
            bad = next(p for p in frames if not is_frame(p.time_s, p.frame, fps))
            problem = (
                f"{path}: frame {bad.frame} is said to be of {bad.time_s} s, at {fps:g} frames/s."
            )
            hint = "Frames and seconds count from the start of the trial; such are left out."
            self._crew.tell(LeftOut(path=path, problem=problem, hint=hint))
        return found

    def _stat(self) -> tuple[int, int]:
        try:
            found = None if self._follower.path is None else self._follower.path.stat()
        except OSError:
            found = None
        return (-1, -1) if found is None else (found.st_ino, found.st_size)

    def _age_s(self) -> float | None:
        """Return how long ago the file of poses was written, by the same clock; None if unknown."""
        if not self._crew.clock.is_live or self._follower.path is None:
            return None
        with contextlib.suppress(OSError):
            age_s = time.time() - self._follower.path.stat().st_mtime
            # A clock that was set, or another computer's, says nothing.
            return max(0.0, age_s) if -0.1 < age_s < 5.0 else None
        return None

    def _step_virtual(self) -> None:
        if self._virtual is not None and not self._crew.clock.is_live:
            to_s = self._crew.clock.now_s()
            self._virtual.control.ask("advance", to_s=to_s, received=self._crew.robot.n_sent)

    def _is_over(self, time_s: float) -> bool:
        duration_s = self._options.duration_s
        self._first_s = time_s if self._first_s is None else self._first_s
        if duration_s is None:
            return False
        return time_s - self._first_s >= duration_s - 1e-6

    def _check_logs(self, now_s: float) -> None:
        """Refuse to write before what an earlier drive has written."""
        later = [s for s in drive_files(self._opened.trial.root) if s > now_s + SEGMENT_S]
        if later:
            raise InputError(
                f"{self._opened.trial.path('drive', max(later), '.mcap')}: an earlier drive got "
                f"to {max(later)} s, the poses are at {now_s:.0f} s.",
                hint="Remove what it left with --force, or drive another trial.",
            )

    def _is_finished(self) -> bool:
        """Return whether no poses come any more; a live drive that had some waits for ever.

        Raises
        ------
        InputError
            None ever came, and none can.
        """
        is_live = self._crew.clock.is_live
        if self._n_batches and is_live:
            return False
        quiet_s = time.monotonic() - self._quiet_since_s
        if self._n_batches:
            return quiet_s > (_END_S if self._follower.is_closed else _CUT_S)
        self._check_ending(quiet_s)
        # On the poses' clock a file that never comes is waited for no longer than the next.
        return not is_live and quiet_s > _CUT_S

    def _check_ending(self, quiet_s: float) -> None:
        """Look once whether poses can come: what it reads may take longer than a tick.

        Raises
        ------
        InputError
            They cannot.
        """
        if self._is_looked_at or quiet_s < _OVER_S:
            return
        self._is_looked_at = True
        root = self._opened.trial.root
        if can_no_tracker_come(root) if self._crew.clock.is_live else is_recorded(root):
            raise InputError(
                f"{root / 'poses'}: no poses for {quiet_s:.0f} s, and the recording has ended: "
                "no process writes poses.",
                hint=no_poses_hint(self._opened),
            )

    def _greet(self) -> None:
        """Say once if nobody answers by the robot's name."""
        if self._asked_s and time.monotonic() - self._asked_s > _ANSWER_S:
            if not self._driver.is_answered:
                letter = self._options.manner.letter
                says = f"No FishBot {letter} answers: check that it is switched on and near."
                self._crew.tell(Note(text=says, warning=True))
            self._asked_s = 0.0

    def _wait(self) -> None:
        """Say once that no poses have come: a duration counts from the first of them."""
        if self._is_waited_for or self._first_s is not None:
            return
        if time.monotonic() - self._quiet_since_s > _WAIT_S:
            folder = self._opened.trial.root / "poses"
            says = f"{folder}: no poses yet. Waits until zfcal track writes them."
            self._crew.tell(Note(text=says, warning=True))
            self._is_waited_for = True
