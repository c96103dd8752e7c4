"""What a round has to beat: random search at equal cost, and doing nothing.

Both are confirmed as the champion is, with the same long simulations and seeds.
"""

from __future__ import annotations

import numpy as np

from zfcal.arrays import Floats
from zfcal.calibrate.confirm import Confirmed, best_distinct, confirm
from zfcal.calibrate.evolve import overall_score
from zfcal.calibrate.group import Purpose
from zfcal.calibrate.task import Settings, Task
from zfcal.errors import InputError
from zfcal.model.effects.genome import check_genomes


def random_search(task: Task, settings: Settings, *, n_evaluations: int) -> Confirmed:
    """Return the best of as many random genomes as the round has evaluated.

    Parameters
    ----------
    task, settings
        Of the round that is compared.
    n_evaluations
        Genomes to draw, uniform in [0, 1], and to evaluate as the round does.
    """
    if n_evaluations < 1:
        raise InputError(f"Random search needs at least one evaluation, got {n_evaluations}.")
    rng = task.seeds.generator(Purpose.RANDOM_SEARCH)
    genes = rng.random((n_evaluations, task.n_genes))
    evaluate = task.evaluation(settings)
    # As many at a time as in a generation, which bounds the memory.
    parts = range(0, n_evaluations, settings.population)
    features = np.concatenate([evaluate(genes[at : at + settings.population]) for at in parts])
    best = best_distinct(genes, overall_score(features), settings.n_confirmed)
    return confirm(task.confirmation(settings), best)


def unchanged(task: Task, settings: Settings, *, genes: Floats) -> Confirmed:
    """Return what given parameters, such as the last window's, score on this window.

    Parameters
    ----------
    task, settings
        Of the round that is compared.
    genes : ndarray, shape (gene,)
        The parameters that stay as they are; speeds are this window's.
    """
    check_genomes(genes, task.group.template)
    return confirm(task.confirmation(settings), np.atleast_2d(genes))
