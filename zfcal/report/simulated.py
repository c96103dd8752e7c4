"""What the calibrated model does, over a time long enough to leave no noise."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from zfcal.arena import Arena
from zfcal.behaviour.located import locate
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import Purpose, SeedSource, as_statistics, pool_runs
from zfcal.calibrate.recorded import Runs, count_recorded
from zfcal.calibrate.task import Settings
from zfcal.model.simulate import pack, simulate_counts, simulate_tracks
from zfcal.report.seen import Visits, visits_of
from zfcal.report.views import Round
from zfcal.tracks import FISH, Samples
from zfcal.trial import Trial

_MAP_RUNS = 4
_MAP_RUN_S = 1800.0


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


def long_visits(champion: Round, trial: Trial, arena: Arena) -> Visits:
    """Simulate a round's model and return where its fish are.

    Parameters
    ----------
    champion
        The round; the seeds are the first of those of its confirmation.
    trial
        Gives the agents; all are driven by the model, and robots are not counted.
    arena
        Where they swim.

    Returns
    -------
    Visits
        Of four runs of half an hour.
    """
    source = SeedSource(trial_seed=trial.seed, window_end_s=champion.second)
    seeds = source.seeds(Purpose.CONFIRMATION, _MAP_RUNS)
    parts = [_visits_of_run(champion, trial, arena, int(seed)) for seed in seeds]
    return functools.reduce(operator.add, parts)


def _visits_of_run(champion: Round, trial: Trial, arena: Arena, seed: int) -> Visits:
    n_steps = max(1, round(_MAP_RUN_S / trial.dt_s))
    xy_m, _ = simulate_tracks(
        champion.parameters,
        arena,
        n_agents=trial.n_agents,
        n_steps=n_steps,
        seed=seed,
        n_robots=trial.n_robots,
        clock_s=(float(champion.second), 1.0),
    )
    samples = Samples(
        dt_s=trial.dt_s,
        k=np.arange(n_steps),
        agent=np.arange(trial.n_fish, dtype=np.int32),
        kind=np.full(trial.n_fish, FISH, dtype=np.int8),
        xy_m=xy_m[:, : trial.n_fish],
        confidence=np.ones((n_steps, trial.n_fish), dtype=np.float32),
    )
    return visits_of(locate(samples, arena))
