"""The files of a calibration round: where they are, what it starts from and what it leaves."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from zfcal.artifacts.arrays import numbers_of
from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.artifacts.models import write_model
from zfcal.artifacts.tables import (
    POPULATION,
    RULES,
    SCORES,
    STATS,
    make_table,
    read_extra,
    read_table,
    write_table,
)
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.features.registry import SCORED
from zfcal.behaviour.rows import scores_to_rows, statistics_from_rows
from zfcal.behaviour.scores import NamedScore, Scores
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.rounds import RoundResult
from zfcal.calibrate.rules import LIKELIHOOD, SAYS, Record
from zfcal.calibrate.task import Previous
from zfcal.errors import DamagedError
from zfcal.model.effects.genome import genome_names
from zfcal.stages.calibrate.record import write_record
from zfcal.stages.calibrate.telling import published_fields, published_note
from zfcal.stages.events import Event, Result
from zfcal.stages.stage import Write

MODEL = "zfcal.model/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundPlaces:
    """Where the files of the round of one window are.

    Parameters
    ----------
    root
        The trial's directory.
    end_s
        Where the window ends, in seconds since trial start.
    """

    root: Path
    end_s: int

    @property
    def stats(self) -> Path:
        """The statistics that it starts from."""
        return self._at("stats", ".parquet")

    @property
    def population(self) -> Path:
        """The last population, from which the next round starts."""
        return self._at("models", ".parquet")

    @property
    def scores(self) -> Path:
        """How alike the champion is to the window."""
        return self._at("scores", "-model.parquet")

    @property
    def rules(self) -> Path:
        """What the publishing rules have scored so far, and their models."""
        return self._at("scores", "-rules.parquet")

    @property
    def model(self) -> Path:
        """The champion."""
        return self._at("models", ".toml")

    @property
    def checkpoint(self) -> Path:
        """Where a killed round was; a dot-file, which nobody mirrors or reads."""
        return self.root / "models" / f".{self.end_s:06d}.checkpoint"

    def artifacts(self, champion: str) -> tuple[tuple[Path, str], ...]:
        """Return the files and their schemas, in the order in which they are written.

        The model is last: whoever finds it finds the others too.
        """
        rules = ((self.rules, RULES),) if champion == "forward" else ()
        return (self.population, POPULATION), (self.scores, SCORES), *rules, (self.model, MODEL)

    def _at(self, folder: str, ending: str) -> Path:
        return self.root / folder / f"{self.end_s:06d}{ending}"


def read_control(path: Path, zone_names: tuple[str, ...]) -> Statistics:
    """Return the control case of a window's statistics.

    Raises
    ------
    DamagedError
        The file is damaged, has no control case, or is of other zones.
    """
    table = read_table(path, STATS).to_pydict()
    cases = {case: counts for (_, case), counts in statistics_from_rows(table).items()}
    control = cases.get("control")
    if control is None or control.zone_names != zone_names:
        found = "no control case" if control is None else f"zones {', '.join(control.zone_names)}"
        raise DamagedError(
            f"{path}: holds {found}, expected a control case of zones {', '.join(zone_names)}.",
            hint="Make it again: zfcal analyse TRIAL --force",
        )
    return control


def read_previous(path: Path, features: tuple[str, ...] = SCORED) -> Previous:
    """Return what a round left for the next one.

    Scores of other features than the next one's are no scores to it: NaN.

    Raises
    ------
    DamagedError
        The file is damaged, or its extra metadata is not what `write_round` writes.
    """
    table = read_table(path, POPULATION)
    extra = read_extra(path)
    champion, noise = extra.get("champion"), extra.get("noise")
    if not isinstance(champion, list):
        raise DamagedError(
            f"{path}: does not say which genome was the champion.",
            hint="Make it again: zfcal calibrate TRIAL --force",
        )
    scores = numbers_of(table.column("S")).copy()
    if "features" in extra or features != SCORED:
        same = extra.get("features") == list(features)
        said = extra.get("score") if same else [None] * len(scores)
        scores = np.array(said, dtype=np.float64)
    return Previous(
        genes=np.array(table.column("genes").to_pylist(), dtype=np.float64),
        scores=scores,
        champion=np.array(champion, dtype=np.float64),
        noise=float(noise) if isinstance(noise, int | float) else math.nan,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """What a round has found.

    Parameters
    ----------
    result
        Of the search.
    baselines
        S of what it had to beat.
    likelihood
        The window's maximum-likelihood estimate; None without one.
    """

    result: RoundResult
    baselines: dict[str, JSON]
    likelihood: dict[str, JSON] | None

    @property
    def table(self) -> dict[str, JSON]:
        """The table ``[result]`` of the model's file."""
        return result_table(self.result, self.baselines, self.likelihood)

    @property
    def summary(self) -> dict[str, JSON]:
        """The numbers of a round that people ask for first."""
        result = self.result
        return {
            "generations": result.generations,
            **score_table(result.scores, result.ceiling),
            "baselines": self.baselines,
            **published_fields(result),
            **_published(result),
        }

    def writers(self, places: RoundPlaces, seed: int) -> tuple[Write, ...]:
        """Return what writes each of the files, in the order of `RoundPlaces.artifacts`."""
        result = self.result

        def population(path: Path, lineage: Lineage) -> None:
            _write_population(path, result, lineage)

        def scores(path: Path, lineage: Lineage) -> None:
            rows = scores_to_rows(
                result.scores,
                window_end_s=places.end_s,
                compared="model-vs-control",
                ceiling=result.ceiling,
            )
            write_table(path, make_table(SCORES, rows), lineage)

        def model(path: Path, lineage: Lineage) -> list[Event]:
            write_model(path, result.champion, lineage, self.table, parents=False)
            value = {"path": str(path), "window_end_s": places.end_s, "seed": seed}
            note = published_note(result, places.end_s)
            return [note, Result(value={**value, **self.summary})]

        handed = result.handed
        if handed is None:
            return population, scores, model
        return population, scores, functools.partial(_write_rules, result, handed.record), model


def _write_rules(result: RoundResult, record: Record, path: Path, lineage: Lineage) -> None:
    write_record(path, record, lineage, gene_names=_gene_names(result))


def _gene_names(result: RoundResult) -> tuple[str, ...]:
    return genome_names(result.champion)[: len(result.genes)]


def _write_population(path: Path, result: RoundResult, lineage: Lineage) -> None:
    state = result.population
    named = result.scores.named
    names = SCORED if named is None else named.features
    nothing = np.full(len(state.genes), np.nan)
    found = dict(zip(names, state.features.T, strict=True))
    features = {f"I_{name}": found.get(name, nothing) for name in SCORED}
    columns = {
        "individual": np.arange(len(state.genes), dtype=np.int32),
        "rank": state.rank.astype(np.int32),
        "S": state.scores if named is None else nothing,
        "genotypic_diversity": state.objectives[:, 1],
        "behavioural_diversity": state.objectives[:, 2],
        **features,
        "genes": state.genes.tolist(),
    }
    extra: dict[str, JSON] = {
        "gene_names": list(_gene_names(result)),
        "champion": result.genes.tolist(),
        "noise": _number(result.as_previous.noise),
        "generations": result.generations,
    }
    if named is not None:
        # A score of these is not S.
        extra["features"] = list(names)
        extra["score"] = [_number(value) for value in state.scores.tolist()]
        extra["similarities"] = {
            name: [_number(value) for value in values.tolist()] for name, values in found.items()
        }
    write_table(path, make_table(POPULATION, columns), lineage, extra=extra)


def result_table(
    result: RoundResult,
    baselines: dict[str, JSON],
    likelihood: dict[str, JSON] | None = None,
) -> dict[str, JSON]:
    """Return the table ``[result]`` of a calibrated model.

    Parameters
    ----------
    result
        Of the round.
    baselines
        S of each baseline.
    likelihood
        The window's maximum-likelihood estimate; None without one.

    Returns
    -------
    dict
        S stands with its ceiling; a value that is NaN is None. Where other features are named,
        their score stands under ``score``, and what decided by it is called so.
    """
    last = result.history[-1]
    score = "S" if result.scores.named is None else "score"
    return {
        "generations": result.generations,
        "evaluations": result.evaluations,
        **score_table(result.scores, result.ceiling),
        "champion": "likely" if result.rule == LIKELIHOOD else result.rule,
        **_published(result),
        f"optimiser_{score}": _number(result.optimiser_score),
        "hypervolume": [_number(line.hypervolume) for line in result.history],
        f"best_{score}_in_population": _number(last.best_score),
        "world_changed": result.world_changed,
        "n_renewed": result.n_renewed,
        "baselines": baselines or None,
        "likelihood": likelihood,
        "intervals": _intervals_table(result, likelihood),
    }


def _published(result: RoundResult) -> dict[str, JSON]:
    """Return why a model was published, where rules are judged."""
    if result.handed is None:
        return {}
    choice, record = result.handed.choice, result.handed.record
    lead = choice.lead
    return {
        "published": {
            "rule": choice.rule,
            "says": SAYS[choice.rule],
            "because": choice.because,
            "of_window_end_s": record.in_use.of_s if record.in_use else None,
            "lead": None if lead is None else _number(lead.mean),
            "lead_error": None if lead is None else _number(lead.error),
            "lead_windows": None if lead is None else lead.n,
            "forward": dict[str, JSON](record.means()) or None,
        }
    }


def _intervals_table(result: RoundResult, likelihood: dict[str, JSON] | None) -> dict[str, JSON]:
    """Return which values of each parameter the window allows, and what was published.

    By the window's likelihood where it has an estimate, whichever model was published; by the
    genomes that score as well where it has none.
    """
    found: Any = {} if likelihood is None else likelihood["parameters"]
    values = {part.name: part.value for part in result.intervals.parameters}
    rows: dict[str, JSON] = {}
    for part in result.intervals.parameters:
        own = found.get(part.name)
        scale = _row_scale(part.name, values, found)
        rows[part.name] = {
            "value": part.value,
            "low": part.low if own is None else own["low"] * scale,
            "high": part.high if own is None else own["high"] * scale,
            "identified": part.identified if own is None else own["identified"],
        }
    return {
        "by": "likelihood" if found else "score",
        "threshold": _number(result.intervals.threshold),
        "n_compatible": result.intervals.n_compatible,
        "within_ceiling": result.intervals.within_ceiling,
        "parameters": rows,
    }


def _row_scale(name: str, values: dict[str, float], found: Any) -> float:
    """Return by what an estimate's gammas are to be multiplied to stand beside published ones.

    The largest gamma of a published row is 1, and may be that of a zone out of reach. The
    estimate's is 1 among those that the window tells of.
    """
    row, is_gamma, _ = name.partition(".gamma.")
    if not is_gamma or name not in found or _says_nothing(found[name]):
        return 1.0
    told = [
        value
        for other, value in values.items()
        if other.startswith(f"{row}.gamma.") and not _says_nothing(found[other])
    ]
    return max(told) or 1.0


def _says_nothing(entry: Any) -> bool:
    return (entry["low"], entry["high"]) == (0.0, 1.0)


def score_table(scores: Scores, ceiling: Ceiling) -> dict[str, JSON]:
    """Return S, its features and its ceiling as the entries of a table."""
    mean, low, high = ceiling.of("S")
    return {
        "S": _number(scores.S),
        "ceiling": _number(mean),
        "ceiling_low": _number(low),
        "ceiling_high": _number(high),
        "n_windows": ceiling.n_windows,
        "against_ceiling": _share(scores.S, mean),
        "features": {
            field.name: _number(getattr(scores, field.name))
            for field in fields(scores)
            if field.name.startswith("I_")
        },
        "n_features": scores.n_features,
        **_named_table(scores.named, ceiling),
    }


def _named_table(named: NamedScore | None, ceiling: Ceiling) -> dict[str, JSON]:
    """Return the score of the features that were named, which is not S, and its ceiling."""
    if named is None:
        return {}
    mean, low, high = ceiling.overall
    return {
        "score": {
            "of": list(named.features),
            "value": _number(named.value),
            "ceiling": _number(mean),
            "ceiling_low": _number(low),
            "ceiling_high": _number(high),
            "against_ceiling": _share(named.value, mean),
            "similarities": {
                name: _number(value)
                for name, value in zip(named.features, named.similarities, strict=True)
            },
            "n_features": named.n_features,
        }
    }


def _share(value: float, mean: float) -> float | None:
    """Return a score over its ceiling; None without a ceiling."""
    return _number(value / mean if mean > 0 else math.nan)


def _number(value: float) -> float | None:
    return None if math.isnan(value) else float(value)
