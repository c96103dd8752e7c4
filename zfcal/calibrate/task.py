"""What a calibration round is given: the window, the group, what came before, how much to do.

Plain data and what follows from it. The search is in ``search``, the round in ``rounds``.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from zfcal.arrays import Floats, Seeds
from zfcal.behaviour.features.registry import SCORED, ordered
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.evolve import GROUP
from zfcal.calibrate.group import (
    Purpose,
    Sampler,
    SeedSource,
    Simulator,
    with_measured_speeds,
)
from zfcal.calibrate.objective import Objective
from zfcal.calibrate.rules import Record
from zfcal.errors import InputError
from zfcal.model.effects.genome import check_genomes, genome_length
from zfcal.model.simulate import Start
from zfcal.parameters import n_genes
from zfcal.units import BURN_IN_S, WINDOW_S

DEFAULT_GENERATIONS = 15
_WORDS = {
    "optimiser": ("zfcal", "deap"),
    "diversity": ("merged", "population"),
    "sampler": ("exact", "grid"),
}
_RULES_SIMULATED = 5
"""Models that a round simulates for the rules: four made, and the one that is handed on."""

FOLLOWED_RUNS, NEAREST_RUNS = 40, 20
"""Simulated windows of each model that a window follows, and of each that may be nearest to it."""

_FOLLOWED = 6
"""Models that a window is the first to follow: one a rule."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How much a round does.

    Parameters
    ----------
    population
        Genomes, a multiple of four.
    generations
        How many to breed at most; None for 15, or as many as a deadline allows.
    runs, steps
        Simulations of an evaluation and their length.
    optimiser
        ``zfcal``, or ``deap`` for DEAP's own operators.
    champion
        ``score``: the best of those that are simulated anew. ``likely``: the first guest, the
        maximum-likelihood estimate, unless its score says that it misses something. ``forward``:
        by the rule that has been better so far, see `zfcal.calibrate.rules`.
    n_confirmed
        So many of the best are simulated anew, and the best of these is champion. With 0 the
        search's own score chooses, and is the one that is reported.
    diversity
        Whether diversities are distances within parents and offspring (``merged``), or to the
        individuals of the current population.
    renews
        Whether a part of the last population is replaced by random genomes where the world has
        changed.
    sampler
        How simulations draw headings: ``exact``, or ``grid``, the paper's numeric way.
    long_runs, long_s
        Simulations of a confirmation and their length in seconds.
    n_windows, window_s
        Simulated windows of the ceiling and their length in seconds: that of the
        window that is calibrated on, if S is to be comparable with it.
    features
        The statistics whose similarity counts. Of D, W, O and T the score is S; of others
        it is a score of its own.
    """

    population: int = 60
    generations: int | None = None
    runs: int = 1
    steps: int = 3000
    optimiser: Literal["zfcal", "deap"] = "zfcal"
    champion: Literal["score", "likely", "forward"] = "score"
    n_confirmed: int = 10
    long_runs: int = 10
    long_s: float = 1800.0
    n_windows: int = 200
    window_s: float = WINDOW_S
    features: tuple[str, ...] = SCORED
    diversity: Literal["merged", "population"] = "merged"
    renews: bool = True
    sampler: Sampler = "exact"

    def __post_init__(self) -> None:
        if self.population < GROUP or self.population % GROUP:
            raise InputError(
                f"population must be a positive multiple of {GROUP}, got {self.population}.",
                hint="The published population is 60.",
            )
        if self.generations is not None and self.generations < 0:
            raise InputError(f"generations must not be negative, got {self.generations}.")
        if self.n_confirmed < 0:
            raise InputError(f"n_confirmed must not be negative, got {self.n_confirmed}.")
        for name in ("runs", "steps", "long_runs", "n_windows"):
            if getattr(self, name) < 1:
                raise InputError(f"{name} must be at least 1, got {getattr(self, name)}.")
        for name in ("long_s", "window_s"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(
                    f"{name} must be a positive time in seconds, got {getattr(self, name)!r}."
                )
        if not self.features:
            raise InputError("features must name at least one statistic, got none.")
        object.__setattr__(self, "features", ordered(self.features))
        for name, words in _WORDS.items():
            if getattr(self, name) not in words:
                expected = " or ".join(repr(word) for word in words)
                raise InputError(f"{name} must be {expected}, got {getattr(self, name)!r}.")
        if self.champion == "forward" and not self.is_scored:
            raise InputError(
                f"Rules are judged by S, not by {','.join(self.features)}.",
                hint="With other features than D,W,O,T publish by score or likelihood.",
            )
        if self.champion not in {"score", "likely", "forward"}:
            raise InputError(
                f"champion must be 'score', 'likely' or 'forward', got {self.champion!r}."
            )

    @property
    def is_scored(self) -> bool:
        """Whether the score is S: of D, W, O and T and nothing else."""
        return self.features == SCORED

    @property
    def said(self) -> dict[str, Any]:
        """Return what a lineage says of them; what is usual goes without saying."""
        options = asdict(self)
        if self.is_scored:
            del options["features"]
        else:
            options["features"] = list(self.features)
        usual = {"champion": "score", "diversity": "merged", "renews": True, "sampler": "exact"}
        return {key: value for key, value in options.items() if usual.get(key, ...) != value}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Previous:
    """What the last round left.

    Parameters
    ----------
    genes : ndarray, shape (genome, gene)
        Its last population, best first.
    scores : ndarray, shape (genome,)
        Their S on that round's window; NaN is null.
    champion : ndarray, shape (gene,)
        The genome that was handed to the robot.
    noise
        Standard deviation of S between windows, from that round's ceiling.
    """

    genes: Floats
    scores: Floats
    champion: Floats
    noise: float

    def __post_init__(self) -> None:
        if self.genes.ndim != 2 or self.scores.shape != self.genes.shape[:1]:
            raise InputError(
                f"A population needs a row of genes and a score per genome, got shapes "
                f"{self.genes.shape} and {self.scores.shape}."
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """What is calibrated on what.

    Parameters
    ----------
    group
        Simulates the trial's agents; its template gives what genes do not say,
        save the speeds, which are measured.
    control
        The statistics of the window.
    seeds
        Where the round's random numbers come from.
    previous
        What the last round left; None in the first one.
    guests : ndarray, shape (genome, gene)
        Genomes that join the initial population, such as a maximum-likelihood estimate.
    memory : ndarray, shape (gene,)
        The estimate over all minutes so far.
    record
        What each rule's earlier models have scored.
    start
        Where all were at the window's beginning, from which rules' models are judged; None where
        nothing says it.
    moves_effects
        Whether the strengths of the model's effects are genes, or stay as they are.
    """

    group: Simulator
    control: Statistics
    seeds: SeedSource
    previous: Previous | None = None
    guests: Floats | None = field(default=None)
    memory: Floats | None = None
    record: Record = field(default_factory=Record)
    start: Start | None = None
    moves_effects: bool = True

    def __post_init__(self) -> None:
        told = [self.guests] if self.guests is not None else []
        if self.previous is not None:
            told += [self.previous.genes, self.previous.champion]
        for genes in told:
            check_genomes(genes, self.group.template)
            if genes.shape[-1] != self.n_genes:
                raise InputError(
                    f"The search has {self.n_genes} genes, got a table of shape {genes.shape}."
                )

    @property
    def n_genes(self) -> int:
        """Genes of a genome: with those of the effects, if these are calibrated as well."""
        template = self.group.template
        return genome_length(template) if self.moves_effects else n_genes(len(template.zones))

    @property
    def simulator(self) -> Simulator:
        """The group with the speeds that were measured in the window."""
        return self.group.with_template(with_measured_speeds(self.group.template, self.control))

    def steps_of(self, seconds: float) -> int:
        """Return the number of the model's steps in a time."""
        return max(1, round(seconds / self.group.template.dt_s))

    def evaluation(self, settings: Settings) -> Objective:
        """Return what the search maximises: short runs, one seed set for the round."""
        seeds = self.seeds.seeds(Purpose.EVALUATION, settings.runs)
        return self._objective(settings, seeds, n_steps=settings.steps)

    def confirmation(self, settings: Settings) -> Objective:
        """Return what decides in the end: long runs with seeds of their own."""
        seeds = self.seeds.seeds(Purpose.CONFIRMATION, settings.long_runs)
        return self._objective(settings, seeds, n_steps=self.steps_of(settings.long_s))

    def _objective(self, settings: Settings, seeds: Seeds, *, n_steps: int) -> Objective:
        return Objective(
            group=self.simulator,
            control=self.control,
            n_steps=n_steps,
            seeds=seeds,
            features=settings.features,
        )

    def work(self, *, n_genomes: int, n_runs: int, n_steps: int) -> float:
        """Return the steps that each worker has to simulate, burn-in included."""
        shifts = math.ceil(n_genomes * n_runs / max(self.group.n_workers, 1))
        return float(shifts * (n_steps + self.steps_of(BURN_IN_S)))

    def closing_work(self, settings: Settings) -> float:
        """Return the steps that confirmation and ceiling take each worker, at most."""
        long, short = self.steps_of(settings.long_s), self.steps_of(settings.window_s)

        def of(n_genomes: int) -> float:
            confirmed = self.work(n_genomes=n_genomes, n_runs=settings.long_runs, n_steps=long)
            return confirmed + self.work(n_genomes=1, n_runs=settings.n_windows, n_steps=short)

        more = {"likely": 0 if self.guests is None else 1, "forward": _RULES_SIMULATED}
        extra = more.get(settings.champion, 0)
        rules = 0.0
        if settings.champion == "forward" and self.start is not None:
            n_windows = _FOLLOWED * FOLLOWED_RUNS + len(self.record.own) * NEAREST_RUNS
            rules = self.work(n_genomes=n_windows, n_runs=1, n_steps=short)
        return of(settings.n_confirmed) + (of(extra) if extra else 0.0) + rules
