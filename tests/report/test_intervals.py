"""Several trials interval by interval: means, spreads, and what they stand beside."""

import csv
import io
import math
import statistics
from pathlib import Path

import numpy as np
import pytest

from zfcal.report.intervals import interval_tables, intervals_csv, intervals_of, published_s
from zfcal.report.labels import labels_of
from zfcal.report.views import FEATURE_NAMES, MODEL, ROBOT, SOCIAL


@pytest.fixture
def three(make_view, course):
    """Return trials of three, three and two windows whose S is known."""
    values = ([0.60, 0.70, 0.80], [0.62, 0.74, 0.86], [0.70, 0.75])
    views = []
    for name, own in zip("abc", values, strict=True):
        view = make_view(name, n_windows=len(own))
        courses = dict(view.courses) | {(MODEL, "S", None): course(own, ceiling=0.9)}
        views.append(make_view(name, courses=courses, published=True))
    return views


def at(views, compared, feature, end_s):
    """Return one interval."""
    (found,) = (
        i
        for i in intervals_of(views)
        if (i.compared, i.feature, i.end_s) == (compared, feature, end_s)
    )
    return found


def test_mean_and_standard_deviation_by_hand(three):
    """Of 0.60, 0.62 and 0.70: mean 0.64, sample sd the root of 0.0056 / 2."""
    found = at(three, MODEL, "S", 120)
    assert (found.n, found.mean) == (3, pytest.approx(0.64))
    assert found.sd == pytest.approx(math.sqrt(0.0028))
    assert found.sd == pytest.approx(statistics.stdev([0.60, 0.62, 0.70]))
    assert (found.ceiling_mean, found.ceiling_sd) == (pytest.approx(0.9), pytest.approx(0.0))


def test_late_intervals_are_of_fewer_trials(three):
    """The third trial has no window to 240 s, and is in no mean there."""
    found = at(three, MODEL, "S", 240)
    assert (found.n, found.mean) == (2, pytest.approx(0.83))


def test_one_trial_has_no_spread(make_view):
    """NaN, a cell without it, an empty field."""
    view = make_view(n_windows=1)
    assert math.isnan(at([view], MODEL, "S", 120).sd)
    (table, *_) = interval_tables([view])
    assert not any("±" in cell for cell in table.rows[0])
    first = next(csv.DictReader(io.StringIO(intervals_csv([view]))))
    assert first["sd"] == ""


def test_a_score_that_is_null_counts_for_nothing(make_view, course):
    """Neither in the mean nor as a trial; where all are null there is no interval."""
    courses = {(MODEL, "S", None): course([np.nan, 0.5], ceiling=0.9)}
    views = [make_view("a", courses=courses), make_view("b", courses=courses)]
    assert [(i.end_s, i.n) for i in intervals_of(views)] == [(180, 2)]


@pytest.mark.parametrize(
    ("end_s", "value"), [(180, 0.610), (300, 0.827), (360, 0.850), (420, 0.850), (1800, 0.850)]
)
def test_published_means_stand_where_they_were_published(three, end_s, value):
    """Of S of the model alone: three intervals, the last one from then on."""
    assert published_s(end_s) == value
    assert math.isnan(published_s(120))
    assert math.isnan(at(three, MODEL, "D", 180).published)
    assert math.isnan(at(three, ROBOT, "S", 180).published)


def test_the_page_has_a_table_per_comparison(three):
    """D, W, O, T and S of each interval with the ceiling; the model's with what was published."""
    model, robot, social = interval_tables(three)
    assert model.heads == ["end (s)", "trials", *FEATURE_NAMES, "ceiling of S", "published S"]
    rows = {row[0]: row for row in model.rows}
    assert rows["180"][1] == "3"
    assert rows["180"][-3:] == ["0.730 ± 0.026", "0.900 ± 0.000", "0.610"]
    assert robot.heads[-1] == social.heads[-1] == "ceiling of S"
    assert {len(row) for row in robot.rows} == {len(robot.heads)}


def test_nothing_published_stands_beside_unasked(make_view):
    """Neither a column of the page nor a number in the file."""
    view = make_view()
    model, *_ = interval_tables([view])
    assert model.heads[-1] == "ceiling of S"
    rows = csv.DictReader(io.StringIO(intervals_csv([view])))
    assert {row["published"] for row in rows} == {""}


def test_the_file_has_a_row_for_each_interval(three):
    """All features of all comparisons, in full."""
    rows = list(csv.DictReader(io.StringIO(intervals_csv(three))))
    assert len(rows) == len(intervals_of(three))
    assert {row["compared"] for row in rows} == {MODEL, ROBOT, SOCIAL}
    (row,) = (
        row
        for row in rows
        if (row["compared"], row["feature"], row["end_s"]) == (MODEL, "S", "180")
    )
    assert float(row["mean"]) == pytest.approx(0.73)
    assert float(row["published"]) == 0.610


def test_trials_of_one_name_are_told_apart():
    """By as much of their paths as it takes."""
    assert labels_of([Path("day1"), Path("day2")]) == ["day1", "day2"]
    assert labels_of([Path("/x/1/trial"), Path("/x/2/trial")]) == ["1/trial", "2/trial"]
    assert labels_of([Path("/x/1/trial")]) == ["trial"]
