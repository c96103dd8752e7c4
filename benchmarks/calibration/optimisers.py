"""Optimisers that search the same objective until they have had enough of it.

Each is used as its own documentation shows; what an optimiser needs beyond that was
chosen on the development windows and stands here. They ask a `Recorder`, which keeps
the answers and the time, and which ends the search.
"""

# ruff: noqa: S311 - the random numbers of DEAP's examples are Python's own

from __future__ import annotations

import math
import random
from collections.abc import Callable

import cma
import numpy as np
from deap import base, creator, tools
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2, RankAndCrowdingSurvival
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem
from skopt import gp_minimize
from threadpoolctl import threadpool_limits

from benchmarks.calibration.recorder import Recorder
from benchmarks.calibration.synthetic import Window
from zfcal.calibrate import search
from zfcal.calibrate.evolve import overall_score, score_and_diversities
from zfcal.calibrate.task import Settings, Task
from zfcal.model.likelihood import fit
from zfcal.model.scene import make_scene
from zfcal.parameters import to_genes

Floats = NDArray[np.float64]

POPULATION = 60

CMA_SIGMA = 0.3
CMA_SIGMA_NEAR = 0.2
CMA_POPULATION = 24
"""First steps of CMA-ES in genes, from the middle and from the likelihood estimate, and its
population: chosen among 0.2, 0.3, 0.5, among 0.05, 0.1, 0.2, and among 12, 24, 60."""


def likelihood_estimate(window: Window) -> Floats:
    """Return the most likely genome of a window's fish, shape (gene,)."""
    group = window.task.group
    found = fit(make_scene(window.samples, group.arena), group.template)
    return to_genes(found.parameters)


def ours(ask: Recorder, window: Window) -> None:
    """NSGA-II of zfcal, from random genomes."""
    _evolve(ask, window.task)


def ours_from_likelihood(ask: Recorder, window: Window) -> None:
    """NSGA-II of zfcal, as it is by default: the likelihood estimate among random genomes."""
    guest = likelihood_estimate(window)[None]
    task = Task(
        group=window.task.group, control=window.task.control, seeds=window.task.seeds, guests=guest
    )
    _evolve(ask, task)


def _evolve(ask: Recorder, task: Task) -> None:
    progress = search.begin(task, Settings(population=POPULATION), ask)
    while True:
        progress = search.advance(progress, ask)


def by_deap(ask: Recorder, window: Window) -> None:
    """NSGA-II of DEAP as in its examples: one individual at a time, fitness in plain Python."""
    random.seed(window.seed)
    if not hasattr(creator, "Similarity"):
        creator.create("Similarity", base.Fitness, weights=(1.0, 1.0, 1.0))
        creator.create("Candidate", list, fitness=creator.Similarity, features=None)
    toolbox = base.Toolbox()
    toolbox.register("gene", random.random)
    toolbox.register(
        "individual", tools.initRepeat, creator.Candidate, toolbox.gene, ask.n_genes
    )  # fmt: skip
    toolbox.register("population", tools.initRepeat, list, toolbox.individual)
    toolbox.register("evaluate", lambda one: ask(np.array([one]))[0].tolist())
    bounds = {"low": 0.0, "up": 1.0, "eta": 20.0}
    toolbox.register("mate", tools.cxSimulatedBinaryBounded, **bounds)
    toolbox.register("mutate", tools.mutPolynomialBounded, **bounds, indpb=1.0 / ask.n_genes)
    toolbox.register("select", tools.selNSGA2)
    population = toolbox.population(n=POPULATION)
    _score_in_python(toolbox, population)
    population = toolbox.select(population, POPULATION)
    while True:
        offspring = [toolbox.clone(one) for one in tools.selTournamentDCD(population, POPULATION)]
        for one, other in zip(offspring[::2], offspring[1::2], strict=True):
            if random.random() <= 0.9:
                toolbox.mate(one, other)
            for child in (one, other):
                toolbox.mutate(child)
                child.features = None
        _score_in_python(toolbox, population + offspring)
        population = toolbox.select(population + offspring, POPULATION)


def _score_in_python(toolbox: base.Toolbox, individuals: list) -> None:
    """Give everybody S and both diversities, simulating those that are new."""
    for one in individuals:
        if one.features is None:
            one.features = [0.0 if math.isnan(value) else value for value in toolbox.evaluate(one)]
    others = max(len(individuals) - 1, 1)
    for one in individuals:
        one.fitness.values = (
            math.prod(one.features) ** 0.25,
            sum(math.dist(one, other) for other in individuals) / others,
            sum(math.dist(one.features, other.features) for other in individuals) / others,
        )


class _MergedObjectives(RankAndCrowdingSurvival):
    """Selection by the published objectives, which depend on who else is there."""

    def _do(self, problem: Problem, pop: Population, **options: object) -> Population:
        values = score_and_diversities(pop.get("X"), np.array(list(pop.get("features"))))
        pop.set("F", -values)
        return super()._do(problem, pop, **options)


def by_pymoo(ask: Recorder, window: Window) -> None:
    """NSGA-II of pymoo with its own settings, on the same three objectives."""
    problem = Problem(n_var=ask.n_genes, n_obj=3, xl=0.0, xu=1.0)
    algorithm = NSGA2(pop_size=POPULATION, survival=_MergedObjectives())
    algorithm.setup(problem, termination=NoTermination(), seed=window.seed, verbose=False)
    while True:
        asked = algorithm.ask()
        genes = asked.get("X")
        features = ask(genes)
        asked.set("features", features)
        values = -score_and_diversities(genes, features)
        Evaluator().eval(StaticProblem(problem, F=values), asked)
        algorithm.tell(infills=asked)


def by_cma(ask: Recorder, window: Window) -> None:
    """CMA-ES of pycma on S, from the middle."""
    _cma(ask, np.full(ask.n_genes, 0.5), CMA_SIGMA, window.seed)


def by_cma_from_likelihood(ask: Recorder, window: Window) -> None:
    """CMA-ES of pycma on S, from the likelihood estimate."""
    _cma(ask, likelihood_estimate(window), CMA_SIGMA_NEAR, window.seed)


def _cma(ask: Recorder, start: Floats, sigma: float, seed: int) -> None:
    """Search; restart with twice the population where it has converged, as pycma's own loop."""
    options = {"bounds": [0.0, 1.0], "seed": seed, "verbose": -9}
    size = CMA_POPULATION
    while True:
        strategy = cma.CMAEvolutionStrategy(start, sigma, {**options, "popsize": size})
        while not strategy.stop():
            asked = strategy.ask()
            scores = np.nan_to_num(overall_score(ask(np.array(asked))), nan=0.0)
            strategy.tell(asked, (-scores).tolist())
        options["seed"] += 1
        size *= 2
        start = np.random.default_rng(options["seed"]).random(len(start))
        sigma = CMA_SIGMA


def by_gp(ask: Recorder, window: Window) -> None:
    """Bayesian optimisation of scikit-optimize on S: a Gaussian process, one genome at a time."""
    # On several threads its small matrices take five times as long where cores are shared.
    with threadpool_limits(1, user_api="blas"):
        gp_minimize(
            lambda genome: -ask.score(np.array(genome)),
            [(0.0, 1.0)] * ask.n_genes,
            n_calls=100_000,
            n_initial_points=10,
            acq_optimizer="sampling",
            random_state=window.seed,
        )


def at_random(ask: Recorder, window: Window) -> None:
    """Random genomes, as many at a time as a generation."""
    rng = np.random.default_rng(window.seed)
    while True:
        ask(rng.random((POPULATION, ask.n_genes)))


SLOW = "Bayesian optimisation of scikit-optimize"
"""Takes half a second for an evaluation, and longer for each further one."""

OPTIMISERS: dict[str, Callable[[Recorder, Window], None]] = {
    "NSGA-II of zfcal": ours,
    "NSGA-II of zfcal, with the likelihood estimate": ours_from_likelihood,
    "NSGA-II of DEAP, used the plain way": by_deap,
    "NSGA-II of pymoo": by_pymoo,
    "CMA-ES of pycma": by_cma,
    "CMA-ES of pycma, from the likelihood estimate": by_cma_from_likelihood,
    SLOW: by_gp,
    "random search": at_random,
}
"""The first is what all others are compared with."""
