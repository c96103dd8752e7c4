"""What scores are worth when nothing is missing: the fitted model through the measurement.

The model is simulated, its positions get the tracker's noise, its gaps and its rounding,
and the same filters, fit and scores follow. Without it two millimetres of noise read as
a turning memory every time: the displacement into a misplaced point and that out of it
err in opposite directions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtr

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.diagnose.screening import Screen
from zfcal.errors import InputError
from zfcal.model.extended import maximise
from zfcal.model.fitted import Fitted
from zfcal.model.scene import Scene, make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import Parameters
from zfcal.tracks import ROBOT, Samples

T = TypeVar("T")

_ROUNDS = 2
"""Steps of a replicate's fit, which starts at the parameters that made it."""

UNLIKE = 0.25
"""Share of what noise makes of a statistic that its replicates may miss."""

_PRIOR_WEIGHT = 20.0
"""Replicates that the theory, a spread of one, counts for in what suspects are asked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """How positions came about: what stands between a fish and its track.

    Parameters
    ----------
    noise_m
        Standard deviation per coordinate.
    grain_m
        Positions are multiples of it; 0 where they are not.
    """

    noise_m: float = 0.0
    grain_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Null:
    """Centre and spread of each statistic when nothing is missing.

    Parameters
    ----------
    centre, spread : ndarray, shape (statistic,)
        Zero and one by theory.
    n
        Replicates; none for the theory alone.
    largest : ndarray, shape (replicate,)
        Of each replicate its largest statistic, standardised by the others.
    """

    centre: Floats
    spread: Floats
    n: int
    largest: Floats

    def standardised(self, z: Floats) -> Floats:
        """Return statistics less their centre, over their spread."""
        return np.asarray((z - self.centre) / self.spread)

    def p(self, z: Floats) -> Floats:
        """Return two-sided p-values of standardised statistics, one by one.

        Student's law stands for what is not known of centre and spread.
        """
        if self.n == 0:
            return np.asarray(2 * ndtr(-np.abs(z)))
        widened = np.abs(z) / np.sqrt(1 + 1 / self.n)
        return np.asarray(2 * stdtr(self.n - 1 + _PRIOR_WEIGHT, -widened))


def theory(n_statistics: int) -> Null:
    """Return the null as it is without noise, in a long recording."""
    return Null(
        centre=np.zeros(n_statistics),
        spread=np.ones(n_statistics),
        n=0,
        largest=np.zeros(0),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moments:
    """What replicates show of statistics, drawn toward the theory.

    Parameters
    ----------
    centre, variance : ndarray, shape (statistic,)
        The mean; and the variance about it, drawn toward the theory's one.
    df
        Degrees of freedom of the variance.
    """

    centre: Floats
    variance: Floats
    df: float

    def spread_of_one_more(self, n: int) -> Floats:
        """Return the standard deviation of one more about the mean of n."""
        return np.asarray(np.sqrt(self.variance * (1 + 1 / max(n, 1))))


def moments_of(table: Floats, weight: float) -> Moments:
    """Return centre and variance of statistics; the theory's variance of one has a weight.

    Parameters
    ----------
    table : ndarray, shape (replicate, statistic)
        Without replicates the theory is left.
    weight
        Replicates that the theory counts for.
    """
    n = len(table)
    centre = table.mean(axis=0) if n else np.zeros(table.shape[1])
    df = max(n - 1, 0) + weight
    squares = ((table - centre) ** 2).sum(axis=0)
    return Moments(centre=centre, variance=(squares + weight) / df, df=df)


def from_replicates(table: Floats) -> Null:
    """Return the null that replicates show.

    Parameters
    ----------
    table : ndarray, shape (replicate, statistic)
    """
    n = len(table)
    moments = moments_of(table, _PRIOR_WEIGHT)
    spread = np.sqrt(moments.variance)
    z = np.abs(table - moments.centre) * np.sqrt(n / (n - 1)) / spread
    return Null(centre=moments.centre, spread=spread, n=n, largest=z.max(axis=1, initial=0.0))


def replicate(
    samples: Samples, arena: Arena, fitted: Fitted, measurement: Measurement, *, seed: int
) -> Samples:
    """Return tracks of the fitted model as they would have been measured.

    Parameters
    ----------
    samples
        The measured ones: as many agents, for as long, with the same gaps and ids.
    fitted
        The model.
    seed
        Makes the simulation and the noise.
    """
    present = ~np.isnan(samples.xy_m[..., 0])
    robots = samples.kind == ROBOT
    n_robots = int(present[:, robots].sum(axis=1).max(initial=0))
    n_fish = int(present[:, ~robots].sum(axis=1).max(initial=0))
    xy, _ = simulate_tracks(
        fitted.parameters,
        arena,
        n_agents=n_fish + n_robots,
        n_robots=n_robots,
        n_steps=len(samples.k),
        seed=seed,
        clock_s=(float(samples.k[0]) * samples.dt_s, 1.0),
    )
    # Whoever is there at a sample takes the next simulated agent, and keeps it.
    made = np.full_like(samples.xy_m, np.nan)
    for group, first, n in ((~robots, 0, n_fish), (robots, n_fish, n_robots)):
        columns = np.flatnonzero(group)
        whose = _assign(present[:, columns], max(1, n))
        for column, agent in zip(columns, whose, strict=True):
            rows = present[:, column]
            made[rows, column] = xy[rows, first + agent]
    generator = np.random.default_rng([seed, 1])
    if measurement.noise_m > 0:
        made += generator.normal(0.0, measurement.noise_m, made.shape)
    if measurement.grain_m > 0:
        made = np.round(made / measurement.grain_m) * measurement.grain_m
    return Samples(
        dt_s=samples.dt_s,
        k=samples.k,
        agent=samples.agent,
        kind=samples.kind,
        xy_m=made,
        confidence=samples.confidence,
    )


def _assign(present: NDArray[np.bool_], n: int) -> NDArray[np.int64]:
    """Return a simulated agent for each track, none twice at a time where that can be."""
    whose = np.zeros(present.shape[1], dtype=np.int64)
    until = np.full(n, -1)
    for track in np.argsort(present.argmax(axis=0), kind="stable"):
        seen = np.flatnonzero(present[:, track])
        if not len(seen):
            continue
        free = np.flatnonzero(until < seen[0])
        agent = int(free[0]) if len(free) else int(until.argmin())
        whose[track], until[agent] = agent, seen[-1]
    return whose


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """All that a replicate needs.

    Parameters
    ----------
    samples, arena
        What was measured, and where.
    fitted
        The model at its maximum likelihood.
    measurement
        Noise and grain.
    maker
        The model that makes the replicates; None for the fitted one.
    seed
        Of the trial.
    keeps
        Replicates below this number are kept, to be asked again.
    """

    samples: Samples
    arena: Arena
    fitted: Fitted
    measurement: Measurement
    seed: int
    maker: Parameters | None = None
    keeps: int = 0
    kept: dict[int, Screen] = field(default_factory=dict)

    @property
    def simulated(self) -> Parameters:
        """The model that makes the replicates."""
        return self.fitted.parameters if self.maker is None else self.maker

    def screen(self, number: int) -> Screen:
        """Return replicate ``number``, fitted and ready to be asked.

        What it works out when it is asked goes with it: six of them would hold as much memory as
        all the rest of a diagnosis.
        """
        made = self.kept[number] if number in self.kept else self._made(number)
        if number < self.keeps:
            self.kept[number] = made
        return replace(made)

    def _made(self, number: int) -> Screen:
        word = int(np.random.SeedSequence([self.seed, 7, number]).generate_state(1)[0])
        maker = replace(self.fitted, parameters=self.simulated)
        made = replicate(self.samples, self.arena, maker, self.measurement, seed=word)
        scene = make_scene(made, self.arena)
        again = maximise(
            scene,
            self.fitted.parameters,
            free=self.fitted.free,
            start=self.fitted.x,
            rounds=_ROUNDS,
        )
        return Screen(scene=scene, fitted=again)


def run_null(
    chain: Chain,
    ask: Callable[[int, Screen], T],
    numbers: Sequence[int],
    *,
    n_workers: int,
    done: Callable[[int], None] = lambda _n: None,
) -> list[T]:
    """Return what is asked of each replicate, in their order.

    Parameters
    ----------
    chain
        From the fitted model to scores.
    ask
        Of a replicate: its number and its screen.
    numbers
        Of the replicates: each is the same whenever it is asked.
    n_workers
        Replicates at the same time; the numbers do not depend on it.
    done
        Told how many are done.
    """
    rows: list[T] = []

    def work(number: int) -> T:
        return ask(number, chain.screen(number))

    with ThreadPoolExecutor(max(1, n_workers)) as pool:
        for row in pool.map(work, numbers):
            rows.append(row)
            done(len(rows))
    return rows


def check_length(samples: Samples, scene: Scene, least_steps: int) -> None:
    """Raise an `InputError` where too few steps have a heading."""
    if len(scene.turns) < least_steps:
        raise InputError(
            f"A diagnosis needs {least_steps} steps of fish with a heading, got "
            f"{len(scene.turns)} in {len(samples.k)} samples of {samples.dt_s:g} s.",
            hint="Record for longer, or look whether fish move and keep their track ids.",
        )
