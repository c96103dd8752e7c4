"""What a diagnosis is asked: which model, which tracks, and how sure the answer is to be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from zfcal.arena import Arena
from zfcal.errors import InputError
from zfcal.parameters import Parameters
from zfcal.tracks import Samples

Tell: TypeAlias = Callable[[str, int, int], None]
"""Hears how far a diagnosis is: the stage, and how much is done of how much."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Question:
    """A model, and the tracks that it is held against.

    Parameters
    ----------
    samples
        Everybody's positions on the model's clock.
    arena
        The tank.
    model
        The model, with the effects that it has already.
    noise_m
        Standard deviation of a measured position, per coordinate, in metres; None
        where it is not known.
    noise_source
        Where that number comes from, in words, such as ``--noise-mm``.
    grain_m
        Positions are multiples of it; 0 where they are not.
    n_null
        Replicates of the null through the measurement chain.
    quick
        Take the analytic null instead.
    seed
        All random numbers derive from it.
    n_workers
        Threads; the numbers do not depend on it.
    """

    samples: Samples
    arena: Arena
    model: Parameters
    noise_m: float | None
    noise_source: str
    n_null: int
    quick: bool
    seed: int
    n_workers: int
    grain_m: float = 0.0

    def __post_init__(self) -> None:
        if self.model.zone_names != self.arena.zone_names:
            raise InputError(
                f"The model's zones are {', '.join(self.model.zone_names)}, expected those of "
                f"arena {self.arena.name!r}: {', '.join(self.arena.zone_names)}.",
                hint="Model and tracks must be of one arena.",
            )
        if not math.isclose(self.samples.dt_s, self.model.dt_s, rel_tol=1e-6):
            raise InputError(
                f"The tracks were sampled every {self.samples.dt_s:g} s, expected the model's "
                f"step of {self.model.dt_s:g} s."
            )
        if self.noise_m is not None and not 0 <= self.noise_m < math.inf:
            raise InputError(f"Position noise must be a length in metres, got {self.noise_m!r}.")
        for name, least in (("n_null", 1), ("seed", 0), ("n_workers", 1)):
            if not getattr(self, name) >= least:
                raise InputError(f"{name} must be at least {least}, got {getattr(self, name)!r}.")
