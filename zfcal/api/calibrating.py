"""`zfcal.calibrate`, and what its command does with its options."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from zfcal.api import tables
from zfcal.api.rounds import round_options
from zfcal.api.trials import TrialPath, heard_by, tables_of, task_of, work_of
from zfcal.api.values import Names, PathLike, Stretch, Time, place, span, taken, text
from zfcal.stages.calibrate.calibrate import calibrate as calibrate_trial
from zfcal.stages.calibrate.holdout import Span, calibrate_span
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import Note, Tell
from zfcal.stages.streams import Work


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """What calibrates a trial as the options of the command say.

    Parameters
    ----------
    chosen
        How, and where it is simulated.
    span
        One pooled window instead of a round for each; None for rounds.
    options
        Those of the command.
    """

    chosen: CalibrateOptions
    span: Span | None
    options: Mapping[str, Any]

    def __call__(self, found: Work, tell: Tell) -> None:
        """Calibrate a trial."""
        if self.span is None:
            task = task_of(self.options, found.ends_s)
            calibrate_trial(found.root, self.chosen, tell, task=task)
        else:
            task = task_of(self.options)
            calibrate_span(found.root, self.span, self.chosen, tell, task=task)


@contextmanager
def calibration_of(options: Mapping[str, Any], tell: Tell) -> Iterator[Calibration]:
    """Have what calibrates trials, connected to the cluster that is asked for.

    Parameters
    ----------
    options
        By the names of the arguments of `calibrate`.
    tell
        Hears of the cluster. A dry run needs none.

    Raises
    ------
    OptionError
        One has another form, two contradict each other, or one could not take effect.
    InputError
        There is no cluster at the address.
    """
    how = {"window": span, "held_out": span, "out": place, "cluster": text}
    asked = taken(options, how)
    chosen, pooled = round_options(asked), None
    if asked["window"] is not None:
        pooled = Span(train_s=asked["window"], held_out_s=asked["held_out"], output=asked["out"])
    calibration = Calibration(chosen=chosen, span=pooled, options=asked)
    if asked["cluster"] is None or asked["dry_run"]:
        yield calibration
        return
    from zfcal.calibrate.scheduler import connect

    with connect(asked["cluster"]) as cluster:
        size = f"workers {cluster.n_workers}, threads {cluster.n_threads}"
        tell(Note(text=f"Cluster {cluster.address}: {size}."))
        yield dataclasses.replace(calibration, chosen=dataclasses.replace(chosen, cluster=cluster))


def calibrate(
    trial: TrialPath,
    *,
    generations: int | None = None,
    budget: Time | None = None,
    population: int = 60,
    runs: int = 1,
    steps: int = 3000,
    optimiser: Literal["zfcal", "deap"] | None = None,
    seed_likelihood: bool | None = None,
    model: PathLike | None = None,
    publish: Literal["forward", "score", "likelihood"] | None = None,
    as_published: bool = False,
    confirm: int | None = None,
    diversity: Literal["merged", "population"] | None = None,
    renewal: bool | None = None,
    sampler: Literal["exact", "grid"] = "exact",
    baselines: bool = False,
    seed: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    window: Stretch | None = None,
    held_out: Stretch | None = None,
    out: PathLike | None = None,
    features: Names = "D,W,O,T",
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables:
    """Find the model that fits each window of a trial best: ``zfcal calibrate``.

    Writes ``models/E.toml``, ``models/E.parquet``, ``scores/E-model.parquet`` and
    ``scores/E-rules.parquet`` for each window that `zfcal.analyse` has measured, where they are
    missing or stale. Each round starts from the last population of the one before.

    Parameters
    ----------
    trial
        Its directory, or its tables. Of a file in it only the windows that depend on it are made.
    generations
        Of a round; 15 unless there is a budget.
    budget
        Wall-clock time of a round, in seconds, or such as ``"50s"``.
    population
        Genomes, a multiple of four.
    runs, steps
        Simulations of an evaluation, and steps of each.
    optimiser
        ``zfcal``, which is usual: NSGA-II as arrays; ``deap``: with DEAP's operators.
    seed_likelihood
        Whether the maximum-likelihood estimate joins the first population; it usually does.
    model
        Another model to calibrate than the trial's first.
    publish
        Which model is handed on; ``forward`` unless the trial's models have another way already.
    as_published
        The paper's way: what is None of optimiser, seed_likelihood, publish, confirm, diversity
        and renewal is as the paper had it.
    confirm
        Number of the best, usually 10, that are simulated anew to choose one.
    diversity
        Distances within parents and offspring (``merged``, usual), or to the ``population``.
    renewal
        Whether a fifth of the last population is renewed where the fish have changed; usually so.
    sampler
        How headings are drawn: ``grid`` is the paper's numeric way.
    baselines
        Score random search and the last model too.
    seed
        Of the random numbers; None for the trial's.
    workers
        Threads; None for one per core. The numbers do not depend on it.
    cluster
        Address of a scheduler where it is simulated, such as ``tcp://host:8786``.
    window
        From and to in seconds: one pooled window instead; its model goes to `out`.
    held_out
        From and to in seconds: the model of `window` is scored there as well.
    out
        Where the model of `window` goes.
    features
        The statistics whose similarity counts.
    dry_run
        Write nothing; `tell` gets what would be made, and why.
    force
        Make what is up to date again.
    tell
        Function that gets an event for every file, for what is left out, and for progress
        (`zfcal.stages.events`). By default what is left out is a warning, and the rest is logged
        as ``zfcal``.

    Returns
    -------
    TrialTables
        Of the trial: ``parameters()`` has a row per model and parameter with its interval,
        ``scores()`` and ``rules()`` how near the models come.

    Raises
    ------
    OptionError
        An option has a wrong type or value, two contradict each other, or one has no effect.
    InputError
        There is no trial, its settings, its arena or its model is wrong, or no cluster answers.
    StorageError
        The disk is full, or a place cannot be written.
    LockedError
        The same command is running on the trial.

    Examples
    --------
    >>> import zfcal
    >>> tables = zfcal.calibrate("trial", generations=1, population=4, steps=20, seed=1)
    >>> tables.parameters()["window_end_s"].unique().tolist()
    [0, 120, 180]
    >>> zfcal.calibrate("trial", generations=3, budget="50s")
    Traceback (most recent call last):
        ...
    zfcal.errors.OptionError: A round ends after --generations or with its --budget: give one.
    """
    asked, hears = locals(), heard_by(tell)
    found = work_of(trial)
    with calibration_of(asked, hears) as work:
        work(found, hears)
    return tables_of(found.root)
