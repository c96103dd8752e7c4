"""A diagnosis as the document that stands in ``findings.json``, and back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from zfcal.arena import Arena
from zfcal.diagnose.findings import (
    Diagnosis,
    EffectFound,
    FeatureCurve,
    Gap,
    Located,
    Note,
    Screened,
    Verdict,
)
from zfcal.diagnose.pictured import Curve, Parts, Pictured, picture_of

SCHEMA = "zfcal.findings/1"

_DIGITS = 6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Findings:
    """What stands in ``findings.json``.

    Parameters
    ----------
    verdict, where, effects, screened, notes
        As in `Diagnosis`; the effects without their traces.
    pictured
        For each effect what its pictures show; None without a trace.
    gap
        How far the effects close the gap; empty before they were added.
    minutes, n_steps
        Length of the recording, and steps with a heading.
    """

    verdict: Verdict
    where: tuple[Located, ...]
    effects: tuple[EffectFound, ...]
    screened: tuple[Screened, ...]
    notes: tuple[Note, ...]
    pictured: tuple[Pictured | None, ...]
    gap: tuple[Gap, ...]
    minutes: float
    n_steps: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sheet:
    """What a page about findings shows.

    Parameters
    ----------
    trial
        What people call the trial.
    model
        Which model it is about, relative to the trial.
    arena
        The tank.
    findings
        What was found.
    provenance
        Of the findings, and their SHA-256: the page holds it.
    """

    trial: str
    model: str
    arena: Arena
    findings: Findings
    provenance: Mapping[str, Any]


def findings_document(diagnosis: Diagnosis, arena: Arena) -> dict[str, Any]:
    """Return a diagnosis as a document; a number that is NaN is null.

    Parameters
    ----------
    diagnosis
        What was found.
    arena
        Gives the extent of the maps.

    Returns
    -------
    dict
        Fits ``schemas/findings.schema.json``, without lineage.
    """
    return {
        "schema": SCHEMA,
        "verdict": diagnosis.verdict.value,
        "where": [_plain(located) for located in diagnosis.where],
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "screened": [
            {key: _value(getattr(each, key)) for key in ("name", "z", "p", "minutes_needed")}
            for each in diagnosis.screened
        ],
        "notes": [_plain(note) for note in diagnosis.notes],
        "details": {
            "minutes": _value(diagnosis.minutes),
            "n_steps": diagnosis.n_steps,
            "effects": [_details(effect, arena) for effect in diagnosis.effects],
            "screened": [
                {"name": each.name, "lacks": each.lacks, "shape": _value(each.shape)}
                for each in diagnosis.screened
            ],
        },
    }


def gap_document(gap: Sequence[Gap]) -> list[dict[str, Any]]:
    """Return the entries of ``gap``; an interval that is NaN is null."""
    made = []
    for each in gap:
        entry = _plain(each)
        entry["interval"] = None if None in entry["interval"] else entry["interval"]
        made.append(entry)
    return made


def read_document(document: Mapping[str, Any]) -> Findings:
    """Return what a document says that fits ``schemas/findings.schema.json``.

    Parameters
    ----------
    document
        Of ``findings.json``; one without ``details`` has no pictures.
    """
    details = document.get("details", {})
    by_effect = details.get("effects", [None] * len(document["effects"]))
    lacks = {each["name"]: each for each in details.get("screened", [])}
    return Findings(
        verdict=Verdict(document["verdict"]),
        where=tuple(_located(each) for each in document["where"]),
        effects=tuple(_found(*pair) for pair in zip(document["effects"], by_effect, strict=True)),
        screened=tuple(_screened(e, lacks.get(e["name"], {})) for e in document["screened"]),
        notes=tuple(
            Note(
                name=note["name"],
                says=note["says"],
                values={key: _number(value) for key, value in note["values"].items()},
            )
            for note in document.get("notes", [])
        ),
        pictured=tuple(_pictured(each) for each in by_effect),
        gap=tuple(_gap(each) for each in document.get("gap", [])),
        minutes=_number(details.get("minutes")),
        n_steps=int(details.get("n_steps", 0)),
    )


def _value(value: Any) -> Any:
    """Return a value as JSON has it: numbers short, NaN as null, arrays as lists."""
    if isinstance(value, np.ndarray):
        return [_value(each) for each in value.tolist()]
    if isinstance(value, Mapping):
        return {key: _value(each) for key, each in value.items()}
    if isinstance(value, tuple | list):
        return [_value(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
    return value


def _plain(record: Any) -> dict[str, Any]:
    """Return the fields of a flat record."""
    return {field.name: _value(getattr(record, field.name)) for field in fields(record)}


def _effect(effect: EffectFound) -> dict[str, Any]:
    keys = ("name", "says", "strength", "interval", "gain_nats_per_step", "p", "ties")
    return {key: _value(getattr(effect, key)) for key in keys}


def _details(effect: EffectFound, arena: Arena) -> dict[str, Any]:
    pictured = None if effect.trace is None else picture_of(effect.trace, arena)
    made: dict[str, Any] = {"gain_se": _value(effect.gain_se)}
    if effect.by_features is not None:
        made["by_features"] = _plain(effect.by_features)
    if pictured is not None:
        made |= {
            "place": {
                "origin_m": _value(pictured.origin_m),
                "cell_m": _value(pictured.cell_m),
                "n": _value(pictured.place_n),
                "score": _value(pictured.place),
            },
            "minutes": _plain(pictured.minutes),
            "agents": _plain(pictured.agents),
            "curve": _plain(pictured.curve),
        }
    return made


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _pair(values: Sequence[float | None] | None) -> tuple[float, float]:
    low, high = (None, None) if values is None else values
    return _number(low), _number(high)


def _located(entry: Mapping[str, Any]) -> Located:
    agents = entry["agents"]
    numbers = {key: _number(entry[key]) for key in ("observed", "expected", "z", "q")}
    return Located(
        statistic=entry["statistic"],
        zone=entry["zone"],
        time_s=_pair(entry["time_s"]),
        agents=tuple(map(int, agents)) if isinstance(agents, list) else None,
        **numbers,
    )


def _found(entry: Mapping[str, Any], details: Mapping[str, Any] | None) -> EffectFound:
    return EffectFound(
        name=entry["name"],
        says=entry["says"],
        strength={key: _number(value) for key, value in entry["strength"].items()},
        interval={key: _pair(value) for key, value in entry["interval"].items()},
        gain_nats_per_step=_number(entry["gain_nats_per_step"]),
        gain_se=_number((details or {}).get("gain_se")),
        p=_number(entry["p"]),
        ties=tuple(entry["ties"]),
        by_features=_curve((details or {}).get("by_features")),
    )


def _three(values: Sequence[float | None]) -> tuple[float, float, float]:
    value, low, high = map(_number, values)
    return value, low, high


def _curve(entry: Mapping[str, Any] | None) -> FeatureCurve | None:
    if entry is None:
        return None
    return FeatureCurve(
        label=entry["label"],
        nats=_number(entry["nats"]),
        form_nats=_number(entry["form_nats"]),
        cue=entry["cue"],
        strength_name=entry["strength_name"],
        **{key: _array(entry[key]) for key in ("at", "strength", "low", "high", "form")},
        besides={name: _three(values) for name, values in entry["besides"].items()},
    )


def _screened(entry: Mapping[str, Any], details: Mapping[str, Any]) -> Screened:
    return Screened(
        name=entry["name"],
        z=_number(entry["z"]),
        p=_number(entry["p"]),
        minutes_needed=entry["minutes_needed"],
        lacks=details.get("lacks"),
        shape=dict(details.get("shape", {})),
    )


def _gap(entry: Mapping[str, Any]) -> Gap:
    numbers = ("before", "after", "floor", "closed", "placebo")
    return Gap(
        measure=entry["measure"],
        interval=_pair(entry["interval"]),
        **{key: _number(entry[key]) for key in numbers},
    )


def _array(values: Sequence[Any]) -> Any:
    return np.array(values, dtype=np.float64)


def _pictured(details: Mapping[str, Any] | None) -> Pictured | None:
    if details is None or "place" not in details:
        return None
    place, curve = details["place"], details["curve"]
    return Pictured(
        origin_m=_pair(place["origin_m"]),
        cell_m=float(place["cell_m"]),
        place_n=np.array(place["n"], dtype=np.int64),
        place=_array(place["score"]),
        minutes=_parts(details["minutes"]),
        agents=_parts(details["agents"]),
        curve=Curve(
            **{key: _array(curve[key]) for key in ("cue", "observed", "before", "after")},
            cue_name=curve["cue_name"],
            response_name=curve["response_name"],
        ),
    )


def _parts(entry: Mapping[str, Any]) -> Parts:
    label, n = (np.array(entry[key], dtype=np.int64) for key in ("label", "n"))
    return Parts(label=label, n=n, before=_array(entry["before"]), after=_array(entry["after"]))
