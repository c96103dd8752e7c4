"""A tank whose numbers are easy by hand, and agents put where a test wants them."""

import numpy as np
import pytest
import shapely

from zfcal.arena import Arena, Zone, make_arena
from zfcal.tracks import Samples


@pytest.fixture(scope="session")
def tank() -> Arena:
    """A square of 0.4 m; `left` is x < 0.2, `right` the other half (the border is left's)."""
    return make_arena(
        name="tank",
        outline=shapely.box(0.0, 0.0, 0.4, 0.4),
        zones=(
            Zone(name="left", follows_walls=False, polygon=shapely.box(0.0, 0.0, 0.2, 0.4)),
            Zone(name="right", follows_walls=False, polygon=shapely.box(0.2, 0.0, 0.4, 0.4)),
        ),
    )


@pytest.fixture(scope="session")
def samples_of():
    """Return what makes samples of positions (sample, agent, xy); None is a missing agent."""

    def make(positions, *, kind=None, agent=None, dt_s=1.0, first_k=0):
        if not isinstance(positions, np.ndarray):
            lost = (np.nan, np.nan)
            positions = [[lost if p is None else p for p in row] for row in positions]
        xy_m = np.asarray(positions, dtype=float)
        n = xy_m.shape[1]
        return Samples(
            dt_s=dt_s,
            k=np.arange(first_k, first_k + len(xy_m), dtype=np.int64),
            agent=np.asarray(range(n) if agent is None else agent, dtype=np.int32),
            kind=np.zeros(n, dtype=np.int8) if kind is None else np.asarray(kind, dtype=np.int8),
            xy_m=xy_m,
            confidence=np.where(np.isnan(xy_m[..., 0]), np.nan, 1.0).astype(np.float32),
        )

    return make


@pytest.fixture
def wander(samples_of):
    """Return what makes agents that wander in and a little beyond the tank, some of them lost."""

    def make(seed, *, n_samples=60, n_agents=5, kind=None, lost=0.2):
        rng = np.random.default_rng(seed)
        start = rng.uniform(0.0, 0.4, (1, n_agents, 2))
        steps = rng.normal(0.0, 0.04, (n_samples, n_agents, 2))
        # Folded back at -0.03 and 0.43: some points are to be settled, some are void.
        path = np.abs((start + steps.cumsum(axis=0) + 0.03) % 0.92 - 0.46) - 0.03
        path[rng.random((n_samples, n_agents)) < lost] = np.nan
        return samples_of(path, kind=kind, dt_s=0.2)

    return make
