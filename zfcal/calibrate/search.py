"""The search of one round: who is in the initial population, and generation after generation.

It knows when to stop but not what comes of it: the champion is chosen in ``rounds``.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from zfcal.arrays import Floats
from zfcal.behaviour.features.registry import SCORED
from zfcal.calibrate import evolve, evolve_deap
from zfcal.calibrate.evolve import (
    Evaluate,
    Objectives,
    State,
    diversities_in,
    overall_score,
    score_and_diversities,
)
from zfcal.calibrate.group import Purpose, SeedSource, Simulator
from zfcal.calibrate.history import Generation, describe
from zfcal.calibrate.objective import simulate_named
from zfcal.calibrate.pace import Deadline, Pace
from zfcal.calibrate.task import DEFAULT_GENERATIONS, Previous, Settings, Task
from zfcal.errors import InputError
from zfcal.parameters import n_genes

_PROBE_SHARE = 0.1
_RENEWED_SHARE = 0.2
"""As dynamic NSGA-II (Deb, Rao and Karthik 2007) with random newcomers."""

_OPTIMISERS: dict[str, ModuleType] = {"zfcal": evolve, "deap": evolve_deap}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Progress:
    """All that a search needs to go on from where it is.

    Parameters
    ----------
    state
        The population.
    parts
        Genes, shape (genome, gene), and features, shape (genome, feature), of all that the
        round has evaluated, in that order. As many parts as there were evaluations:
        to join them each time would cost a long search more than its breeding.
    history
        A line per generation, the initial population's first.
    world_changed
        Whether the probe said so.
    n_renewed
        Genomes of the last population that were replaced by random ones.
    """

    state: State
    parts: tuple[tuple[Floats, Floats], ...]
    history: tuple[Generation, ...]
    world_changed: bool = False
    n_renewed: int = 0

    @property
    def genes(self) -> Floats:
        """All genomes that the round has evaluated, shape (genome, gene)."""
        return np.concatenate([genes for genes, _ in self.parts])

    @property
    def features(self) -> Floats:
        """Their similarities, shape (genome, feature); NaN is null."""
        return np.concatenate([features for _, features in self.parts])

    @property
    def scores(self) -> Floats:
        """Score of all genomes that the round has evaluated, shape (genome,)."""
        return overall_score(self.features)


Watch = Callable[[Progress], None]
"""Called after the initial population and after every generation: to show, or to save."""


def search(
    task: Task,
    settings: Settings,
    *,
    deadline: Deadline | None = None,
    watch: Watch | None = None,
    resume: Progress | None = None,
) -> Progress:
    """Evolve the population until the generations or the time are used up.

    Parameters
    ----------
    task, settings
        What to calibrate, and how much to do.
    deadline
        The time for the confirmation and the ceiling is kept back from it. The
        initial population is evaluated in any case. None for no limit.
    watch
        Sees every generation.
    resume
        Where an earlier search of the same task and settings was; it goes on as
        that one would have.
    """
    limit = _limit(settings, deadline)
    step = functools.partial(_OPTIMISERS[settings.optimiser].step, objectives=_objectives(settings))
    evaluate = task.evaluation(settings)
    per_generation = task.work(
        n_genomes=settings.population, n_runs=settings.runs, n_steps=settings.steps
    )
    closing = task.closing_work(settings)
    pace = Pace(deadline)
    if deadline is not None:
        warm_up(task.simulator, settings.features)
    pace.start()
    if resume is None:
        progress = begin(task, settings, evaluate)
        pace.finish(per_generation)
        _show(watch, progress)
    else:
        if deadline is not None:
            _take_pace(pace, task, settings, evaluate)
        progress = resume
    while progress.state.generation < limit and pace.allows(per_generation + closing):
        pace.start()
        progress = advance(progress, evaluate, step)
        pace.finish(per_generation)
        _show(watch, progress)
    return progress


def _limit(settings: Settings, deadline: Deadline | None) -> float:
    if settings.generations is not None:
        return settings.generations
    return DEFAULT_GENERATIONS if deadline is None else math.inf


def _objectives(settings: Settings) -> Objectives:
    if settings.diversity == "population":
        return diversities_in(settings.population)
    return score_and_diversities


def _show(watch: Watch | None, progress: Progress) -> None:
    if watch is not None:
        watch(progress)


def warm_up(simulator: Simulator, features: Sequence[str] = SCORED) -> None:
    """Have the kernels compiled before the clock is asked how fast it is."""
    genes = np.full((1, n_genes(len(simulator.template.zones))), 0.5)
    seeds = SeedSource(trial_seed=0, window_end_s=0).seeds(Purpose.EVALUATION, 1)
    simulate_named(simulator, genes, features, n_counted=simulator.n_agents, n_steps=1, seeds=seeds)


def _take_pace(pace: Pace, task: Task, settings: Settings, evaluate: Evaluate) -> None:
    """Time a genome per worker, since a resumed search has timed no population."""
    n = max(task.group.n_workers, 1)
    pace.start()
    evaluate(np.full((n, task.n_genes), 0.5))
    pace.finish(task.work(n_genomes=n, n_runs=settings.runs, n_steps=settings.steps))


def advance(
    progress: Progress,
    evaluate: Evaluate,
    step: Callable[[State, Evaluate], State] = evolve.step,
) -> Progress:
    """Return the search one generation later, with all that it evaluated kept."""
    kept: list[tuple[Floats, Floats]] = []

    def evaluate_and_keep(genes: Floats) -> Floats:
        features = evaluate(genes)
        kept.append((genes, features))
        return features

    state = step(progress.state, evaluate_and_keep)
    return replace(
        progress,
        state=state,
        parts=(*progress.parts, *kept),
        history=(*progress.history, describe(state)),
    )


def begin(task: Task, settings: Settings, evaluate: Evaluate) -> Progress:
    """Return the search with its initial population evaluated on the new window.

    Nothing that was scored on an old window survives: everybody is simulated again.
    Where the probe finds that the world has changed, the worst fifth by crowded rank
    is replaced by random genomes, unless the settings say that it stays.
    """
    start = functools.partial(
        _OPTIMISERS[settings.optimiser].begin, objectives=_objectives(settings)
    )
    seed = task.seeds.sequence(Purpose.EVOLUTION)
    genes = first_population(task, settings)
    features = evaluate(genes)
    parts: tuple[tuple[Floats, Floats], ...] = ((genes, features),)
    state = start(genes, features, seed=seed)
    changed = (settings.renews and task.previous is not None) and world_changed(
        task.previous,
        overall_score(features),
        rng=task.seeds.generator(Purpose.PROBE),
    )
    n_renewed = round(_RENEWED_SHARE * len(genes)) if changed else 0
    if n_renewed:
        newcomers = task.seeds.generator(Purpose.RENEWAL).random((n_renewed, genes.shape[1]))
        fresh = evaluate(newcomers)
        state = start(
            np.concatenate([state.genes[:-n_renewed], newcomers]),
            np.concatenate([state.features[:-n_renewed], fresh]),
            seed=seed,
        )
        parts += ((newcomers, fresh),)
    state = replace(state, evaluations=len(genes) + n_renewed)
    return Progress(
        state=state,
        parts=parts,
        history=(describe(state),),
        world_changed=changed,
        n_renewed=n_renewed,
    )


def first_population(task: Task, settings: Settings) -> Floats:
    """Return who starts: the last population, or random genomes, and the guests.

    Parameters
    ----------
    task
        The guests and the last champion take the places at the end, the last
        population's best come first, and random genomes fill what is left.

    Returns
    -------
    ndarray, shape (population, gene)
    """
    n = settings.population
    fresh = task.seeds.generator(Purpose.FIRST_POPULATION).random((n, task.n_genes))
    guests = fresh[:0] if task.guests is None else np.atleast_2d(task.guests)
    if len(guests) > n:
        raise InputError(f"A population of {n} has no room for {len(guests)} guests.")
    if task.previous is None:
        return np.concatenate([fresh[: n - len(guests)], guests])
    veterans, champion = task.previous.genes, task.previous.champion
    if not (veterans[: n - len(guests)] == champion).all(axis=1).any() and len(guests) < n:
        guests = np.vstack([guests, champion])
    veterans = veterans[: n - len(guests)]
    return np.concatenate([veterans, fresh[: n - len(guests) - len(veterans)], guests])


def world_changed(previous: Previous, scores: Floats, *, rng: np.random.Generator) -> bool:
    """Return whether a probe of the last population does worse than a window's noise explains.

    Parameters
    ----------
    previous
        The last population, its scores on the old window, and the noise of a window.
    scores : ndarray, shape (genome,)
        On the new window; the last population's come first, in its order.
    rng
        Draws the tenth of them that is the probe.

    Returns
    -------
    bool
        Whether the probe's mean S has dropped by more than one standard deviation.
        NaN counts as 0; with an unknown noise any drop is a change.
    """
    n = min(len(previous.genes), len(scores))
    if n == 0:
        return False
    probe = rng.choice(n, size=math.ceil(_PROBE_SHARE * n), replace=False)
    before, after = (np.nan_to_num(s[probe], nan=0.0).mean() for s in (previous.scores, scores))
    noise = 0.0 if math.isnan(previous.noise) else previous.noise
    return bool(before - after > noise)
