"""What the calibrated model does, over a time long enough to leave no noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from zfcal.arena import Arena
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import Purpose, SeedSource, as_statistics, pool_runs
from zfcal.calibrate.recorded import Runs, count_recorded
from zfcal.calibrate.task import Settings
from zfcal.model.simulate import pack, simulate_counts
from zfcal.report.views import Round
from zfcal.trial import Trial


def long_run(
    champion: Round,
    trial: Trial,
    arena: Arena,
    *,
    settings: Settings | None = None,
    further: Sequence[str] = (),
) -> Statistics:
    """Simulate a round's model as the round itself did for its confirmation.

    Parameters
    ----------
    champion
        The round; its seeds follow from the trial's and its window.
    trial
        Gives the agents, all driven by the model and all counted.
    arena
        Where they swim.
    settings
        How many runs, and how long; None for the default, 10 x 1800 s.
    further
        Statistics to count beside D, W, O, T and V, from the same paths.

    Returns
    -------
    Statistics
        The runs pooled.
    """
    settings = settings or Settings()
    source = SeedSource(trial_seed=trial.seed, window_end_s=champion.second)
    model = pack([champion.parameters], arena)
    runs = Runs(
        n_agents=trial.n_agents,
        n_counted=trial.n_agents,
        n_robots=trial.n_robots,
        n_steps=max(1, round(settings.long_s / trial.dt_s)),
        seeds=np.asarray(source.seeds(Purpose.CONFIRMATION, settings.long_runs)),
    )
    counts = simulate_counts(
        model,
        arena,
        n_agents=runs.n_agents,
        n_counted=runs.n_counted,
        n_robots=runs.n_robots,
        n_steps=runs.n_steps,
        seeds=runs.seeds,
    )
    found = {}
    if further:
        recorded = count_recorded([model], arena, further, runs)
        found = {name: values[0].sum(axis=0) for name, values in recorded.items()}
    return replace(as_statistics(pool_runs(counts), 0, arena.zone_names), further=found)
