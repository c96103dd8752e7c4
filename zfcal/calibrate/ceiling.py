"""How well a perfect model would score: a model's short windows against its own long run.

Two windows of one and the same model are never equal, so S means something only
beside what the model reaches against itself. Computed each time, never quoted.
"""

from __future__ import annotations

from statistics import NormalDist

from zfcal.arrays import Floats, Seeds
from zfcal.behaviour.ceilings import Ceiling, summarise
from zfcal.behaviour.features.registry import SCORED
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import Simulator
from zfcal.calibrate.objective import score_each, simulate_named
from zfcal.errors import InputError

_SDS = 2 * NormalDist().inv_cdf(0.975)
"""Standard deviations from the 2.5 to the 97.5 % quantile of a normal distribution."""


def measure_ceiling(  # noqa: PLR0913 - what is simulated, and what it is held against
    group: Simulator,
    genome: Floats,
    *,
    long_run: Statistics,
    n_steps: int,
    seeds: Seeds,
    features: tuple[str, ...] = SCORED,
) -> Ceiling:
    """Simulate windows of a model and score each against the model's own long run.

    Parameters
    ----------
    group
        Only as many agents as there are fish are counted in a window, as in a
        measured one; all of them where there is no fish.
    genome : ndarray, shape (gene,)
        The model.
    long_run
        Its own long simulation, all agents counted.
    n_steps
        Steps of a window.
    seeds : ndarray of uint64, shape (window,)
        One per window, none of them used for the long run.
    features
        What counts; `long_run` holds it.

    Returns
    -------
    Ceiling
        Mean and 2.5 to 97.5 % quantiles over windows, for every feature and zone.
    """
    if len(seeds) < 1 or n_steps < 1:
        raise InputError(
            f"A ceiling needs at least one window of one step, got {len(seeds)} windows "
            f"of {n_steps} steps."
        )
    runs = simulate_named(
        group,
        genome[None, :],
        features,
        n_counted=group.n_fish or group.n_agents,
        n_steps=n_steps,
        seeds=seeds,
    )
    return summarise(score_each(runs.of_genome(0), long_run, features))


def window_noise(ceiling: Ceiling) -> float:
    """Return the standard deviation of S between windows, from the ceiling's interval.

    Parameters
    ----------
    ceiling
        Its interval is taken as that of a normal distribution.

    Returns
    -------
    float
        NaN where S is null in every window.
    """
    _, low, high = ceiling.overall
    return (high - low) / _SDS
