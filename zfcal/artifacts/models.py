"""Model files: a base model, its effects and their parameters, as people read and edit them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from zfcal.arena import Arena
from zfcal.artifacts.atomic import write_text_whole
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.validation import check, descriptions_of, nearest, read_toml
from zfcal.errors import InputError
from zfcal.parameters import Parameters, ZoneParameters
from zfcal.trial import Trial

SCHEMA = "zfcal.model/1"


def read_model(path: Path) -> Parameters:
    """Read a model file.

    Parameters
    ----------
    path
        A TOML file of schema ``zfcal.model/1``.

    Returns
    -------
    zfcal.parameters.Parameters
        Zones in the file's order; an effect that is only named has no parameters.

    Raises
    ------
    InputError
        The file is missing, or a key is unknown, missing or wrong.
    SchemaError
        It has another schema.
    DamagedError
        It is empty or not TOML.
    """
    document = read_toml(path)
    check(document, "model", path)
    try:
        return _parameters(document)
    except InputError as error:
        raise InputError(f"{path}: {error}", hint=error.hint) from error


def read_model_for(path: Path, arena: Arena, *, dt_s: float) -> Parameters:
    """Read a model file and check that it is one for an arena and a step.

    Parameters
    ----------
    path
        A model file.
    arena
        Gives the zones and their order.
    dt_s
        The trial's step in seconds.

    Returns
    -------
    zfcal.parameters.Parameters
        Zones in the arena's order.

    Raises
    ------
    InputError, SchemaError, DamagedError
        As `read_model`; or the model has other zones, or holds for another step.
    """
    model = read_model(path)
    _check_names(path, set(model.zone_names), arena)
    if not math.isclose(model.dt_s, dt_s, rel_tol=1e-6):
        raise InputError(
            f"{path}: the model holds for dt_s = {model.dt_s:g} s, the trial has {dt_s:g} s.",
            hint="Calibrate at the trial's dt_s, or set dt_s in trial.toml to the model's.",
        )
    by_name = {zone.name: zone for zone in model.zones}
    return Parameters(
        dt_s=model.dt_s,
        zones=tuple(by_name[name] for name in arena.zone_names),
        fov_rad=model.fov_rad,
        base=model.base,
        effects=model.effects,
    )


def write_model(
    path: Path,
    parameters: Parameters,
    lineage: Lineage,
    result: Mapping[str, JSON] | None = None,
    *,
    parents: bool = True,
) -> None:
    """Write a model file whole, or not at all.

    Parameters
    ----------
    path
        Where it goes.
    parameters
        The model.
    lineage
        Where it comes from.
    result
        How the calibration went, for the table ``[result]``; values that are
        None are left out, since TOML has no word for them.
    parents
        See `zfcal.artifacts.atomic.write_whole`.

    Raises
    ------
    InputError
        The lineage is not that of a model.
    StorageError
        The file cannot be written.
    """
    document = _document(parameters)
    check(document.unwrap(), "model", path)
    if lineage.schema != SCHEMA:
        raise InputError(f"{path}: a model's lineage has schema {SCHEMA}, got {lineage.schema!r}.")
    if result:
        document.add("result", _table(result))
    origin = lineage.as_dict()
    # The file's own schema stands at its head, once.
    del origin["schema"]
    document.add("lineage", _table(origin))
    write_text_whole(path, tomlkit.dumps(document), parents=parents)


def read_result(path: Path) -> dict[str, Any]:
    """Return the table ``[result]`` of a model file; empty if there is none.

    Raises
    ------
    InputError, SchemaError, DamagedError
        As `read_model`.
    """
    document = read_toml(path)
    check(document, "model", path)
    return dict(document.get("result", {}))


def newest_model(trial: Trial) -> Path:
    """Return the model of the latest round: the highest number in ``models/``.

    Raises
    ------
    InputError
        There is none.
    """
    folder = trial.root / "models"
    known = numbered_of(folder, ".toml")
    if not known:
        raise InputError(
            f"{folder}: holds no numbered model.",
            hint=f"Make one with: zfcal calibrate {trial.root}",
        )
    return known[max(known)]


def _parameters(document: dict[str, Any]) -> Parameters:
    names = tuple(document["zones"])
    effects = document.get("effects", {})
    if isinstance(effects, list):
        effects = {name: {} for name in effects}
    return Parameters(
        dt_s=float(document["dt_s"]),
        zones=tuple(_zone(name, document["zones"][name], names) for name in names),
        fov_rad=float(document["fov_rad"]),
        base=document["base"],
        effects={
            name: {key: float(value) for key, value in table.items()}
            for name, table in effects.items()
        },
    )


def _zone(name: str, table: dict[str, Any], names: tuple[str, ...]) -> ZoneParameters:
    gamma = {to: float(value) for to, value in table["gamma"].items()}
    for to in gamma:
        if to not in names:
            raise InputError(
                f"zones.{name}.gamma names {to!r}, which is no zone of this model.",
                hint=f"{nearest(to, names)}Its zones: {', '.join(names)}.",
            )
    for to in names:
        if to not in gamma:
            raise InputError(
                f"zones.{name}.gamma lacks zone {to!r}.",
                hint="gamma needs a value for each zone; 1 for no preference.",
            )
    kappa_w = table.get("kappa_w")
    return ZoneParameters(
        name=name,
        kappa_0=float(table["kappa_0"]),
        kappa_f=float(table["kappa_f"]),
        alpha=float(table["alpha"]),
        kappa_w=None if kappa_w is None else float(kappa_w),
        speed_frequency=tuple(map(float, table["speed_frequency"])),
        gamma={to: gamma[to] for to in names},
    )


def _check_names(path: Path, found: set[str], arena: Arena) -> None:
    wanted = arena.zone_names
    for name in wanted:
        if name not in found:
            raise InputError(
                f"{path}: zone {name!r} of arena {arena.name!r} is missing.",
                hint=f"{nearest(name, found)}The arena's zones: {', '.join(wanted)}.",
            )
    for name in sorted(found.difference(wanted)):
        raise InputError(
            f"{path}: arena {arena.name!r} has no zone {name!r}.",
            hint=f"{nearest(name, wanted)}The arena's zones: {', '.join(wanted)}.",
        )


def _document(parameters: Parameters) -> tomlkit.TOMLDocument:
    document = tomlkit.document()
    document.add(tomlkit.comment("A model of fish in a tank; metres, seconds, radians."))
    head = {
        "schema": SCHEMA,
        "base": parameters.base,
        "dt_s": float(parameters.dt_s),
        "fov_rad": float(parameters.fov_rad),
    }
    for key, value in head.items():
        item = tomlkit.item(value)
        document.add(key, item.comment(descriptions_of("model")[key]))
    zones = tomlkit.table(is_super_table=True)
    for zone in parameters.zones:
        zones.add(zone.name, _zone_table(zone))
    document.add("zones", zones)
    effects = _table(parameters.effects)
    if not parameters.effects:
        effects.add(tomlkit.comment("None. Each effect has a table [effects.NAME] of parameters."))
    document.add("effects", effects)
    return document


def _zone_table(zone: ZoneParameters) -> tomlkit.items.Table:
    values: dict[str, JSON] = {
        "kappa_0": zone.kappa_0,
        "kappa_f": zone.kappa_f,
        "kappa_w": zone.kappa_w,
        "alpha": zone.alpha,
        "speed_frequency": zone.speed_frequency,
    }
    table = _table(values)
    gamma = tomlkit.inline_table()
    for name, value in zone.gamma.items():
        gamma.append(name, float(value))
    table.add("gamma", gamma)
    return table


def _table(values: Mapping[str, Any]) -> tomlkit.items.Table:
    """Return a TOML table; None is left out, and NumPy's numbers become Python's."""
    table = tomlkit.table()
    for key, value in values.items():
        if value is not None:
            table.add(key, _table(value) if isinstance(value, Mapping) else _plain(value))
    return table


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
