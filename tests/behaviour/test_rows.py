"""Statistics and scores go into the tables of the contract, and come back."""

import json
import math

import numpy as np
import pytest

from zfcal.behaviour.ceilings import robot_ceiling, summarise
from zfcal.behaviour.rows import (
    SCORES_COLUMNS,
    STATISTICS_COLUMNS,
    join_tables,
    scores_from_rows,
    scores_to_rows,
    statistics_from_rows,
    statistics_to_rows,
)
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import measure
from zfcal.errors import InputError


@pytest.fixture
def counts(tank, samples_of):
    """Two fish: left and left, then left and right."""
    return measure(samples_of([[(0.1, 0.1), (0.1, 0.2)], [(0.1, 0.14), (0.3, 0.2)]]), tank)


@pytest.fixture
def other(tank, samples_of):
    """Two fish that stay left."""
    return measure(samples_of([[(0.1, 0.1), (0.1, 0.2)], [(0.1, 0.12), (0.1, 0.3)]]), tank)


def rows_where(table, **wanted):
    """Return the rows with the given values, as dictionaries."""
    rows = [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


@pytest.mark.parametrize(
    ("file", "columns"),
    [("stats.arrow.json", STATISTICS_COLUMNS), ("scores.arrow.json", SCORES_COLUMNS)],
)
def test_the_columns_are_those_of_the_schema(file, columns, repository):
    """Names and order."""
    schema = json.loads((repository / "schemas" / file).read_text())

    assert tuple(column["name"] for column in schema["columns"]) == columns


def test_statistics_have_a_row_per_count(counts):
    """Two zones: D, W and V 20 rows each, O 2, T 4."""
    table = statistics_to_rows(counts, window_end_s=120, case="control")

    assert tuple(table) == STATISTICS_COLUMNS
    assert len(table["count"]) == 66
    assert set(table["window_end_s"]) == {120}
    assert set(table["case"]) == {"control"}
    assert [len(rows_where(table, feature=f)) for f in "DWOTV"] == [20, 20, 2, 4, 20]


def test_statistics_rows_by_hand(counts):
    """One pair 0.10 apart (bin 4), 3 of 4 agent-samples left, half of the steps from left stay."""
    table = statistics_to_rows(counts, window_end_s=120, case="social")
    window = {"window_end_s": 120, "case": "social"}

    assert rows_where(table, feature="D", zone="left", bin=4) == [
        window | {"feature": "D", "zone": "left", "to_zone": None, "bin": 4}
        | {"count": 1, "frequency": 1.0}
    ]  # fmt: skip
    assert rows_where(table, feature="O", zone="left") == [
        window | {"feature": "O", "zone": "left", "to_zone": None, "bin": None}
        | {"count": 3, "frequency": 0.75}
    ]  # fmt: skip
    assert rows_where(table, feature="T", zone="left", to_zone="right") == [
        window | {"feature": "T", "zone": "left", "to_zone": "right", "bin": None}
        | {"count": 1, "frequency": 0.5}
    ]  # fmt: skip


def test_a_frequency_without_a_count_is_null(counts):
    """Nobody met right and nobody left from there."""
    table = statistics_to_rows(counts, window_end_s=120, case="control")

    assert {row["frequency"] for row in rows_where(table, feature="D", zone="right")} == {None}
    assert {row["frequency"] for row in rows_where(table, feature="T", zone="right")} == {None}


def test_statistics_come_back_from_their_rows(counts, other):
    """Two windows and two cases in one table."""
    table = join_tables(
        [
            statistics_to_rows(counts, window_end_s=120, case="control"),
            statistics_to_rows(other, window_end_s=120, case="social"),
            statistics_to_rows(other, window_end_s=180, case="control"),
        ]
    )

    back = statistics_from_rows(table)

    assert list(back) == [(120, "control"), (120, "social"), (180, "control")]
    for key, original in zip(back, (counts, other, other), strict=True):
        assert back[key].zone_names == original.zone_names
        for name in ("distance", "wall", "occupation", "transition", "speed"):
            assert np.array_equal(getattr(back[key], name), getattr(original, name))


def test_scores_have_a_row_per_zone_and_one_for_the_mean(counts, other):
    """Two zones: three rows for each of D, W and T, one for O, one for S with its n_features."""
    scores = compare(counts, other)

    table = scores_to_rows(scores, window_end_s=120, compared="social-vs-control")

    assert tuple(table) == SCORES_COLUMNS
    assert [len(rows_where(table, feature=f)) for f in "DWTOS"] == [3, 3, 3, 1, 1]
    assert rows_where(table, feature="W", zone=None)[0]["value"] == pytest.approx(0.5)
    assert rows_where(table, feature="D", zone="right")[0]["value"] is None
    assert rows_where(table, feature="S") == [
        {
            "window_end_s": 120, "compared": "social-vs-control", "feature": "S", "zone": None,
            "value": scores.S, "low": None, "high": None, "ceiling": None,
            "n_windows": None, "n_features": 4,
        }
    ]  # fmt: skip
    assert {row["n_features"] for row in rows_where(table, feature="O")} == {None}


def test_scores_stand_beside_their_ceiling(tank, wander, counts, other):
    """Mean, interval and number of the ceiling's comparisons, score by score."""
    ceiling = summarise(robot_ceiling(wander(1), tank))

    table = scores_to_rows(
        compare(counts, other), window_end_s=120, compared="robot-vs-fish", ceiling=ceiling
    )

    S = rows_where(table, feature="S")[0]
    assert (S["ceiling"], S["low"], S["high"]) == ceiling.of("S")
    T = rows_where(table, feature="T", zone="left")[0]
    assert (T["ceiling"], T["low"], T["high"]) == ceiling.of("T", "left")
    assert set(table["n_windows"]) == {5}


def test_scores_come_back_from_their_rows(tank, wander, counts, other):
    """With a ceiling and without, nulls included."""
    ceiling = summarise(robot_ceiling(wander(1), tank))
    scores = compare(counts, other)
    table = join_tables(
        [
            scores_to_rows(scores, window_end_s=120, compared="social-vs-control"),
            scores_to_rows(scores, window_end_s=120, compared="robot-vs-fish", ceiling=ceiling),
        ]
    )

    back = scores_from_rows(table)

    plain, none = back[120, "social-vs-control"]
    assert none is None
    assert plain.values == pytest.approx(scores.values, abs=0, nan_ok=True)
    assert plain.n_features == scores.n_features
    assert math.isnan(plain.D[1])
    assert back[120, "robot-vs-fish"][1] == ceiling


def test_only_known_cases_and_comparisons_are_written(counts, other):
    """A slip of the pen does not get into a file."""
    with pytest.raises(InputError, match="Unknown case 'fish', expected one of control, social"):
        statistics_to_rows(counts, window_end_s=120, case="fish")
    with pytest.raises(InputError, match="Unknown compared 'model'"):
        scores_to_rows(compare(counts, other), window_end_s=120, compared="model")


def without(table, row):
    """Return the table without one row."""
    return {name: values[:row] + values[row + 1 :] for name, values in table.items()}


def test_statistics_rows_that_are_not_whole_are_refused(counts):
    """A column gone, a row gone, a row doubled, a row of an unknown bin."""
    table = statistics_to_rows(counts, window_end_s=120, case="control")

    with pytest.raises(InputError, match="no column bin"):
        statistics_from_rows({name: table[name] for name in table if name != "bin"})
    with pytest.raises(InputError, match="no row for feature D, zone left, to_zone None, bin 3"):
        statistics_from_rows(without(table, 3))
    with pytest.raises(InputError, match="two rows for"):
        statistics_from_rows(join_tables([table, table]))
    odd = {name: [*values, values[0]] for name, values in table.items()}
    odd["bin"][-1] = 10
    with pytest.raises(InputError, match="unknown row feature D, zone left, to_zone None, bin 10"):
        statistics_from_rows(odd)


def test_scores_rows_that_are_not_whole_are_refused(counts, other, tank, wander):
    """A column gone, a row gone, a row doubled, no n_features; a ceiling of other zones."""
    scores = compare(counts, other)
    table = scores_to_rows(scores, window_end_s=120, compared="model-vs-control")

    with pytest.raises(InputError, match="no column low"):
        scores_from_rows({name: table[name] for name in table if name != "low"})
    with pytest.raises(InputError, match="row for feature D, zone None is missing"):
        scores_from_rows(without(table, 2))
    with pytest.raises(InputError, match="two rows for"):
        scores_from_rows(join_tables([table, table]))
    with pytest.raises(InputError, match="no n_features"):
        scores_from_rows(table | {"n_features": [None] * len(table["zone"])})
    ceiling = summarise(robot_ceiling(wander(1), tank))
    object.__setattr__(ceiling, "zone_names", ("a", "b"))
    with pytest.raises(InputError, match="ceiling is of zones a, b"):
        scores_to_rows(scores, window_end_s=120, compared="model-vs-control", ceiling=ceiling)
