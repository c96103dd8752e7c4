"""What the options of `zfcal reproduce` come to."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .foreign import import_options
from .output import EXIT_DISAGREES, Output

if TYPE_CHECKING:
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.stages.init import NewTrial
    from zfcal.stages.trial_context import Task

_OF_TWIN = ("n_trials", "duration")
_OF_ARCHIVES = (
    "scoring", "arena", "radius_m", "side_m", "n_fish", "format_", "fps", "mm_per_px",
    "origin", "noise_mm", "robots", "columns", "keypoint", "body_axis", "box", "first_frame",
    "min_confidence", "generations",
)  # fmt: skip
_OF_TANK = ("arena", "radius_m", "side_m")


def check_together(archives: tuple[Path, ...], options: Mapping[str, Any]) -> None:
    """Refuse what could not take effect.

    Raises
    ------
    click.UsageError
        Archives and a twin are asked for, or neither; an option belongs to the other one.
    """
    if options["twin"] and archives:
        raise click.UsageError("--twin makes its own trials: give no archives.")
    if not options["twin"] and not archives:
        raise click.UsageError("Missing argument 'ARCHIVE...'; or --twin.")
    names = _OF_ARCHIVES if options["twin"] else _OF_TWIN
    given = [name for name in names if options[name] is not None]
    if options["twin"]:
        given += [name for name in ("robot", "flip_y") if options[name]]
        given += ["way"] if options["way"] != "as-published" else []
    if given:
        option = "--" + given[0].removeprefix("n_").rstrip("_").replace("_", "-")
        where = "archives" if options["twin"] else "--twin"
        raise click.UsageError(f"{option} belongs to {where}.")


def reproduce_archives(
    out: Output, archives: tuple[Path, ...], folder: Path, options: Mapping[str, Any]
) -> None:
    """Reproduce scores from archives."""
    from zfcal.reproduction.archives import Archives
    from zfcal.reproduction.reference import read_reference
    from zfcal.reproduction.reproduce import ReproduceOptions, reproduce

    foreign = import_options({name: options[name] for name in _foreign_names()})
    found = Archives(
        paths=archives,
        new=_new_trial(options),
        format=options["format_"],
        options=foreign,
    )
    asked = ReproduceOptions(
        reference=read_reference(options["reference"]),
        calibrate=_calibration(options),
        way=options["way"].replace("-", " "),
        scoring=options["scoring"],
    )
    verdict = reproduce(found, asked, folder, out.tell, task=_task(options))
    if verdict not in {"agrees", None}:
        out.worsen(EXIT_DISAGREES)


def _foreign_names() -> tuple[str, ...]:
    return (
        "fps", "mm_per_px", "origin", "flip_y", "noise_mm", "robots", "columns", "keypoint",
        "body_axis", "box", "first_frame", "min_confidence",
    )  # fmt: skip


def _calibration(options: Mapping[str, Any]) -> CalibrateOptions:
    from zfcal.stages.calibrate.searching import AS_PUBLISHED, CalibrateOptions

    chosen = AS_PUBLISHED if options["way"] == "as-published" else CalibrateOptions(keeps_way=True)
    settings = dataclasses.replace(chosen.settings, generations=options["generations"])
    return dataclasses.replace(chosen, settings=settings)


def _new_trial(options: Mapping[str, Any]) -> NewTrial | None:
    """Return the trials that foreign archives become; None where their tank is not said."""
    from zfcal.stages.init import NewTrial

    if all(options[name] is None for name in _OF_TANK) or options["n_fish"] is None:
        return None
    return NewTrial(
        **{name: options[name] for name in _OF_TANK},
        n_fish=options["n_fish"],
        n_robots=len(options["robots"] or ()) or int(options["robot"]),
        fps=options["fps"] or 15.0,
        seed=1 if options["seed"] is None else options["seed"],
    )


def reproduce_virtual(
    out: Output,
    archives: tuple[Path, ...],  # noqa: ARG001 - there are none
    folder: Path,
    options: Mapping[str, Any],
) -> None:
    """Make the twin of the published experiment, and reproduce it."""
    from zfcal.reproduction.reference import read_reference
    from zfcal.reproduction.twin import TwinOptions, reproduce_twin

    asked = {
        "n_trials": options["n_trials"],
        "duration_s": options["duration"],
        "seed": options["seed"],
    }
    twin = TwinOptions(**{name: value for name, value in asked.items() if value is not None})
    reference = read_reference(options["reference"])
    verdict = reproduce_twin(twin, reference, folder, out.tell, task=_task(options))
    if verdict not in {"agrees", None}:
        out.worsen(EXIT_DISAGREES)


def _task(options: Mapping[str, Any]) -> Task:
    from zfcal.stages.trial_context import Task

    return Task(dry_run=options["dry_run"], force=options["force"])
