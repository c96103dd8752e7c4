"""The tables of the page."""

from dataclasses import replace

from zfcal.artifacts.lineage import Lineage
from zfcal.report.figures.rules import rules_picture
from zfcal.report.numbers import lineage_table, tables, trials_table
from zfcal.report.views import MODEL, Integration, Mark, Published, RuleScore, Source


def table_of(view, name):
    """Return one table of a trial."""
    (found,) = (table for table in tables(view) if table.name == name)
    return found


def test_rows_are_as_wide_as_the_head(make_view):
    """Every cell has its column, in every table."""
    for table in (*tables(make_view()), trials_table([make_view("a"), make_view("b")])):
        assert {len(row) for row in table.rows} == {len(table.heads)}, table.name


def test_scores_have_mean_last_ceiling_and_interval(make_view):
    """S of the model: 0.74 to 0.84, last 0.84 of 0.85, that is 99 %."""
    rows = {tuple(row[:2]): row[2:] for row in table_of(make_view(), "numbers").rows}

    assert rows["model", "S"] == ["0.790", "0.840", "0.850", "99 %", "0.750 to 0.950"]
    assert rows["fish with robot", "S"][2:] == ["–", "–", "–"]


def test_a_score_by_zone_stands_apart(make_view):
    """Three zones of D, W and T for three comparisons."""
    assert len(table_of(make_view(), "numbers-by-zone").rows) == 27


def test_windows_meet_by_their_end(make_view, course):
    """A comparison that lacks a window has dashes there."""
    view = make_view(n_windows=2)
    courses = dict(view.courses) | {(MODEL, "S", None): course([0.5], ceiling=0.8)}

    rows = table_of(make_view(courses=courses), "windows").rows

    assert rows[0][:3] == ["120", "0.500", "0.800"]
    assert rows[1][:3] == ["180", "–", "–"]


def test_parameters_say_what_they_are_worth(make_view):
    """corridor.kappa_0 is 9, its interval as found, and it is not identified."""
    row = table_of(make_view(), "parameter-values").rows[0]

    assert row == ["corridor.kappa_0", "9", "0.1 to 0.9", "no"]


def test_empty_tables_are_left_out(make_view):
    """Without scores, models and files there is nothing to tabulate."""
    empty = make_view(courses={}, rounds=[], sources=())

    assert tables(empty) == []


def test_every_file_says_where_it_comes_from(make_view):
    """Command, version, seed, inputs, hash and options; of several trials by its name."""
    lineage = Lineage(
        schema="zfcal.stats/1",
        command="analyse",
        version="1.2",
        options={"a": 1},
    )
    source = Source(path="stats/000120.parquet", sha256="ab" * 32, lineage=lineage, n_inputs=1)
    view = make_view("t", sources=[source])

    (row,) = lineage_table([view]).rows
    (named, _) = lineage_table([view, view]).rows

    assert row == ["stats/000120.parquet", "analyse", "1.2", "–", "1", "abababababab", '{"a": 1}']
    assert named[0] == "t/stats/000120.parquet"


def test_a_trial_without_anything_has_a_row_of_dashes(make_view):
    """A trial that was only just begun does not stop the table."""
    empty = make_view(courses={}, integration=Integration(start_s=0, end_s=0), seen=None)

    assert trials_table([empty]).rows[0] == ["trial", "0.0", "–", "0", *"–" * 7]


def test_rules_have_their_mean_forward_score_and_how_often_they_published(make_view):
    """0.7 and 0.8 are 0.75 on the average; a trial without rules has neither table."""
    view = make_view()
    scores = [
        RuleScore(rule="score", end_s=end, made_at_s=end - 120, score=Mark(value=value))
        for end, value in ((240, 0.7), (300, 0.8))
    ]
    last = replace(view.rounds[-1], published=Published(rule="score", because="so", of_s=240))
    judged = replace(view, rule_scores=scores, rounds=[*view.rounds[:-1], last])

    assert table_of(judged, "rules-by-score").rows == [["score", "2", "0.750", "0.071", "1"]]
    assert table_of(judged, "published").rows == [[str(last.second), "score", "240", "so"]]
    assert {"rules-by-score", "published"}.isdisjoint(table.name for table in tables(view))
    assert rules_picture(judged.rule_scores).panels[0].alt.endswith("score 0.75.")
    assert rules_picture(view.rule_scores) is None
