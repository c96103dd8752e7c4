"""What a run of the tracker tells: what is wrong, when it happens; how it went, at the end."""

from __future__ import annotations

import statistics
from collections import Counter, deque
from collections.abc import Mapping
from pathlib import Path
from typing import final

import numpy as np

from zfcal.artifacts.lineage import JSON
from zfcal.cameras.frames import Frame, Image
from zfcal.cameras.stamps import Problem, Tally
from zfcal.stages.camera.rig import BELOW, OVERHEAD, Feed
from zfcal.stages.events import LeftOut, Note, Result, Tell
from zfcal.stages.track.below import Below
from zfcal.stages.track.learnt import learnt_by, notes_of, remedy
from zfcal.stages.track.plan import Plan
from zfcal.stages.track.tracker_noise import losses, tracker_noise
from zfcal.stages.track_window import NOISE_KEY
from zfcal.tracking.learning import Learnt
from zfcal.tracking.robot import RobotSeen
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker
from zfcal.tracks import FISH, GUESS, FramePoses, Tracks
from zfcal.trial import Trial

LACKS_KEY = "lacks"
"""Extra metadata of a segment: what of the images up to its end could not be read, in sentences."""

_SAYS = {
    "black": "the image shows nothing (a lens cap, a lost signal, no light)",
    "size": "the image has another size than the first",
    "light": "the image is far brighter or darker than the background",
    "too many": "more blobs than animals; the likeliest are followed",
    "no LED": "the robot's LEDs have not been seen for five seconds",
}
"""What is told when it happens for the first time; what touching fish do is not."""

_HINTS = {
    "too many": " Check n_fish and n_robots in trial.toml, or raise --min-blob-px.",
    "no LED": " Check their colour (--led-hue), and that the camera below sees the robot.",
}
_INEXACT = {"too few", "forced", "unclaimed"}
"""Words of frames in which the animals were not all seen for themselves."""

_FEW = 0.5
"""Below this share of all fish, a warning says so."""

_NO_LED_S = 5.0
_LATENCIES = 100_000
"""Latencies that are kept at most: two hours at 15 Hz."""


def measured(trial: Trial, tracks: Tracks) -> Mapping[str, JSON]:
    """Return what is known of a segment's tracks: losses, and noise where it can be told."""
    fish = tracks.take(tracks.kind == FISH)
    sd_m = tracker_noise(fish, fps=trial.fps, dt_s=trial.dt_s)
    noise: Mapping[str, JSON] = {} if sd_m is None else {NOISE_KEY: sd_m}
    return {**losses(tracks, n_agents=trial.n_agents), **noise}


def _same(one: Image, other: Image) -> bool:
    # A few pixels tell almost always, in a hundredth of the time.
    some = np.s_[::16, ::16]
    return np.array_equal(one[some], other[some]) and np.array_equal(one, other)


@final
class Outcome:
    """Keeps count during a run.

    Parameters
    ----------
    plan
        What is tracked.
    tally
        Gaps and duplicates, counted elsewhere.
    tell
        Hears of everything.
    """

    def __init__(self, plan: Plan, tally: Tally, tell: Tell) -> None:
        self._plan = plan
        self._tally = tally
        self._tell = tell
        self._feeds: list[Feed] = []
        self._below: Below | None = None
        self._bad: Counter[str] = Counter()
        self._exact = 0
        self._emitted = 0
        self._guesses = self._rows = 0
        self._fish = self._with_fish = 0
        self.learnt: Mapping[str, JSON] = {}
        self._told = 0
        self._heard: Learnt | None = None
        self._before: Image | None = None
        self._last: tuple[int, float] | None = None
        self._led_s: float | None = None
        self._took_s: deque[float] = deque(maxlen=_LATENCIES)

    def begin(self, overhead: Feed, below: Below | None) -> None:
        """Take the cameras, and tell what is worth knowing of them."""
        self._below = below
        self._feeds = [overhead] if below is None else [overhead, below.feed]
        self._tell_notes()

    def hear(self, tracker: FishTracker, *, asked: TrackerOptions) -> None:
        """Say what was learnt of the animals, once it is known or has become surer.

        Parameters
        ----------
        tracker
            Has learnt it.
        asked
            What a person said.
        """
        if tracker.learnt is None or tracker.learnt is self._heard:
            return
        self._heard = tracker.learnt
        found = learnt_by(tracker, asked)
        if found == self.learnt:
            return
        self.learnt = found
        for note in notes_of(self._plan.overhead.source, found):
            self._tell(note)

    def judge(
        self, frame: Frame, poses: FramePoses, bad: list[str], robot: RobotSeen | None
    ) -> tuple[str, ...]:
        """Return what was wrong with a frame, in words, and tell what is new."""
        words = list(dict.fromkeys(bad))
        if len(poses.agents) >= self._plan.opened.trial.n_agents and "too few" in words:
            # The camera overhead misses a robot that the one below sees: all are there.
            words.remove("too few")
        if self._before is not None and _same(self._before, frame.image):
            words.append("repeated")
        if self._last is not None and frame.number > self._last[0] + 1:
            words.append("after a gap")
        self._before, self._last = frame.image, (frame.number, frame.time_s)
        self._weigh(poses, words)
        if self._leds_are_gone(frame, robot):
            words.append("no LED")
        for word in words:
            self._count(word, frame)
        self._tell_notes()
        return tuple(words)

    def _weigh(self, poses: FramePoses, words: list[str]) -> None:
        """Count a frame as exact where as many as there are were seen, each for itself.

        As many rows are told as well of nonsense: those count whose blobs are as large as they
        have to be, that are no guesses, and beside whom nothing like an animal is left over.
        """
        guesses = sum(agent.confidence < GUESS for agent in poses.agents)
        fish = sum(agent.kind == FISH for agent in poses.agents)
        self._fish += fish
        self._with_fish += fish > 0
        self._rows += len(poses.agents)
        self._guesses += guesses
        emitted = len(poses.agents) == self._plan.opened.trial.n_agents
        self._emitted += emitted
        self._exact += emitted and not guesses and not _INEXACT & set(words)

    def took(self, seconds: float) -> None:
        """Note how long a frame took."""
        self._took_s.append(seconds)

    def finish(self) -> None:
        """Say how it went."""
        frames = max(self._tally.frames, 1)
        name = self._plan.overhead.source
        self._tell_notes()
        n_agents = self._plan.opened.trial.n_agents
        wrong = ", ".join(f"{word} {n}" for word, n in self._bad.most_common())
        self._tell(
            Note(
                text=f"{name}: {self._tally}; {self._exact / frames:.1%} of them with exactly "
                f"{n_agents} animals seen, none guessed or unexplained "
                f"({self._emitted / frames:.1%} with as many rows){'; ' if wrong else ''}{wrong}."
            )
        )
        if self._guesses > self._rows / 2:
            text = (
                f"{name}: {self._guesses / self._rows:.0%} of the positions are guesses: what was "
                "found is mostly not what animals look like. Look at --overlay or --contact-sheet."
            )
            self._tell(Note(text=text, warning=True))
        if self._bad["no background"]:
            text = (
                f"{name}: no background was learnt, since no frame shows a tank: no animal "
                "was found. Give an image of the empty tank with --background."
            )
            self._tell(Note(text=text, warning=True))
        self._warn_of_few()
        self._tell(Result(value=self._numbers()))
        for feed in self._feeds:
            for problem in self._problems(feed):
                self._tell(
                    LeftOut(path=Path(feed.source.name), problem=problem.says, hint=problem.hint)
                )

    def lacks(self) -> dict[str, JSON]:
        """Return what could not be read of a recording so far, for its segments; maybe nothing.

        Files have their bare names: where they lay does not bear on the tracks.
        """
        found: list[JSON] = []
        for camera, feed in zip((OVERHEAD, BELOW), self._feeds, strict=False):
            for problem in self._problems(feed):
                name, _, says = problem.says.partition(": ")
                found.append(f"{camera}: {Path(name).name}: {says}")
        return {LACKS_KEY: found} if found and not self._plan.is_live else {}

    def _problems(self, feed: Feed) -> list[Problem]:
        """Return what could not be read of a camera in the stretch that is tracked."""
        first_s = self._plan.options.start_s or 0.0
        return [problem for problem in feed.source.problems if problem.end_s > first_s]

    def _warn_of_few(self) -> None:
        """Warn where fewer than half of the fish were found, and say what to try."""
        frames, n_fish = self._tally.frames, self._plan.opened.trial.n_fish
        if not frames or self._bad["no background"] or self._fish >= _FEW * n_fish * frames:
            return
        found = (
            f"no fish found in any of {frames} frames"
            if not self._fish
            else f"only {self._fish / frames:.1f} of {n_fish} fish found in a frame on average, "
            f"and none in {frames - self._with_fish} of {frames} frames"
        )
        text = f"{self._plan.overhead.source}: {found}. {remedy(self.learnt)}"
        self._tell(Note(text=text, warning=True))

    def _numbers(self) -> dict[str, JSON]:
        took_ms = [1000 * took for took in self._took_s]
        cuts = statistics.quantiles(took_ms, n=20) if len(took_ms) > 1 else [0.0] * 19
        return {
            "source": self._plan.overhead.source,
            "frames": self._tally.frames,
            "missing": self._tally.missing,
            "gaps": self._tally.gaps,
            "duplicates": self._tally.duplicates,
            "exact": self._exact,
            "as_many_rows": self._emitted,
            "guesses": self._guesses,
            "fish": self._fish,
            "without_fish": self._tally.frames - self._with_fish,
            "learnt": dict(self.learnt),
            "bad_frames": dict(self._bad),
            "leds": {} if self._below is None else dict(self._below.counts),
            "latency_ms": {
                "median": cuts[9],
                "p95": cuts[18],
                "max": max(took_ms, default=0.0),
            },
        }

    def _count(self, word: str, frame: Frame) -> None:
        self._bad[word] += 1
        if word in _SAYS and self._bad[word] == 1:
            self._warn(frame, word)

    def _warn(self, frame: Frame, word: str) -> None:
        text = (
            f"{self._plan.overhead.source}: frame {frame.number} ({frame.time_s:.2f} s): "
            f"{_SAYS[word]}; further ones are counted.{_HINTS.get(word, '')}"
        )
        self._tell(Note(text=text, warning=True))

    def _leds_are_gone(self, frame: Frame, robot: RobotSeen | None) -> bool:
        """Return whether no LED was seen for five seconds."""
        if robot is None:
            return False
        if not robot.is_lost or self._led_s is None:
            self._led_s = frame.time_s
        return frame.time_s - self._led_s > _NO_LED_S

    def _tell_notes(self) -> None:
        notes = [note for feed in self._feeds for note in feed.source.notes]
        for note in notes[self._told :]:
            self._tell(Note(text=note))
        self._told = len(notes)
