"""The control group of a trial, where it is the fish of other trials without a robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Self

import numpy as np

from zfcal.arrays import Ints
from zfcal.artifacts.agreement import check_agreement
from zfcal.artifacts.freshness import hash_inputs, relative_to
from zfcal.artifacts.lineage import JSON
from zfcal.artifacts.segments import segment_path
from zfcal.behaviour.legacy import LegacyStatistics, measure_legacy
from zfcal.behaviour.located import Located, join
from zfcal.behaviour.pooling import Pool
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.errors import InputError
from zfcal.stages.events import Tell
from zfcal.stages.segments import STEP_S, Segments, segment_hashes
from zfcal.stages.trial_context import OpenTrial
from zfcal.stages.windows import whole_segments


@dataclass(frozen=True, kw_only=True)
class ControlGroup:
    """The fish of robot-free trials, over all their whole segments.

    Parameters
    ----------
    statistics
        What they did, pooled.
    inputs
        SHA-256 of the files that this stands on, by their path relative to the
        trial that is analysed.
    options
        For each trial, by its path relative to the one that is analysed, the
        settings that bear on the counts.
    parts
        For each trial the segments, in order.
    segments
        Reads them.
    """

    statistics: Statistics
    inputs: dict[str, str]
    options: dict[str, JSON]
    parts: tuple[tuple[OpenTrial, tuple[int, ...]], ...]
    segments: Segments
    _legacy: dict[float, LegacyStatistics] = field(default_factory=dict)
    _further: dict[tuple[str, ...], dict[str, Ints]] = field(default_factory=dict)

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
            One has a robot, other zones or bins, another step, or no tracks, or its tracks are of
            other agents than it states.
        """
        if not roots:
            return None
        parts, statistics = [], []
        inputs: dict[str, str] = {}
        options: dict[str, JSON] = {}
        for root in roots:
            other = segments.open(root)
            check_agreement(other.trial)
            _check_comparable(opened, other)
            hashes = segment_hashes(root, whole_segments(other.trial))
            pooled = segments.pool(other, hashes, tell)
            whole = [start for start in hashes if start not in pooled.problems]
            _check_fish_only(other, pooled.pool, whole)
            statistics.append(pooled.pool.fish())
            parts.append((other, tuple(whole)))
            files = [segment_path(root, start) for start in whole] + other.arena_files
            inputs |= hash_inputs(opened.trial.root, files)
            options[relative_to(opened.trial.root, root)] = other.clock_options
        return cls(
            statistics=reduce(add, statistics),
            inputs=inputs,
            options=options,
            parts=tuple(parts),
            segments=segments,
        )

    def with_further(self, names: tuple[str, ...]) -> Statistics:
        """Return what they did with further statistics, of windows that follow each other.

        A segment that has no neighbour to make a window with counts for D, W, O, T and V alone.

        Raises
        ------
        InputError
            There is no whole window.
        """
        if names and names not in self._further:
            windows = [window for part in self.parts for window in self._windows(*part)]
            if not windows:
                raise InputError(
                    f"The control group has no whole window for {', '.join(names)}.",
                    hint="These are counted in windows of 120 s.",
                )
            counts = [measure(points, points.arena, further=names).further for points in windows]
            self._further[names] = {
                name: np.sum([one[name] for one in counts], axis=0) for name in names
            }
        return replace(self.statistics, further=self._further[names] if names else {})

    def _windows(self, opened: OpenTrial, starts: tuple[int, ...]) -> Iterator[Located]:
        """Yield where the fish were in each window, none overlapping the one before."""
        known, done_s = set(starts), 0
        for start in starts:
            if start >= done_s and start + STEP_S in known:
                done_s = start + 2 * STEP_S
                yield join([self.segments.read(opened, s) for s in (start, start + STEP_S)])

    def legacy(self, extent_m: float) -> LegacyStatistics:
        """Return what they did as the authors' scripts count it, pooled."""
        if extent_m not in self._legacy:
            known = self.statistics
            counts = [
                measure_legacy(self.segments.read(opened, start), opened.arena, extent_m=extent_m)
                for opened, starts in self.parts
                for start in starts
            ]
            self._legacy[extent_m] = LegacyStatistics(
                zone_names=known.zone_names,
                distance=reduce(add, (one.distance for one in counts)),
                n_distance=reduce(add, (one.n_distance for one in counts)),
                # Steps from one segment to the next are in what is known.
                occupation=known.occupation,
                transition=known.transition,
            )
        return self._legacy[extent_m]


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


def _check_fish_only(other: OpenTrial, pool: Pool, whole: list[int]) -> None:
    root = other.trial.root
    if not whole:
        raise InputError(
            f"{root}: has no whole track segment to be a control.",
            hint=f"Import its tracks first: zfcal import SRC {root}",
        )
    if pool.first_robot_k is not None:
        seen_s = pool.first_robot_k * other.trial.dt_s
        start = max(start for start in whole if start <= seen_s + 0.5 * other.trial.dt_s)
        raise InputError(
            f"{segment_path(root, start)}: holds a robot, expected fish alone.",
            hint="A control group is fish alone.",
        )
