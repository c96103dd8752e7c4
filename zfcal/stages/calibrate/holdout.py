"""One pooled window of a trial: a model calibrated on it, and what a model scores there.

For recordings whose behaviour is to be learnt from one half and judged on the other.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from zfcal.arena import Arena
from zfcal.arrays import Floats, Seeds
from zfcal.artifacts.atomic import discard
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.models import write_model
from zfcal.artifacts.segments import segment_path
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.features.registry import further as further_of
from zfcal.behaviour.located import join
from zfcal.behaviour.scores import Scores
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.calibrate.group import SeedSource
from zfcal.calibrate.rounds import judge
from zfcal.calibrate.task import Settings
from zfcal.calibrate.task import Task as RoundTask
from zfcal.errors import InputError
from zfcal.model.simulate import Counts, pack, simulate_counts
from zfcal.parameters import Parameters, to_genes
from zfcal.stages.calibrate.calibrate import calibrate_options, make_group
from zfcal.stages.calibrate.likelihood import estimate
from zfcal.stages.calibrate.result import score_table
from zfcal.stages.calibrate.rounds import MODEL, Found
from zfcal.stages.calibrate.searching import (
    CalibrateOptions,
    baseline_scores,
    checkpoint_key,
    run_search,
)
from zfcal.stages.calibrate.telling import stretch_note
from zfcal.stages.events import Event, Note, Result, Tell
from zfcal.stages.making import run
from zfcal.stages.segments import Segments, covered, guess_options, touched
from zfcal.stages.stage import Draft, Item, OneThing, Output, Run
from zfcal.stages.trial_context import OpenTrial, Task
from zfcal.tracks import FISH


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Which stretch to learn from, and which to judge on.

    Parameters
    ----------
    train_s, held_out_s
        From and to, in seconds since trial start; None to judge on nothing.
    output
        Where the model goes; its table ``[result]`` holds the scores.
    """

    output: Path
    train_s: tuple[int, int]
    held_out_s: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        held_out = self.held_out_s
        if held_out and max(self.train_s[0], held_out[0]) < min(self.train_s[1], held_out[1]):
            raise InputError(
                f"The window {_text(self.train_s)} and the held-out {_text(held_out)} overlap.",
                hint="What is held out must not be learnt from.",
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracked:
    """What there are tracks of in a stretch that was asked for.

    Parameters
    ----------
    asked_s
        From and to of the stretch, in seconds since trial start.
    parts_s
        From and to of each part of it that tracks cover, in order; at least one.
    """

    asked_s: tuple[int, int]
    parts_s: tuple[tuple[int, int], ...]

    @property
    def span_s(self) -> tuple[int, int]:
        """From the first to the last second that is covered."""
        return self.parts_s[0][0], self.parts_s[-1][1]

    @property
    def seconds(self) -> float:
        """How long the parts are together: a ceiling is that of so long a window."""
        return float(sum(end_s - start_s for start_s, end_s in self.parts_s))

    @property
    def goes_without_saying(self) -> tuple[str, ...]:
        """Options of a lineage that the window states already; models of old state another."""
        start_s, end_s = self.span_s
        return ("window_s",) if self.seconds == end_s - start_s else ()

    def notes(self, name: str) -> list[Note]:
        """Return what to say where tracks do not cover all that was asked for."""
        said = []
        if self.span_s != self.asked_s:
            start_s, end_s = self.span_s
            text = f"there are tracks from {start_s} s to {end_s} s alone, and only these count."
            said.append(f"{name} {_text(self.asked_s)} s: {text}")
        without_s = self.span_s[1] - self.span_s[0] - self.seconds
        if without_s > 0:
            text = f"{without_s:g} s in between have no tracks; {self.seconds:g} s count."
            said.append(f"{name} {_text(self.span_s)} s: {text}")
        return [Note(text=text, warning=True) for text in said]


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """What a model scores on a stretch of a trial, and what it could score at best."""

    scores: Scores
    ceiling: Ceiling


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedModel:
    """A group that swims as one model says, whatever the genes: a `Simulator`.

    Parameters
    ----------
    arena
        Where it swims.
    template
        The model, with its own speeds and effects.
    n_agents, n_fish
        Fish and robots, and how many of them are fish.
    n_workers
        Threads.
    """

    arena: Arena
    template: Parameters
    n_agents: int
    n_fish: int
    n_workers: int = 1

    def with_template(self, template: Parameters) -> FixedModel:  # noqa: ARG002 - the protocol's
        """Return itself: the model is what is judged, speeds and all."""
        return self

    def simulate(self, genes: Floats, *, n_counted: int, n_steps: int, seeds: Seeds) -> Counts:
        """Return counts with leading axes (genome, run); all genomes are the model."""
        return simulate_counts(
            pack([self.template] * len(genes), self.arena),
            self.arena,
            n_agents=self.n_agents,
            n_counted=n_counted,
            n_robots=self.n_agents - self.n_fish,
            n_steps=n_steps,
            seeds=seeds,
            n_threads=self.n_workers,
        )


def evaluate_model(
    root: Path,
    parameters: Parameters,
    span_s: tuple[int, int],
    *,
    seed: int = 0,
    segments: Segments | None = None,
) -> Evaluation:
    """Return what a model scores against the fish of a stretch of a trial.

    Parameters
    ----------
    root
        The trial's directory.
    parameters
        The model, which is taken as it is, measured speeds included.
    span_s
        From and to, in seconds since trial start; what tracks cover of it counts.
    seed
        Of the simulations: 10 x 1800 s for the score, and 200 windows as long as
        the tracks of the stretch for the ceiling.
    segments
        What was read before.
    """
    opened = (segments := segments or Segments()).open(root)
    control, _ = pooled_fish(opened, segments, span_s)
    tracked = tracked_in(opened, span_s)
    group = FixedModel(
        arena=opened.arena,
        template=parameters,
        n_agents=opened.trial.n_agents,
        n_fish=opened.trial.n_fish,
        n_workers=CalibrateOptions().workers,
    )
    settings = Settings(window_s=tracked.seconds)
    task = RoundTask(
        group=group,
        control=control,
        seeds=SeedSource(trial_seed=seed, window_end_s=tracked.span_s[1]),
    )
    confirmed, ceiling = judge(task, settings, to_genes(parameters)[None, :])
    return Evaluation(scores=confirmed.scores, ceiling=ceiling)


def pooled_fish(
    opened: OpenTrial, segments: Segments, span_s: tuple[int, int], further: Sequence[str] = ()
) -> tuple[Statistics, list[int]]:
    """Return the statistics of the fish in a stretch, and the starts of its segments.

    Further statistics are counted where they are named.

    Raises
    ------
    InputError
        The stretch holds no segment, or no fish.
    DamagedError
        A segment is damaged.
    """
    start_s, end_s = span_s
    starts = touched(opened.trial.root, span_s)
    if not starts:
        raise _no_tracks(opened, span_s)
    points = join([segments.read(opened, start) for start in starts]).between(start_s, end_s)
    statistics = measure(points.of_kind(FISH), opened.arena, further=further)
    if not statistics.occupation.sum():
        raise InputError(
            f"{opened.trial.root}: no fish was seen inside the arena from {start_s} s to {end_s} s."
        )
    return statistics, starts


def tracked_in(opened: OpenTrial, span_s: tuple[int, int]) -> Tracked:
    """Return what there are tracks of in a stretch of a trial.

    Raises
    ------
    InputError
        There are none.
    DamagedError
        A segment is damaged.
    """
    parts = covered(opened.trial.root, span_s, fps=opened.trial.fps)
    if not parts:
        raise _no_tracks(opened, span_s)
    return Tracked(asked_s=span_s, parts_s=tuple(parts))


def _no_tracks(opened: OpenTrial, span_s: tuple[int, int]) -> InputError:
    root = opened.trial.root
    return InputError(
        f"{root}: has no tracks from {span_s[0]} s to {span_s[1]} s.",
        hint=f"Import them first: zfcal import SRC {root}",
    )


def calibrate_span(
    root: Path,
    span: Span,
    options: CalibrateOptions,
    tell: Tell,
    *,
    task: Task | None = None,
) -> None:
    """Calibrate a model on one pooled window and judge it on what was held out.

    Parameters
    ----------
    root
        The trial's directory.
    span
        What to learn from, what to judge on, and where the model goes.
    options
        How to calibrate.
    tell
        Hears of the artifact, of the result, and of each generation.
    task
        How to go about it.
    """
    stage = OneThing(
        name="calibrate", item=lambda run: _model(run, span, options), scores_tracks=True
    )
    run(stage, root, tell, task=task)


def _model(run: Run, span: Span, options: CalibrateOptions) -> Item:
    """Return the model; the tracks are read first, so that damaged ones are named at once."""
    segments = Segments()
    opened = segments.open(run.root)
    names = further_of(options.settings.features)
    control, starts = pooled_fish(opened, segments, span.train_s, names)
    if span.held_out_s:
        starts = sorted({*starts, *pooled_fish(opened, segments, span.held_out_s)[1]})
    tracked, span = _cut(opened, span, run.tell)
    options = replace(options, settings=replace(options.settings, window_s=tracked.seconds))
    output = Output(
        path=span.output,
        lineage=_lineage(run, opened, options, span, starts),
        ignore=(*options.not_asked, *tracked.goes_without_saying),
    )
    seed = options.seed_of(opened.trial)

    def compute() -> Iterator[Draft]:
        began_s = time.monotonic()
        group = make_group(opened, options)
        estimated = None
        if options.seed_likelihood:
            estimated = estimate(opened, group.template, span.train_s, run.tell)
        round_task = RoundTask(
            group=group,
            control=control,
            guests=None if estimated is None else estimated.genes,
            seeds=SeedSource(trial_seed=seed, window_end_s=span.train_s[1]),
        )
        asked = options.left_since(began_s)
        checkpoint = output.path.with_name(f".{output.path.name}.checkpoint")
        key = checkpoint_key(output.lineage)
        result = run_search(round_task, asked, checkpoint, run.tell, key=key)
        models = {"before": group.template, "after": result.champion}
        judged, notes = _judge(opened, span, models, seed, segments)
        trained = f"Window {_text(span.train_s)} s"
        notes = [stretch_note(trained, result.scores, result.ceiling), *notes]
        found = Found(
            result=result,
            baselines=baseline_scores(round_task, options, result),
            likelihood=None if estimated is None else estimated.table,
        )

        def write(path: Path, lineage: Lineage) -> list[Event]:
            write_model(path, result.champion, lineage, {**found.table, **judged})
            return [*notes, Result(value={"path": str(output.path), **found.summary, **judged})]

        yield Draft(output=output.with_options(generations=result.generations), write=write)
        discard(checkpoint)

    return Item(outputs=[output], compute=compute)


def _cut(opened: OpenTrial, span: Span, tell: Tell) -> tuple[Tracked, Span]:
    """Return what there are tracks of in the window, and the span cut to that, which is told."""
    tracked = tracked_in(opened, span.train_s)
    said, held_out_s = tracked.notes("Window"), None
    if span.held_out_s:
        judged_on = tracked_in(opened, span.held_out_s)
        said, held_out_s = said + judged_on.notes("Held-out"), judged_on.span_s
    for note in said:
        tell(note)
    return tracked, replace(span, train_s=tracked.span_s, held_out_s=held_out_s)


def _lineage(
    run: Run, opened: OpenTrial, options: CalibrateOptions, span: Span, starts: list[int]
) -> Lineage:
    trial = opened.trial
    files = [segment_path(trial.root, start) for start in starts]
    said = calibrate_options(opened, options, generations=options.generations_asked)
    said |= guess_options(files) if options.seed_likelihood else {}
    files += [options.model_of(trial), *opened.arena_files]
    stretches: dict[str, JSON] = {
        "fps": trial.fps,
        "window": _text(span.train_s),
        "held_out": _text(span.held_out_s) if span.held_out_s else None,
    }
    seed = options.seed_of(trial)
    return run.lineage(MODEL, files, options={**said, **stretches}, seed=seed)


def _judge(
    opened: OpenTrial, span: Span, models: Mapping[str, Parameters], seed: int, segments: Segments
) -> tuple[dict[str, JSON], list[Note]]:
    """Score models on what was held out; also in words."""
    if span.held_out_s is None:
        return {}, []
    stretch = _text(span.held_out_s)
    scored: dict[str, JSON] = {"window": stretch}
    notes = []
    for name, model in models.items():
        found = evaluate_model(
            opened.trial.root, model, span.held_out_s, seed=seed, segments=segments
        )
        scored[name] = score_table(found.scores, found.ceiling)
        where = f"Held-out {stretch} s, {name} calibration"
        notes.append(stretch_note(where, found.scores, found.ceiling))
    return {"held_out": scored}, notes


def _text(span_s: tuple[int, int]) -> str:
    return f"{span_s[0]}:{span_s[1]}"
