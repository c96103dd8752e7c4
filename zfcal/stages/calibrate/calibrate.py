"""From a window's statistics to a model, round by round.

Each round starts from the last population of the round before it. The offline
run over all windows and the online run on the newest one are the same code.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from zfcal.artifacts.atomic import check_free, discard
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.places import is_regular
from zfcal.artifacts.settings import read_trial
from zfcal.behaviour.features.registry import further
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.cluster import ClusterGroup
from zfcal.calibrate.objective import Group, SeedSource, Simulator
from zfcal.calibrate.task import Task as RoundTask
from zfcal.errors import DamagedError, InputError
from zfcal.stages.calibrate.likelihood import estimate, track_files
from zfcal.stages.calibrate.rounds import (
    MODEL,
    RoundPlaces,
    checkpoint_key,
    read_control,
    read_previous,
    result_table,
    summary_of,
    write_round,
)
from zfcal.stages.calibrate.searching import CalibrateOptions, baseline_scores, run_search
from zfcal.stages.events import (
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
from zfcal.stages.opening import OpenTrial, Task, at_work, open_trial, tell_version
from zfcal.stages.segments import readable
from zfcal.stages.settled import Items
from zfcal.stages.skipping import skipped_path, without_skipped
from zfcal.stages.taken import unless_taken
from zfcal.stages.windows import LENGTH_S

_INSTANT_S = 0.001


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
    if _taken(run, places):
        return False
    if run.task.dry_run:
        for path, _ in places.artifacts:
            run.tell(Planned(path=path, reason=reason))
        return True
    estimated = None
    options = run.options
    features = options.settings.features
    began_s = time.monotonic()
    if options.seed_likelihood:
        template = run.group.template
        estimated = estimate(run.opened, template, window_span(places.end_s), run.tell)
    round_task = RoundTask(
        group=run.group,
        control=control,
        guests=None if estimated is None else estimated.genes,
        seeds=SeedSource(trial_seed=run.seed, window_end_s=places.end_s),
        previous=None if previous is None else read_previous(previous, features),
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
    discard(skipped_path(run.root, places.end_s))
    write_round(places, result, lineages, result_table(result, baselines, likelihood))
    discard(places.checkpoint)
    for path, _ in places.artifacts:
        run.tell(Made(path=path, reason=reason))
    value = {"path": str(places.model), "window_end_s": places.end_s, "seed": run.seed}
    run.tell(Result(value={**value, **summary_of(result, baselines)}))
    return False


def _taken(run: _Run, places: RoundPlaces) -> bool:
    """Return whether a folder stands where one of a round's files is to go, which is told."""
    for path, _ in places.artifacts:
        with unless_taken(path, run.tell):
            check_free(path)
            continue
        return True
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
    missing = set(run.options.settings.features) - set(control.names)
    if missing:
        names = ",".join(further(run.options.settings.features))
        run.tell(
            LeftOut(
                path=places.stats,
                problem=f"{places.stats}: holds no {', '.join(sorted(missing))}.",
                hint=f"Count it first: zfcal analyse {run.root} --features {names}",
                damaged=False,
            )
        )
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
