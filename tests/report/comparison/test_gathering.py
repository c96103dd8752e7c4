"""From trials to a table, a document, lines and a picture."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.validation import check
from zfcal.errors import DamagedError, InputError
from zfcal.report.comparison.compare import (
    Sets,
    compare,
    comparison_files,
    comparison_reason,
    write_comparison,
)
from zfcal.report.comparison.document import SCHEMA, compare_document
from zfcal.report.comparison.gathering import (
    TrialValues,
    check_apart,
    missing_of,
    read_values,
    rows_of,
    values_of,
    warnings_of,
)
from zfcal.report.comparison.picture import comparison_picture
from zfcal.report.comparison.table import lines_of, missing_lines, p_text, statements
from zfcal.report.figures import theme
from zfcal.report.figures.panels import compose
from zfcal.report.views import MODEL, Integration

LINEAGE = Lineage(schema=SCHEMA, command="compare")


def made(label, values, **changes):
    """Return a trial of some values."""
    trial = TrialValues(
        label=label,
        values=values,
        why={"model": "no model", "robot": "no robot"},
        conditions={"the number of fish": "4"},
        left_out=(),
        tracked_s=120.0,
        zone_names=("walls", "centre"),
        tracks=(label,),
    )
    return replace(trial, **changes)


@pytest.fixture
def make_sets():
    """Return what makes two sets of trials that differ in speed by some spreads."""

    def make(n_a=4, n_b=4, *, shift=0.0, seed=1):
        rng = np.random.default_rng(seed)

        def side(name, n, more):
            return [
                made(
                    f"{name}{i}",
                    {
                        "V_m_s": 0.1 + 0.01 * (rng.normal() + more),
                        "W_m": 0.05 + 0.01 * rng.normal(),
                        "S_model_over_ceiling": 0.9 + 0.02 * rng.normal(),
                    },
                )
                for i in range(n)
            ]

        return side("a", n_a, shift), side("b", n_b, 0.0)

    return make


def document_of(sets):
    """Return the comparison of two sets, checked against its schema."""
    document = compare_document(*sets, LINEAGE)
    check(document, "compare", "here")
    json.dumps(document, allow_nan=False)
    return document


def row_of(document, name):
    """Return a row of a document."""
    (row,) = (each for each in document["statistics"] if each["name"] == name)
    return row


def test_scores_are_those_of_the_report_over_their_ceilings(make_view):
    """Means over the windows of the model; the robot as it was pooled."""
    view = make_view("day1")
    found = values_of(view, {"V_m_s": 0.1})

    assert found.values["V_m_s"] == 0.1
    mean = float(np.mean(view.course(MODEL, "S").value))
    assert found.values["S_model_over_ceiling"] == pytest.approx(mean / 0.85)
    assert found.values["S_robot_over_ceiling"] == pytest.approx(0.6 / 0.9)
    assert found.values["S_robot"] == 0.6
    assert found.label == "day1"


@pytest.mark.parametrize(
    ("changes", "name", "says"),
    [
        ({"courses": {}}, "S_model_over_ceiling", "no model has been scored"),
        ({"seen": None}, "V_m_s", "there are no tracks"),
        ({"integration": Integration(start_s=0, end_s=0)}, "S_robot", "has not been compared"),
    ],
)
def test_what_a_trial_lacks_is_left_out_with_its_reason(make_view, changes, name, says):
    """Of the row alone; the trial stays in the others."""
    trial = values_of(make_view("short", **changes), {})
    rows = rows_of([trial, made("full", {name: 1.0, "W_m": 1.0})], [])
    found = {each: part.why for part in missing_of(trial, rows) for each in part.names}

    assert says in found[name]
    assert "W_m" in found


def test_a_robot_without_a_ceiling_keeps_its_own_score(make_view):
    """With two fish nobody can be put in the robot's place."""
    view = make_view("pair")
    marks = {f: replace(mark, ceiling=math.nan) for f, mark in view.integration.robot.items()}
    found = values_of(replace(view, integration=replace(view.integration, robot=marks)), {})

    assert found.values["S_robot"] == 0.6
    assert "S_robot_over_ceiling" not in found.values
    assert "three fish" in found.why["robot"]


def test_a_trial_is_read_once_for_scores_and_means(small_trial, quick_model):
    """From tracks, scores and models as they lie in its directory."""
    found = read_values(small_trial("day1"), "day1", pytest.fail)

    assert found.values["S_model_over_ceiling"] == pytest.approx(0.7 / 0.85)
    assert found.values["S_robot"] == pytest.approx(0.7)
    assert 0 < found.values["V_m_s"] < 1
    assert sum(found.values[f"O_share_{zone}"] for zone in found.zone_names) == pytest.approx(1)
    assert len(found.tracks) == 4


def test_a_damaged_segment_is_heard_of_and_left_out(small_trial, quick_model):
    """The rest of the trial counts."""
    root = small_trial("day1")
    (root / "tracks" / "000060.parquet").write_bytes(b"PAR1")
    heard = []
    found = read_values(root, "day1", heard.append)

    assert isinstance(heard[0], DamagedError)
    assert "tracks/000060.parquet" in found.left_out[0]
    assert "V_m_s" in found.values
    assert len(found.tracks) == 3


@pytest.mark.parametrize(
    ("a", "b", "says"),
    [
        (["x", "y"], ["z", "y"], "y is in both sets"),
        (["x", "x"], ["z"], "named twice"),
        (["x"], ["./x"], "in both sets"),
        (["x"], [], "Set B has no trial"),
    ],
)
def test_a_trial_counts_once(a, b, says):
    """On both sides, twice on a side, by another name of its path; a side without any."""
    with pytest.raises(InputError, match=says):
        check_apart(list(map(Path, a)), list(map(Path, b)))


def test_what_the_sets_differ_in_besides_is_said(make_view):
    """Another frame rate; trials of one set that differ among themselves; nothing else."""
    view = make_view("one")
    faster = replace(view, trial=replace(view.trial, fps=30.0), label="two")
    one, two = values_of(view, {}), values_of(faster, {})

    (said,) = warnings_of([one], [two])
    assert "Trials differ in the frame rate: A has 15 Hz, B 30 Hz" in said
    (within,) = warnings_of([one, two], [replace(one, label="c"), replace(two, label="d")])
    assert "A has 15 Hz and 30 Hz" in within
    assert warnings_of([one], [replace(one, label="c")]) == []
    unscored = values_of(replace(view, courses={}, label="d"), {})
    assert warnings_of([one], [unscored]) == []


def test_other_tanks_and_other_numbers_of_fish_are_said(make_view, arenas):
    """Each in a line of its own."""
    view = make_view("one")
    other = replace(view, arena=arenas["ring"], trial=replace(view.trial, n_fish=6), label="two")
    said = warnings_of([values_of(view, {})], [values_of(other, {})])

    assert [line.partition(":")[0] for line in said] == [
        "Trials differ in the arena",
        "Trials differ in the number of fish",
    ]
    assert "two-rooms" in said[0]
    assert "ring" in said[0]


def test_a_copy_of_a_trial_is_found_out():
    """Two names of the same tracks count as two trials, which they are not."""
    one = made("day1", {"V_m_s": 0.1})
    (said,) = warnings_of([one], [replace(one, label="copy")])

    assert said.startswith("day1 and copy hold the same tracks")


def test_a_difference_is_found_and_its_row_says_what_it_is(make_sets):
    """Ten spreads apart in speed, alike in the others."""
    document = document_of(make_sets(shift=10))
    row = row_of(document, "V_m_s")

    assert row["difference"] == pytest.approx(row["A"]["mean"] - row["B"]["mean"])
    assert row["interval"][0] < row["difference"] < row["interval"][1]
    assert row["p"] == row["p_family"] == pytest.approx(2 / 70)
    assert row["unit"] == "m/s"
    assert document["test"]["relabellings"] == 70
    assert row_of(document, "W_m")["p_family"] > 0.05
    text = "\n".join(lines_of(document))
    assert "A and B differ, over 3 statistics together, in V_m_s (p 0.029)." in text
    assert "W_m (" not in text


def test_sets_alike_are_not_told_apart_and_not_called_alike(make_sets):
    """No difference is no proof."""
    text = " ".join(statements(document_of(make_sets(seed=4))))

    assert "No difference is found in 3 statistics together" in text
    assert "no proof" in text
    assert "about g = 2.7" in text


@pytest.mark.parametrize(("n", "least"), [(3, "0.1"), (2, "0.33"), (1, "1")])
def test_fewer_than_four_are_described_with_what_could_be_shown(make_sets, n, least):
    """No p anywhere; the smallest p and the smallest effects are told."""
    document = document_of(make_sets(n, n, shift=50))
    text = "\n".join(lines_of(document))

    assert {row["p"] for row in document["statistics"]} == {None}
    assert {row["p_family"] for row in document["statistics"]} == {None}
    assert row_of(document, "V_m_s")["untested"].startswith(f"{n} and {n} trials have it")
    assert "Nothing is tested" in text
    assert f"no p by relabelling could be below {least}," in text
    assert "With 4 trials on each side about g = 2.7" in text
    assert ("A t test, which trusts" in text) == (n > 1)
    assert "differ, over" not in text


def test_a_row_that_few_trials_have_is_not_tested_beside_others(make_sets):
    """One of four trials has no model: its row is described, and said not to be tested."""
    a, b = make_sets(shift=10)
    a[0] = replace(a[0], values={"V_m_s": a[0].values["V_m_s"], "W_m": 0.05})
    document = document_of((a, b))
    row = row_of(document, "S_model_over_ceiling")

    assert (row["A"]["n"], row["p"], row["A"]["values"][0]) == (3, None, None)
    assert document["test"]["tested"] == 2
    assert document["missing"] == [
        {"set": "A", "trial": "a0", "statistics": ["S_model_over_ceiling"], "why": "no model"}
    ]
    assert missing_lines(document) == ["Left out of S_model_over_ceiling: a0: no model."]
    assert "Not tested: S_model_over_ceiling: 3 and 4 trials have it" in "\n".join(
        lines_of(document)
    )


def test_few_trials_of_unequal_spread_are_warned_of(make_sets):
    """The speeds of one side thirty times as far apart as the other's; ten a side are enough."""

    def wide(trials):
        return [
            replace(each, values={**each.values, "V_m_s": 0.1 + (each.values["V_m_s"] - 0.1) * 30})
            for each in trials
        ]

    for n, warned in ((4, True), (10, False)):
        a, b = make_sets(n, n)
        found = document_of((wide(a), b))["warnings"]
        assert any("times as far apart" in line and "V_m_s" in line for line in found) == warned


def test_trials_without_anything_make_a_document_and_no_picture():
    """A trial of nothing but settings."""
    document = document_of(([made("a", {})], [made("b", {})]))

    assert document["statistics"] == []
    assert "No trial has a statistic." in lines_of(document)
    assert comparison_picture(document) is None


def test_the_picture_has_a_row_for_each_effect_and_a_dot_for_each_trial(make_sets):
    """The mean of A's dots is g, that of B's is zero."""
    document = document_of(make_sets(shift=3))
    picture = comparison_picture(document)
    with theme.style():
        (axes,) = compose(picture).axes
    labels = [text.get_text() for text in axes.get_yticklabels()]
    at = labels.index("Speeds (m/s)")
    dots = {
        line.get_marker(): line.get_xdata()
        for line in axes.lines
        if line.get_marker() in {"o", "^"} and abs(line.get_ydata()[0] - at) < 0.4
    }

    assert len(labels) == 3
    assert np.mean(dots["o"]) == pytest.approx(row_of(document, "V_m_s")["g"])
    assert np.mean(dots["^"]) == pytest.approx(0, abs=1e-9)
    assert {marker: len(x) for marker, x in dots.items()} == {"o": 4, "^": 4}


def test_a_huge_effect_does_not_hide_the_others(make_sets):
    """It stands as a number at the edge, and its trials are an arrow there."""
    picture = comparison_picture(document_of(make_sets(shift=500)))
    with theme.style():
        (axes,) = compose(picture).axes

    assert max(axes.get_xlim()) < 15
    assert any(text.get_text().startswith("g = ") for text in axes.texts)
    assert [line for line in axes.lines if line.get_marker() == ">"]


def test_small_p_is_not_printed_as_zero():
    """And one that is not there as a dash."""
    assert [p_text(p) for p in (None, 0.00004, 0.0286)] == ["–", "< 0.001", "0.029"]


def test_files_are_whole_and_up_to_date_until_an_input_changes(small_trial, quick_model, tmp_path):
    """A document that says what lies beside it; another picture takes the place of the first."""
    sets = Sets(a=[small_trial("a", minutes=2)], b=[small_trial("b", minutes=2)])
    folder = tmp_path / "out"
    document, paths = write_comparison(sets, folder, pytest.fail)

    assert [path.name for path in paths] == ["compare.json"]
    assert comparison_reason(sets, folder) is None
    assert comparison_files(folder) == (json.loads(paths[0].read_text()), paths)
    assert document["lineage"]["options"]["A"] == ["a"]
    assert comparison_reason(sets, folder, kind="svg") == "option format: png -> svg"
    (sets.a[0] / "scores" / "000120.parquet").unlink()
    assert comparison_reason(sets, folder) == "input ../a/scores/000120.parquet is gone"


@pytest.mark.slow
def test_the_picture_is_a_png_or_an_svg(small_trial, quick_model, tmp_path):
    """One at a time; a picture that was changed is made again."""
    sets = Sets(
        a=[small_trial(f"a{i}", minutes=2) for i in range(2)],
        b=[small_trial(f"b{i}", minutes=2) for i in "23"],
    )
    for root in (sets.a[0], sets.b[0]):
        (root / "tracks" / "000060.parquet").unlink()
    png = write_comparison(sets, tmp_path / "out", pytest.fail)[1][1]
    assert png.read_bytes().startswith(b"\x89PNG")
    svg = write_comparison(sets, tmp_path / "out", pytest.fail, kind="svg")[1][1]

    assert b"<svg" in svg.read_bytes()
    assert not png.exists()
    svg.write_text("other")
    assert comparison_reason(sets, tmp_path / "out", kind="svg") == "compare.svg was changed"
    svg.unlink()
    assert comparison_reason(sets, tmp_path / "out", kind="svg") == "compare.svg is missing"


def test_the_same_trials_give_the_same_bytes(small_trial, quick_model, tmp_path):
    """Nothing of the day is in them."""
    sets = Sets(a=[small_trial("a", minutes=2)], b=[small_trial("b", minutes=2)])
    first, second = (compare(sets, pytest.fail, lineage=LINEAGE) for _ in range(2))

    assert json.dumps(first) == json.dumps(second)


def test_what_is_no_trial_is_refused(tmp_path, small_trial):
    """With its path."""
    with pytest.raises(InputError, match="nowhere"):
        compare(Sets(a=[small_trial("a")], b=[tmp_path / "nowhere"]), pytest.fail)
