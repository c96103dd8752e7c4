"""The published experiment on virtual fish, since no archive of its trials is public.

Four fish and a robot in the two rooms. Each group has parameters of its own, which drift. The
trials are calibrated as the paper did, and once more by zfcal's default.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zfcal.artifacts.lineage import JSON
from zfcal.artifacts.models import read_model_for
from zfcal.artifacts.segments import segment_path
from zfcal.calibrate.task import Settings
from zfcal.errors import InputError
from zfcal.parameters import Parameters, from_genes, n_genes
from zfcal.reproduction.archives import copy_trial
from zfcal.reproduction.courses import Course, driving_courses, models_of, reported_course
from zfcal.reproduction.document import Way
from zfcal.reproduction.planning import Planning
from zfcal.reproduction.reference import Reference
from zfcal.reproduction.reproduce import Origin, calibrated, publish
from zfcal.reproduction.statements import statements_of
from zfcal.reproduction.verdict import Verdict
from zfcal.stages.calibrate.searching import AS_PUBLISHED, CalibrateOptions
from zfcal.stages.events import Note, Planned, Progress, Tell, UpToDate
from zfcal.stages.recording import starts_between
from zfcal.stages.trial_context import Task, open_trial
from zfcal.trial import LOOP_NAME
from zfcal.virtual.closed_loop import closed_loop
from zfcal.virtual.trial import LoopOptions

SEED = 9001
"""The first trial's; nothing was chosen on these seeds."""

_RANDOM_START = 17
"""Of the random parameters with which a robot begins, beside the trial's seed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinOptions:
    """How large the twin is.

    Parameters
    ----------
    n_trials
        Virtual trials.
    duration_s
        Length of each.
    seed
        Of the first one; the next have the numbers that follow.
    """

    n_trials: int = 10
    duration_s: float = 1800.0
    seed: int = SEED

    def __post_init__(self) -> None:
        if self.n_trials < 1:
            raise InputError(f"A twin needs a trial or more, got {self.n_trials}.")
        if not self.duration_s >= 180.0:
            raise InputError(
                f"A twin needs trials of three minutes or more, got {self.duration_s:g} s.",
                hint="The published figure begins with the window that ends at 180 s.",
            )


def reproduce_twin(
    options: TwinOptions,
    reference: Reference,
    folder: Path,
    tell: Tell,
    *,
    task: Task | None = None,
) -> Verdict | None:
    """Make virtual trials, calibrate them as the paper did, and hold them against its statements.

    Parameters
    ----------
    options
        How many, and how long.
    reference
        What was published.
    folder
        Gets ``tanks/``, ``as-published/`` and ``default/`` with a trial each, and the results.
    tell
        Hears of every file, and of what was found.
    task
        How.

    Returns
    -------
    str or None
        The verdict on what the paper's way reports; None of a dry run.
    """
    task, plan = task or Task(), Planning(tell)
    recorded = _recorded(options, folder, plan, task)
    published = _all_calibrated(recorded, folder / "as-published", AS_PUBLISHED, plan, task)
    default = _all_calibrated(
        recorded, folder / "default", CalibrateOptions(keeps_way=True), plan, task
    )

    def ways() -> tuple[list[Way], dict[str, JSON]]:
        driven = {root.name: _driven(root) for root in published}
        found = [
            Way(name="as published", courses=_by_name(published, reported_course)),
            Way(
                name="driving, random start",
                courses={name: both[0] for name, both in driven.items()},
            ),
            Way(
                name="driving, given start",
                courses={name: both[1] for name, both in driven.items()},
            ),
            Way(name="our default", courses=_by_name(default, reported_course)),
        ]
        statements: list[JSON] = [each.as_dict() for each in statements_of(found, reference)]
        return found, {"statements": statements}

    said: dict[str, JSON] = {
        "twin": True,
        "n_trials": options.n_trials,
        "duration_s": options.duration_s,
        "seed": options.seed,
    }
    origin = Origin(reference=reference, roots=[*published, *default], options=said)
    return publish(origin, ways, folder, plan, task=task)


def _recorded(options: TwinOptions, folder: Path, tell: Tell, task: Task) -> list[Path]:
    found = []
    for k in range(options.n_trials):
        tell(Progress(stage="virtual trials", done=k, total=options.n_trials))
        loop = LoopOptions(
            duration_s=options.duration_s,
            robot="fixed",
            video=False,
            seed=options.seed + k,
            settings=Settings(generations=0),
        )
        # A recording has no answer to a force: it would be the same to the byte.
        place = folder / "tanks" / f"twin-{k + 1:02d}"
        record = _plan_recorded if task.dry_run else closed_loop
        found.append(record(place, loop, tell, task=task))
    return found


def _plan_recorded(place: Path, loop: LoopOptions, tell: Tell, *, task: Task) -> Path:
    """Say which tracks a virtual trial would record; return the trial."""
    root = place / "trial"
    is_whole = (root / LOOP_NAME).exists() and not task.force
    for start in starts_between(0.0, loop.duration_s):
        path = segment_path(root, start)
        reason = "forced" if path.exists() else "missing"
        is_made = is_whole and path.exists()
        tell(UpToDate(path=path) if is_made else Planned(path=path, reason=reason))
    return root


def _all_calibrated(
    recorded: Sequence[Path], folder: Path, options: CalibrateOptions, plan: Planning, task: Task
) -> list[Path]:
    found = []
    for k, source in enumerate(recorded):
        plan(Progress(stage=folder.name, done=k, total=len(recorded)))
        root = folder / source.parent.name
        found.append(root)
        if plan.is_planned(source):
            plan(Note(text=f"{root}: is made of {source} and calibrated after that."))
            continue
        copy_trial(source, root, plan, task=task)
        calibrated(root, options, plan, task=task)
    return found


def _by_name(roots: Sequence[Path], course: Callable[[Path], Course]) -> dict[str, Course]:
    return {root.name: course(root) for root in roots}


def _driven(root: Path) -> list[Course]:
    """Return what drove a robot that began with random parameters, and with the trial's model."""
    return driving_courses(root, [random_start(root), models_of(open_trial(root))[0]])


def random_start(root: Path) -> Parameters:
    """Return random parameters with which a trial's robot could have begun.

    Uniform genes, by a generator of the trial's own seed.
    """
    opened = open_trial(root)
    template = read_model_for(root / opened.trial.model, opened.arena, dt_s=opened.trial.dt_s)
    rng = np.random.default_rng([opened.trial.seed, _RANDOM_START])
    return from_genes(rng.random(n_genes(len(template.zones))), template)
