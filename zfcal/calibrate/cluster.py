"""A group of agents that is simulated on a cluster, with the same numbers as here.

A population is cut into pieces, a few genomes with all runs or one genome with a few
runs. Every simulation is made of its genome and its seed alone, so it does not matter
who does which, in what order, how many there are, or how often a piece is begun anew.
How the cluster is reached stands in ``scheduler``.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zfcal.arrays import Floats, Seeds
from zfcal.calibrate.group import Group
from zfcal.calibrate.scheduler import Cluster
from zfcal.model.effects.genome import check_genomes
from zfcal.model.simulate import Counts, Start, burn_in_steps
from zfcal.parameters import Parameters

LEAST_STEPS = 50_000
MOST_STEPS = 1_000_000
"""Agent-steps in a piece: from some ten milliseconds, much more than a message takes,
to some tenths of a second, so that little is lost with a worker."""

_PIECES_PER_THREAD = 4


Piece = tuple[slice, slice]
"""Genomes and runs that are simulated together."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClusterGroup:
    """The agents of a trial, simulated on a cluster: a `Simulator`.

    Parameters
    ----------
    group
        The same agents here; its number of workers has no meaning.
    cluster
        Who simulates.
    """

    group: Group
    cluster: Cluster

    @property
    def template(self) -> Parameters:
        """What genes do not say: step, speeds, field of view, effects."""
        return self.group.template

    @property
    def n_agents(self) -> int:
        """Fish and robots, all driven by the candidate."""
        return self.group.n_agents

    @property
    def n_fish(self) -> int:
        """Agents that a measured window would count."""
        return self.group.n_fish

    @property
    def n_workers(self) -> int:
        """Simulations that run at the same time; bears on time only."""
        return max(1, self.cluster.n_threads)

    def with_template(self, template: Parameters) -> ClusterGroup:
        """Return the same group with another template."""
        return ClusterGroup(group=self.group.with_template(template), cluster=self.cluster)

    def begun(self, start: Start) -> ClusterGroup:
        """Return the same group, whose simulations begin where agents were seen."""
        return ClusterGroup(group=self.group.begun(start), cluster=self.cluster)

    @cached_property
    def _parcel(self) -> bytes:
        """The group as it travels, packed once for all generations.

        Each piece brings it, two kilobytes: what is scattered over workers is lost
        with the last of them that has it, and cannot be made again.
        """
        return pickle.dumps(replace(self.group, n_workers=1))

    def simulate(self, genes: Floats, *, n_counted: int, n_steps: int, seeds: Seeds) -> Counts:
        """Simulate every genome with every seed; see `Group.simulate`.

        Raises
        ------
        ZfcalError
            The cluster has gone.
        """
        check_genomes(genes, self.template)
        table = np.ascontiguousarray(genes, dtype=np.float64)
        words = np.ascontiguousarray(seeds, dtype=np.uint64)
        steps = self.n_agents * (n_steps + burn_in_steps(self.template.dt_s))
        blocks = pieces(len(table), len(words), steps_each=steps, n_workers=self.n_workers)
        parts = self.cluster.work(
            _simulate_piece,
            [
                (self._parcel, table[rows], words[runs], (n_counted, n_steps))
                for rows, runs in blocks
            ],
        )
        return assemble(parts, blocks)


def _simulate_piece(parcel: bytes, genes: Floats, seeds: Seeds, sizes: tuple[int, int]) -> Counts:
    """Simulate one piece, on a worker.

    Parameters
    ----------
    parcel
        The group, with one thread: the worker's threads have pieces of their own.
    genes : ndarray, shape (genome, gene)
    seeds : ndarray of uint64, shape (run,)
    sizes
        Agents that count, and steps of each run.
    """
    group: Group = pickle.loads(parcel)  # noqa: S301 - from whoever runs this worker
    n_counted, n_steps = sizes
    return group.simulate(genes, n_counted=n_counted, n_steps=n_steps, seeds=seeds)


def pieces(n_genomes: int, n_runs: int, *, steps_each: int, n_workers: int) -> list[Piece]:
    """Return how a population is cut: each pair of genome and run is in one piece.

    Parameters
    ----------
    n_genomes, n_runs
        Shape of what is cut.
    steps_each
        Agent-steps of one simulation, burn-in included.
    n_workers
        There are some pieces for each, unless they were too small or too large.
    """
    jobs = n_genomes * n_runs
    fair = -(-jobs // (_PIECES_PER_THREAD * n_workers))
    least, most = -(-LEAST_STEPS // steps_each), max(1, MOST_STEPS // steps_each)
    size = max(1, min(max(fair, least), most))
    rows = max(1, size // max(n_runs, 1))
    runs = min(size, n_runs) if rows == 1 else n_runs
    return [
        (slice(row, min(row + rows, n_genomes)), slice(run, min(run + runs, n_runs)))
        for row in range(0, n_genomes, rows)
        for run in range(0, n_runs, max(runs, 1))
    ]


def assemble(parts: list[Counts], blocks: list[Piece]) -> Counts:
    """Return the counts of all pieces, each at its place, leading axes (genome, run)."""
    rows = max(block[0].stop for block in blocks)
    runs = max(block[1].stop for block in blocks)
    tables = []
    for number in range(len(Counts._fields)):
        whole = np.zeros((rows, runs, *parts[0][number].shape[2:]), dtype=np.int64)
        for part, block in zip(parts, blocks, strict=True):
            whole[block] = part[number]
        tables.append(whole)
    return Counts(*tables)
