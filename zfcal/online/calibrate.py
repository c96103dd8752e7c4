"""From a window's statistics to a model, round by round.

Each round starts from the last population of the round before it. The offline
run over all windows and the online run on the newest one are the same code.
"""

from __future__ import annotations

import math
import os
import time
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.places import is_regular
from zfcal.artifacts.reading import numbered_of
from zfcal.artifacts.settings import read_trial
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.baselines import random_search, unchanged
from zfcal.calibrate.cluster import ClusterGroup
from zfcal.calibrate.objective import Group, SeedSource, Simulator
from zfcal.calibrate.pace import Deadline
from zfcal.calibrate.rounds import RoundResult, calibrate_window
from zfcal.calibrate.scheduler import Cluster
from zfcal.calibrate.search import Progress as Search
from zfcal.calibrate.task import DEFAULT_GENERATIONS, Settings
from zfcal.calibrate.task import Task as RoundTask
from zfcal.errors import DamagedError, InputError
from zfcal.online.events import (
    LeftOut,
    Made,
    Note,
    Planned,
    Progress,
    Result,
    Tell,
    UpToDate,
    say_nothing,
)
from zfcal.online.likelihood import estimate, track_files
from zfcal.online.opening import OpenTrial, Task, at_work, open_trial, tell_version
from zfcal.online.rounds import (
    MODEL,
    Checkpoint,
    RoundPlaces,
    checkpoint_key,
    read_control,
    read_previous,
    result_table,
    summary_of,
    write_round,
)
from zfcal.online.segments import readable
from zfcal.online.settled import Items
from zfcal.online.skipping import skipped_path, without_skipped
from zfcal.online.windows import LENGTH_S

_INSTANT_S = 0.001


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateOptions:
    """How to calibrate.

    Parameters
    ----------
    settings
        How much a round does; bears on the result.
    budget_s
        Wall-clock seconds a round may take; None for no limit. The artifact
        records the generations that were run, not the budget.
    seed
        None for the trial's.
    n_workers
        Threads; None for one a core. The numbers do not depend on it.
    baselines
        Whether to score random search and the last model beside the champion.
    seed_likelihood
        Whether the maximum-likelihood estimate from the window's tracks joins the
        first population; False is the paper's way.
    cluster
        Who simulates instead of this machine's threads. The numbers do not depend
        on it.
    """

    settings: Settings = field(default_factory=Settings)
    budget_s: float | None = None
    seed: int | None = None
    n_workers: int | None = None
    baselines: bool = False
    seed_likelihood: bool = True
    cluster: Cluster | None = None

    def __post_init__(self) -> None:
        if self.budget_s is not None and not self.budget_s > 0:
            raise InputError(f"A budget must be a positive time, got {self.budget_s!r} s.")
        if self.budget_s is not None and self.settings.generations is not None:
            raise InputError(
                "A round ends after --generations or with its --budget, not with both.",
                hint="Give one of them; the artifact records the generations that were run.",
            )

    @property
    def generations_asked(self) -> int:
        """Generations of a round that has no budget."""
        asked = self.settings.generations
        return DEFAULT_GENERATIONS if asked is None else asked

    @property
    def workers(self) -> int:
        """Threads to use."""
        return self.n_workers or len(os.sched_getaffinity(0))

    def deadline(self) -> Deadline | None:
        """Return when a round that starts now has to be over."""
        if self.budget_s is None:
            return None
        return Deadline(ends_s=time.monotonic() + self.budget_s, clock=time.monotonic)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """All that the rounds of one run share."""

    opened: OpenTrial
    options: CalibrateOptions
    task: Task
    tell: Tell
    group: Simulator

    @property
    def root(self) -> Path:
        return self.opened.trial.root

    @property
    def seed(self) -> int:
        asked = self.options.seed
        return self.opened.trial.seed if asked is None else asked

    def lineage(self, places: RoundPlaces, previous: Path | None, generations: int) -> Lineage:
        trial = self.opened.trial
        files = [places.stats, self.root / trial.model, *self.opened.arena_files]
        files += [previous] if previous is not None else []
        if self.options.seed_likelihood:
            # One that is no file is no input: it is told where the estimate is made.
            files += readable(track_files(self.root, window_span(places.end_s)), say_nothing)
        options = calibrate_options(self.opened, self.options, generations=generations)
        inputs = hash_inputs(self.root, files)
        return Lineage(
            schema=MODEL, command="calibrate", options=options, seed=self.seed, inputs=inputs
        )


def calibrate_options(
    opened: OpenTrial, options: CalibrateOptions, *, generations: int
) -> dict[str, JSON]:
    """Return the options that bear on a round's result, as its lineage states them."""
    trial = opened.trial
    return {
        "arena": trial.arena,
        "n_fish": trial.n_fish,
        "n_robots": trial.n_robots,
        **options.settings.said,
        "generations": generations,
        "baselines": options.baselines,
        "seed_likelihood": options.seed_likelihood,
    }


def calibrate(
    root: Path, options: CalibrateOptions, tell: Tell, *, task: Task | None = None
) -> None:
    """Calibrate a model to each window of a trial that has statistics.

    Parameters
    ----------
    root
        The trial's directory.
    options
        How to calibrate.
    tell
        Hears of every artifact, of what is left out, and of each generation.
    task
        Which windows, and how. Windows before those asked for are made first
        where they are missing, since each round starts from the one before.

    Raises
    ------
    ZfcalError
        The trial, its arena or its model is wrong, the disk is full, or another
        calibrate is at work on the trial. Damaged statistics are left out and
        told instead.
    """
    task = task or Task()

    def open_run() -> _Run:
        opened = open_trial(root)
        group = make_group(opened, options)
        return _Run(opened=opened, options=options, task=task, tell=tell, group=group)

    # First: where there is no trial no lock is to lie.
    read_trial(root)
    with at_work(root, "calibrate", task):
        items = Items(open_run, tell)
        ends = _ends(items.run)
        previous: Path | None = None
        planned = False
        for number, end in enumerate(ends):
            tell(Progress(stage="rounds", done=number, total=len(ends)))
            places = RoundPlaces(root=root, end_s=end)
            if task.wants(end) or not is_regular(places.population):
                work = partial(_make_round, places=places, previous=previous, shaken=planned)
                found = items.make(places.model, work)
                if found is None:
                    # Later rounds would start from another one than the next run's.
                    return
                planned |= found
            previous = places.population if is_regular(places.population) else previous
        tell(Progress(stage="rounds", done=len(ends), total=len(ends)))


def make_group(opened: OpenTrial, options: CalibrateOptions) -> Simulator:
    """Return the trial's agents, driven by its starting model, where they are to be simulated."""
    trial = opened.trial
    template = read_model_for(trial.root / trial.model, opened.arena, dt_s=trial.dt_s)
    group = Group(
        arena=opened.arena,
        template=template,
        n_fish=trial.n_fish,
        n_robots=trial.n_robots,
        n_workers=options.workers,
    )
    return group if options.cluster is None else ClusterGroup(group=group, cluster=options.cluster)


def window_span(end_s: int) -> tuple[int, int]:
    """Return from and to of the window that ends at a second, in seconds."""
    return end_s - LENGTH_S, end_s


def _ends(run: _Run) -> list[int]:
    places = {path: end for end, path in numbered_of(run.root / "stats", ".parquet").items()}
    ends = [places[path] for path in readable(places, run.tell)]
    if not ends and run.task.ends_s is None:
        text = (
            f"{run.root / 'stats'}: no statistics to calibrate on; first: zfcal analyse {run.root}"
        )
        run.tell(Note(text=text))
    wanted = run.task.ends_s
    if wanted is not None:
        ends = [end for end in ends if end <= max(wanted, default=0)]
    return without_skipped(run.root, ends, run.task, run.tell)


def _make_round(run: _Run, places: RoundPlaces, previous: Path | None, *, shaken: bool) -> bool:
    """Make one round's files if they are missing or stale.

    Returns whether a dry run plans to make them; ``shaken`` says that it plans to
    make the round before, whatever the hashes say now.
    """
    control = _control_or_tell(run, places)
    if control is None:
        return False
    expected = run.lineage(places, previous, run.options.generations_asked)
    reason = _reason(run, places, expected, shaken=shaken)
    if reason is None:
        return False
    if run.task.dry_run:
        for path, _ in places.artifacts:
            run.tell(Planned(path=path, reason=reason))
        return True
    estimated = None
    options = run.options
    began_s = time.monotonic()
    if options.seed_likelihood:
        template = run.group.template
        estimated = estimate(run.opened, template, window_span(places.end_s), run.tell)
    round_task = RoundTask(
        group=run.group,
        control=control,
        guests=None if estimated is None else estimated.genes,
        seeds=SeedSource(trial_seed=run.seed, window_end_s=places.end_s),
        previous=None if previous is None else read_previous(previous),
    )
    key = checkpoint_key(expected)
    if options.budget_s is not None:
        # The estimate is a part of the round.
        left_s = options.budget_s - (time.monotonic() - began_s)
        options = replace(options, budget_s=max(left_s, _INSTANT_S))
    result = run_search(round_task, options, places.checkpoint, run.tell, key=key)
    made = run.lineage(places, previous, result.generations)
    lineages = {schema: replace(made, schema=schema) for _, schema in places.artifacts}
    baselines = baseline_scores(round_task, run.options, result)
    likelihood = None if estimated is None else estimated.table
    # First, so that no window is ever both passed over and calibrated.
    skipped_path(run.root, places.end_s).unlink(missing_ok=True)
    write_round(places, result, lineages, result_table(result, baselines, likelihood))
    places.checkpoint.unlink(missing_ok=True)
    for path, _ in places.artifacts:
        run.tell(Made(path=path, reason=reason))
    value = {"path": str(places.model), "window_end_s": places.end_s, "seed": run.seed}
    run.tell(Result(value={**value, **summary_of(result, baselines)}))
    return False


def _control_or_tell(run: _Run, places: RoundPlaces) -> Statistics | None:
    try:
        control = read_control(places.stats, run.opened.arena.zone_names)
    except (DamagedError, InputError) as error:
        run.tell(LeftOut(path=places.stats, problem=str(error), hint=error.hint))
        return None
    if not control.occupation.sum():
        problem = f"{places.stats}: the window holds no position of a fish inside the arena."
        run.tell(LeftOut(path=places.stats, problem=problem, damaged=False))
        return None
    _warn_if_stale(run, places)
    return control


def _warn_if_stale(run: _Run, places: RoundPlaces) -> None:
    """Say that tracks have changed since the statistics were taken: analyse comes first."""
    for name, known in read_lineage(places.stats).inputs.items():
        path = run.root / name
        if is_regular(path) and set(hash_inputs(run.root, [path]).values()) != {known}:
            text = f"{places.stats}: {name} has changed since; first: zfcal analyse {run.root}"
            run.tell(Note(text=text, warning=True))


def _reason(run: _Run, places: RoundPlaces, expected: Lineage, *, shaken: bool) -> str | None:
    """Return why a round is to be made; None if it is up to date, which is told."""
    paths = [path for path, _ in places.artifacts]
    ignore = ("generations",) if run.options.budget_s is not None else ()
    reason = stale_reason(paths, expected, ignore_options=ignore)
    if reason is None and run.task.force:
        reason = "forced"
    if reason is None and shaken:
        reason = "the round before it is made again"
    if reason is None:
        tell_version(paths, expected, run.tell)
        for path in paths:
            run.tell(UpToDate(path=path))
    return reason


def run_search(
    round_task: RoundTask,
    options: CalibrateOptions,
    checkpoint: Path,
    tell: Tell,
    *,
    key: str,
) -> RoundResult:
    """Calibrate, with a checkpoint after every generation; go on where a killed run was.

    Parameters
    ----------
    round_task
        What to calibrate on what.
    options
        How.
    checkpoint
        Where to keep it; the caller removes it when the result is written.
    tell
        Hears of each generation.
    key
        What a checkpoint must agree in to be of use.
    """
    at_most = options.generations_asked if options.budget_s is None else None
    started_s = time.monotonic()
    stage = f"window to {round_task.seeds.window_end_s} s"
    kept = Checkpoint(checkpoint, key)

    def watch(search: Search) -> None:
        kept.save(search)
        done, total = search.state.generation, options.generations_asked
        if options.budget_s is not None:
            done, total = int(time.monotonic() - started_s), math.ceil(options.budget_s)
        tell(Progress(stage=stage, done=min(done, total), total=total))

    return calibrate_window(
        round_task,
        options.settings,
        deadline=options.deadline(),
        watch=watch,
        resume=kept.load(at_most=at_most),
    )


def baseline_scores(
    round_task: RoundTask, options: CalibrateOptions, result: RoundResult
) -> dict[str, JSON]:
    """Return S of what the round has to beat; empty unless baselines are asked for.

    Parameters
    ----------
    round_task
        Of the round.
    options
        Say whether, and how long an evaluation is.
    result
        Random search gets as many evaluations as it took.
    """
    if not options.baselines:
        return {}
    n = result.evaluations
    luck = random_search(round_task, options.settings, n_evaluations=n)
    scores = {"random_search": luck.scores.S}
    if round_task.previous is not None:
        champion = round_task.previous.champion
        scores["last_window_unchanged"] = unchanged(
            round_task, options.settings, genes=champion
        ).scores.S
    return {name: None if math.isnan(value) else value for name, value in scores.items()}
