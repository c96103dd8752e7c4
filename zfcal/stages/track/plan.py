"""What is to be tracked, and how: checked before any image is opened."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.tables import TRACKS
from zfcal.cameras.handedness import ABOVE
from zfcal.cameras.handedness import BELOW as SEEN_FROM_BELOW
from zfcal.errors import InputError
from zfcal.stages.camera.rig import BELOW, OVERHEAD, CameraChoice, View, view_of
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracking.robot import LedOptions
from zfcal.tracking.seen import TrackerOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class Pictures:
    """What to draw, by which a person judges the tracking; None for nothing.

    Parameters
    ----------
    overlay
        A video of the images with what was found in them.
    contact_sheet
        A picture of the frames with which most is wrong.
    """

    overlay: Path | None = None
    contact_sheet: Path | None = None

    @property
    def missing(self) -> bool:
        """Whether one of them is still to be made."""
        return any(path is not None and not path.exists() for path in self.paths)

    @property
    def paths(self) -> tuple[Path | None, ...]:
        """Where they go."""
        return self.overlay, self.contact_sheet


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackOptions:
    """What to track, and how.

    Parameters
    ----------
    overhead, below
        The cameras.
    tracker
        How fish are tracked; its ``n_agents`` is set from the trial.
    leds
        What the robot's LEDs look like.
    background
        An image of the empty tank; None to learn it from the first frames.
    robot_as_fish
        Whether a robot that cannot be told from the fish counts as one of them.
    start_s, duration_s
        The stretch of the recording that is tracked; None for all of it.
    record
        ``jpeg`` or ``png``: a live camera's images are kept in ``frames/``.
    pictures
        What to draw.
    """

    overhead: CameraChoice = dataclasses.field(default_factory=CameraChoice)
    below: CameraChoice = dataclasses.field(default_factory=CameraChoice)
    tracker: TrackerOptions = dataclasses.field(default_factory=TrackerOptions)
    leds: LedOptions = dataclasses.field(default_factory=LedOptions)
    background: Path | None = None
    robot_as_fish: bool = False
    start_s: float | None = None
    duration_s: float | None = None
    record: str | None = None
    pictures: Pictures = dataclasses.field(default_factory=Pictures)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A trial, its cameras and how they are tracked.

    Parameters
    ----------
    opened
        The trial.
    options
        As they were asked for, with the trial's numbers.
    overhead, below
        The cameras; below may be None.
    """

    opened: OpenTrial
    options: TrackOptions
    overhead: View
    below: View | None

    @property
    def is_live(self) -> bool:
        """Whether the images never come again."""
        return self.overhead.is_live

    def lineage(self) -> Lineage:
        """Return where the tracks come from; every file is hashed for it."""
        root = self.opened.trial.root
        inputs = self.overhead.hashes(root) | hash_inputs(root, self.opened.arena_files)
        if self.below is not None:
            inputs |= self.below.hashes(root)
        if self.options.background is not None:
            inputs |= hash_inputs(root, [self.options.background])
        return Lineage(schema=TRACKS, command="track", options=self._said(), inputs=inputs)

    def _said(self) -> dict[str, JSON]:
        trial, options = self.opened.trial, self.options
        said: dict[str, JSON] = {
            "arena": trial.arena,
            "fps": trial.fps,
            "n_fish": trial.n_fish,
            "n_robots": trial.n_robots,
            "start_s": options.start_s,
            "duration_s": options.duration_s,
            "corners_px": _pairs(self.overhead.corners_px),
            "seen_from": None if self.overhead.side == ABOVE else self.overhead.side,
            "below_seen_from": ABOVE if self.below and self.below.side == ABOVE else None,
            "robot_as_fish": options.robot_as_fish or None,
            **_changed(options.tracker, TrackerOptions(n_agents=options.tracker.n_agents)),
            **{f"led_{key}": value for key, value in _changed(options.leds, LedOptions()).items()},
        }
        said["method"] = options.tracker.method
        for view in (self.overhead, self.below):
            if view is not None and view.is_live:
                said[view.name] = view.source
        return said


def plan_of(opened: OpenTrial, options: TrackOptions) -> Plan:
    """Return what is to be done, checked as far as it can be without opening an image.

    Raises
    ------
    InputError
        An option cannot take effect, or something is missing.
    """
    trial = opened.trial
    overhead = view_of(opened, OVERHEAD, options.overhead)
    if overhead is None:
        raise InputError(
            f"{trial.config}: names no source of overhead images.",
            hint="Give --overhead SRC: a video, images, MCAP segments or a camera.",
        )
    below = view_of(opened, BELOW, options.below)
    _check_robot(opened, below, options)
    if below is not None and overhead.side == SEEN_FROM_BELOW:
        # Of two cameras, the one whose name says so may be meant.
        overhead = dataclasses.replace(overhead, or_usual=True)
    for view in (overhead, below):
        if view is not None and view.is_live != overhead.is_live:
            raise InputError("One camera is live and the other a recording: give two alike.")
    if overhead.is_live and options.start_s is not None:
        raise InputError("--start is for recordings: a live camera begins now.")
    if options.record is not None and not overhead.is_live:
        raise InputError(
            f"--record keeps the images of a live camera; {overhead.source} is a recording."
        )
    n_agents = trial.n_agents
    tracker = dataclasses.replace(options.tracker, n_agents=n_agents)
    options = dataclasses.replace(options, tracker=tracker)
    return Plan(opened=opened, options=options, overhead=overhead, below=below)


def _check_robot(opened: OpenTrial, below: View | None, options: TrackOptions) -> None:
    trial = opened.trial
    if trial.n_robots > 1:
        raise InputError(
            f"{trial.config}: states {trial.n_robots} robots; "
            "one robot can be recognised by its LEDs."
        )
    if trial.n_robots and below is None and not options.robot_as_fish:
        raise InputError(
            f"{trial.config}: states a robot, and without the camera below it cannot be "
            "distinguished from the fish.",
            hint="Give --below SRC; or --robot-as-fish, and it is tracked as one fish more.",
        )
    if not trial.n_robots and below is not None:
        raise InputError(
            f"{trial.config}: states no robot; the camera below sees nothing else.",
            hint="Leave --below out, or set n_robots = 1.",
        )
    if options.robot_as_fish and (below is not None or not trial.n_robots):
        raise InputError("--robot-as-fish is for a trial with a robot and no camera below.")


def _pairs(corners: tuple[tuple[float, float], ...] | None) -> JSON:
    return None if corners is None else [list(corner) for corner in corners]


def _changed(options: object, default: object) -> Mapping[str, JSON]:
    """Return the options that are not the usual ones: new ones make nothing stale."""
    names = [field.name for field in dataclasses.fields(options)]  # type: ignore[arg-type]
    return {
        name: getattr(options, name)
        for name in names
        if getattr(options, name) != getattr(default, name)
    }
