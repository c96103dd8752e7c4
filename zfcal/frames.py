"""A trial's artifacts as pandas tables, for notebooks and scripts.

Columns are those of the artifacts, with units in their names. All of a trial's files of a kind are
one table. Nothing is computed or written here.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, final

import pandas as pd
import pyarrow as pa

from zfcal.artifacts.models import read_model, read_result
from zfcal.artifacts.reading.contents import numbered_of
from zfcal.artifacts.segments import segment_path, segment_starts
from zfcal.artifacts.settings import find_trial, read_trial
from zfcal.artifacts.tables import FOLLOWING, RULES, SCORES, STATS, TRACKS, read_table
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import DamagedError, InputError, OptionError, SchemaError
from zfcal.parameters import Parameters
from zfcal.trial import Trial, second_of

T = TypeVar("T")

Damage: TypeAlias = Callable[[DamagedError | SchemaError], None]
"""Hears of each file that is left out."""

TABLES = ("tracks", "stats", "following", "scores", "rules", "parameters", "findings")
"""The tables of a trial: the methods of `TrialTables` that return one."""

_PARAMETERS = {
    "window_end_s": "int64",
    "parameter": "str",
    "value": "float64",
    "low": "float64",
    "high": "float64",
    "identified": "boolean",
    "intervals_by": "str",
    "rule": "str",
}
"""Columns and their types, also where a column is empty."""

_FINDINGS = {
    "rank": "int64",
    "effect": "str",
    "parameter": "str",
    "value": "float64",
    "low": "float64",
    "high": "float64",
    "gain_nats_per_step": "float64",
    "p": "float64",
    "ties": "str",
}


@final
class TrialTables:
    """The artifacts of a trial as pandas tables.

    Parameters
    ----------
    trial
        Its directory, or anything in it.
    on_damage
        Hears of each damaged file, which is then left out; None to refuse its table.
    findings
        The findings that are meant where none are named; None for ``diagnosis/findings.json``.

    Raises
    ------
    InputError
        There is no trial, or its settings are wrong.
    OptionError
        `trial` is no path.

    Examples
    --------
    >>> import zfcal
    >>> trial = zfcal.open("data-samples/two-rooms")
    >>> tracks = trial.tracks()
    >>> sorted(tracks["kind"].unique())
    ['fish', 'robot']
    """

    def __init__(
        self,
        trial: str | Path,
        *,
        on_damage: Damage | None = None,
        findings: str | Path | None = None,
    ) -> None:
        if not isinstance(trial, str | os.PathLike):
            raise OptionError(f"{trial!r} is no path of a trial.")
        # Absolute: a script may go to another folder, in which another trial has that name.
        self._trial = read_trial(find_trial(Path(trial)).absolute())
        self._on_damage = on_damage
        usual = self.root / "diagnosis" / "findings.json"
        self._findings = usual if findings is None else Path(findings).absolute()

    @property
    def trial(self) -> Trial:
        """Its settings."""
        return self._trial

    @property
    def root(self) -> Path:
        """Its directory, absolute."""
        return self._trial.root

    def files(self, table: str) -> list[Path]:
        """Return the files that a table is made of, in the order of time.

        Parameters
        ----------
        table
            One of `TABLES`.
        """
        match table:
            case "tracks":
                return [segment_path(self.root, start) for start in segment_starts(self.root)]
            case "scores":
                return [
                    *self._numbered(table, ".parquet"),
                    *self._numbered(table, "-model.parquet"),
                ]
            case "following":
                return self._numbered("stats", "-following.parquet")
            case "rules":
                return self._numbered("scores", "-rules.parquet")[-1:]
            case "parameters":
                return self._numbered("models", ".toml")
            case "findings":
                return [self._findings] if self._findings.is_file() else []
        return self._numbered(table, ".parquet")

    def tracks(self) -> pd.DataFrame:
        """Return the positions of everybody in every frame, in the order of time.

        Returns
        -------
        DataFrame
            One row per agent and frame: ``time_s``, ``frame``, ``agent``, ``kind`` (fish or robot),
            ``x_m``, ``y_m``, ``heading_rad`` (NaN where it is not known), ``confidence``. Who is
            lost in a frame has no row. Below a confidence of one half a position is a guess.

        Raises
        ------
        InputError
            There are no tracks.
        DamagedError
            A segment is damaged.
        """
        hint = f"First: zfcal track {self.root}, or zfcal import SRC {self.root}"
        return self._joined("tracks", TRACKS, hint)

    def stats(self) -> pd.DataFrame:
        """Return the counts of all windows: one row per window, case, zone, statistic and bin.

        Raises
        ------
        InputError
            There are none.
        DamagedError
            A file is damaged.
        """
        hint = f"First: zfcal analyse {self.root}"
        return self._joined("stats", STATS, hint)

    def following(self) -> pd.DataFrame:
        """Return what the robot makes the fish do: one row per window, measure and lag.

        Returns
        -------
        DataFrame
            ``window_end_s``, ``measure`` (such as ``direction``), ``lag_s`` (missing for what is of
            no lag), ``value``, ``low``, ``high`` and ``ceiling`` (fish in the robot's place),
            ``floor`` (what chance gives) and ``n``.

        Raises
        ------
        InputError
            There are none: the trial has no robot, or was not analysed since.
        DamagedError
            A file is damaged.
        """
        hint = f"First: zfcal analyse {self.root}; a trial without a robot has none."
        return self._joined("following", FOLLOWING, hint)

    def scores(self) -> pd.DataFrame:
        """Return all scores: one row per window, comparison, feature and zone.

        Returns
        -------
        DataFrame
            ``window_end_s``, ``compared`` (such as ``model-vs-control``), ``feature``, ``zone``
            (missing for the whole tank), ``value``, ``low``, ``high``, ``ceiling``, ``n_windows``
            and ``n_features``. A score says little without its ceiling: what a perfect model would
            score.

        Raises
        ------
        InputError
            There are none.
        DamagedError
            A file is damaged.
        """
        return self._joined("scores", SCORES, f"First: zfcal analyse {self.root}")

    def rules(self) -> pd.DataFrame:
        """Return the forward scores of the rules by which models are published.

        Returns
        -------
        DataFrame
            ``window_end_s``, ``rule``, ``made_at_s``, ``S``, ``low``, ``high``, ``n``, as in the
            newest record, which has all rows so far.

        Raises
        ------
        InputError
            No rules were judged.
        DamagedError
            The record is damaged.
        """
        hint = f"First: zfcal calibrate {self.root} --publish forward"
        return self._joined("rules", RULES, hint)

    def parameters(self) -> pd.DataFrame:
        """Return the parameters of all numbered models, those of effects as well.

        Returns
        -------
        DataFrame
            One row per model and parameter: ``window_end_s`` (0 for the starting model),
            ``parameter`` (``walls.kappa_0``, ``walls.gamma.centre``, ``alignment.weight``),
            ``value``, the 95 % interval ``low`` to ``high`` and whether it pins the value down,
            ``identified`` (missing where the file has none), ``intervals_by`` (``likelihood`` or
            ``score``) and the publishing ``rule``.

        Raises
        ------
        InputError
            There are no models.
        DamagedError
            A model is damaged.
        """
        rows = [
            row
            for path in self.files("parameters")
            for row in self._unless_damaged(path, _parameter_rows) or ()
        ]
        if not rows:
            raise _nothing(self.root / "models", f"First: zfcal calibrate {self.root}")
        return pd.DataFrame(rows, columns=list(_PARAMETERS)).astype(_PARAMETERS)

    def findings(self, path: str | Path | None = None) -> pd.DataFrame:
        """Return the effects that a diagnosis names; without any the table is empty.

        Parameters
        ----------
        path
            Of the findings; by default those that the tables were opened with.

        Returns
        -------
        DataFrame
            One row per effect and parameter: ``rank`` from 1 on, ``effect``, ``parameter``,
            ``value``, ``low``, ``high``, ``gain_nats_per_step``, ``p`` and ``ties`` (names, with
            commas). ``attrs`` has the ``verdict`` and, once the model was extended, the rows of
            its ``gap``.

        Raises
        ------
        InputError
            There are no findings, or they are not what a diagnosis writes.
        DamagedError
            They are no JSON.
        """
        place = self._findings if path is None else Path(path)
        if not place.is_file():
            raise _nothing(place, f"First: zfcal diagnose {self.root}")
        found = read_json(place)
        check(found, "findings", place)
        rows = [row for rank, each in enumerate(found["effects"], 1) for row in _found(rank, each)]
        table = pd.DataFrame(rows, columns=list(_FINDINGS)).astype(_FINDINGS)
        table.attrs = {"verdict": found["verdict"], "gap": found.get("gap") or []}
        return table

    def _numbered(self, folder: str, ending: str) -> list[Path]:
        return [path for _, path in sorted(numbered_of(self.root / folder, ending).items())]

    def _joined(self, name: str, schema: str, hint: str) -> pd.DataFrame:
        read = [
            self._unless_damaged(path, partial(read_table, schema=schema))
            for path in self.files(name)
        ]
        tables = [table for table in read if table is not None]
        if not tables:
            folder = {"rules": "scores", "following": "stats"}.get(name, name)
            raise _nothing(self.root / folder, hint)
        return _as_frame(tables)

    def _unless_damaged(self, path: Path, read: Callable[[Path], T]) -> T | None:
        try:
            return read(path)
        except (DamagedError, SchemaError) as error:
            if self._on_damage is None:
                raise
            self._on_damage(error)
            return None

    def __repr__(self) -> str:
        """Return how it was made."""
        return f"zfcal.open({str(self.root)!r})"


def _nothing(place: Path, hint: str) -> InputError:
    return InputError(f"{place}: there is nothing to read.", hint=hint)


def _as_frame(tables: list[pa.Table]) -> pd.DataFrame:
    table = pa.concat_tables(tables).unify_dictionaries()
    frame: pd.DataFrame = table.to_pandas()
    for name, column in zip(table.column_names, table.columns, strict=True):
        if pa.types.is_integer(column.type) and column.null_count:
            # Where null means "not defined" a whole number stays one, as wide as in the file.
            width = str(column.type).capitalize()
            frame[name] = column.to_pandas(integer_object_nulls=True).astype(width)
    return frame


def _parameter_rows(path: Path) -> list[tuple[Any, ...]]:
    result = read_result(path)
    end_s = second_of(path, ".toml")
    intervals = result.get("intervals") or {}
    published = result.get("published") or {}
    said = intervals.get("parameters", {})
    rows = []
    for name, value in _values(read_model(path)):
        row = said.get(name, {})
        known = (row.get("low"), row.get("high"), row.get("identified"))
        rows.append((end_s, name, value, *known, intervals.get("by"), published.get("rule")))
    return rows


def _values(model: Parameters) -> Iterator[tuple[str, float]]:
    for zone in model.zones:
        for key in ("kappa_0", "kappa_f", "alpha"):
            yield f"{zone.name}.{key}", float(getattr(zone, key))
        for to, gamma in zone.gamma.items():
            yield f"{zone.name}.gamma.{to}", float(gamma)
    for effect, values in model.effects.items():
        for key, value in values.items():
            yield f"{effect}.{key}", float(value)


def _found(rank: int, effect: dict[str, Any]) -> Iterator[tuple[Any, ...]]:
    ties = ",".join(effect["ties"])
    for parameter, value in effect["strength"].items():
        low, high = effect["interval"].get(parameter, (None, None))
        gain, p = effect["gain_nats_per_step"], effect["p"]
        yield rank, effect["name"], parameter, value, low, high, gain, p, ties
