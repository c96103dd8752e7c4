"""Whether an effect is there all the time.

A listed effect is: one whose strength differs between minutes, or phases of a period, by more than
its mean is another one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.pulses import pulses
from zfcal.diagnose.scores import Score
from zfcal.model.scene import Moves, Scene

PHASES = 20
"""Parts of the time from pulse to pulse."""

MINUTES_S = 60.0
"""Blocks of time in which an effect is to be of one strength."""

WAVERS = 3e-3
"""Chance at which the scores of blocks are no longer of one strength."""


_LEAST_BESIDE = 1e-9
"""Share of all weight that is not that of one block alone."""

Of: TypeAlias = tuple[Scene, NDArray[np.int64]]
"""A recording, and the sample in which each step of what is asked begins."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """What an effect that is to be there all the time gains at each step of a recording.

    Parameters
    ----------
    apart : ndarray, shape (step,)
        What it gains, less what it would gain if the fish drew from it: in the mean nothing.
    expected : ndarray, shape (step,)
        What it would gain. Close to no effect that is half of the information that a step has.
    of
        The recording, and the sample in which each step begins.
    """

    apart: Floats
    expected: Floats
    of: Of

    @property
    def in_all_minutes(self) -> bool:
        """Whether its strength differs between minutes by less than its mean."""
        scene, at = self.of
        minute = (scene.k[at] * scene.dt_s // MINUTES_S).astype(np.int64)
        return self._is_alike(minute - minute.min(initial=0))

    @property
    def in_all_phases(self) -> bool:
        """Whether it does over the phases of its period, if it has one."""
        scene, at = self.of
        series = np.bincount(at, self.apart, len(scene.k)).astype(np.float64)
        found = pulses(series[None], scene.dt_s)
        if not found.tail <= WAVERS:
            return True
        return self._is_alike((at * scene.dt_s / found.period_s % 1 * PHASES).astype(np.int64))

    def _is_alike(self, part: NDArray[np.int64]) -> bool:
        own = [self.apart, self.expected, self.apart**2]
        apart, expected, variance = (_sums(part, each) for each in own)
        return _has_one_strength(apart + 2 * expected, 2 * expected, variance)


def is_steady(score: Score, scene: Scene, block_s: float) -> bool:
    """Return whether the strength of an effect differs between blocks by less than its mean.

    The spread is that of the scores of each block.

    Parameters
    ----------
    score
        Of the effect in the model without it.
    scene
        Whose steps the score is of.
    block_s
        Length of a block.
    """
    if not _lasts(score.candidate):
        return True
    times_s = scene.time_s(judged_by(score, scene))
    return _scores_of_one_strength(score.steps, times_s // block_s)


def has_pulses(score: Score, scene: Scene) -> bool:
    """Return whether an effect comes in pulses at regular times.

    Scores of a steady effect are no white noise where few moments ask for it, and then have a
    period as well; that its strength spreads by more than its mean over the phases is asked of it
    in any case.

    Parameters
    ----------
    score
        Of the effect in the model without it.
    scene
        Whose steps the score is of.
    """
    if not _lasts(score.candidate):
        return False
    moves = judged_by(score, scene)
    series = np.bincount(moves.at, score.steps, len(scene.k)).astype(np.float64)
    found = pulses(series[None], scene.dt_s)
    if not found.tail <= WAVERS:
        return False
    phase = scene.time_s(moves) / found.period_s % 1
    return not _scores_of_one_strength(score.steps, phase * PHASES // 1)


def judged_by(score: Score, scene: Scene) -> Moves:
    """Return the steps that an effect's score is of: all moves, or those with a turn.

    Parameters
    ----------
    score
        Of the effect.
    scene
        The recording.
    """
    return scene.moves if score.candidate.effect.on_speed else scene.turns


def _lasts(candidate: Candidate) -> bool:
    """Return whether an effect is one that cannot be there at times only.

    Individuals and rests differ between blocks by nature, and effects beyond the list may have
    their times.
    """
    return candidate.effect.in_any_steps and not candidate.effect.generic


def _scores_of_one_strength(steps: Floats, block: Floats) -> bool:
    """Return whether blocks of scores may have one strength, or spread by less than its mean."""
    place = np.unique(block, return_inverse=True)[1]
    information = _sums(place, steps**2)
    return _has_one_strength(_sums(place, steps), information, information)


def _sums(part: NDArray[np.int64], values: Floats) -> Floats:
    """Return the sum of values over each part of a recording."""
    return np.bincount(part, values).astype(np.float64)


def _has_one_strength(asked: Floats, information: Floats, variance: Floats) -> bool:
    """Return whether blocks may have one strength, or spread by less than its mean.

    That the spread is more than chance is not enough: in a long recording of a strong effect any
    two minutes differ. The spread is that of DerSimonian and Laird (1986, Controlled Clinical
    Trials 7: 177-188).

    Parameters
    ----------
    asked : ndarray, shape (block,)
        What each block asks for: its strength times its information.
    information : ndarray, shape (block,)
        That a block has of the strength. Blocks without any are left out.
    variance : ndarray, shape (block,)
        Of what is asked for.
    """
    tells = (information > 0) & (variance > 0)
    strength = asked[tells] / information[tells]
    weight = (information[tells] / np.sqrt(variance[tells])) ** 2
    total = float(weight.sum())
    beside = total - float((weight**2).sum()) / total if total > 0 else 0.0
    # One block alone tells of no spread.
    if not beside > _LEAST_BESIDE * total:
        return True
    mean = float((weight * strength).sum()) / total
    q, df = float((weight * (strength - mean) ** 2).sum()), len(strength) - 1
    spread2 = (q - df) / beside
    return bool(spread2 <= mean**2 or chdtrc(df, q) > WAVERS)
