"""The lapses of a law: in each zone a share of headings that are drawn from anywhere.

Each zone has one of its own, as the model has. With one for all of them a feature of the steps in
one zone would gain by what the others' share falls to where it takes over these headings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from zfcal.arrays import Floats
from zfcal.model.extended import LAPSE

UNIFORM = 1 / (2 * math.pi)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lapses:
    """Where they are, and where a search for them begins.

    Parameters
    ----------
    usual : ndarray, shape (step,)
        Share of lapses that a fitted law has at each step.
    zone : ndarray of int, shape (step,)
    """

    usual: Floats
    zone: NDArray[np.int64]

    @cached_property
    def _zones(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the first step of each zone, and which zone each step is in, counted on."""
        return np.unique(self.zone, return_index=True, return_inverse=True)[1:]

    @cached_property
    def start(self) -> Floats:
        """Logits at which a search begins, shape (zone,)."""
        return np.asarray(logit(np.clip(self.usual[self._zones[0]], *LAPSE)))

    @cached_property
    def likely(self) -> Floats:
        """Shares of lapses at the start, shape (step,)."""
        return self.shares(self.start)

    def shares(self, levels: Floats) -> Floats:
        """Return the shares of lapses by their logits in the zones, shape (step,)."""
        return np.asarray(expit(levels)[self._zones[1]])

    def mixed(self, density: Floats, levels: Floats) -> tuple[float, Floats, Floats]:
        """Return the log likelihood, the shares of steps that are no lapse, and its slopes.

        Parameters
        ----------
        density : ndarray, shape (step,)
            Without lapses.
        levels : ndarray, shape (zone,)
            Logits of the lapses; slopes are by these, shape (step, zone).
        """
        each, own = expit(levels), self._zones[1]
        lapse = each[own]
        both = (1 - lapse) * density + lapse * UNIFORM
        slopes = np.zeros((len(density), len(levels)))
        rows = np.arange(len(density))
        slopes[rows, own] = (UNIFORM - density) / both * lapse * (1 - lapse)
        return float(np.log(both).sum()), (1 - lapse) * density / both, slopes

    def log_mixed(self, density: Floats, levels: Floats) -> Floats:
        """Return log densities with lapses."""
        lapse = self.shares(levels)
        return np.asarray(np.log((1 - lapse) * density + lapse * UNIFORM))
