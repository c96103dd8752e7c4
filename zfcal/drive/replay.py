"""Works out from a drive's log what the driver decided, and compares it with what it did.

The log says which frames the driver took, which model it had and why it could not drive on;
poses come from ``poses/``. Targets and commands follow from these alone.
"""

from __future__ import annotations

import functools
import hashlib
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.mcap_files import Overview
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.pose_files import read_poses
from zfcal.drive.pilot import InForce, Manner, Pilot, Target, command_item, target_item
from zfcal.errors import DamagedError, InputError
from zfcal.model.packing import pack
from zfcal.robot.fishbot import FishBot
from zfcal.robot.motion import Gains
from zfcal.stages.events import LeftOut, Note, Progress, Result, Tell, UpToDate
from zfcal.stages.track.minutes import pose_files
from zfcal.stages.trial_context import OpenTrial, Task, at_work, open_trial
from zfcal.tracks import FramePoses

_NEAR_S = 120
"""Poses so far from a minute of the log are at hand: files of both need not break together."""

_DERIVED = {"no-target", "refused"}
"""Reasons that the pilot finds by itself."""

_NOT_DECIDED = {"sent", "n_sent"}


@final
class NoLine:
    """A line on which nothing is said."""

    is_open = False
    is_guarded = False
    n_opened = 0

    def write(self, data: bytes) -> bool:  # noqa: ARG002 - a line's signature
        """Send nothing."""
        return False

    def read(self) -> bytes:
        """Hear nothing."""
        return b""

    def beat(self, until_s: float) -> None:
        """Tell nobody."""

    def close(self) -> None:
        """Leave nothing."""


@dataclass(slots=True, kw_only=True)
class Tally:
    """How much was worked out again, and how much came out the same.

    Parameters
    ----------
    targets, same_targets, commands, same_commands
        All that could be compared, and those that came out the same.
    frames_lost
        Frames that the log names and ``poses/`` does not hold.
    not_compared
        Targets and commands behind a loss that came out in another way: they may depend on it.
    first_difference
        Which one that could be compared came out in another way first; empty for none.
    """

    targets: int = 0
    same_targets: int = 0
    commands: int = 0
    same_commands: int = 0
    frames_lost: int = 0
    not_compared: int = 0
    first_difference: str = ""

    @property
    def is_same(self) -> bool:
        """Whether everything did."""
        return self.targets == self.same_targets and self.commands == self.same_commands


def replay(root: Path, tell: Tell) -> Tally:
    """Work out targets and commands of a trial's drive again.

    Parameters
    ----------
    root
        The trial's directory.
    tell
        Hears of each file, and how it went.

    Raises
    ------
    InputError
        There is no log, or what comes out is not what it says.
    LockedError
        A driver is at work on the trial.
    """
    opened = open_trial(root)
    files = drive_files(root)
    if not files:
        raise InputError(
            f"{root / 'drive'}: there is no log of a drive.",
            hint=f"Make one with: zfcal drive {root} --port virtual --clock poses",
        )
    again = _Again(opened, tell)
    # Not while a driver still writes: its log and its poses would not end together.
    with at_work(root, "drive", Task()):
        for number, (start_s, path) in enumerate(files.items(), start=1):
            again.file(start_s, path)
            tell(UpToDate(path=path))
            tell(Progress(stage="replay", done=number, total=len(files)))
    tally = again.tally
    again.tell_cut_poses()
    tell(Result(value={key: getattr(tally, key) for key in Tally.__slots__}))
    says = (
        f"{tally.same_targets} of {tally.targets} targets and {tally.same_commands} of "
        f"{tally.commands} commands came out the same"
    )
    if tally.not_compared:
        says += f"; {tally.not_compared} behind what is lost could not be compared"
    if not tally.is_same:
        raise InputError(
            f"{root / 'drive'}: {says}; the first that did not: {tally.first_difference}.",
            hint="Arena, seed and poses must be those of the drive; another processor may round.",
        )
    tell(Note(text=f"{says}."))
    return tally


@final
class _Again:
    """A driver's decisions, one file of its log after the other."""

    def __init__(self, opened: OpenTrial, tell: Tell) -> None:
        self.tally = Tally()
        self._opened = opened
        self._tell = tell
        self._poses = _Poses(opened.trial.root, tell)
        self._pilot: Pilot | None = None
        self._model: InForce | None = None
        self._target: Target | None = None
        self._manner = Manner()
        self._is_behind_loss = False

    def file(self, start_s: int, path: Path) -> None:
        """Take the next file."""
        self._poses.go_to(start_s)
        found = Overview()
        try:
            self._manner = _manner_of(read_lineage(path).options)
            for item in read_drive(path, found):
                self._item(item)
        except DamagedError as error:
            self._lose(path, str(error), error.hint)
        else:
            if not found.whole:
                hint = "Copy it again from where it was made; what lies before is compared."
                self._lose(path, f"{path}: {found.problem}; {found.loss}.", hint)

    def _lose(self, path: Path, problem: str, hint: str) -> None:
        self._is_behind_loss = True
        self._tell(LeftOut(path=path, problem=problem, hint=hint))

    def tell_cut_poses(self) -> None:
        """Say which poses were cut short; the last file may still grow, unless it lacks frames."""
        self._poses.tell_cuts(lacks_frames=self.tally.frames_lost > 0)

    def _item(self, item: dict[str, Any]) -> None:
        match item["what"]:
            case "model":
                self._take_model(item)
            case "pose":
                self._take_frame(item["frame"])
            case "target":
                made = None if self._target is None else target_item(self._target)
                self._compare("targets", item, made)
            case "command":
                self._take_command(item)
            case _:
                pass

    def _take_model(self, item: dict[str, Any]) -> None:
        self._model = _model_of(item, self._opened)
        if item.get("begins"):
            # A driver that begins knows nothing of what was before.
            self._is_behind_loss = False
        if item.get("begins") or self._pilot is None:
            self._pilot = Pilot(self._opened, self._manner, FishBot(self._manner.letter, NoLine()))

    def _take_frame(self, number: int) -> None:
        poses = self._poses.get(number)
        self._target = None
        if poses is None:
            self.tally.frames_lost += 1
            self._is_behind_loss = True
        elif self._pilot is not None and self._model is not None:
            self._target = self._pilot.see(poses, self._model)

    def _take_command(self, item: dict[str, Any]) -> None:
        made = None
        if self._pilot is not None:
            held = "" if item["held"] in _DERIVED else item["held"]
            made = command_item(self._pilot.tick(item["time_s"], held), self._manner.letter)
        self._compare("commands", item, made)

    def _compare(self, kind: str, item: dict[str, Any], made: dict[str, Any] | None) -> None:
        tally = self.tally
        said = {key: value for key, value in item.items() if key not in _NOT_DECIDED}
        same = made is not None and said == made
        if self._is_behind_loss and not same:
            tally.not_compared += 1
            return
        setattr(tally, kind, getattr(tally, kind) + 1)
        setattr(tally, f"same_{kind}", getattr(tally, f"same_{kind}") + same)
        if not same and not tally.first_difference:
            tally.first_difference = f"the {item['what']} at {item['time_s']:.2f} s"


@final
class _Poses:
    """The frames of a trial about a minute, by their numbers."""

    def __init__(self, root: Path, tell: Tell) -> None:
        self._files = pose_files(root)
        self._tell = tell
        self._frames: dict[int, FramePoses] = {}
        self._read: set[int] = set()
        self._cuts: dict[Path, DamagedError] = {}

    def tell_cuts(self, *, lacks_frames: bool) -> None:
        """Say which files were cut short."""
        last = max(self._files, default=-1)
        for path, problem in self._cuts.items():
            if lacks_frames or path != self._files[last]:
                self._tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))

    def go_to(self, start_s: int) -> None:
        """Read the minute that begins then, those about it, and forget what lies long before."""
        for second, path in self._files.items():
            if abs(second - start_s) <= _NEAR_S and second not in self._read:
                self._read.add(second)
                self._frames |= {poses.frame: poses for poses in self._of(path)}
        gone = [n for n, poses in self._frames.items() if poses.time_s < start_s - 2 * _NEAR_S]
        for number in gone:
            del self._frames[number]

    def get(self, number: int) -> FramePoses | None:
        """Return a frame; None if it is not there."""
        return self._frames.get(number)

    def _of(self, path: Path) -> Iterator[FramePoses]:
        problems: list[DamagedError] = []
        try:
            # The driver went on behind frames, and beside agents, that are none, too.
            cut = functools.partial(self._cuts.__setitem__, path)
            yield from read_poses(path, left_out=problems.append, cut=cut)
        except DamagedError as error:
            problems.append(error)
        for problem in problems[:1]:
            self._tell(LeftOut(path=path, problem=str(problem), hint=problem.hint))


def _manner_of(options: Any) -> Manner:
    known = {key: options[key] for key in ("pattern", "free_running", "radius_m", "letter")}
    return Manner(**known, gains=Gains(**options["gains"]))


def _model_of(item: dict[str, Any], opened: OpenTrial) -> InForce:
    """Return the model as the log holds it: its file may have been replaced since."""
    text = item["parameters"]
    if hashlib.sha256(text.encode()).hexdigest() != item["sha256"]:
        raise DamagedError(f"The log's own copy of {item['model']} does not have the hash it says.")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / Path(item["model"]).name
        path.write_bytes(text.encode())
        model = read_model_for(path, opened.arena, dt_s=opened.trial.dt_s)
    packed = pack([model], opened.arena)
    return InForce(
        name=item["model"], sha256=item["sha256"], text=text, parameters=model, packed=packed
    )
