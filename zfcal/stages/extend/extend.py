"""Add what a diagnosis found to the model, calibrate it anew, and show whether the gap shrinks.

Every other minute is learnt from, the rest is held out. Three models take the same way, with
the same budget and the same luck: without the effects, with them, and with a placebo.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from zfcal.artifacts.atomic import discard
from zfcal.artifacts.freshness import hash_inputs, relative_to
from zfcal.artifacts.lineage import JSON, Lineage, read_lineage
from zfcal.artifacts.models import read_model, read_result, write_model
from zfcal.artifacts.settings import find_trial
from zfcal.diagnose.document import gap_document
from zfcal.diagnose.findings import Gap, Verdict
from zfcal.errors import DamagedError, InputError
from zfcal.model.effects import find_effect
from zfcal.stages.calibrate.rounds import MODEL
from zfcal.stages.calibrate.searching import CalibrateOptions, checkpoint_key
from zfcal.stages.diagnose.diagnose import Case, DiagnoseOptions, diagnose, open_case
from zfcal.stages.diagnose.findings import FILE, FOLDER, Book, Draw
from zfcal.stages.events import Made, Note, Result, Tell, say_nothing
from zfcal.stages.extend.extension import Extension, extension_of
from zfcal.stages.making import run
from zfcal.stages.stage import Draft, Item, OneThing, Output, Run
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import Task, at_work, open_trial

Effects = Mapping[str, Mapping[str, float]]

_EXTENDED = "extended"
_NOTE = "extended"


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtendOptions:
    """What to add, and how to calibrate.

    Parameters
    ----------
    names
        Effects to add; empty for those that the findings name.
    findings
        Where these are, the file or its folder; None for ``diagnosis/findings.json``. They are
        made when they are missing or stale.
    calibration
        Budget, seed and workers of each of the three calibrations.
    output
        Where the model goes; None for ``models/extended.toml``, or, where the findings are
        about an extended model, the next number: ``models/extended-2.toml``.
    """

    names: tuple[str, ...] = ()
    findings: Path | None = None
    calibration: CalibrateOptions = field(default_factory=CalibrateOptions)
    output: Path | None = None


def extend(
    root: Path,
    options: ExtendOptions,
    tell: Tell,
    *,
    task: Task | None = None,
    draw: Draw | None = None,
) -> Path | None:
    """Add effects to a trial's model.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What to add, and how to calibrate.
    tell
        Hears of every artifact, of what is left out, and how far it is.
    task
        How to go about it.
    draw
        Draws the findings' page anew.

    Returns
    -------
    Path or None
        The model; None where there is nothing to add, or in a dry run.

    Raises
    ------
    ZfcalError
        The trial or the tracks are wrong, they are too little to say anything, an effect is
        unknown or in the model already, or another extend is at work on the trial.
    """
    # Its diagnosis, made or up to date, looks whether settings agree with the tracks.
    stage = OneThing(name="extend", item=lambda run: _extended(run, options, draw))
    there = run(stage, root, tell, task=task)
    return there[0] if there and not (task and task.dry_run) else None


def _extended(run: Run, options: ExtendOptions, draw: Draw | None) -> Item | None:
    """Return the extended model, after a diagnosis where there is none that holds."""
    path = _findings_of(run.root, options.findings)
    asked = _question_of(run.root, path)
    case = open_case(run.root, asked)
    # Before the diagnosis, which takes minutes.
    _check_new(case, options.names)
    if not _up_to_date(run.root, asked, run.tell, task=run.task, draw=draw):
        return None
    book = Book(opened=case.opened, folder=path.parent, draw=draw)
    document, found = book.read()
    effects = _chosen(case, options, document, run.tell)
    if effects is None:
        run.tell(Result(value=document))
        return None
    stretch = read_stretch(case.opened, asked.window_s, say_nothing)
    ties = [tie for effect in found.effects for tie in effect.ties]
    extension = extension_of(case, stretch, effects, (options.calibration, ties, run.tell))
    output = Output(
        path=options.output or _place(run.root, case.model),
        lineage=_lineage(case, extension, list(stretch.files)),
        ignore=options.calibration.not_asked,
    )

    def finish() -> None:
        if not run.task.dry_run:
            _tell_gap(book, document, output.path, run.tell, task=run.task)
            run.tell(Result(value=book.read()[0]))

    return Item(outputs=[output], compute=lambda: _made(output, extension), finish=finish)


def _made(output: Output, extension: Extension) -> Iterator[Draft]:
    """Fit, calibrate and judge the three models, and yield the one with the effects."""
    checkpoints = output.path.with_name(f".{output.path.stem}")
    made = extension.make(checkpoints, key=checkpoint_key(output.lineage))
    table = {**made.result, "gap": {each.measure: _entry(each) for each in made.gap}}
    yield Draft(
        output=output.with_options(generations=made.result["generations"]),
        write=lambda path, lineage: write_model(path, made.model, lineage, table),
    )
    for path in extension.checkpoints(checkpoints):
        discard(path)


def _findings_of(root: Path, named: Path | None) -> Path:
    """Return where the findings are that name the effects, which may be made there anew.

    Raises
    ------
    InputError
        Findings under another name would not be read, those of another trial be written over.
    """
    if named is None:
        return root / FOLDER / FILE
    path = named / FILE if named.is_dir() else named
    if path.name != FILE:
        raise InputError(
            f"{path}: findings are read from a file named {FILE}.",
            hint=f"Name the folder in which zfcal diagnose --out wrote its {FILE}.",
        )
    if _owner(path) not in (None, root.resolve()):
        raise InputError(
            f"{path}: belongs to another trial than {root}.",
            hint=f"Say which effects to add instead: zfcal extend {root} --effect NAME",
        )
    return path


def _owner(path: Path) -> Path | None:
    try:
        return find_trial(path.resolve().parent)
    except InputError:
        return None


def _question_of(root: Path, path: Path) -> DiagnoseOptions:
    """Return the options with which findings were made, so that they can be asked again."""
    asked = DiagnoseOptions(out_dir=path.parent)
    try:
        lineage = read_lineage(path)
    except (InputError, DamagedError):
        return asked
    said = lineage.options
    model = root / str(said.get("model", ""))
    window = said.get("window")
    noise_mm = said.get("noise_mm")
    numbered = re.fullmatch(r"\d{6,}", model.stem) is not None and model.parent == root / "models"
    start_s, _, end_s = str(window or "").partition(":")
    null = said.get("null")
    return replace(
        asked,
        # That of the newest round, as it was then: a newer one makes the findings stale.
        model=None if numbered else model,
        quick=bool(said.get("quick", False)),
        n_null=null if isinstance(null, int) else asked.n_null,
        noise_m=float(noise_mm) / 1e3 if isinstance(noise_mm, int | float) else None,
        window_s=(int(start_s), int(end_s)) if window else None,
        seed=None if lineage.seed == open_trial(root).trial.seed else lineage.seed,
    )


def _up_to_date(
    root: Path, asked: DiagnoseOptions, tell: Tell, *, task: Task, draw: Draw | None
) -> bool:
    """Make the findings if they are missing or stale; whether they are there now."""

    def without_result(event: Any) -> None:
        if not isinstance(event, Result):
            tell(event)

    again = Task(dry_run=task.dry_run)
    return diagnose(root, asked, without_result, task=again, draw=draw) is not None


def _chosen(
    case: Case, options: ExtendOptions, document: Mapping[str, Any], tell: Tell
) -> Effects | None:
    """Return the effects to add with parameters to start from; None where nothing is to be done."""
    found = {effect["name"]: effect for effect in document["effects"]}
    names = options.names or tuple(found)
    _check_new(case, names)
    if not names:
        return _nothing(case, Verdict(document["verdict"]), document, tell)
    return {
        name: {
            key: float(value)
            for key, value in found.get(name, {"strength": {}})["strength"].items()
            if value is not None
        }
        for name in names
    }


def _check_new(case: Case, names: Iterable[str]) -> None:
    for name in names:
        find_effect(name)
        if name in case.parameters.effects:
            raise InputError(
                f"{case.model}: the model has the effect {name!r} already.",
                hint="Leave it out, or take the model without it: zfcal diagnose TRIAL --model.",
            )


def _nothing(
    case: Case, verdict: Verdict, document: Mapping[str, Any], tell: Tell
) -> Effects | None:
    root = case.root
    if verdict is Verdict.UNTESTABLE:
        needed = [each["minutes_needed"] for each in document["screened"]]
        known = [minutes for minutes in needed if minutes is not None]
        more = f" {min(known):.0f} min would do for the first effect." if known else ""
        raise InputError(
            f"{root}: the recording is too short to say what the model lacks.",
            hint=f"Record for longer.{more}",
        )
    says = {
        Verdict.UNEXPLAINED: "model and fish disagree, but nothing that is known explains it: "
        "no effect to add",
    }.get(verdict, "the model lacks no effect: nothing to add")
    tell(Note(text=f"{root}: {says}."))
    return None


def _place(root: Path, model: Path) -> Path:
    """Return where the extended model goes: beside, never over, the one that it extends."""
    found = re.fullmatch(rf"{_EXTENDED}(?:-(\d+))?", model.stem)
    number = int(found.group(1) or 1) + 1 if found else 1
    return root / "models" / (f"{_EXTENDED}-{number}.toml" if number > 1 else f"{_EXTENDED}.toml")


def _lineage(case: Case, extension: Extension, files: list[Path]) -> Lineage:
    trial, calibration = case.opened.trial, extension.calibration
    window = case.options.window_s
    said: dict[str, JSON] = {
        **case.opened.clock_options,
        "n_fish": trial.n_fish,
        "n_robots": trial.n_robots,
        "model": relative_to(case.root, case.model),
        "window": None if window is None else f"{window[0]}:{window[1]}",
        "effects": {name: dict(values) for name, values in extension.effects.items()},
        "placebo": extension.placebo,
        "noise_mm": None if case.options.noise_m is None else 1e3 * case.options.noise_m,
        **calibration.settings.said,
        "generations": calibration.generations_asked,
        "seed_likelihood": calibration.seed_likelihood,
    }
    return Lineage(
        schema=MODEL,
        command="extend",
        options=said,
        seed=extension.seed,
        inputs=hash_inputs(case.root, [*files, case.model, *case.opened.arena_files]),
    )


def _entry(gap: Gap) -> dict[str, JSON]:
    """Return an entry of ``[result.gap]``; what is NaN is None, and left out."""
    low, high = gap.interval
    values = {"low": low, "high": high}
    for key in ("before", "after", "floor", "closed", "placebo"):
        values[key] = getattr(gap, key)
    return {key: None if math.isnan(value) else value for key, value in values.items()}


def _note(effects: Sequence[str], placebo: str | None) -> dict[str, JSON]:
    """Return the note that says between which models the gap is."""
    says = f"The extended model has {' and '.join(effects)}."
    if placebo is not None:
        says += f" Wrong effect for comparison: {placebo}."
    return {"name": _NOTE, "says": says, "values": {}}


def _tell_gap(
    book: Book, document: dict[str, Any], output: Path, tell: Tell, *, task: Task
) -> None:
    """Put a model's gap into the findings that it came from, and draw their page anew."""
    root, result = book.opened.trial.root, read_result(output)
    gap = [
        Gap(
            measure=measure,
            interval=(entry.get("low", math.nan), entry.get("high", math.nan)),
            **{
                key: entry.get(key, math.nan)
                for key in ("before", "after", "floor", "closed", "placebo")
            },
        )
        for measure, entry in result.get("gap", {}).items()
    ]
    about = hash_inputs(root, [output])
    notes = [note for note in document["notes"] if note["name"] != _NOTE]
    notes.append(_note(tuple(read_model(output).effects), result.get("placebo")))
    said = {"gap": gap_document(gap), "extended": about, "notes": notes}
    if {key: document.get(key) for key in said} != said:
        lineage = document.pop("lineage")
        with at_work(root, "diagnose", task):
            book.replace({**document, **said, "lineage": lineage})
        tell(Made(path=book.path, reason="the gap is new"))
    book.show(tell, Task())
