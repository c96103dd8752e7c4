"""Statistics and scores as the rows of their tables, and back.

A table here is a column of values per name, with None where a column has no
meaning. Files are written and read in ``artifacts``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from zfcal.arena import N_BINS
from zfcal.arrays import Ints
from zfcal.behaviour.ceilings import Ceiling
from zfcal.behaviour.features.registry import named
from zfcal.behaviour.features.statistic import GROUP_ROW
from zfcal.behaviour.histograms import frequencies
from zfcal.behaviour.scores import NAN, Scores, score_keys
from zfcal.behaviour.statistics import ATTRIBUTES, Statistics
from zfcal.errors import InputError

STATISTICS_COLUMNS = (
    "window_end_s",
    "case",
    "feature",
    "zone",
    "to_zone",
    "bin",
    "count",
    "frequency",
)
SCORES_COLUMNS = (
    "window_end_s",
    "compared",
    "feature",
    "zone",
    "value",
    "low",
    "high",
    "ceiling",
    "n_windows",
    "n_features",
)
CASES = ("control", "social", "robot")
COMPARED = ("social-vs-control", "robot-vs-fish", "model-vs-control")

Table: TypeAlias = dict[str, list[Any]]


def join_tables(tables: Sequence[Table]) -> Table:
    """Return the rows of several tables of the same columns, one after the other.

    Parameters
    ----------
    tables
        At least one.
    """
    return {name: [value for table in tables for value in table[name]] for name in tables[0]}


def statistics_to_rows(statistics: Statistics, *, window_end_s: int, case: str) -> Table:
    """Return a window's statistics as rows.

    Parameters
    ----------
    statistics
        Of one window and case.
    window_end_s
        Where the window ends, in seconds since the start of the trial.
    case
        One of `CASES`.

    Returns
    -------
    dict of list
        The `STATISTICS_COLUMNS`. A row per zone and bin for D, W and V, per
        zone for O, per pair of zones for T, also where the count is 0; then
        the further statistics, in which the zone of what belongs to the group
        is ``all``. The frequency is the count's share of its histogram (of its row for T, of
        all zones for O), None where that has no count.

    Raises
    ------
    InputError
        There is no such case.
    """
    _check_name("case", case, CASES)
    rows: list[tuple[Any, ...]] = []
    names = statistics.zone_names
    for feature in statistics.names:
        statistic, counts = named(feature), statistics.of(feature)
        shares = frequencies(counts)
        rooms = names if statistic.per_zone else (GROUP_ROW,)
        for at in np.ndindex(counts.shape):
            to_zone = names[at[1]] if statistic.form == "table" else None
            number = at[1] if statistic.form == "bins" else None
            key = (rooms[at[0]], to_zone, number)
            rows.append((feature, *key, int(counts[at]), _or_none(float(shares[at]))))
    columns = dict(zip(STATISTICS_COLUMNS[2:], map(list, zip(*rows, strict=True)), strict=True))
    return {"window_end_s": [window_end_s] * len(rows), "case": [case] * len(rows), **columns}


def statistics_from_rows(table: Mapping[str, Sequence[Any]]) -> dict[tuple[int, str], Statistics]:
    """Return the statistics in a table, by window end and case.

    Parameters
    ----------
    table
        The `STATISTICS_COLUMNS`, with None where a column has no meaning.

    Returns
    -------
    dict of Statistics
        What is no count (points put at the wall, points in the void) has no
        row: it is 0 here.

    Raises
    ------
    InputError
        A column or a row is missing, doubled or unknown.
    """
    _check_columns(table, STATISTICS_COLUMNS)
    windows: dict[tuple[int, str], dict[tuple[Any, ...], Any]] = {}
    for end_s, case, *key, count, _ in zip(
        *(table[name] for name in STATISTICS_COLUMNS), strict=True
    ):
        cells = windows.setdefault((end_s, case), {})
        if tuple(key) in cells:
            raise InputError(f"Statistics to {end_s} s, {case}: two rows for {tuple(key)}.")
        cells[tuple(key)] = count
    return {
        (end_s, case): _statistics(cells, where=f"Statistics to {end_s} s, {case}")
        for (end_s, case), cells in windows.items()
    }


def _statistics(cells: dict[tuple[Any, ...], Any], *, where: str) -> Statistics:
    names = tuple(zone for feature, zone, _, _ in cells if feature == "O")
    wanted: dict[str, list[tuple[Any, ...]]] = {
        feature: [(feature, zone, None, b) for zone in names for b in range(N_BINS)]
        for feature in "DWV"
    }
    wanted["O"] = [("O", zone, None, None) for zone in names]
    wanted["T"] = [("T", zone, to, None) for zone in names for to in names]
    others = dict.fromkeys(feature for feature, *_ in cells if feature not in ATTRIBUTES)
    wanted |= {feature: _grid(feature, cells, names) for feature in others}
    keys = [key for part in wanted.values() for key in part]
    for problem, found in (
        ("no row for", [key for key in keys if key not in cells]),
        ("unknown row", sorted(cells.keys() - set(keys), key=str)),
    ):
        if found:
            raise InputError(
                f"{where}: {problem} feature {found[0][0]}, zone {found[0][1]}, "
                f"to_zone {found[0][2]}, bin {found[0][3]}.",
                hint="Make the file again: zfcal analyse TRIAL --force",
            )

    def counts(feature: str) -> Ints:
        part = wanted[feature]
        values = np.array([cells[key] for key in part], dtype=np.int64)
        is_row = part[0][2:] == (None, None)
        return values if is_row else values.reshape(len({zone for _, zone, *_ in part}), -1)

    counted: dict[str, Any] = {name: counts(feature) for feature, name in ATTRIBUTES.items()}
    return Statistics(
        zone_names=names, further={feature: counts(feature) for feature in others}, **counted
    )


def _grid(
    feature: str, cells: Mapping[tuple[Any, ...], Any], names: tuple[str, ...]
) -> list[tuple[Any, ...]]:
    """Return the rows of a further statistic, whether or not its package is installed here."""
    own = [key for key in cells if key[0] == feature]
    rooms = (GROUP_ROW,) if own[0][1] == GROUP_ROW and GROUP_ROW not in names else names
    last = max((b for *_, b in own if b is not None), default=None)
    if last is not None:
        return [(feature, zone, None, b) for zone in rooms for b in range(last + 1)]
    if own[0][2] is not None:
        return [(feature, zone, to, None) for zone in names for to in names]
    return [(feature, zone, None, None) for zone in names]


def scores_to_rows(
    scores: Scores, *, window_end_s: int, compared: str, ceiling: Ceiling | None = None
) -> Table:
    """Return a comparison's scores as rows.

    Parameters
    ----------
    scores
        Of one window and comparison.
    window_end_s
        Where the window ends, in seconds since the start of the trial.
    compared
        One of `COMPARED`.
    ceiling
        What a perfect match would score; its mean and interval go into the
        columns ceiling, low and high, and the number of its comparisons into
        n_windows. Without one these are None.

    Returns
    -------
    dict of list
        The `SCORES_COLUMNS`. D, W and T have a row per zone and one with zone
        None, the mean; O and S one row with zone None. A score that is NaN is
        None. n_features stands with S.

    Raises
    ------
    InputError
        There is no such comparison, or the ceiling is of other zones.
    """
    _check_name("compared", compared, COMPARED)
    keys = score_keys(scores.zone_names)
    if ceiling is not None and ceiling.zone_names != scores.zone_names:
        raise InputError(
            f"The ceiling is of zones {', '.join(ceiling.zone_names)}, the scores are of "
            f"{', '.join(scores.zone_names)}."
        )
    nothing = (None,) * len(keys)
    columns: dict[str, Sequence[Any]] = {
        "window_end_s": (window_end_s,) * len(keys),
        "compared": (compared,) * len(keys),
        "feature": [feature for feature, _ in keys],
        "zone": [zone for _, zone in keys],
        "value": scores.values,
        "low": ceiling.low if ceiling else nothing,
        "high": ceiling.high if ceiling else nothing,
        "ceiling": ceiling.mean if ceiling else nothing,
        "n_windows": (ceiling.n_windows if ceiling else None,) * len(keys),
        "n_features": [scores.n_features if feature == "S" else None for feature, _ in keys],
    }
    return {name: [_or_none(value) for value in values] for name, values in columns.items()}


def scores_from_rows(
    table: Mapping[str, Sequence[Any]],
) -> dict[tuple[int, str], tuple[Scores, Ceiling | None]]:
    """Return the scores in a table and their ceilings, by window end and comparison.

    Parameters
    ----------
    table
        The `SCORES_COLUMNS`, with None where a score is null.

    Returns
    -------
    dict of (Scores, Ceiling or None)

    Raises
    ------
    InputError
        A column or a row is missing, doubled or unknown.
    """
    _check_columns(table, SCORES_COLUMNS)
    windows: dict[tuple[int, str], dict[tuple[Any, Any], tuple[Any, ...]]] = {}
    for end_s, compared, feature, zone, *values in zip(
        *(table[name] for name in SCORES_COLUMNS), strict=True
    ):
        cells = windows.setdefault((end_s, compared), {})
        if (feature, zone) in cells:
            raise InputError(
                f"Scores to {end_s} s, {compared}: two rows for feature {feature}, zone {zone}."
            )
        cells[feature, zone] = tuple(values)
    return {
        (end_s, compared): _scores(cells, where=f"Scores to {end_s} s, {compared}")
        for (end_s, compared), cells in windows.items()
    }


def _scores(
    cells: dict[tuple[Any, Any], tuple[Any, ...]], *, where: str
) -> tuple[Scores, Ceiling | None]:
    names = tuple(zone for feature, zone in cells if feature == "D" and zone is not None)
    keys = score_keys(names)
    if set(keys) == cells.keys() and cells["S", None][-1] is None:
        raise InputError(f"{where}: the row for feature S has no n_features.")
    if set(keys) != cells.keys():
        odd = min(set(keys) ^ cells.keys(), key=str)
        raise InputError(
            f"{where}: the row for feature {odd[0]}, zone {odd[1]} is missing or unknown.",
            hint="Make the file again, with --force.",
        )
    value, *interval = (
        {key: NAN if cells[key][column] is None else float(cells[key][column]) for key in keys}
        for column in range(4)
    )
    *_, n_windows, n_features = cells["S", None]
    parts: dict[str, Any] = {f: tuple(value[f, zone] for zone in names) for f in "DWT"}
    parts |= {f"I_{feature}": value[feature, None] for feature in "DWOT"}
    scores = Scores(zone_names=names, S=value["S", None], n_features=int(n_features), **parts)
    if n_windows is None:
        return scores, None
    low, high, mean = (tuple(column.values()) for column in interval)
    ceiling = Ceiling(zone_names=names, mean=mean, low=low, high=high, n_windows=int(n_windows))
    return scores, ceiling


def _or_none(value: Any) -> Any:
    """Return None for NaN: a table says null where a score has none."""
    return None if isinstance(value, float) and np.isnan(value) else value


def _check_name(column: str, name: str, known: tuple[str, ...]) -> None:
    if name not in known:
        raise InputError(f"Unknown {column} {name!r}, expected one of {', '.join(known)}.")


def _check_columns(table: Mapping[str, Sequence[Any]], wanted: tuple[str, ...]) -> None:
    missing = [name for name in wanted if name not in table]
    if missing:
        raise InputError(
            f"The table has no column {', '.join(missing)}; it needs {', '.join(wanted)}."
        )
