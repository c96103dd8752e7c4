"""The paper's statements on known courses."""

import math

import pytest

from zfcal.reproduction.document import Way
from zfcal.reproduction.reference import read_reference
from zfcal.reproduction.statements import statements_of


def course(first, settled, wave=0.0):
    """Return a trial of 20 min that goes from one value to the other; D also waves."""
    found = {}
    for k, end in enumerate(range(120, 1201, 60)):
        share = min(max((end - 180) / 120, 0.0), 1.0)
        for name in "DWOTS":
            value = first[name] + share * (settled[name] - first[name])
            found[name, end] = value + (wave * (-1) ** k if name == "D" else 0.0)
    return found


LOW = {"D": 0.6, "W": 0.6, "O": 0.9, "T": 0.6, "S": 0.6}
HIGH = {"D": 0.7, "W": 0.85, "O": 0.9, "T": 0.85, "S": 0.85}


def said(first, settled, wave=0.05):
    """Return statement by text of three trials that differ a little."""
    courses = {
        str(k): {key: value + 0.001 * k for key, value in course(first, settled, wave).items()}
        for k in (-1, 0, 1)
    }
    courses["1"] = {k: v + 0.002 * (k[1] % 7) / 7 for k, v in courses["1"].items()}
    found = statements_of([Way(name="a way", courses=courses)], read_reference())
    return {each.says: each for each in found}


def test_a_course_as_published_holds_everything():
    """S from 0.6 to 0.85 by 300 s, W and T with it, O high and flat, D waving."""
    found = said(LOW, HIGH)
    assert {each.holds for each in found.values()} == {"holds"}
    assert len(found) == 7


def test_a_course_without_a_rise_holds_none_of_it():
    """All high from the first window on, and nothing waves."""
    found = said(HIGH, HIGH, wave=0.0)
    for says, each in found.items():
        if "rise" in says and "over" not in says:
            assert each.holds != "holds", says
    assert found["S rises as published, by 0.24 (half of it or more)"].holds == "does not hold"
    assert found["O stays nearly flat"].holds == "holds"


def test_one_trial_leaves_all_open():
    """There is no interval, and that is said as null."""
    way = Way(name="a way", courses={"one": course(LOW, HIGH)})
    for each in statements_of([way], read_reference()):
        assert each.holds == "open"
        assert each.as_dict()["low"] is None


def test_a_trial_that_is_too_short_counts_for_nothing():
    """Its value is unknown; the others decide."""
    short = {key: value for key, value in course(LOW, HIGH).items() if key[1] <= 240}
    courses = {"a": course(LOW, HIGH), "b": short}
    rise = statements_of([Way(name="a way", courses=courses)], read_reference())[0]
    assert rise.n == 1
    assert rise.mean == pytest.approx(0.25)
    assert math.isnan(rise.low)
