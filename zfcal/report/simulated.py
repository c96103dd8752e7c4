"""What the calibrated model does, over a time long enough to leave no noise."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from zfcal.arena import Arena
from zfcal.behaviour.located import Located, locate
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.group import Purpose, SeedSource, as_statistics, pool_runs
from zfcal.calibrate.recorded import Runs, count_recorded
from zfcal.calibrate.task import Settings
from zfcal.model.simulate import pack, simulate_counts, simulate_tracks
from zfcal.report.seen import Visits, visits_of
from zfcal.report.views import Round
from zfcal.tracks import FISH, ROBOT, Samples
from zfcal.trial import Trial
from zfcal.units import WINDOW_S

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
    runs = (_run(champion, trial, arena, int(seed), _MAP_RUN_S) for seed in seeds)
    parts = [visits_of(locate(samples, arena).of_kind(FISH)) for samples in runs]
    return functools.reduce(operator.add, parts)


def window_run(champion: Round, trial: Trial, arena: Arena) -> Located:
    """Simulate a round's model for one window and return where all agents are.

    Parameters
    ----------
    champion, trial, arena
        As for `long_visits`; robots are among the agents, driven by the model as fish are.
    """
    source = SeedSource(trial_seed=trial.seed, window_end_s=champion.second)
    (seed,) = source.seeds(Purpose.CONFIRMATION, 1)
    return locate(_run(champion, trial, arena, int(seed), WINDOW_S), arena)


def _run(champion: Round, trial: Trial, arena: Arena, seed: int, length_s: float) -> Samples:
    n_steps, n = max(1, round(length_s / trial.dt_s)), trial.n_agents
    xy_m, _ = simulate_tracks(
        champion.parameters,
        arena,
        n_agents=n,
        n_steps=n_steps,
        seed=seed,
        n_robots=trial.n_robots,
        clock_s=(float(champion.second), 1.0),
    )
    return Samples(
        dt_s=trial.dt_s,
        k=np.arange(n_steps),
        agent=np.arange(n, dtype=np.int32),
        kind=np.where(np.arange(n) < trial.n_fish, FISH, ROBOT).astype(np.int8),
        xy_m=xy_m,
        confidence=np.ones((n_steps, n), dtype=np.float32),
    )
