"""What a search has reached, generation by generation."""

from __future__ import annotations

from dataclasses import dataclass

import moocore
import numpy as np

from zfcal.arrays import Floats
from zfcal.calibrate.evolve import State


@dataclass(frozen=True, slots=True, kw_only=True)
class Generation:
    """One line of a search's history.

    Parameters
    ----------
    generation
        0 for the initial population.
    evaluations
        Genomes evaluated so far.
    best_score
        The highest S in the population, as the search sees it: optimistic.
    hypervolume
        Of the population's similarities above 0: of I_D, I_W, I_O, I_T, or of what was named.
    """

    generation: int
    evaluations: int
    best_score: float
    hypervolume: float


def describe(state: State) -> Generation:
    """Return the line of history of a population."""
    scores = np.nan_to_num(state.scores, nan=0.0)
    return Generation(
        generation=state.generation,
        evaluations=state.evaluations,
        best_score=float(scores.max()),
        hypervolume=hypervolume(state.features),
    )


def hypervolume(features: Floats) -> float:
    """Return the volume of what the features dominate, down to 0.

    Parameters
    ----------
    features : ndarray, shape (individual, feature)
        In [0, 1]. A feature that is null (NaN) for everybody is left out; where
        it is null for some, it counts as 0 for these.

    Returns
    -------
    float
        In [0, 1]; 0 where all are null.
    """
    known = ~np.isnan(features).all(axis=0)
    if not known.any():
        return 0.0
    points = np.nan_to_num(features[:, known], nan=0.0)
    return float(moocore.hypervolume(points, ref=np.zeros(known.sum()), maximise=True))
