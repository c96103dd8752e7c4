"""`zfcal.simulate`, and what its command does with its options."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

from zfcal.api import tables
from zfcal.api.trials import TrialPath, heard_by, path_of, tables_of, task_of
from zfcal.api.values import (
    PathLike,
    Time,
    existing,
    flag,
    number,
    one_of,
    place,
    seconds,
    seed,
    shown,
    taken,
    whole,
)
from zfcal.errors import OptionError
from zfcal.stages.events import Tell
from zfcal.stages.simulate import SimulateOptions
from zfcal.stages.simulate import simulate as simulate_trial
from zfcal.trial import CONFIG_NAME

if TYPE_CHECKING:
    from zfcal.virtual.film import FilmOptions

Changes: TypeAlias = str | Iterable[str] | Mapping[str, Any]
"""Texts such as ``noise_grey=4``, or values by their names."""

LookName: TypeAlias = Literal["clean", "usual", "hard"]


def _arena(value: PathLike) -> str:
    place(value)
    # As it was typed: the name of one, or a path.
    return os.fspath(value)


def _changes(asked: Changes) -> dict[str, Any]:
    if isinstance(asked, Mapping):
        return dict(asked)
    texts = (asked,) if isinstance(asked, str) else asked
    if not isinstance(texts, Iterable):
        raise OptionError(f"{shown(asked)} is neither NAME=VALUE nor values by their names.")
    return dict(map(_change, texts))


def _change(text: Any) -> tuple[str, Any]:
    if not isinstance(text, str):
        raise OptionError(f"{shown(text)} is no text such as noise_grey=4.")
    name, _, value = text.partition("=")
    try:
        if value == "none":
            return name, None
        if name == "jpeg_quality":
            return name, int(value)
        numbers = tuple(map(float, value.split(",")))
    except ValueError:
        raise OptionError(f"each takes NAME=VALUE with a number, got {text!r}.") from None
    return name, numbers if len(numbers) > 1 else numbers[0]


_FORMS: dict[str, Callable[[Any], Any]] = {
    "seed": seed,
    "arena": _arena,
    "fish": whole(0),
    "robots": whole(0),
    "fps": number(low=0, is_open=True),
    "video_file": place,
    "look": one_of("clean", "usual", "hard"),
    "photograph": existing,
}
_NEEDED: dict[str, Callable[[Any], Any]] = {
    "model": existing,
    "duration": seconds,
    "robot": flag,
    "video": flag,
    "draw": _changes,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulation:
    """What simulates a trial as the options of the command say.

    Parameters
    ----------
    chosen
        What to simulate.
    filmed
        What to draw of it; None for no images.
    options
        Those of the command.
    """

    chosen: SimulateOptions
    filmed: FilmOptions | None
    options: Mapping[str, Any]

    def __call__(self, root: Path, tell: Tell) -> None:
        """Simulate a trial."""
        task = task_of(self.options)
        if self.filmed is None:
            simulate_trial(root, self.chosen, tell, task=task)
            return
        # What draws images takes a third of a second to import.
        from zfcal.virtual.filming import simulate_on_film

        simulate_on_film(root, self.chosen, self.filmed, tell, task=task)


def simulation_of(options: Mapping[str, Any]) -> Simulation:
    """Return what simulates a trial as the options of the command say.

    Parameters
    ----------
    options
        By the names of the arguments of `simulate`.

    Raises
    ------
    OptionError
        One has another form, two contradict each other, or one could not take effect.
    """
    asked = taken(options, _FORMS, needed=_NEEDED)
    chosen = SimulateOptions(
        model=asked["model"],
        duration_s=asked["duration"],
        seed=asked["seed"],
        arena=asked["arena"],
        n_fish=asked["fish"],
        n_robots=count_robots(robot=asked["robot"], n_robots=asked["robots"]),
        fps=asked["fps"],
    )
    return Simulation(chosen=chosen, filmed=_film(asked), options=asked)


def count_robots(*, robot: bool, n_robots: int | None) -> int | None:
    """Return the number of robots that --robot and --robots ask for; None if neither does."""
    if robot and n_robots not in (None, 1):
        raise OptionError(f"--robot means one robot, --robots says {n_robots}.")
    return 1 if robot else n_robots


def _film(asked: Mapping[str, Any]) -> FilmOptions | None:
    given = {f"--{name}": asked[name] for name in ("look", "draw", "photograph")}
    if asked["video"] or asked["video_file"] is not None:
        from zfcal.virtual.film import FilmOptions
        from zfcal.virtual.images.look import USUAL, look_of

        return FilmOptions(
            look=look_of(asked["look"] or USUAL, asked["draw"]),
            photograph=asked["photograph"],
            seed=asked["seed"],
            video=asked["video_file"],
        )
    if any(given.values()):
        name = next(name for name, value in given.items() if value)
        raise OptionError(f"{name} is about images: add --video.")
    return None


@overload
def simulate(
    trial: TrialPath,
    *,
    model: PathLike,
    duration: Time,
    seed: int | None = None,
    arena: PathLike | None = None,
    fish: int | None = None,
    robot: bool = False,
    robots: int | None = None,
    fps: float | None = None,
    video: bool = False,
    video_file: PathLike | None = None,
    look: LookName | None = None,
    draw: Changes = (),
    photograph: PathLike | None = None,
    dry_run: Literal[False] = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables: ...
@overload
def simulate(
    trial: TrialPath,
    *,
    model: PathLike,
    duration: Time,
    seed: int | None = None,
    arena: PathLike | None = None,
    fish: int | None = None,
    robot: bool = False,
    robots: int | None = None,
    fps: float | None = None,
    video: bool = False,
    video_file: PathLike | None = None,
    look: LookName | None = None,
    draw: Changes = (),
    photograph: PathLike | None = None,
    dry_run: bool,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables | None: ...
def simulate(
    trial: TrialPath,
    *,
    model: PathLike,
    duration: Time,
    seed: int | None = None,
    arena: PathLike | None = None,
    fish: int | None = None,
    robot: bool = False,
    robots: int | None = None,
    fps: float | None = None,
    video: bool = False,
    video_file: PathLike | None = None,
    look: LookName | None = None,
    draw: Changes = (),
    photograph: PathLike | None = None,
    dry_run: bool = False,
    force: bool = False,
    tell: Tell | None = None,
) -> tables.TrialTables | None:
    """Simulate fish that a model drives, and what cameras see of them: ``zfcal simulate``.

    A trial that does not exist is made, at the model's own step (with images: at 15 Hz or so),
    with the arena and the fish of the trial in which the model lies unless others are given. The
    first 60 s of the simulation are dropped.

    Parameters
    ----------
    trial
        Its directory, or its tables.
    model
        A model file.
    duration
        How long, in seconds, or such as ``"30min"``.
    seed
        Of the simulation; None for the trial's.
    arena
        Of a new trial: its name, or a GeoJSON file in metres.
    fish, robots
        Of a new trial, how many.
    robot
        The same as ``robots=1``.
    fps
        Frame rate of a new trial, in hertz.
    video
        Also draw what the cameras see.
    video_file
        Also as a plain video: ``.avi`` and ``.mkv`` are lossless, ``.mp4`` is small.
    look
        How easy the images are; usual by default.
    draw
        Values of the look that are changed, such as ``{"noise_grey": 4}``.
    photograph
        Of the empty tank from above, instead of a drawn one.
    dry_run
        Write nothing; `tell` gets what would be made, and why.
    force
        Make what is up to date again.
    tell
        Function that gets an event for every file, for what is left out, and for progress
        (`zfcal.stages.events`). By default what is left out is a warning, and the rest is logged
        as ``zfcal``.

    Returns
    -------
    TrialTables
        Of the trial: ``tracks()`` has a row per agent and frame, positions in metres. None where
        a dry run has made no trial.

    Raises
    ------
    OptionError
        An option has a wrong type or value, two contradict each other, or one has no effect.
    InputError
        The model is not one for the trial's arena and step, or the trial holds other tracks.
    StorageError
        The disk is full, or a place cannot be written.
    LockedError
        The same command is running on the trial.

    Examples
    --------
    >>> import zfcal
    >>> made = zfcal.simulate("alone", model="trial/models/000000.toml", duration="2min", seed=2)
    >>> made.tracks()["agent"].nunique()
    4
    """
    work, root = simulation_of(locals()), path_of(trial)
    work(root, heard_by(tell))
    is_planned = dry_run and not (root / CONFIG_NAME).exists()
    return None if is_planned else tables_of(root)
