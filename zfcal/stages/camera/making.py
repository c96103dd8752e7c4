"""From a calibration to its files: the camera, its figure, and its name in ``trial.toml``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from zfcal.artifacts.cameras import SCHEMA
from zfcal.artifacts.freshness import hash_inputs
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.settings import name_camera, read_trial
from zfcal.cameras.calibration import Calibration
from zfcal.cameras.calibration_boards import LensCalibration
from zfcal.cameras.handedness import ABOVE, BELOW, check_side
from zfcal.errors import InputError
from zfcal.stages.camera.cameras import SIDE_KEY, write_camera
from zfcal.stages.events import Event, Made, Note, Result, Tell
from zfcal.stages.making import make_alone, run
from zfcal.stages.stage import Draft, Item, OneThing, Output, Run
from zfcal.stages.trial_context import Task
from zfcal.trial import CONFIG_NAME

_NAMES = ("overhead", "below")

Found: TypeAlias = Calibration | LensCalibration
"""A camera with its errors, or a lens alone."""

Draw: TypeAlias = Callable[[Found], Path]
"""Draws the errors, and returns where the picture is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraTask(Task):
    """How a camera is to be made.

    Parameters
    ----------
    draw
        Draws the errors of one that was made; None for no picture.
    """

    draw: Draw | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where a camera file goes.

    Parameters
    ----------
    path
        The file.
    root
        The trial whose ``trial.toml`` is to name it; None for no trial.
    name
        What it is called there: ``overhead`` or ``below``.
    stated_side
        From where a person says that it looks: ``above`` or ``below``; None for no word.
    """

    path: Path
    root: Path | None = None
    name: str = ""
    stated_side: str | None = None

    @property
    def base(self) -> Path:
        """What paths in the lineage are relative to."""
        return self.path.parent if self.root is None else self.root

    @property
    def side(self) -> str:
        """From where it looks at the tank: as stated, or as its name says, or from above."""
        return self.stated_side or usual_side(self.name)

    @property
    def unusual_side(self) -> str | None:
        """From where it looks, if its name does not say so already."""
        return None if self.side == usual_side(self.name) else self.side


def usual_side(name: str) -> str:
    """Return from where a camera of that name looks: ``below``, or ``above`` for any other."""
    return BELOW if name == BELOW else ABOVE


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """How a camera file is made.

    Parameters
    ----------
    place
        Where it goes.
    command
        The command, such as ``camera corners``.
    work
        Does the calibration.
    options
        Those that bear on the result.
    inputs
        Files that it reads.
    """

    place: Place
    command: str
    work: Callable[[], Found]
    options: Mapping[str, JSON] = field(default_factory=dict)
    inputs: tuple[Path, ...] = ()

    def lineage(self) -> Lineage:
        """Return the lineage of what it makes."""
        return Lineage(
            schema=SCHEMA,
            command=self.command,
            options={**self.options, SIDE_KEY: self.place.unusual_side},
            inputs=hash_inputs(self.place.base, self.inputs),
        )


def place_for(
    *, out: Path | None, trial: Path | None, name: str | None, stated_side: str | None = None
) -> Place:
    """Return where a camera file goes: a path, or a trial's camera of that name.

    Raises
    ------
    InputError
        No place was given, or two; or there is no such trial.
    """
    if (out is None) == (trial is None):
        raise InputError(
            "A camera file needs one place to go.",
            hint="Give -o FILE.toml, or --trial TRIAL and --camera overhead (or below).",
        )
    if trial is None:
        if out is None or out.suffix != ".toml":
            raise InputError(f"{out}: a camera file is TOML.", hint="Let its name end in .toml.")
        return Place(path=out, stated_side=stated_side)
    if name not in _NAMES:
        raise InputError(
            f"Which camera of {trial} is it?", hint=f"Give --camera with {' or '.join(_NAMES)}."
        )
    read_trial(trial)
    path = trial / "cameras" / f"{name}.toml"
    return Place(path=path, root=trial, name=name, stated_side=stated_side)


def make_camera(
    place: Place, prepare: Callable[[], Recipe], tell: Tell, *, task: CameraTask
) -> None:
    """Make a camera file, unless it is up to date.

    Parameters
    ----------
    place
        Where it goes.
    prepare
        Reads what is given, and returns how the file is made.
    tell
        Hears of the files, the errors and what a person should know.
    task
        Whether to write, whether to do it again, and who draws the errors.
    """
    stage = OneThing(name="camera", item=lambda run: _camera_file(run, prepare(), task.draw))
    if place.root is None:
        # No trial, no lock: a file of a person's own.
        make_alone(stage, Run(root=place.base, command=stage.name, tell=tell, task=task))
    else:
        run(stage, place.root, tell, task=task)


def _camera_file(run: Run, recipe: Recipe, draw: Draw | None) -> Item:
    place = recipe.place
    output = Output(path=place.path, lineage=recipe.lineage())

    def compute() -> Iterator[Draft]:
        found = recipe.work()
        _check_side(place, found)

        def write(_: Path, lineage: Lineage) -> Iterable[Event]:
            _write(place, found, lineage)
            return _told(found, draw)

        yield Draft(output=output, write=write)

    def finish() -> None:
        root = place.root
        if root is not None and not run.task.dry_run and name_camera(root, place.name, place.path):
            run.tell(Note(text=f"{root / CONFIG_NAME} names it as the {place.name} camera."))

    return Item(outputs=[output], compute=compute, finish=finish)


def _told(found: Found, draw: Draw | None) -> Iterator[Event]:
    if draw is not None:
        yield Made(path=draw(found), reason="")
    result = found.result() if isinstance(found, Calibration) else found.result
    for note in result.get("notes", ()):
        yield Note(text=note, warning=True)
    yield Note(text=_in_words(result))
    yield Result(value=result)


def _check_side(place: Place, found: Found) -> None:
    if not isinstance(found, Calibration):
        return
    other = BELOW if place.side == ABOVE else ABOVE
    look = "up through the floor" if other == BELOW else "down on the tank"
    check_side(
        found.camera,
        place.side,
        what=f"{place.path}, by these points",
        near_px=found.pairs.px.mean(axis=0),
        hint="Metres count y up, pixels y down: give the points' places in the arena's own axes. "
        f"Or does this camera look {look}? Then say --seen-from {other}.",
    )


def _write(place: Place, found: Found, lineage: Lineage) -> None:
    if isinstance(found, Calibration):
        points = (found.pairs.px, found.pairs.m)
        write_camera(place.path, found.camera, lineage, result=found.result(), points=points)
    else:
        write_camera(place.path, found.lens, lineage, result=found.result)


def _in_words(result: Mapping[str, Any]) -> str:
    """Return the errors of a calibration as a sentence."""
    parts = [f"{result['method']}, {result['n_points']} points"]
    if "seen_from" in result:
        parts.append(f"seen from {result['seen_from']}")
    for key, unit, words in (
        ("error_mm", "mm", "error"),
        ("left_out_mm", "mm", "of points left out"),
        ("error_px", "px", "in the image"),
    ):
        if key in result:
            found = result[key]
            parts.append(
                f"{words} {found['median']:.2f} {unit} median, {found['max']:.2f} {unit} largest"
            )
    return "; ".join(parts) + "."
