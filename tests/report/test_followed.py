"""Over the windows of a trial: who follows whom, in numbers, words and a picture."""

import math

import pytest

from zfcal.behaviour.influence import influence_to_rows
from zfcal.behaviour.measured import Measured
from zfcal.report.figures.followed import followed_picture
from zfcal.report.followed import DELAY, DIRECTION, FOLLOWING, LEAD, LED, followed_from
from zfcal.report.followed_words import followed_gap, followed_statement

NAN = math.nan


def rows_of(lead, *, end_s, led=(0.5, 2), own=(1.0, 1), value=0.3):
    """Return the rows of a window."""
    place = {"low": 0.1, "high": 0.5, "ceiling": 0.4, "floor": 0.2}
    of = {
        FOLLOWING: {"value": value, **place, "n": 90},
        LEAD: {"value": lead, "low": -0.1, "high": 0.1, "ceiling": 0.0, "floor": 0.2, "n": 90},
        DELAY: {"value": 0.6, "n": 90},
        LED: {"value": led[0], **place, "n": led[1]},
        "departures_followed": {"value": own[0], **place, "n": own[1]},
    }
    made = [
        Measured(measure=DIRECTION, lag_s=lag_s, value=value + lag_s / 100, **place, n=30)
        for lag_s in (-0.2, 0.0, 0.2)
    ]
    made += [Measured(measure=name, **numbers) for name, numbers in of.items()]
    table = influence_to_rows(made, window_end_s=end_s)
    return [dict(zip(table, cells, strict=True)) for cells in zip(*table.values(), strict=True)]


def found_of(leads, **parts):
    """Return what windows of some leads say, a window a minute from 420 s on."""
    rows = [
        row
        for number, lead in enumerate(leads)
        for row in rows_of(lead, end_s=420 + 60 * number, **parts)
    ]
    return followed_from(rows, start_s=300)


def said(make_view, found):
    """Return the answer on the page."""
    return followed_statement(make_view(following=found)).answer


def test_means_are_over_all_windows_and_intervals_over_those_apart():
    """Of five windows the first, third and fifth do not overlap: 0.1, 0.2, 0.3."""
    level = found_of([0.1, 0.9, 0.2, 0.9, 0.3]).measures[LEAD]
    assert level.value == pytest.approx((0.1 + 0.9 + 0.2 + 0.9 + 0.3) / 5)
    assert level.n_windows == 3
    # t of two degrees of freedom, times 0.1 over the root of three.
    assert level.high - 0.2 == pytest.approx(4.302653 * 0.1 / math.sqrt(3))
    assert level.n_above == 1


def test_departures_count_by_their_number():
    """One of one and none of three: a quarter."""
    rows = rows_of(0.0, end_s=420, led=(1.0, 1)) + rows_of(0.0, end_s=540, led=(0.0, 3))
    level = followed_from(rows, start_s=300).measures[LED]
    assert (level.value, level.n) == (0.25, 4)


def test_windows_that_begin_early_are_left_out():
    """If any begins later; fish get used to the robot in the first minutes."""
    early, late = rows_of(0.5, end_s=360), rows_of(0.1, end_s=480)
    assert followed_from([*early, *late], start_s=300).measures[LEAD].value == 0.1
    assert followed_from(early, start_s=300).measures[LEAD].value == 0.5
    assert followed_from([], start_s=300) is None


@pytest.mark.parametrize(
    ("leads", "words"),
    [
        ([0.2, 0.2, 0.21, 0.2, 0.2], "where both turn alike it is the first"),
        ([-0.2, -0.2, -0.21, -0.2, -0.2], "where both turn alike the fish are the first"),
        ([-0.2, 0.0, 0.1, 0.0, 0.1], "neither it nor the fish turn first"),
        ([0.2, 0.2], "too few windows"),
    ],
)
def test_the_page_says_who_turns_first(make_view, leads, words):
    """By the interval of the lead, where there is one."""
    assert words in said(make_view, found_of(leads))


def test_the_page_names_ceiling_and_chance(make_view):
    """Every number stands beside what a fish, and what nobody, would reach."""
    answer = said(make_view, found_of([0.1, 0.2, 0.1, 0.2, 0.1]))
    assert "mean cosine of 0.30" in answer
    assert "a fish in its place 0.40 (0.10 to 0.50)" in answer
    assert "up to 0.20 by chance" in answer
    assert "above that it is in 3 of 3 windows" in answer
    assert "from a room it led 0.50, a fish in its place 0.40" in answer


def test_of_a_single_window_the_page_counts_in_figures(make_view):
    """It is 0 or 1 of 1 window."""
    answer = said(make_view, found_of([0.1]))
    assert "above that it is in 1 of 1 window, where chance" in answer
    assert "one window" not in answer


def test_where_departures_are_not_defined_the_page_says_so(make_view):
    """One room, or nobody left."""
    answer = said(make_view, found_of([0.1], led=(NAN, None), own=(NAN, None)))
    assert "has not two rooms" in answer
    assert "did not leave" in said(make_view, found_of([0.1], led=(NAN, 0), own=(NAN, 0)))


def test_a_robot_that_was_never_near_is_said(make_view):
    """There is no picture then."""
    found = found_of([NAN], value=NAN)
    assert "never seen near" in said(make_view, found)
    assert followed_picture(found) is None


def test_what_was_not_measured_is_a_gap(make_view):
    """With the command that makes it; without a robot there is nothing to make."""
    assert followed_gap(make_view(following=None)).command == "zfcal analyse trial"
    assert followed_gap(make_view(following=found_of([0.1]))) is None
    assert followed_gap(make_view(following=None, statistics={})) is None


def test_the_picture_says_what_is_to_be_seen(covered_texts):
    """Two panels; the second one only where a group left a room."""
    picture = followed_picture(found_of([0.1, 0.2, 0.1, 0.2, 0.1]))
    assert "highest at +0.2 s with 0.30" in picture.panels[0].alt
    assert "a share of 0.50" in picture.panels[1].alt
    assert covered_texts(picture) == []
    assert len(followed_picture(found_of([0.1], led=(NAN, None))).panels) == 1


def test_without_an_interval_the_key_has_none():
    """One window has no spread."""
    labels = [entry.label for entry in followed_picture(found_of([0.1])).key]
    assert labels[0] == "robot"
    assert "95 % of its mean" not in labels
