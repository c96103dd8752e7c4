"""From a window's statistics to a model, round by round.

Each round starts from the last population of the round before it. The offline
run over all windows and the online run on the newest one are the same code.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple, final

from zfcal.artifacts.atomic import discard
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.reading.places import is_regular
from zfcal.artifacts.tables import read_extra
from zfcal.behaviour.features.registry import further
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.cluster import ClusterGroup
from zfcal.calibrate.group import Group, SeedSource, Simulator
from zfcal.calibrate.rules import LONG_RUNS, START, Record
from zfcal.calibrate.task import Previous
from zfcal.calibrate.task import Task as RoundTask
from zfcal.errors import DamagedError, InputError
from zfcal.model.effects.genome import check_effects, genome_names
from zfcal.stages.calibrate.beginning import seen_first
from zfcal.stages.calibrate.likelihood import estimate, memory_span, remembered
from zfcal.stages.calibrate.record import read_record
from zfcal.stages.calibrate.rounds import (
    MODEL,
    Found,
    RoundPlaces,
    read_control,
    read_previous,
)
from zfcal.stages.calibrate.searching import (
    CalibrateOptions,
    baseline_scores,
    checkpoint_key,
    run_search,
)
from zfcal.stages.calibrate.way import as_before
from zfcal.stages.events import LeftOut, Note, Progress, Tell, say_nothing
from zfcal.stages.making import run
from zfcal.stages.segments import guess_options, readable, segment_files
from zfcal.stages.skipping import skipped_path, without_skipped
from zfcal.stages.stage import Draft, Item, Output, Run, Stage
from zfcal.stages.trial_context import OpenTrial, Task, open_trial
from zfcal.stages.windows import LENGTH_S

_NO_START = (
    "Window to {} s: tracks do not say where half of the fish were at its beginning, so models "
    "are not judged on it from there."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Window:
    """A window to calibrate, and the one before it."""

    places: RoundPlaces
    before: _Window | None

    @property
    def previous(self) -> Path | None:
        """The population from which its round starts: the last one that is there."""
        last = self._last()
        return None if last is None else last.population

    @property
    def rules(self) -> Path | None:
        """The record of the rules that the same round left; None where it left none."""
        last = self._last()
        return last.rules if last is not None and is_regular(last.rules) else None

    def _last(self) -> RoundPlaces | None:
        window = self.before
        while window is not None and not is_regular(window.places.population):
            window = window.before
        return None if window is None else window.places


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shared:
    """All that the rounds of one run share."""

    run: Run
    opened: OpenTrial
    options: CalibrateOptions
    group: Simulator

    @property
    def root(self) -> Path:
        return self.run.root

    @property
    def seed(self) -> int:
        return self.options.seed_of(self.opened.trial)


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
    run(Calibrate(options=options), root, tell, task=task)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrate(Stage[_Shared, _Window]):
    """A round for each window that has statistics; each starts from the one before.

    Parameters
    ----------
    options
        How to calibrate.
    """

    name = "calibrate"
    scores_tracks = True
    counted = "rounds"
    is_chain = True

    options: CalibrateOptions = field(default_factory=CalibrateOptions)

    def open(self, run: Run) -> _Shared:
        """Read the trial and its starting model."""
        opened, options = open_trial(run.root), as_before(run.root, self.options)
        group = make_group(opened, options)
        return _Shared(run=run, opened=opened, options=options, group=group)

    def items(self, shared: _Shared) -> list[_Window]:
        """Return the windows up to the last one that is asked for."""
        windows: list[_Window] = []
        for end in _ends(shared.run):
            places = RoundPlaces(root=shared.root, end_s=end)
            windows.append(_Window(places=places, before=windows[-1] if windows else None))
        shared.run.tell(Progress(stage=self.counted, done=0, total=len(windows)))
        return windows

    def place(self, shared: _Shared, key: _Window) -> Path:  # noqa: ARG002 - the protocol's
        """Return the champion."""
        return key.places.model

    def item(self, shared: _Shared, key: _Window) -> Item | None:
        """Return a round; one before those asked for is made only where there is none."""
        places = key.places
        if not shared.run.task.wants(places.end_s) and is_regular(places.population):
            return None
        control = _control_or_tell(shared, places)
        return None if control is None else _round(shared, key, control)


def make_group(opened: OpenTrial, options: CalibrateOptions) -> Simulator:
    """Return the trial's agents, driven by the model to calibrate, where they are simulated."""
    trial, path = opened.trial, options.model_of(opened.trial)
    template = read_model_for(path, opened.arena, dt_s=trial.dt_s)
    check_effects(template, of=path)
    group = Group(
        arena=opened.arena,
        template=template,
        n_fish=trial.n_fish,
        n_robots=trial.n_robots,
        n_workers=options.workers,
        sampler=options.settings.sampler,
    )
    return group if options.cluster is None else ClusterGroup(group=group, cluster=options.cluster)


def _window_span(end_s: int) -> tuple[int, int]:
    """Return from and to of the window that ends at a second, in seconds."""
    return end_s - LENGTH_S, end_s


def _ends(run: Run) -> list[int]:
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


def _round(shared: _Shared, window: _Window, control: Statistics) -> Item:
    """Return a round: population, scores and champion; the model is last."""
    places, before = window.places, _Before(window.previous, None)
    champion = shared.options.settings.champion
    if champion == "forward" and _carries_on(shared, before.population, window.rules):
        before = before._replace(rules=window.rules)
    lineage = _lineage(shared, places, before)
    # A dry run that makes the round before makes this one too, whatever the hashes say now.
    otherwise = "the round before it is made again" if shared.run.planned else None
    outputs = [
        Output(
            path=path,
            lineage=replace(lineage, schema=schema),
            ignore=shared.options.not_asked,
            otherwise=otherwise,
        )
        for path, schema in places.artifacts(champion)
    ]

    def compute() -> Iterator[Draft]:
        found = _search(shared, places, control, before, key=checkpoint_key(lineage))
        # First, so that no window is ever both passed over and calibrated.
        discard(skipped_path(shared.root, places.end_s))
        if champion != "forward":
            discard(places.rules)
        for output, write in zip(outputs, found.writers(places, shared.seed), strict=True):
            yield Draft(
                output=output.with_options(generations=found.result.generations), write=write
            )
        discard(places.checkpoint)

    return Item(outputs=outputs, compute=compute)


def _carries_on(shared: _Shared, population: Path | None, rules: Path | None) -> bool:
    """Return whether a record is of the round that left a population, and of this very model.

    A damaged one is: its round is left out by name, rather than that a new record begins.
    """
    if population is None or rules is None:
        return False
    try:
        made, record = read_lineage(population), read_lineage(rules)
    except (InputError, DamagedError):
        return True
    opened = shared.opened
    files = [shared.options.model_of(opened.trial), *opened.arena_files]
    same = hash_inputs(shared.root, files).items() <= record.inputs.items()
    return same and replace(record, schema=made.schema) == made


class _Before(NamedTuple):
    """What a round carries on: a population, and the record of the rules."""

    population: Path | None
    rules: Path | None


def _lineage(shared: _Shared, places: RoundPlaces, before: _Before) -> Lineage:
    opened, options = shared.opened, shared.options
    files = [places.stats, options.model_of(opened.trial), *opened.arena_files]
    files += [path for path in before if path is not None]
    said = calibrate_options(opened, options, generations=options.generations_asked)
    if options.settings.champion == "forward":
        said |= {"judged_from": START if options.seed_likelihood else LONG_RUNS}
    if options.seed_likelihood:
        # One that is no file is no input: it is told where the estimate is made.
        span_s = _window_span(places.end_s)
        if options.settings.champion == "forward":
            span_s = memory_span(places.end_s)
        tracks = readable(segment_files(shared.root, span_s), say_nothing)
        said |= guess_options(tracks)
        files += tracks
    return shared.run.lineage(MODEL, files, options=said, seed=shared.seed)


def _search(
    shared: _Shared,
    places: RoundPlaces,
    control: Statistics,
    before: _Before,
    *,
    key: str,
) -> Found:
    """Search for the model of a window, and go on from a checkpoint where there is one."""
    options, tell = shared.options, shared.run.tell
    began_s = time.monotonic()
    template = shared.group.template
    estimated = memory = start = None
    if options.seed_likelihood:
        estimated = estimate(shared.opened, template, _window_span(places.end_s), tell)
    if options.seed_likelihood and options.settings.champion == "forward":
        memory = remembered(shared.opened, template, places.end_s, memory_span(places.end_s))
        start = seen_first(shared.opened, places.end_s)
        if start is None:
            tell(Note(text=_NO_START.format(places.end_s)))
    round_task = RoundTask(
        group=shared.group,
        control=control,
        guests=None if estimated is None else estimated.genes,
        seeds=SeedSource(trial_seed=shared.seed, window_end_s=places.end_s),
        previous=_previous(shared, before.population),
        memory=memory,
        record=_record(shared, before.rules),
        start=start,
    )
    options = options.left_since(began_s)
    result = run_search(round_task, options, places.checkpoint, tell, key=key)
    return Found(
        result=result,
        baselines=baseline_scores(round_task, options, result),
        likelihood=None if estimated is None else estimated.table,
    )


def _previous(shared: _Shared, path: Path | None) -> Previous | None:
    """Return the last population; None where there is none, or its models have other effects."""
    if path is None or not _has_same_genes(shared, path):
        return None
    return read_previous(path, shared.options.settings.features)


def _record(shared: _Shared, path: Path | None) -> Record:
    """Return the record of the rules; a new one where there is none to carry on."""
    if path is None or not _has_same_genes(shared, path):
        return Record()
    return read_record(path, shared.opened.arena.zone_names)


def _has_same_genes(shared: _Shared, path: Path) -> bool:
    names = list(genome_names(shared.group.template))
    return bool(read_extra(path).get("gene_names", names) == names)


def _control_or_tell(shared: _Shared, places: RoundPlaces) -> Statistics | None:
    try:
        control = read_control(places.stats, shared.opened.arena.zone_names)
    except (DamagedError, InputError) as error:
        shared.run.tell(LeftOut(path=places.stats, problem=str(error), hint=error.hint))
        return None
    if not control.occupation.sum():
        problem = f"{places.stats}: the window holds no position of a fish inside the arena."
        shared.run.tell(LeftOut(path=places.stats, problem=problem, damaged=False))
        return None
    missing = set(shared.options.settings.features) - set(control.names)
    if missing:
        names = ",".join(further(shared.options.settings.features))
        problem = f"{places.stats}: holds no {', '.join(sorted(missing))}."
        hint = f"Count it first: zfcal analyse {shared.root} --features {names}"
        shared.run.tell(LeftOut(path=places.stats, problem=problem, hint=hint, damaged=False))
        return None
    _warn_if_stale(shared, places)
    return control


def _warn_if_stale(shared: _Shared, places: RoundPlaces) -> None:
    """Say that tracks have changed since the statistics were taken: analyse comes first."""
    for name, known in read_lineage(places.stats).inputs.items():
        path = shared.root / name
        if is_regular(path) and set(hash_inputs(shared.root, [path]).values()) != {known}:
            text = f"{places.stats}: {name} has changed since; first: zfcal analyse {shared.root}"
            shared.run.tell(Note(text=text, warning=True))
