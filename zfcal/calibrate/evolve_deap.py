"""The same generation with DEAP's own operators, as the published rig ran it.

Slower than ``evolve`` by tens of milliseconds a generation and the same in law. DEAP
draws from two global streams, ``random`` and ``numpy.random``: both are set from the
state before a generation and put back as they were found after it, so a run can be
stopped and resumed here too. No other module imports DEAP.
"""

# ruff: noqa: NPY002, S311 - the global streams are DEAP's, and nothing here is secret

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from deap import base, tools
from numpy.typing import ArrayLike

from zfcal.arrays import Floats
from zfcal.calibrate import evolve
from zfcal.calibrate.evolve import Evaluate, Objectives, State, score_and_diversities
from zfcal.calibrate.nsga2 import CROSSOVER_PROBABILITY, ETA, front_ranks


class _Individual(list[float]):
    """A genome as DEAP wants it: a list with a fitness."""

    def __init__(self, genes: list[float], row: int, fitness: base.Fitness) -> None:
        super().__init__(genes)
        self.row = row
        self.fitness = fitness


def begin(
    genes: ArrayLike,
    features: ArrayLike,
    *,
    seed: int | np.random.SeedSequence,
    objectives: Objectives = score_and_diversities,
) -> State:
    """Return the state of an initial population; see `evolve.begin`."""
    state = evolve.begin(genes, features, seed=seed, objectives=objectives)
    draw = np.random.Generator(np.random.PCG64(seed))
    first, second = (int(value) for value in draw.integers(2**32, size=2))
    with _global_streams() as capture:
        random.seed(first)
        np.random.seed(second)
        streams = capture()
    return replace(state, rng=streams)


def step(state: State, evaluate: Evaluate, objectives: Objectives = score_and_diversities) -> State:
    """Return the population one generation later; see `evolve.step`."""
    offspring, streams = _breed(state)
    genes = np.concatenate([state.genes, offspring])
    features = np.concatenate([state.features, evaluate(offspring)])
    values = objectives(genes, features)
    chosen = tools.selNSGA2(_individuals(genes, values), len(state.genes))
    kept = np.array([individual.row for individual in chosen])
    return State(
        genes=genes[kept],
        features=features[kept],
        objectives=values[kept],
        rank=front_ranks(values)[kept],
        crowding=np.array([individual.fitness.crowding_dist for individual in chosen]),
        generation=state.generation + 1,
        evaluations=state.evaluations + len(offspring),
        rng=streams,
    )


def _breed(state: State) -> tuple[Floats, dict[str, Any]]:
    parents = _individuals(state.genes, state.objectives)
    for parent, crowding in zip(parents, state.crowding, strict=True):
        parent.fitness.crowding_dist = float(crowding)
    with _global_streams(state.rng) as capture:
        picked = tools.selTournamentDCD(parents, len(parents))
        children = [_Individual(list(one), one.row, one.fitness) for one in picked]
        for one, other in zip(children[::2], children[1::2], strict=True):
            if random.random() <= CROSSOVER_PROBABILITY:
                tools.cxSimulatedBinaryBounded(one, other, ETA, 0.0, 1.0)
            for child in (one, other):
                tools.mutPolynomialBounded(child, ETA, 0.0, 1.0, 1.0 / len(child))
        return np.array(children), capture()


def _individuals(genes: Floats, objectives: Floats) -> list[_Individual]:
    weights = (1.0,) * objectives.shape[1]
    maximised = type("Maximised", (base.Fitness,), {"weights": weights})
    return [
        _Individual(row, number, maximised(values))
        for number, (row, values) in enumerate(
            zip(genes.tolist(), objectives.tolist(), strict=True)
        )
    ]


@contextmanager
def _global_streams(
    streams: dict[str, Any] | None = None,
) -> Iterator[Callable[[], dict[str, Any]]]:
    """Lend both global streams to a run; the caller's own come back in any case."""
    python, legacy = random.getstate(), np.random.get_state(legacy=False)
    try:
        if streams is not None:
            version, words, gauss = streams["random"]
            random.setstate((version, tuple(words), gauss))
            np.random.set_state(streams["numpy"])
        yield _captured
    finally:
        random.setstate(python)
        np.random.set_state(legacy)


def _captured() -> dict[str, Any]:
    version, words, gauss = random.getstate()
    legacy: Any = np.random.get_state(legacy=False)
    inner = {"key": legacy["state"]["key"].tolist(), "pos": int(legacy["state"]["pos"])}
    return {
        "random": [version, list(words), gauss],
        "numpy": {**legacy, "state": inner},
    }
