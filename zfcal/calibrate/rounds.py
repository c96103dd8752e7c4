"""One calibration round: from the statistics of a window to a champion and what it is worth.

The same code offline and online; a round knows the last one's outcome and nothing
of files. What leads to the champion is in ``search``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from zfcal.arrays import Floats
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.scores import Scores, compare
from zfcal.calibrate.ceiling import measure_ceiling, window_noise
from zfcal.calibrate.confirm import Confirmed, best_distinct, confirm, unconfirmed
from zfcal.calibrate.evolve import State
from zfcal.calibrate.group import Purpose, express, scale_gamma
from zfcal.calibrate.history import Generation
from zfcal.calibrate.intervals import Intervals, parameter_intervals
from zfcal.calibrate.judging import judged, nearest
from zfcal.calibrate.pace import Deadline
from zfcal.calibrate.rules import (
    COMPROMISE,
    KEEP,
    LIKELIHOOD,
    MEMORY,
    NEAREST,
    SCORE,
    Candidate,
    Choice,
    Record,
    half_way,
)
from zfcal.calibrate.search import Progress, Watch, search
from zfcal.calibrate.task import Previous, Settings, Task
from zfcal.model.effects.genome import to_genome
from zfcal.parameters import Parameters


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoundResult:
    """What a round has found.

    Parameters
    ----------
    champion
        The model that is handed on, its gamma rows scaled to a maximum of one.
    genes : ndarray, shape (gene,)
        The same as a genome, gamma as it was bred.
    rule
        By which of `zfcal.calibrate.rules.RULES` it was chosen.
    handed
        Why, and the record of all rules; None where one rule was asked for.
    scores
        Its similarities with the window, by long simulations with new seeds.
    optimiser_score
        The best S that the search itself saw: higher by its luck.
    ceiling
        What the champion reaches against itself.
    intervals
        Per parameter, the values that agree with the window.
    history
        A line per generation.
    population
        The last one, best first, with objectives and rank.
    world_changed
        Whether the last population's probe did worse than noise explains.
    n_renewed
        How many of it were replaced by random genomes.
    """

    champion: Parameters
    genes: Floats
    rule: str
    handed: HandedOn | None
    scores: Scores
    optimiser_score: float
    ceiling: Ceiling
    intervals: Intervals
    history: tuple[Generation, ...]
    population: State
    world_changed: bool
    n_renewed: int

    @property
    def generations(self) -> int:
        """Generations bred; with this number and the same seed the round repeats bit by bit."""
        return self.population.generation

    @property
    def evaluations(self) -> int:
        """Genomes evaluated in the search."""
        return self.population.evaluations

    @property
    def against_ceiling(self) -> float:
        """The score over its ceiling: about one if nothing is missed; NaN without a ceiling."""
        mean = self.ceiling.overall[0]
        return self.scores.overall / mean if mean > 0 else math.nan

    @property
    def as_previous(self) -> Previous:
        """What the next round starts from."""
        return Previous(
            genes=self.population.genes,
            scores=self.population.scores,
            champion=self.genes,
            noise=window_noise(self.ceiling),
        )


def calibrate_window(
    task: Task,
    settings: Settings,
    *,
    deadline: Deadline | None = None,
    watch: Watch | None = None,
    resume: Progress | None = None,
) -> RoundResult:
    """Find the model that comes nearest to a window.

    Parameters
    ----------
    task, settings
        What to calibrate, and how much to do.
    deadline
        When to be over. The answer is valid even if the time does not suffice for
        the initial population, the confirmation and the ceiling, which are done in
        any case. None for no limit.
    watch
        Sees every generation: to show it, or to save it for `resume`.
    resume
        Where a killed round of the same task and settings was.

    Returns
    -------
    RoundResult
        The same, bit by bit, for one task, seed and number of generations.

    Raises
    ------
    InputError
        The window is empty, or is of another arena than the model or the last population.
    """
    progress = search(task, settings, deadline=deadline, watch=watch, resume=resume)
    return conclude(task, settings, progress)


def conclude(task: Task, settings: Settings, progress: Progress) -> RoundResult:
    """Choose the champion of a search and say what its score is worth.

    The ten best of all that the search evaluated are simulated anew; the best by
    that simulation is the champion, and its S there is the one that is reported. Where none
    is to be simulated anew, the search's own S chooses and is reported.
    Where the likely one is asked for, the estimate is the champion if the window scores
    against it as its own windows do, less one standard deviation of them: the best of many
    scores fits what happened by chance. Of windows of the true model one in six scores less.
    Where rules are judged, it is the model of the rule that has been better so far.
    """
    likely = _likely(task, settings)
    confirmed, ceiling = likely or _best(task, settings, progress)
    handed = None
    if settings.champion == "forward":
        handed = hand_on(task, settings, confirmed, window_noise(ceiling))
        confirmed, ceiling = handed.confirmed or confirmed, handed.ceiling or ceiling
    intervals = parameter_intervals(
        confirmed.genes,
        (progress.genes, progress.scores),
        score=confirmed.scores.overall,
        ceiling=ceiling,
        template=task.group.template,
    )
    return RoundResult(
        champion=express(confirmed.genes, task.simulator.template),
        genes=confirmed.genes,
        rule=LIKELIHOOD if likely is not None else SCORE if handed is None else handed.choice.rule,
        handed=handed,
        scores=confirmed.scores,
        optimiser_score=float(np.nan_to_num(progress.scores, nan=0.0).max()),
        ceiling=ceiling,
        intervals=intervals,
        history=progress.history,
        population=progress.state,
        world_changed=progress.world_changed,
        n_renewed=progress.n_renewed,
    )


def _best(task: Task, settings: Settings, progress: Progress) -> tuple[Confirmed, Ceiling]:
    if settings.n_confirmed == 0:
        confirmed = unconfirmed(
            task.evaluation(settings), task.confirmation(settings), progress.state
        )
        return confirmed, _ceiling_of(task, settings, confirmed)
    return judge(
        task, settings, best_distinct(progress.genes, progress.scores, settings.n_confirmed)
    )


def _likely(task: Task, settings: Settings) -> tuple[Confirmed, Ceiling] | None:
    """Return the estimate; None where it is not asked for, or its score speaks against it."""
    if settings.champion != "likely" or task.guests is None:
        return None
    confirmed, ceiling = judge(task, settings, np.atleast_2d(task.guests)[:1])
    mean, _, _ = ceiling.overall
    falls_short = mean - confirmed.scores.overall
    return (confirmed, ceiling) if falls_short <= window_noise(ceiling) else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandedOn:
    """The model that a round hands on, by the rule that has been better.

    Parameters
    ----------
    choice
        The rule, and why.
    record
        Of all rules, with the models of this round.
    confirmed, ceiling
        What the model scores on the window, and at best; None where it is the window's best.
    """

    choice: Choice
    record: Record
    confirmed: Confirmed | None
    ceiling: Ceiling | None


def hand_on(task: Task, settings: Settings, best: Confirmed, noise: float) -> HandedOn:
    """Judge all rules' earlier models on a window, and hand on by the one that has been better.

    Parameters
    ----------
    task, settings
        Of the round.
    best
        The window's best by its score.
    noise
        Standard deviation of S between windows of one model.
    """
    record = judged(task, settings, noise)
    made = _made(task, settings, best)
    record = record.with_models(made.values())
    made |= _handed_before(task, settings, record)
    near = nearest(task, settings, record.own)
    if near is not None:
        made |= _swum(task, settings, {NEAREST: near.genes}, of_s=near.of_s)
    choice = record.choose(set(made) - {KEEP}, noise)
    chosen = made[choice.rule]
    record = replace(
        record.with_models([made[rule] for rule in (NEAREST, KEEP) if rule in made]),
        n_rounds=record.n_rounds + 1,
        in_use=chosen,
        in_charge=choice.in_charge,
    )
    if choice.rule == SCORE:
        return HandedOn(choice=choice, record=record, confirmed=None, ceiling=None)
    confirmed = Confirmed(
        genes=chosen.genes,
        scores=compare(chosen.long_run, task.control),
        long_run=chosen.long_run,
        candidates=best.candidates,
    )
    return HandedOn(
        choice=choice,
        record=record,
        confirmed=confirmed,
        ceiling=_ceiling_of(task, settings, confirmed),
    )


def _made(task: Task, settings: Settings, best: Confirmed) -> dict[str, Candidate]:
    """Return the model of each rule that makes one."""
    n_zones, end_s = len(task.group.template.zones), task.seeds.window_end_s
    own = scale_gamma(best.genes, n_zones)
    made = {
        SCORE: Candidate(rule=SCORE, made_at_s=end_s, of_s=end_s, genes=own, long_run=best.long_run)
    }
    others = {}
    if task.guests is not None:
        others[LIKELIHOOD] = scale_gamma(np.atleast_2d(task.guests)[0], n_zones)
        others[COMPROMISE] = half_way(own, others[LIKELIHOOD])
    if task.memory is not None:
        others[MEMORY] = scale_gamma(task.memory, n_zones)
    return made | _swum(task, settings, others, of_s=end_s)


def _handed_before(task: Task, settings: Settings, record: Record) -> dict[str, Candidate]:
    """Return the model that drives until this round's does."""
    if record.in_use is None:
        of_s = task.seeds.window_end_s
        return _swum(task, settings, {KEEP: _first_in_use(task)}, of_s=of_s)
    return _swum(task, settings, {KEEP: record.in_use.genes}, of_s=record.in_use.of_s)


def _first_in_use(task: Task) -> Floats:
    """Return the genes of the model that drives before rules are judged, shape (gene,)."""
    if task.previous is not None:
        return scale_gamma(task.previous.champion, len(task.group.template.zones))
    return to_genome(task.group.template)[: task.n_genes]


def _swum(
    task: Task, settings: Settings, genes: Mapping[str, Floats], *, of_s: int
) -> dict[str, Candidate]:
    """Return models by rule as the round would hand them on: with the speeds of its window.

    Parameters
    ----------
    task, settings
        Of the round.
    genes
        A genome for each rule, shape (gene,), its gamma rows scaled.
    of_s
        End of the window that they were made of.
    """
    if not genes:
        return {}
    found = task.confirmation(settings).simulate(np.stack(list(genes.values())))
    return {
        rule: Candidate(
            rule=rule,
            made_at_s=task.seeds.window_end_s,
            of_s=of_s,
            genes=own,
            long_run=found.as_statistics(k, task.control.zone_names),
        )
        for k, (rule, own) in enumerate(genes.items())
    }


def judge(task: Task, settings: Settings, genes: Floats) -> tuple[Confirmed, Ceiling]:
    """Return the best of some genomes by long runs, and what it reaches against its own.

    Parameters
    ----------
    task, settings
        What they are held against, and how long is simulated.
    genes : ndarray, shape (genome, gene)
        At least one.
    """
    confirmed = confirm(task.confirmation(settings), genes)
    return confirmed, _ceiling_of(task, settings, confirmed)


def _ceiling_of(task: Task, settings: Settings, confirmed: Confirmed) -> Ceiling:
    return measure_ceiling(
        task.simulator,
        confirmed.genes,
        long_run=confirmed.long_run,
        n_steps=task.steps_of(settings.window_s),
        seeds=task.seeds.seeds(Purpose.CEILING, settings.n_windows),
        features=settings.features,
    )
