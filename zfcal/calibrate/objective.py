"""What a genome is worth: the similarity of the group that it drives with a measured one.

Of D, W, O and T, or of the features that are named. Who is simulated, and with which
random numbers, stands in ``group``; how the search goes in ``evolve``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from zfcal.arrays import Floats, Ints, Seeds
from zfcal.behaviour.features.registry import SCORED
from zfcal.behaviour.features.registry import further as further_of
from zfcal.behaviour.scores import (
    FeatureScores,
    Scores,
    named_scores,
    population_scores,
    similarities,
)
from zfcal.behaviour.statistics import ATTRIBUTES, Statistics
from zfcal.calibrate.group import (
    Recorder,
    Simulator,
    as_statistics,
    pool_runs,
    runs_of,
)
from zfcal.errors import InputError
from zfcal.model.simulate import Counts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulated:
    """What simulated groups did: the counts of some genomes or runs.

    Parameters
    ----------
    counts
        D, W, O, T and V.
    further
        Further statistics by name, with the same leading axes.
    """

    counts: Counts
    further: dict[str, Ints] = field(default_factory=dict)

    @property
    def by_name(self) -> dict[str, Ints]:
        """All of them."""
        five = {name: getattr(self.counts, attribute) for name, attribute in ATTRIBUTES.items()}
        return five | self.further

    def pooled(self) -> Simulated:
        """Return each genome's runs together, from leading axes (genome, run)."""
        further = {name: values.sum(axis=1) for name, values in self.further.items()}
        return Simulated(counts=pool_runs(self.counts), further=further)

    def of_genome(self, genome: int) -> Simulated:
        """Return one genome's runs, from leading axes (genome, run)."""
        further = {name: values[genome] for name, values in self.further.items()}
        return Simulated(counts=runs_of(self.counts, genome), further=further)

    def as_statistics(self, row: int, zone_names: tuple[str, ...]) -> Statistics:
        """Return one row of pooled counts as the statistics of a window."""
        further = {name: values[row] for name, values in self.further.items()}
        return replace(as_statistics(self.counts, row, zone_names), further=further)


def simulate_named(  # noqa: PLR0913 - the simulator's arguments, and what to count
    group: Simulator,
    genes: Floats,
    features: Sequence[str],
    *,
    n_counted: int,
    n_steps: int,
    seeds: Seeds,
) -> Simulated:
    """Simulate genomes and count D, W, O, T, V and what else is named, axes (genome, run)."""
    counts = group.simulate(genes, n_counted=n_counted, n_steps=n_steps, seeds=seeds)
    names = further_of(features)
    if not names:
        return Simulated(counts=counts)
    if not isinstance(group, Recorder):
        raise InputError(
            f"{type(group).__name__} counts D, W, O, T and V alone, not {', '.join(names)}.",
            hint="Calibrate on these features on this machine.",
        )
    found = group.record(genes, names, n_counted=n_counted, n_steps=n_steps, seeds=seeds)
    return Simulated(counts=counts, further=found)


def score_each(found: Simulated, control: Statistics, features: Sequence[str]) -> list[Scores]:
    """Return the scores of each row, with the one of the named statistics unless that is S."""
    scores = population_scores(found.counts, control).each(control.zone_names)
    if tuple(features) == SCORED:
        return scores
    named = named_scores(features, _similarities(found, control, features))
    return [replace(one, named=own) for one, own in zip(scores, named, strict=True)]


def _similarities(found: Simulated, control: Statistics, features: Sequence[str]) -> Floats:
    measured = {name: control.of(name) for name in features}
    return similarities(found.by_name, measured, features)


def n_counted(group: Simulator) -> int:
    """Return how many simulated agents are counted: all of them.

    Save where there is a single fish: a measured window has no pairs of fish then,
    and a simulated one that counts the robot has, which would score 0 for ever.
    """
    return 1 if group.n_fish == 1 else group.n_agents


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Objective:
    """The similarity of simulated groups with a measured one.

    Parameters
    ----------
    group
        Simulates; all its agents are counted, see `n_counted`.
    control
        What was measured.
    n_steps
        Steps of each run.
    seeds : ndarray of uint64, shape (run,)
        One per run, the same for all genomes.
    features
        The statistics whose similarity counts; `control` holds them.
    """

    group: Simulator
    control: Statistics
    n_steps: int
    seeds: Seeds = field(repr=False)
    features: tuple[str, ...] = SCORED

    def __post_init__(self) -> None:
        if self.n_steps < 1 or len(self.seeds) < 1:
            raise InputError(
                f"An evaluation needs at least one run of one step, got {len(self.seeds)} runs "
                f"of {self.n_steps} steps."
            )
        if not self.control.occupation.sum() > 0:
            raise InputError(
                "The window holds no position of a fish inside the arena.",
                hint="Look at its tracks with: zfcal inspect FILE",
            )
        for name in self.features:
            self.control.of(name)

    def simulate(self, genes: Floats) -> Simulated:
        """Return all that counts of each genome, runs pooled, leading axis (genome,)."""
        return simulate_named(
            self.group,
            genes,
            self.features,
            n_counted=n_counted(self.group),
            n_steps=self.n_steps,
            seeds=self.seeds,
        ).pooled()

    def scores(self, genes: Floats) -> FeatureScores:
        """Return the scores of each genome against the window."""
        return population_scores(self.simulate(genes).counts, self.control)

    def __call__(self, genes: Floats) -> Floats:
        """Return the similarities of each genome, shape (genome, feature); NaN is null.

        These are I_D, I_W, I_O and I_T, unless other features are named.

        Parameters
        ----------
        genes : ndarray, shape (genome, gene)
            In [0, 1].
        """
        if self.features == SCORED:
            return self.scores(genes).features
        return _similarities(self.simulate(genes), self.control, self.features)
