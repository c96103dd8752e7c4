"""The record of the publishing rules: ``scores/E-rules.parquet``, and the models that it judges."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.tables import RULES, make_table, read_extra, read_table, write_table
from zfcal.behaviour.statistics import ATTRIBUTES, Statistics
from zfcal.calibrate.rules import RULES as RULE_NAMES
from zfcal.calibrate.rules import Candidate, Forward, Record
from zfcal.errors import DamagedError, InputError


def read_record(path: Path, zone_names: tuple[str, ...]) -> Record:
    """Return what rules had scored by a round, and their models; none of an earlier version.

    Raises
    ------
    DamagedError
        The file is damaged, or its extra metadata is not what `write_record` writes.
    """
    table, extra = read_table(path, RULES).to_pydict(), read_extra(path)
    if "in_use" in extra and "judged_from" not in extra:
        # Of a version that judged otherwise: its scores are no scores to this one.
        return Record()
    rows = (dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True))
    try:
        models: Any = extra["models"]
        in_use: Any = extra["in_use"]
        n_genes = len(extra["gene_names"])  # type: ignore[arg-type]
        return Record(
            rows=tuple(Forward(**{**row, **_numbers(row)}) for row in rows),
            models=tuple(_candidate(entry, zone_names, n_genes) for entry in models),
            n_rounds=int(extra["n_rounds"]),  # type: ignore[arg-type]
            in_use=None if in_use is None else _candidate(in_use, zone_names, n_genes),
            in_charge=_rule(extra["in_charge"]),
            by=str(extra["judged_from"]),
            lead_noises=tuple(_noise(noise) for noise in extra["lead_noises"]),  # type: ignore[union-attr]
        )
    except (KeyError, TypeError, ValueError, OverflowError, InputError) as error:
        raise DamagedError(
            f"{path}: does not say which models the rules made ({error!r}).",
            hint="Make it again: zfcal calibrate TRIAL --force",
        ) from error


def _numbers(row: dict[str, Any]) -> dict[str, float]:
    return {key: math.nan if row[key] is None else row[key] for key in ("S", "low", "high")}


def _noise(value: object) -> float:
    return math.nan if value is None else float(value)  # type: ignore[arg-type]


def _rule(name: object) -> str:
    if name not in RULE_NAMES:
        raise ValueError(f"{name!r} is no rule")
    return str(name)


def _candidate(entry: dict[str, Any], zone_names: tuple[str, ...], n_genes: int) -> Candidate:
    genes = np.array(entry["genes"], dtype=np.float64)
    are_genes = genes.shape == (n_genes,) and bool(((genes >= 0) & (genes <= 1)).all())
    if not are_genes:
        raise ValueError(f"a model with genes of shape {genes.shape}")
    counts = {
        attribute: np.array(entry["counts"][name], dtype=np.int64)
        for name, attribute in ATTRIBUTES.items()
    }
    return Candidate(
        rule=_rule(entry["rule"]),
        made_at_s=int(entry["made_at_s"]),
        of_s=int(entry["of_s"]),
        genes=genes,
        long_run=Statistics(zone_names=zone_names, **counts),  # type: ignore[arg-type]
    )


def write_record(
    path: Path, record: Record, lineage: Lineage, *, gene_names: tuple[str, ...]
) -> None:
    """Write the forward scores of all rules so far, and the models that wait to be judged.

    The genes have names, since models of other effects can be neither scored nor handed on.
    """
    columns: dict[str, Any] = {
        key: [getattr(row, key) for row in record.rows]
        for key in ("window_end_s", "rule", "made_at_s", "S", "low", "high", "n")
    }
    for key in ("S", "low", "high"):
        columns[key] = [None if math.isnan(value) else value for value in columns[key]]
    extra: dict[str, JSON] = {
        "gene_names": list(gene_names),
        "models": [_entry(model) for model in record.models],
        "in_use": None if record.in_use is None else _entry(record.in_use),
        "in_charge": record.in_charge,
        "n_rounds": record.n_rounds,
        "judged_from": record.by,
        "lead_noises": [None if math.isnan(noise) else noise for noise in record.lead_noises],
    }
    write_table(path, make_table(RULES, columns), lineage, extra=extra)


def _entry(model: Candidate) -> dict[str, JSON]:
    counts = {
        name: getattr(model.long_run, attribute).tolist() for name, attribute in ATTRIBUTES.items()
    }
    return {
        "rule": model.rule,
        "made_at_s": model.made_at_s,
        "of_s": model.of_s,
        "genes": model.genes.tolist(),
        "counts": counts,
    }
