"""A recording in blocks of 60 s: every other one to learn from, the rest to judge on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise
from operator import add

import numpy as np

from zfcal.arrays import Bools, Ints
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.diagnose.heldout import scene_of
from zfcal.errors import InputError
from zfcal.model.scene import Scene, make_scene
from zfcal.stages.track_window import Stretch
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import FISH
from zfcal.units import SEGMENT_S

_FEWEST = 2
"""Blocks that each half needs at least."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Halves:
    """The blocks of a recording.

    Parameters
    ----------
    scene
        Of the whole recording.
    block : ndarray of int, shape (sample,)
        Which block each sample is in.
    statistics
        Of the fish in each block; no pair of samples crosses an edge.
    learnt : ndarray of bool, shape (block,)
        Blocks to learn from; the others that hold anything are held out.
    """

    scene: Scene
    block: Ints
    statistics: tuple[Statistics, ...]
    learnt: Bools

    @cached_property
    def held_out(self) -> Bools:
        """Blocks to judge on, shape (block,)."""
        filled = [bool(each.occupation.sum()) for each in self.statistics]
        return np.asarray(~self.learnt & np.array(filled, dtype=bool))

    @cached_property
    def training(self) -> Scene:
        """The steps to learn from."""
        return scene_of(self.scene, self.block, self.learnt)

    @cached_property
    def judging(self) -> Scene:
        """The steps to judge on."""
        return scene_of(self.scene, self.block, self.held_out)

    def pooled(self, chosen: Bools) -> Statistics:
        """Return the statistics of chosen blocks together."""
        return reduce(add, (self.statistics[b] for b in np.flatnonzero(chosen)))

    def seconds(self, chosen: Bools) -> float:
        """Return how long chosen blocks are together, in seconds."""
        return float(chosen[self.block].sum()) * self.scene.dt_s


def split(opened: OpenTrial, stretch: Stretch) -> Halves:
    """Return the blocks of a recording.

    Parameters
    ----------
    opened
        The trial.
    stretch
        Its tracks. Blocks start on whole minutes of the trial.

    Raises
    ------
    InputError
        There are no fish, or fewer than two blocks for either half.
    """
    samples, arena = stretch.samples, opened.arena
    scene = make_scene(samples, arena)
    # 0.2 s is no binary fraction: the sample at 60 s belongs to the block that it starts.
    minute = np.floor(samples.k * samples.dt_s / SEGMENT_S + 1e-9).astype(np.int64)
    block = minute - minute[0]
    points = locate(samples, arena).of_kind(FISH)
    first = samples.k[np.searchsorted(block, np.arange(block[-1] + 1))]
    edges = [*np.searchsorted(points.k, first).tolist(), len(points)]
    statistics = tuple(
        measure(points.take(slice(low, high)), arena) for low, high in pairwise(edges)
    )
    filled = np.array([bool(each.occupation.sum()) for each in statistics])
    learnt = filled & (np.arange(len(filled)) % 2 == 0)
    halves = Halves(scene=scene, block=block, statistics=statistics, learnt=learnt)
    least = min(int(learnt.sum()), int(halves.held_out.sum()))
    if least < _FEWEST:
        raise InputError(
            f"{opened.trial.root}: has {int(learnt.sum())} minutes to learn from and "
            f"{int(halves.held_out.sum())} to judge on, expected at least {_FEWEST} of each.",
            hint="Record for longer: every other minute is held out.",
        )
    return halves
