"""Groups whose model has effects: their trial's clock runs as long as the recording."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.effects.genome import check_genomes
from zfcal.model.simulate import Counts, pack_genes, simulate_counts
from zfcal.parameters import Parameters


@dataclass(frozen=True, slots=True, kw_only=True)
class SpanGroup:
    """A `Simulator` in which every run, however short, goes through the whole recording's time.

    Speed or attraction may drift over a trial. A search simulates minutes: they are spread
    over the recording, so that each run sees as much of the drift as the fish did.

    Parameters
    ----------
    arena, template, n_fish, n_robots, n_workers
        As of `zfcal.calibrate.group.Group`.
    span_s
        From and to of the recording, in seconds of the trial.
    """

    arena: Arena
    template: Parameters
    n_fish: int
    n_robots: int
    span_s: tuple[float, float]
    n_workers: int = 1

    @property
    def n_agents(self) -> int:
        """Fish and robots."""
        return self.n_fish + self.n_robots

    def with_template(self, template: Parameters) -> SpanGroup:
        """Return the same group with another template."""
        return replace(self, template=template)

    def simulate(
        self, genes: Floats, *, n_counted: int, n_steps: int, seeds: NDArray[np.uint64]
    ) -> Counts:
        """Return counts with leading axes (genome, run); the burn-in comes on top."""
        check_genomes(genes, self.template)
        start_s, end_s = self.span_s
        pace = (end_s - start_s) / (n_steps * self.template.dt_s)
        packed = pack_genes(genes, self.template, self.arena)
        return simulate_counts(
            packed._replace(clock_s=np.array([start_s, pace])),
            self.arena,
            n_agents=self.n_agents,
            n_counted=n_counted,
            n_steps=n_steps,
            seeds=seeds,
            n_robots=self.n_robots,
            n_threads=self.n_workers,
        )
