"""Import, analyse and calibrate archived trials, and hold their scores against published ones.

The commands are the ordinary ones; what they make stays, so that a second run has nothing to do.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage, to_json
from zfcal.artifacts.reading.contents import numbered_of, read_limited
from zfcal.errors import InputError
from zfcal.report.figures.panels import png_of
from zfcal.reproduction.archives import Archives, bring_in
from zfcal.reproduction.courses import Course, legacy_course, reported_course
from zfcal.reproduction.document import (
    SCHEMA,
    Way,
    document_of,
    intervals_csv,
    judged,
    lines_of,
)
from zfcal.reproduction.picture import reproduction_picture
from zfcal.reproduction.reference import Reference, Scoring
from zfcal.reproduction.verdict import Verdict
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.searching import AS_PUBLISHED, CalibrateOptions
from zfcal.stages.events import Made, Note, Result, Tell, UpToDate
from zfcal.stages.trial_context import Task

NAME = "reproduction.json"
"""The document; the table and the picture lie beside it under the same name."""


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
) -> Verdict:
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
    str
        ``agrees``, ``disagrees`` or ``undecided``.

    Raises
    ------
    ZfcalError
        An archive is wrong, or none has a window that can be calibrated.
    """
    task = task or Task()
    roots = bring_in(archives, folder, tell, task=task)
    courses: dict[str, Course] = {}
    for root in roots:
        calibrated(root, options.calibrate, tell, task=task)
        courses[root.name] = course_of(root, options.scored_by)
    if not any(courses.values()):
        raise InputError(
            f"{folder}: no archive has a window with a model.",
            hint="A window takes two whole minutes of tracks.",
        )
    ways = [Way(name=options.way, courses=courses)]
    said: dict[str, JSON] = {"way": options.way, "scoring": options.scored_by}
    found = Found(ways=ways, reference=options.reference, roots=roots, options=said)
    return publish(found, folder, tell)


def calibrated(root: Path, options: CalibrateOptions, tell: Tell, *, task: Task) -> None:
    """Analyse and calibrate a trial, as ``zfcal analyse`` and ``zfcal calibrate`` do."""
    analyse(root, AnalyseOptions(), tell, task=task)
    calibrate(root, options, tell, task=task)


def course_of(root: Path, scoring: Scoring) -> Course:
    """Return the scores of a calibrated trial, window by window."""
    return legacy_course(root) if scoring == "legacy" else reported_course(root)


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What a reproduction has found.

    Parameters
    ----------
    ways
        The first one decides.
    reference
        What was published.
    roots
        The trials that the numbers come from.
    options
        What bears on the result, for the lineage.
    further
        More of the document.
    """

    ways: Sequence[Way]
    reference: Reference
    roots: Sequence[Path]
    options: Mapping[str, JSON]
    further: Mapping[str, JSON] = field(default_factory=dict)


def publish(found: Found, folder: Path, tell: Tell) -> Verdict:
    """Write document, table and picture where they have changed, and tell what was found.

    Parameters
    ----------
    found
        What there is to tell.
    folder
        Where they go.
    tell
        Hears of them.

    Returns
    -------
    str
        The verdict.
    """
    ways, reference = found.ways, found.reference
    models = [p for root in found.roots for p in numbered_of(root / "models", ".toml").values()]
    lineage = Lineage(
        schema=SCHEMA,
        command="reproduce",
        options={**found.options, "reference": _hash_of(reference)},
        inputs=hash_inputs(folder, models),
    )
    document = document_of(ways, reference, lineage, further=found.further)
    contents = {
        ".json": (to_json(document) + "\n").encode(),
        ".csv": intervals_csv(ways, reference).encode(),
        ".png": png_of(reproduction_picture(ways, reference)),
    }
    for ending, content in contents.items():
        _write(folder / Path(NAME).with_suffix(ending), content, tell)
    for way in ways:
        tell(Note(text="\n".join(lines_of(way, reference))))
    tell(Result(value=document))
    return judged(ways[0], reference)[1]


def _hash_of(reference: Reference) -> str:
    return hashlib.sha256(repr(reference).encode()).hexdigest()


def _write(path: Path, content: bytes, tell: Tell) -> None:
    if path.is_file() and read_limited(path) == content:
        tell(UpToDate(path=path))
        return
    reason = "changed" if path.exists() else "missing"
    write_bytes_whole(path, content)
    tell(Made(path=path, reason=reason))
