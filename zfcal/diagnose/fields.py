"""Fields of the tank, within which effects on speed are asked for.

A lit room makes fish fast there, and so where many are, if they gather there. Within a field of
the tank all is lit alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Ints
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.contexts import N_FIELDS, field_of
from zfcal.model.kernels.state import X, Y
from zfcal.model.scene import Scene

_LEAST_MOVES = 20
"""Moves of a field of its own; less their own mean, fewer would vary too little."""


def is_within_fields(candidate: Candidate) -> bool:
    """Return whether an effect on speed is asked for within fields, rather than across them."""
    return not candidate.effect.by_place


def fields_of(scene: Scene, kept: NDArray[np.bool_]) -> Ints:
    """Return the field of each move, numbered on over the zones, shape (move,).

    Parameters
    ----------
    scene
        Of the recording.
    kept : ndarray of bool, shape (move,)
        Moves that count. Fields of a zone with fewer than 20 of them are one.
    """
    moves, states = scene.moves, scene.states
    field = field_of(scene, states[moves.at, X, moves.who], states[moves.at, Y, moves.who])
    own = moves.zone * (N_FIELDS + 1) + field
    return np.where(is_known(own, kept), own, own - field + N_FIELDS).astype(np.int64)


def is_known(field: Ints, learnt: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which moves are in a field with enough moves that are learnt from, shape (move,).

    Parameters
    ----------
    field
        Of each move.
    learnt : ndarray of bool, shape (move,)
    """
    n_fields = int(field.max(initial=0)) + 1
    return np.asarray(np.bincount(field[learnt], minlength=n_fields)[field] >= _LEAST_MOVES)
