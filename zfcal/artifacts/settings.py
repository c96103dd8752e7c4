"""``trial.toml``: the one file of a trial that people write in."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import tomlkit
from tomlkit.items import Table

from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.reading.contents import note_values, values_alone
from zfcal.artifacts.validation import check, descriptions_of, read_toml, written_by_people
from zfcal.errors import InputError
from zfcal.trial import CONFIG_NAME, Trial

_SCHEMA = "zfcal.trial/1"

_Container: TypeAlias = tomlkit.TOMLDocument | Table


def find_trial(path: Path) -> Path:
    """Return the trial that a path lies in: itself or the nearest folder above with a trial.toml.

    Raises
    ------
    InputError
        There is none.
    """
    place = path.absolute()
    for folder in (place, *place.parents):
        if (folder / CONFIG_NAME).is_file():
            return path if folder == place else folder
    raise InputError(
        f"{path}: is not in a trial (no {CONFIG_NAME} here or above).",
        hint=f"Make one with: zfcal init {path} --arena two-rooms --fish 4",
    )


def read_trial(root: Path) -> Trial:
    """Read the settings of a trial.

    Parameters
    ----------
    root
        The trial's directory.

    Raises
    ------
    InputError
        There is no such trial, it is not TOML, or a setting is unknown,
        missing or wrong.
    """
    path = root / CONFIG_NAME
    if not path.exists():
        raise InputError(
            f"{root}: is not a trial (it has no {CONFIG_NAME}).",
            hint=f"Make one with: zfcal init {root} --arena two-rooms --fish 4",
        )
    # What is made states the settings that it was made with: a comment, or a camera that another
    # command names meanwhile, bears on nothing.
    with written_by_people(), values_alone():
        document = read_toml(path)
    note_values(path, repr(sorted({**document, "cameras": None}.items())))
    check(document, "trial", path)
    document.pop("schema")
    for key in ("fps", "dt_s"):
        document[key] = float(document[key])
    return Trial(root=root, **document)


def write_trial(trial: Trial) -> None:
    """Write ``trial.toml`` anew, with a comment on each key.

    Raises
    ------
    InputError
        A setting is wrong.
    StorageError
        The file cannot be written.
    """
    document = _as_document(trial)
    check(document.unwrap(), "trial", trial.config)
    write_text_whole(trial.config, tomlkit.dumps(document))


def name_camera(root: Path, name: str, file: Path) -> bool:
    """Let ``trial.toml`` name the file of a camera; all else in it stays as it is.

    Parameters
    ----------
    root
        The trial's directory.
    name
        ``overhead`` or ``below``.
    file
        The camera file, inside the trial.

    Returns
    -------
    bool
        Whether the settings had to be changed.

    Raises
    ------
    InputError
        There is no such trial, or its settings are wrong.
    StorageError
        They cannot be written.
    """
    trial = read_trial(root)
    relative = file.relative_to(root).as_posix()
    if (trial.cameras or {}).get(name, {}).get("file") == relative:
        return False
    document = tomlkit.parse(trial.config.read_text(encoding="utf-8-sig"))
    cameras = document.setdefault("cameras", tomlkit.table(is_super_table=True))
    cameras.setdefault(name, tomlkit.table())["file"] = relative
    check(document.unwrap(), "trial", trial.config)
    write_text_whole(trial.config, tomlkit.dumps(document))
    return True


def _as_document(trial: Trial) -> tomlkit.TOMLDocument:
    values: dict[str, Any] = {
        "schema": _SCHEMA,
        "arena": trial.arena,
        "n_fish": trial.n_fish,
        "n_robots": trial.n_robots,
        "fps": trial.fps,
        "dt_s": trial.dt_s,
        "seed": trial.seed,
        "model": trial.model,
        "source": trial.source,
    }
    document = tomlkit.document()
    document.add(tomlkit.comment("Settings of a trial. Edit them: stages that depend on them are"))
    document.add(tomlkit.comment("made again by the next run of their command."))
    _add_commented(document, values, descriptions_of("trial"))
    if trial.cameras:
        cameras = tomlkit.table(is_super_table=True)
        for name, camera in sorted(trial.cameras.items()):
            table = tomlkit.table()
            _add_commented(table, camera, descriptions_of("trial", "camera"))
            cameras.add(name, table)
        document.add(tomlkit.nl())
        document.add("cameras", cameras)
    return document


def _add_commented(
    place: _Container, values: Mapping[str, Any], descriptions: Mapping[str, str]
) -> None:
    for key, value in values.items():
        place.add(tomlkit.nl())
        for line in textwrap.wrap(descriptions.get(key, ""), 78):
            place.add(tomlkit.comment(line))
        place.add(key, tomlkit.item(value))
