"""A group of agents that genomes drive: its random numbers, its models, and what its runs count.

What the counts are worth beside a measured window stands in ``objective``, and what a
simulation does in ``zfcal.model``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from zfcal.arena import Arena
from zfcal.arrays import Floats, Ints, Seeds
from zfcal.behaviour.statistics import ATTRIBUTES, Statistics
from zfcal.calibrate.recorded import Runs, count_recorded
from zfcal.errors import InputError
from zfcal.model.effects import find_effect
from zfcal.model.effects.genome import check_genomes, from_genome
from zfcal.model.kernels.state import GRID
from zfcal.model.simulate import Counts, Start, pack_genes, simulate_counts
from zfcal.parameters import Parameters, n_genes

Sampler = Literal["exact", "grid"]

_MIN_SPEEDS = 10
"""A zone with fewer measured speeds borrows those of all zones."""


class Purpose(IntEnum):
    """What random numbers are for; the codes are part of every result's seed."""

    EVOLUTION = 1
    EVALUATION = 2
    CONFIRMATION = 3
    CEILING = 4
    FIRST_POPULATION = 5
    RENEWAL = 6
    PROBE = 7
    RANDOM_SEARCH = 8
    JUDGING = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class SeedSource:
    """Where the random numbers of one calibration round come from.

    Parameters
    ----------
    trial_seed
        The trial's seed, not negative.
    window_end_s
        The second at which the window ends: each round has its own numbers.
    """

    trial_seed: int
    window_end_s: int

    def __post_init__(self) -> None:
        if self.trial_seed < 0 or self.window_end_s < 0:
            raise InputError(
                f"A seed and a window's second must not be negative, got seed "
                f"{self.trial_seed} and second {self.window_end_s}."
            )

    def sequence(self, purpose: Purpose, run: int = 0) -> np.random.SeedSequence:
        """Return the seed sequence of one run, whatever the order in which runs are asked for."""
        key = (self.window_end_s, int(purpose), run)
        return np.random.SeedSequence(self.trial_seed, spawn_key=key)

    def generator(self, purpose: Purpose) -> np.random.Generator:
        """Return a generator for one purpose."""
        return np.random.Generator(np.random.PCG64(self.sequence(purpose)))

    def seeds(self, purpose: Purpose, n_runs: int) -> Seeds:
        """Return a seed per simulation run, shape (run,); more runs keep the first ones."""
        runs = [self.sequence(purpose, run).generate_state(1, np.uint64) for run in range(n_runs)]
        return np.concatenate(runs) if runs else np.empty(0, dtype=np.uint64)


class Simulator(Protocol):
    """A group of agents that can be simulated for many genomes at once.

    `Group` does it here; a cluster may do it elsewhere, with the same numbers.
    """

    @property
    def template(self) -> Parameters:
        """What genes do not say: step, speeds, field of view, effects."""

    @property
    def n_agents(self) -> int:
        """Fish and robots, all driven by the candidate."""

    @property
    def n_fish(self) -> int:
        """Agents that a measured window would count."""

    @property
    def n_workers(self) -> int:
        """Simulations that run at the same time; bears on time only."""

    def with_template(self, template: Parameters) -> Simulator:
        """Return the same group with another template."""

    def simulate(self, genes: Floats, *, n_counted: int, n_steps: int, seeds: Seeds) -> Counts:
        """Return counts with leading axes (genome, run)."""


@runtime_checkable
class Startable(Protocol):
    """A group whose simulations can begin where agents were seen."""

    def begun(self, start: Start) -> Simulator:
        """Return the same group, begun there."""


@runtime_checkable
class Recorder(Protocol):
    """A group whose paths can be looked at, for statistics that `Simulator` does not count."""

    def record(
        self, genes: Floats, names: Sequence[str], *, n_counted: int, n_steps: int, seeds: Seeds
    ) -> dict[str, Ints]:
        """Return counts of further statistics of the same simulations, axes (genome, run)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """The agents of a trial, simulated on this machine.

    Parameters
    ----------
    arena
        Where they swim.
    template
        What genes do not say: step, speeds, field of view, effects.
    n_fish, n_robots
        Agents, all driven by the candidate.
    n_workers
        Threads; the numbers do not depend on it.
    sampler
        How headings are drawn: ``exact``, or ``grid``, the paper's numeric way. One law, other
        random numbers.
    start
        Where all are at the first sample; None for anywhere, 60 s before. From a start headings are
        drawn exactly.
    """

    arena: Arena
    template: Parameters
    n_fish: int
    n_robots: int
    n_workers: int = 1
    sampler: Sampler = "exact"
    start: Start | None = field(default=None, compare=False, repr=False)

    @property
    def n_agents(self) -> int:
        """Fish and robots."""
        return self.n_fish + self.n_robots

    def with_template(self, template: Parameters) -> Group:
        """Return the same group with another template."""
        return replace(self, template=template)

    def begun(self, start: Start) -> Group:
        """Return the same group, whose simulations begin where agents were seen."""
        return replace(self, start=start)

    def simulate(self, genes: Floats, *, n_counted: int, n_steps: int, seeds: Seeds) -> Counts:
        """Simulate every genome with every seed; the burn-in comes on top, if there is one.

        Parameters
        ----------
        genes : ndarray, shape (genome, gene)
            In [0, 1].
        n_counted
            The first so many agents are counted.
        n_steps
            Steps of each run.
        seeds : ndarray of uint64, shape (run,)
            The same for all genomes (common random numbers).

        Returns
        -------
        Counts
            With leading axes (genome, run).
        """
        check_genomes(genes, self.template)
        if self.sampler == "grid" and self.start is None:
            tables = self.record(
                genes, tuple(ATTRIBUTES), n_counted=n_counted, n_steps=n_steps, seeds=seeds
            )
            return Counts(**{ATTRIBUTES[name]: table for name, table in tables.items()})
        return simulate_counts(
            pack_genes(genes, self.template, self.arena),
            self.arena,
            n_agents=self.n_agents,
            n_counted=n_counted,
            n_robots=self.n_robots,
            n_steps=n_steps,
            seeds=seeds,
            n_threads=self.n_workers,
            start=self.start,
        )

    def record(
        self, genes: Floats, names: Sequence[str], *, n_counted: int, n_steps: int, seeds: Seeds
    ) -> dict[str, Ints]:
        """Return counts of further statistics of the simulations that `simulate` counts.

        Parameters
        ----------
        genes : ndarray, shape (genome, gene)
        names
            Of the statistics.
        n_counted, n_steps, seeds
            As in `simulate`.

        Returns
        -------
        dict of ndarray of int64, with leading axes (genome, run)
        """
        check_genomes(genes, self.template)
        return count_recorded(
            [pack_genes(genome[None, :], self.template, self.arena) for genome in genes],
            self.arena,
            names,
            Runs(
                n_agents=self.n_agents,
                n_counted=n_counted,
                n_robots=self.n_robots,
                n_steps=n_steps,
                seeds=seeds,
                n_threads=self.n_workers,
                grid=GRID if self.sampler == "grid" else 0,
            ),
        )


def scale_gamma(genes: ArrayLike, n_zones: int) -> Floats:
    """Return genes with each row of gamma scaled to a maximum of one, as models are reported.

    Only ratios within a row matter, so the model stays what it is. A row of zeros
    prefers nothing and becomes a row of ones.

    Parameters
    ----------
    genes : array_like, shape (..., gene)
        In [0, 1], in the order of `zfcal.model.effects.genome.genome_names`.
    n_zones
        Zones of the arena.

    Returns
    -------
    ndarray, shape (..., gene)
    """
    values = np.array(genes, dtype=np.float64)
    if values.shape[-1:] < (n_genes(n_zones),):
        raise InputError(
            f"Genomes of {n_zones} zones need {n_genes(n_zones)} genes, got a table of shape "
            f"{values.shape}."
        )
    rates = slice(3 * n_zones, n_genes(n_zones))
    rows = values[..., rates].reshape(*values.shape[:-1], n_zones, n_zones)
    most = rows.max(axis=-1, keepdims=True)
    rows = np.where(most > 0, rows / np.where(most > 0, most, 1.0), 1.0)
    values[..., rates] = rows.reshape(*values.shape[:-1], n_zones**2)
    return values


def express(genes: ArrayLike, template: Parameters) -> Parameters:
    """Return the model that a genome stands for, its gamma rows scaled to a maximum of one."""
    return from_genome(scale_gamma(genes, len(template.zones)), template)


def with_measured_speeds(template: Parameters, control: Statistics) -> Parameters:
    """Return a model that draws its speeds from what was measured.

    Rule: the speeds of a model are those of its draws, before an effect multiplies them.
    Measured speeds hold that effect already, so a model with an effect on speed keeps its
    own, from which the effect was divided out when it was added.

    Parameters
    ----------
    template
        Gives everything else.
    control
        Its V counts: a zone with fewer than ten takes the speeds of all zones
        together; with fewer than ten of these, the template's stay.

    Raises
    ------
    InputError
        The zones are not the template's.
    """
    if control.zone_names != template.zone_names:
        raise InputError(
            f"The model's zones are {', '.join(template.zone_names)}, "
            f"the window's {', '.join(control.zone_names)}.",
            hint="Model and trial must name the same arena.",
        )
    if any(find_effect(name).on_speed for name in template.effects):
        return template
    everywhere = control.speed.sum(axis=0)
    zones = []
    for zone, own in zip(template.zones, control.speed, strict=True):
        counts = own if own.sum() >= _MIN_SPEEDS else everywhere
        measured = tuple((counts / max(counts.sum(), 1)).tolist())
        frequency = measured if counts.sum() >= _MIN_SPEEDS else zone.speed_frequency
        zones.append(replace(zone, speed_frequency=frequency))
    return replace(template, zones=tuple(zones))


def pool_runs(counts: Counts) -> Counts:
    """Return the counts of each genome's runs together, leading axis (genome,)."""
    return Counts(*(values.sum(axis=1) for values in counts))


def runs_of(counts: Counts, genome: int) -> Counts:
    """Return the counts of one genome run by run, leading axis (run,)."""
    return Counts(*(values[genome] for values in counts))


def as_statistics(counts: Counts, row: int, zone_names: tuple[str, ...]) -> Statistics:
    """Return one row of pooled counts as the statistics of a window."""
    return Statistics(
        zone_names=zone_names,
        distance=counts.distance[row],
        wall=counts.wall[row],
        occupation=counts.occupation[row],
        transition=counts.transition[row],
        speed=counts.speed[row],
    )
