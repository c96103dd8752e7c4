"""The files of a calibration round: where they are, what it starts from and what it leaves."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

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
from zfcal.behaviour.features.registry import SCORED
from zfcal.behaviour.rows import scores_to_rows, statistics_from_rows
from zfcal.behaviour.statistics import Statistics
from zfcal.calibrate.rounds import RoundResult
from zfcal.calibrate.rules import Record
from zfcal.calibrate.task import Previous
from zfcal.errors import DamagedError
from zfcal.model.effects.genome import genome_names
from zfcal.stages.calibrate.record import write_record
from zfcal.stages.calibrate.result import or_none, published_table, result_table, score_table
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
            **published_table(result),
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
        "noise": or_none(result.as_previous.noise),
        "generations": result.generations,
    }
    if named is not None:
        # A score of these is not S.
        extra["features"] = list(names)
        extra["score"] = [or_none(value) for value in state.scores.tolist()]
        extra["similarities"] = {
            name: [or_none(value) for value in values.tolist()] for name, values in found.items()
        }
    write_table(path, make_table(POPULATION, columns), lineage, extra=extra)
