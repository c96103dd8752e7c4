"""One run of the tracker over the images of a trial, frame by frame, into its files."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import time
from collections.abc import Iterator
from typing import final

import cv2

from zfcal.artifacts.frame_files import FRAMES
from zfcal.artifacts.images import read_image
from zfcal.artifacts.reading.contents import Contents, one_content
from zfcal.artifacts.validation import written_by_people
from zfcal.cameras.frames import Frame
from zfcal.cameras.live import ArrivalClock, LiveCamera
from zfcal.cameras.stamps import FrameClock, Shot, number_frames
from zfcal.errors import InputError
from zfcal.stages.camera.rig import BELOW, OVERHEAD, Feed, open_feed
from zfcal.stages.camera.sources import Recorder
from zfcal.stages.events import Made, Progress, Tell
from zfcal.stages.realtime import garbage_left_alone
from zfcal.stages.track.below import Below
from zfcal.stages.track.drawing import Drawing
from zfcal.stages.track.learnt import LEARNT_KEY, as_before
from zfcal.stages.track.minutes import Minutes, Origins
from zfcal.stages.track.outcome import Outcome, measured
from zfcal.stages.track.plan import Plan
from zfcal.stages.track.resuming import STARTED, Resumed, take_up
from zfcal.stages.trial_context import Task
from zfcal.tracking.background import Background, background_of
from zfcal.tracking.fitting import prepare
from zfcal.tracking.fusing import Fuser
from zfcal.tracking.identity_revision import IdentityRevision
from zfcal.tracking.overlay import Scene
from zfcal.tracking.region import region_of
from zfcal.tracking.robot import RobotSeen
from zfcal.tracking.seen import Seen
from zfcal.tracking.tracker import FishTracker, follow
from zfcal.tracks import FramePoses


@final
class Following:
    """Tracks a recording or a camera to its end.

    Parameters
    ----------
    plan
        What to track, and how.
    origins
        Where the files come from.
    tell
        Hears of everything.
    task
        Whether to make everything again.
    clock
        Of live cameras.
    resumed
        What is there of a live recording.
    seen
        What its lineage has seen of the files that it reads at its start.
    """

    def __init__(  # noqa: PLR0913 - one keyword for each of its surroundings
        self,
        plan: Plan,
        origins: Origins,
        tell: Tell,
        *,
        task: Task,
        clock: ArrivalClock | None = None,
        resumed: Resumed | None = None,
        seen: Contents | None = None,
    ) -> None:
        self._plan = plan
        self._tell = tell
        self._clock = clock or ArrivalClock()
        self._resumed = resumed or Resumed()
        self._seen = seen
        self._fps = plan.opened.trial.fps
        self._numbers = FrameClock(self._fps, after=self._resumed.last)
        self._fuser = Fuser(
            self._resumed.next_agent,
            keeps=plan.options.tracker.n_agents is not None,
            break_s=plan.opened.trial.longest_step_s,
        )
        self._revision = IdentityRevision(plan.opened.trial.longest_step_s)
        self._outcome = Outcome(plan, self._numbers.tally, tell)
        if origins.is_live:
            origins = dataclasses.replace(origins, clock=self._said_clock)
        self._minutes = Minutes(
            plan.opened,
            origins,
            lambda tracks: {
                **measured(plan.opened.trial, tracks),
                LEARNT_KEY: dict(self._outcome.learnt),
                **self._outcome.lacks(),
            },
            tell,
            task=task,
            revise=self._revision.revise,
        )
        self._origins = origins
        self._recorders: dict[str, Recorder] = {}
        self._robots: dict[int, RobotSeen] = {}
        self._handed = (-1, 0.0)
        self._held_s = -1.0
        self._end_s = 0.0

    def run(self) -> None:
        """Track everything, and say how it went.

        Raises
        ------
        InputError
            A camera cannot be opened or does not fit the trial.
        StorageError
            A file cannot be written.
        """
        with self._undisturbed():
            self._run()

    def _run(self) -> None:
        plan = self._plan
        # A camera waits for nobody, and compiling takes twenty seconds on a first start.
        prepare()
        with one_content(self._seen):
            overhead = open_feed(plan.opened, plan.overhead, self._clock)
            below = self._open_below()
            background = self._background(overhead)
        options = as_before(plan.options.tracker, self._resumed.learnt)
        tracker = FishTracker(
            options,
            overhead.projection,
            background=background,
            region=region_of(plan.opened.arena, overhead.projection),
        )
        drawing = Drawing(plan, overhead)
        self._outcome.begin(overhead, below)
        take_up(self._resumed, self._minutes)
        try:
            for frame, seen in follow(tracker, self._frames(overhead, below, tracker)):
                self._look_below(below, frame)
                self._outcome.hear(tracker, asked=plan.options.tracker)
                bad: list[str] = [each.reason for each in tracker.take_bad_frames()]
                self._revision.exchange(self._fuser.named(tracker.take_exchanges()), frame.time_s)
                self._take(frame, seen, bad, drawing)
        except BaseException:
            self._minutes.interrupt(self._end_s)
            raise
        finally:
            self._close(overhead, below)
        if plan.is_live and overhead.source.problems:
            # The camera went away: run again, the recording goes on, so it has no end yet.
            self._minutes.interrupt(self._end_s)
        else:
            self._minutes.finish(self._end_s)
        drawing.finish(self._tell)
        self._outcome.finish()

    @contextlib.contextmanager
    def _undisturbed(self) -> Iterator[None]:
        """Keep away what makes an image wait: it is for a live camera alone."""
        if not self._plan.is_live:
            yield
            return
        threads = cv2.getNumThreads()
        # An image is too small to be worth waiting for a second core that is busy.
        cv2.setNumThreads(1)
        try:
            with garbage_left_alone():
                yield
        finally:
            cv2.setNumThreads(threads)

    def _said_clock(self) -> dict[str, str]:
        return {STARTED: repr(self._clock.started_unix_s)}

    def _take(self, frame: Frame, seen: list[Seen], bad: list[str], drawing: Drawing) -> None:
        """Write down one frame."""
        robot = self._robots.pop(frame.number, None)
        poses = FramePoses(
            time_s=frame.time_s,
            frame=frame.number,
            agents=self._fuser.step(seen, robot, frame.time_s),
        )
        self._revision.note(frame.number, frame.time_s, self._fuser.agents)
        words = self._outcome.judge(frame, poses, bad, robot)
        self._minutes.add(
            poses,
            next_agent=self._fuser.next_agent,
            bad=words,
            is_urgent=self._plan.is_live,
        )
        self._end_s = frame.time_s + 1 / self._fps
        self._note_time(frame)
        # The poses are out: from here on there is time until the next image.
        self._minutes.close_passed()
        outlines = [each.contour_px for each in seen]
        drawing.add(Scene(frame=frame, poses=poses, outlines=outlines, bad=words))

    def _note_time(self, frame: Frame) -> None:
        """Note how long a frame took from being read, or from its arrival, to being written.

        Those that waited for a background do not count, nor those that arrived meanwhile.
        """
        if self._handed[0] != frame.number:
            self._held_s = self._clock.now() if self._plan.is_live else frame.time_s
        elif not self._plan.is_live:
            self._outcome.took(time.perf_counter() - self._handed[1])
        elif frame.time_s > self._held_s:
            self._outcome.took(self._clock.now() - frame.time_s)

    def _look_below(self, below: Below | None, frame: Frame) -> None:
        """Look for the robot in a frame, where that has not been done yet."""
        if below is not None and frame.number not in self._robots:
            self._robots[frame.number] = below.at(frame.time_s)

    def _frames(self, feed: Feed, below: Below | None, tracker: FishTracker) -> Iterator[Frame]:
        """Yield the frames that are asked for, as they are read.

        While they wait for a background the robot is looked for at once, since images of the
        camera below do not wait. Afterwards fish come first: the image below arrives meanwhile.
        """
        shots: Iterator[Shot] = feed.shots
        options = self._plan.options
        first_s = options.start_s or 0.0
        if options.start_s is not None:
            shots = itertools.dropwhile(lambda shot: shot.time_s < first_s - 1e-6, shots)
        if options.duration_s is not None:
            shots = _for_a_while(shots, options.duration_s)
        recorder = self._recorder(OVERHEAD)
        if recorder is not None:
            shots = map(recorder.keep, shots)
        length_s = options.duration_s or (feed.source.length_s or 0.0) - first_s
        for frame in number_frames(shots, self._numbers):
            self._handed = (frame.number, time.perf_counter())
            if tracker.is_learning:
                self._look_below(below, frame)
            yield frame
            done_s = frame.time_s - first_s
            if int(done_s) > int(done_s - 1 / self._fps) and length_s > 0:
                self._tell(Progress(stage="track", done=int(done_s), total=int(length_s) + 1))

    def _open_below(self) -> Below | None:
        plan = self._plan
        if plan.below is None:
            return None
        feed = open_feed(plan.opened, plan.below, self._clock)
        return Below(plan.opened.arena, feed, plan.options.leds, self._recorder(BELOW))

    def _recorder(self, camera: str) -> Recorder | None:
        form = self._plan.options.record
        if form is None:
            return None
        lineage = dataclasses.replace(self._origins.tracks, schema=FRAMES)
        root = self._plan.opened.trial.root
        self._recorders[camera] = Recorder(root, camera, form, lineage, self._tell)
        return self._recorders[camera]

    def _background(self, feed: Feed) -> Background | None:
        path = self._plan.options.background
        if path is None:
            return None
        with written_by_people():
            background = background_of(read_image(path))
        if background.size_px != feed.size_px:
            has, got = (f"{w} x {h} px" for w, h in (background.size_px, feed.size_px))
            raise InputError(
                f"{path}: has {has}, the images of {feed.source.name} have {got}.",
                hint="Give an image of the empty tank that the same camera took.",
            )
        return background

    def _close(self, overhead: Feed, below: Below | None) -> None:
        if isinstance(overhead.source, LiveCamera):
            overhead.source.stop()
        if below is not None:
            below.close()
        for recorder in self._recorders.values():
            recorder.close()
            for path in recorder.paths:
                self._tell(Made(path=path, reason="recorded"))


def _for_a_while(shots: Iterator[Shot], duration_s: float) -> Iterator[Shot]:
    """Yield the images of so many seconds from the first one on."""
    first = next(shots, None)
    if first is not None:
        end_s = first.time_s + duration_s - 1e-6
        yield first
        yield from itertools.takewhile(lambda shot: shot.time_s < end_s, shots)
