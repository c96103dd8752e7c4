"""The control group of a trial, where it is the fish of other trials without a robot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from operator import add
from pathlib import Path
from typing import Self

from zfcal.artifacts.freshness import relative_to
from zfcal.artifacts.lineage import JSON
from zfcal.behaviour.legacy import LegacyStatistics, measure_legacy
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.errors import InputError
from zfcal.online.events import Tell
from zfcal.online.opening import OpenTrial
from zfcal.online.segments import Segments, segment_path
from zfcal.online.windows import whole_segments
from zfcal.tracks import ROBOT


@dataclass(frozen=True, kw_only=True)
class ControlGroup:
    """The fish of robot-free trials, over all their whole segments.

    Parameters
    ----------
    fish
        Where they were, a stretch per trial.
    files
        The files that this stands on.
    options
        For each trial, by its path relative to the one that is analysed, the
        settings that bear on the counts.
    """

    fish: tuple[Located, ...]
    files: tuple[Path, ...]
    options: dict[str, JSON]

    @classmethod
    def read(
        cls, opened: OpenTrial, roots: tuple[Path, ...], segments: Segments, tell: Tell
    ) -> Self | None:
        """Read the trials of a control group; None if there are none.

        Parameters
        ----------
        opened
            The trial that is to be compared with them.
        roots
            Their directories.
        segments
            Reads them.
        tell
            Hears of damaged segments, which are left out.

        Raises
        ------
        InputError
            One has a robot, other zones or bins, another step, or no tracks.
        """
        if not roots:
            return None
        fish, files = [], []
        options: dict[str, JSON] = {}
        for root in roots:
            other = segments.open(root)
            _check_comparable(opened, other)
            found = {
                start: segments.read_or_tell(other, start, tell)
                for start in whole_segments(other.trial)
            }
            whole = {start: part for start, part in found.items() if part is not None}
            _check_fish_only(root, whole)
            fish.append(join([whole[start] for start in sorted(whole)]))
            files += [segment_path(root, start) for start in sorted(whole)] + other.arena_files
            options[relative_to(opened.trial.root, root)] = other.clock_options
        return cls(fish=tuple(fish), files=tuple(files), options=options)

    @cached_property
    def statistics(self) -> Statistics:
        """What they did, pooled."""
        return reduce(add, (measure(part, part.arena) for part in self.fish))

    def legacy(self, extent_m: float) -> LegacyStatistics:
        """Return what they did as the authors' scripts count it, pooled."""
        parts = [measure_legacy(part, part.arena, extent_m=extent_m) for part in self.fish]
        names = ("distance", "n_distance", "occupation", "transition")
        sums = {name: reduce(add, (getattr(part, name) for part in parts)) for name in names}
        return LegacyStatistics(zone_names=parts[0].zone_names, **sums)


def _check_comparable(opened: OpenTrial, other: OpenTrial) -> None:
    where = f"{other.trial.root}: cannot be the control of {opened.trial.root}"
    if other.trial.root.resolve() == opened.trial.root.resolve():
        raise InputError(
            f"{where}: it is the same trial.",
            hint="Without --control a trial's own fish are its control.",
        )
    if other.trial.n_robots:
        raise InputError(
            f"{where}: it has {other.trial.n_robots} robots.",
            hint="A control group is fish alone.",
        )
    pairs = {
        "zones": (", ".join(opened.arena.zone_names), ", ".join(other.arena.zone_names)),
        "bins": (opened.arena.bins, other.arena.bins),
        "dt_s": (opened.trial.dt_s, other.trial.dt_s),
    }
    for key, (ours, theirs) in pairs.items():
        if ours != theirs:
            raise InputError(
                f"{where}: its {key} are {theirs}, expected {ours}.",
                hint="Counts are comparable only in the same zones and bins, at the same step.",
            )


def _check_fish_only(root: Path, whole: dict[int, Located]) -> None:
    if not whole:
        raise InputError(
            f"{root}: has no whole track segment to be a control.",
            hint=f"Import its tracks first: zfcal import SRC {root}",
        )
    for start, part in whole.items():
        if (part.kind == ROBOT).any():
            raise InputError(
                f"{segment_path(root, start)}: holds a robot, expected fish alone.",
                hint="A control group is fish alone.",
            )
