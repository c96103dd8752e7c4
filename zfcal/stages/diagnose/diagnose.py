"""Where the model and a trial's tracks disagree: from tracks to ``diagnosis/findings.json``.

What is found is the business of ``zfcal.diagnose``; how it is drawn, of whoever hands in
a `Draw`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from zfcal.artifacts.freshness import hash_inputs, relative_to
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.machine import cores
from zfcal.artifacts.models import newest_model, read_model_for
from zfcal.diagnose.document import SCHEMA, findings_document
from zfcal.diagnose.findings import Diagnosis
from zfcal.diagnose.question import Question
from zfcal.diagnose.question import Tell as Heard
from zfcal.errors import InputError
from zfcal.model.effects.genome import check_effects
from zfcal.parameters import Parameters
from zfcal.stages.diagnose.findings import FOLDER, Book, Draw, write_findings
from zfcal.stages.events import Progress, Result, Tell
from zfcal.stages.making import run
from zfcal.stages.segments import guess_options
from zfcal.stages.stage import Draft, Item, OneThing, Output, Run
from zfcal.stages.track_window import Stretch, read_stretch
from zfcal.stages.trial_context import OpenTrial, Task, open_trial


@dataclass(frozen=True, slots=True, kw_only=True)
class DiagnoseOptions:
    """How to diagnose.

    Parameters
    ----------
    model
        A model file; None for the one of the newest round.
    n_null
        Replicates of the null through the measurement chain.
    quick
        Take the analytic null instead.
    noise_m
        Position noise, standard deviation per coordinate, in metres; None for what the
        tracks state or show.
    window_s
        From and to, in seconds since trial start; None for the whole recording.
    seed
        None for the trial's.
    n_workers
        Threads; None for one a core. The numbers do not depend on it.
    out_dir
        Where the findings go; None for `folder_of`.
    """

    model: Path | None = None
    n_null: int = 39
    quick: bool = False
    noise_m: float | None = None
    window_s: tuple[int, int] | None = None
    seed: int | None = None
    n_workers: int | None = None
    out_dir: Path | None = None

    @property
    def workers(self) -> int:
        """Threads to use."""
        return self.n_workers or cores()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A trial, the model that is held against it, and where the findings go."""

    opened: OpenTrial
    options: DiagnoseOptions
    model: Path
    parameters: Parameters

    @property
    def root(self) -> Path:
        """The trial's directory."""
        return self.opened.trial.root

    @property
    def seed(self) -> int:
        """Of all random numbers."""
        asked = self.options.seed
        return self.opened.trial.seed if asked is None else asked

    @property
    def folder(self) -> Path:
        """Where the findings go."""
        asked = self.options.out_dir
        return folder_of(self.root, self.model, self.parameters) if asked is None else asked


def folder_of(root: Path, model: Path, parameters: Parameters) -> Path:
    """Return where the findings about a model go.

    A model with effects has a folder of its own, named after its file, so that
    ``diagnosis/`` keeps what was found before they were added.

    Parameters
    ----------
    root
        The trial's directory.
    model, parameters
        The model file, and what it holds.
    """
    return root / FOLDER / model.stem if parameters.effects else root / FOLDER


def open_case(root: Path, options: DiagnoseOptions) -> Case:
    """Open a trial and the model that is asked about.

    Raises
    ------
    ZfcalError
        The trial or its arena is wrong, there is no such model, or it is one of another
        arena or step.
    """
    opened = open_trial(root)
    trial = opened.trial
    model = options.model or newest_model(trial)
    parameters = read_model_for(model, opened.arena, dt_s=trial.dt_s)
    check_effects(parameters, of=model)
    return Case(opened=opened, options=options, model=model, parameters=parameters)


def diagnose(
    root: Path,
    options: DiagnoseOptions,
    tell: Tell,
    *,
    task: Task | None = None,
    draw: Draw | None = None,
) -> Path | None:
    """Diagnose a model on the tracks of a trial.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What to ask, and how.
    tell
        Hears of every artifact, of what is left out, and how far it is.
    task
        How to go about it.
    draw
        Draws pictures and a page beside the findings; None for the findings alone.

    Returns
    -------
    Path or None
        The findings; None in a dry run that would make them.

    Raises
    ------
    ZfcalError
        The trial, the model or the tracks are wrong, the disk is full, or another
        diagnose is at work on the trial. Damaged segments are left out and told instead.
    """
    stage = OneThing(
        name="diagnose", item=lambda run: _findings(run, options, draw), scores_tracks=True
    )
    there = run(stage, root, tell, task=task)
    return there[0] if there else None


def _findings(run: Run, options: DiagnoseOptions, draw: Draw | None) -> Item:
    """Return the findings; the tracks are read first, since the damaged ones are no inputs."""
    case = open_case(run.root, options)
    stretch = read_stretch(case.opened, options.window_s, run.tell)
    book = Book(opened=case.opened, folder=case.folder, draw=draw)
    output = Output(path=book.path, lineage=lineage_of(case, stretch))

    def compute() -> Iterator[Draft]:
        if draw is not None and options.workers > 1:
            draw.prepare()
        document = _document(case, stretch, _answer(case, stretch, run.tell))
        yield Draft(output=output, write=partial(write_findings, document))

    def finish() -> None:
        book.show(run.tell, run.task)
        run.tell(Result(value=book.read()[0]))

    return Item(outputs=[output], compute=compute, finish=finish)


def lineage_of(case: Case, stretch: Stretch) -> Lineage:
    """Return the lineage that findings about a case would get now."""
    options, root = case.options, case.root
    window = options.window_s
    said: dict[str, JSON] = {
        **case.opened.clock_options,
        "model": relative_to(root, case.model),
        "null": None if options.quick else options.n_null,
        "quick": options.quick,
        "noise_mm": None if options.noise_m is None else 1e3 * options.noise_m,
        "window": None if window is None else f"{window[0]}:{window[1]}",
        **guess_options(stretch.files),
    }
    files = [*stretch.files, case.model, *case.opened.arena_files]
    return Lineage(
        schema=SCHEMA,
        command="diagnose",
        options=said,
        seed=case.seed,
        inputs=hash_inputs(root, files),
    )


def _question(case: Case, stretch: Stretch) -> Question:
    options = case.options
    noise = noise_of(case, stretch)
    return Question(
        samples=stretch.samples,
        arena=case.opened.arena,
        model=case.parameters,
        noise_m=noise.sd_m,
        noise_source=noise.source,
        n_null=options.n_null,
        quick=options.quick,
        seed=case.seed,
        n_workers=options.workers,
        grain_m=noise.grain_m,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownNoise:
    """How exact the positions of a recording are.

    Parameters
    ----------
    sd_m
        Standard deviation per coordinate, in metres; None where it is not known.
    source
        Where that is known from, in words.
    grain_m
        Positions are multiples of it; 0 where they are not.
    """

    sd_m: float | None
    source: str
    grain_m: float = 0.0


def noise_of(case: Case, stretch: Stretch) -> KnownNoise:
    """Return the position noise as it was asked for, stated by the tracks, or estimated."""
    stated_m, source = case.options.noise_m, "--noise-mm"
    if stated_m is None:
        stated_m, source = stretch.noise_m, "the tracks' own metadata"
    return _estimate(case, stretch, stated_m, source)


def _estimate(case: Case, stretch: Stretch, stated_m: float | None, source: str) -> KnownNoise:
    from zfcal.diagnose.noise import estimate_noise

    trial, arena = case.opened.trial, case.opened.arena
    found = estimate_noise(
        stretch.tracks, fps=trial.fps, dt_s=trial.dt_s, arena=arena, stated_m=stated_m
    )
    if found is None:
        return KnownNoise(sd_m=stated_m, source="unknown" if stated_m is None else source)
    if stated_m is None:
        source = f"the tracks: {found.how}"
    sd_m = None if math.isnan(found.sd_m) else found.sd_m
    return KnownNoise(sd_m=sd_m, source=source, grain_m=found.quantum_m)


def _document(case: Case, stretch: Stretch, diagnosis: Diagnosis) -> dict[str, Any]:
    document = findings_document(diagnosis, case.opened.arena)
    if stretch.n_left_out:
        n = stretch.n_segments
        says = f"{stretch.n_left_out} of {n} segments of tracks were damaged and left out."
        values = {"left_out": float(stretch.n_left_out), "segments": float(n)}
        document["notes"].append({"name": "left-out", "says": says, "values": values})
    return document


def _answer(case: Case, stretch: Stretch, tell: Tell) -> Diagnosis:
    try:
        return _engine(_question(case, stretch), _follow(tell))
    except InputError as error:
        # Whoever answers knows samples, not whose they are.
        hint = error.hint or "Look at its tracks with: zfcal inspect FILE"
        raise InputError(f"{case.root}: {error}", hint=hint) from error


def _follow(tell: Tell) -> Heard:
    def heard(stage: str, done: int, total: int) -> None:
        tell(Progress(stage=stage, done=done, total=total))

    return heard


def _engine(question: Question, heard: Heard) -> Diagnosis:
    # Slow to import, and a diagnosis that is up to date does not need it.
    from zfcal.diagnose.diagnose import diagnose as answer

    return answer(question, heard)
