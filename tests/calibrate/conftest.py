"""A group whose behaviour is a plain function of its genes: quick, and known throughout."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from zfcal.calibrate.group import SeedSource, as_statistics, pool_runs, scale_gamma
from zfcal.calibrate.task import Settings, Task
from zfcal.model.simulate import Counts
from zfcal.parameters import Parameters, natural, to_genes

ZONES = (("corridor", True), ("walls", True), ("centre", False))
NAMES = tuple(name for name, _ in ZONES)
N_GENES = 18


@dataclass(frozen=True, kw_only=True)
class StandIn:
    """Agents that fall into bins with probabilities that their genes set, step by step."""

    template: Parameters
    n_fish: int = 4
    n_robots: int = 1
    n_workers: int = 2
    sharpness: float = 4.0

    @property
    def n_agents(self):
        """Fish and robots."""
        return self.n_fish + self.n_robots

    def with_template(self, template):
        """Return the same group with another template."""
        return replace(self, template=template)

    def simulate(self, genes, *, n_counted, n_steps, seeds):
        """Return counts; every genome meets the same uniform numbers in a run."""
        genes = scale_gamma(genes, 3)
        draws = [np.random.default_rng(int(seed)).random((n_steps, n_counted)) for seed in seeds]
        shapes = ((3, 10), (3, 10), (3,), (3, 3), (3, 10))
        tables = []
        for number, shape in enumerate(shapes):
            weights = np.random.default_rng(number).normal(size=(N_GENES, *shape))
            logits = self.sharpness * np.tensordot(genes - 0.5, weights, axes=1)
            cells = self._bins(logits.reshape(len(genes), -1), draws, number)
            tables.append(cells.reshape(len(genes), len(seeds), *shape))
        if n_counted == 1:
            tables[0] = np.zeros_like(tables[0])
        return Counts(*tables)

    def _bins(self, logits, draws, number):
        odds = np.exp(logits - logits.max(axis=1, keepdims=True))
        edges = np.cumsum(odds / odds.sum(axis=1, keepdims=True), axis=1)
        edges[:, -1] = 1.0
        out = np.zeros((len(logits), len(draws), logits.shape[1]), dtype=np.int64)
        for run, uniform in enumerate(draws):
            shifted = np.sort((uniform.ravel() + 0.137 * number) % 1.0)
            upto = np.array([np.searchsorted(shifted, row) for row in edges])
            out[:, run] = np.diff(upto, axis=1, prepend=0)
        return out


@pytest.fixture
def template():
    """Return a model of the three default zones."""
    return natural(ZONES, dt_s=0.2)


@pytest.fixture
def truth(template):
    """Return the genome of that model."""
    return to_genes(template)


@pytest.fixture
def stand_in(template):
    """Return a group of four fish and a robot."""
    return StandIn(template=template)


@pytest.fixture
def window(stand_in, truth):
    """Return what makes the statistics of a window of the true model, from a seed."""

    def make(seed=1, genes=truth, n_steps=600):
        seeds = np.array([seed], dtype=np.uint64)
        counts = stand_in.simulate(genes[None], n_counted=4, n_steps=n_steps, seeds=seeds)
        return as_statistics(pool_runs(counts), 0, NAMES)

    return make


@pytest.fixture
def task(stand_in, window):
    """Return the task of calibrating on one window."""
    return Task(group=stand_in, control=window(), seeds=SeedSource(trial_seed=7, window_end_s=120))


@pytest.fixture
def small():
    """Return settings of a round that takes a blink."""
    return Settings(
        population=20, generations=4, steps=300, long_runs=2, long_s=120.0, n_windows=40
    )
