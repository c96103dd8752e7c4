"""Import, analyse and calibrate archived trials, and hold their scores against published ones.

The commands are the ordinary ones; what they make stays, so that a second run has nothing to do.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from zfcal.artifacts.atomic import write_bytes_whole, write_text_whole
from zfcal.artifacts.freshness import hash_inputs, stale_reason
from zfcal.artifacts.lineage import JSON, Lineage, to_json
from zfcal.artifacts.reading.contents import numbered_of, sha256_of
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import InputError
from zfcal.report.figures.panels import png_of
from zfcal.reproduction.archives import Archives, bring_in
from zfcal.reproduction.courses import Course, legacy_course, reported_course
from zfcal.reproduction.document import (
    SCHEMA,
    Way,
    document_of,
    intervals_csv,
    lines_of,
)
from zfcal.reproduction.picture import reproduction_picture
from zfcal.reproduction.planning import Planning, plan_calibrated, reason_before
from zfcal.reproduction.reference import Reference, Scoring
from zfcal.reproduction.verdict import Verdict
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.searching import AS_PUBLISHED, CalibrateOptions
from zfcal.stages.events import Made, Note, Planned, Result, Tell, UpToDate
from zfcal.stages.trial_context import Task

NAME = "reproduction.json"
"""The document; the table and the picture lie beside it under the same name."""

_BESIDE = (".csv", ".png")
"""Endings of the table and the picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReproduceOptions:
    """How archived trials are reproduced.

    Parameters
    ----------
    reference
        What was published, and the contrasts that were fixed.
    calibrate
        How models are made; the paper's way unless told.
    way
        What that is called.
    scoring
        ``paper``, or ``legacy`` for the authors' published scripts; None for the reference's.
    """

    reference: Reference
    calibrate: CalibrateOptions = AS_PUBLISHED
    way: str = "as published"
    scoring: Scoring | None = None

    @property
    def scored_by(self) -> Scoring:
        """The scoring that is used."""
        return self.scoring or self.reference.scoring


def reproduce(
    archives: Archives,
    options: ReproduceOptions,
    folder: Path,
    tell: Tell,
    *,
    task: Task | None = None,
) -> Verdict | None:
    """Reproduce published scores from archives.

    Parameters
    ----------
    archives
        Trials, and tracks of other programs. They are only read.
    options
        How, and against what.
    folder
        Gets a trial for each archive, and ``reproduction.json``, ``.csv`` and ``.png``.
    tell
        Hears of every file, and of what was found.
    task
        How.

    Returns
    -------
    str or None
        ``agrees``, ``disagrees`` or ``undecided``; None of a dry run.

    Raises
    ------
    ZfcalError
        An archive is wrong, or none has a window that can be calibrated.
    """
    task, plan = task or Task(), Planning(tell)
    roots = bring_in(archives, folder, plan, task=task)
    for root in roots:
        calibrated(root, options.calibrate, plan, task=task)

    def ways() -> tuple[list[Way], dict[str, JSON]]:
        courses = {root.name: course_of(root, options.scored_by) for root in roots}
        if not any(courses.values()):
            raise InputError(
                f"{folder}: no archive has a window with a model.",
                hint="A window takes two whole minutes of tracks.",
            )
        return [Way(name=options.way, courses=courses)], {}

    said: dict[str, JSON] = {"way": options.way, "scoring": options.scored_by}
    origin = Origin(reference=options.reference, roots=roots, options=said)
    return publish(origin, ways, folder, plan, task=task)


def calibrated(root: Path, options: CalibrateOptions, plan: Planning, *, task: Task) -> None:
    """Analyse and calibrate a trial, as ``zfcal analyse`` and ``zfcal calibrate`` do."""
    if task.dry_run:
        plan_calibrated(root, options, plan, task=task)
        return
    analyse(root, AnalyseOptions(), plan, task=task)
    calibrate(root, options, plan, task=task)


def course_of(root: Path, scoring: Scoring) -> Course:
    """Return the scores of a calibrated trial, window by window."""
    return legacy_course(root) if scoring == "legacy" else reported_course(root)


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """What a reproduction comes from.

    Parameters
    ----------
    reference
        What was published.
    roots
        The trials that the numbers come from.
    options
        What else bears on the result.
    """

    reference: Reference
    roots: Sequence[Path]
    options: Mapping[str, JSON]

    def lineage(self, folder: Path) -> Lineage:
        """Return where the document comes from, paths relative to its folder."""
        models = [p for root in self.roots for p in numbered_of(root / "models", ".toml").values()]
        digest = hashlib.sha256(repr(self.reference).encode()).hexdigest()
        return Lineage(
            schema=SCHEMA,
            command="reproduce",
            options={**self.options, "reference": digest},
            inputs=hash_inputs(folder, models),
        )


def publish(
    origin: Origin,
    ways: Callable[[], tuple[Sequence[Way], Mapping[str, JSON]]],
    folder: Path,
    plan: Planning,
    *,
    task: Task,
) -> Verdict | None:
    """Write document, table and picture unless they are up to date, and tell what was found.

    Parameters
    ----------
    origin
        What they come from.
    ways
        Returns the ways, of which the first decides, and more of the document.
    folder
        Where they go.
    plan
        Hears of them, and knows what would be made before.
    task
        A forced one makes them again.

    Returns
    -------
    str or None
        The verdict; None of a dry run.
    """
    if task.dry_run:
        _plan(origin, folder, plan, task=task)
        return None
    place, lineage = folder / NAME, origin.lineage(folder)
    reason = "forced" if task.force else _reason(place, lineage)
    if reason is not None:
        _write(place, *ways(), origin.reference, lineage)
    document = read_json(place)
    for path in (place, *(folder / name for name in document["files"])):
        plan(UpToDate(path=path) if reason is None else Made(path=path, reason=reason))
    for text in lines_of(document):
        plan(Note(text=text))
    plan(Result(value=document))
    verdict: Verdict = document["verdict"]
    return verdict


def _plan(origin: Origin, folder: Path, plan: Planning, *, task: Task) -> None:
    """Say whether document, table and picture would be made, and why."""
    place = folder / NAME
    reason = reason_before(place, plan, task=task) or _reason(place, origin.lineage(folder))
    for path in (place, *(place.with_suffix(suffix) for suffix in _BESIDE)):
        plan(UpToDate(path=path) if reason is None else Planned(path=path, reason=reason))


def _reason(place: Path, lineage: Lineage) -> str | None:
    """Return why the document has to be made; None if it and its files are as they were made."""
    reason = stale_reason([place], lineage)
    if reason is not None:
        return reason
    for name, digest in read_json(place)["files"].items():
        path = place.with_name(name)
        if not path.is_file() or sha256_of(path) != digest:
            return f"{name} is missing or was changed"
    return None


def _write(
    place: Path,
    ways: Sequence[Way],
    further: Mapping[str, JSON],
    reference: Reference,
    lineage: Lineage,
) -> None:
    table, picture = (place.with_suffix(suffix) for suffix in _BESIDE)
    contents = {
        table: intervals_csv(ways, reference).encode(),
        picture: png_of(reproduction_picture(ways, reference)),
    }
    for path, content in contents.items():
        write_bytes_whole(path, content)
    files = {path.name: sha256_of(path) for path in contents}
    document = document_of(ways, reference, lineage, further=further, files=files)
    check(document, "reproduction", place)
    write_text_whole(place, to_json(document) + "\n")
