"""A comparison as lines of text: the table, what was tested, and what so many trials can show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_NONE = "–"
_HEADS = ("", "unit", "n", "A", "B", "A - B", "95 %", "g", "95 %", "p", "p of all")
_LEFT = 2
"""Columns of words; the others are numbers and stand to the right."""

_LEAST_TO_SAY = 0.001


def lines_of(document: Mapping[str, Any]) -> list[str]:
    """Return a comparison as text.

    Parameters
    ----------
    document
        From `compare_document`, or as its file holds it.

    Returns
    -------
    list of str
        The sets, a row per statistic, and what the test says.
    """
    sets = document["sets"]
    named = (f"{name}: {', '.join(each['trial'] for each in sets[name])}" for name in "AB")
    rows = document["statistics"]
    shown = _aligned([_HEADS, *map(_cells, rows)]) if rows else ["No trial has a statistic."]
    return [*named, "", *shown, "", *statements(document)]


def statements(document: Mapping[str, Any]) -> list[str]:
    """Return in sentences what was tested, what came of it, and what could have been found."""
    test = document["test"]
    said = [_verdict(document), _how(document), *_power(document)]
    if test["tested"] and any(row["untested"] for row in document["statistics"]):
        rows = [row for row in document["statistics"] if row["untested"]]
        said += [f"Not tested: {row['name']} ({row['untested']})." for row in rows]
    return said


def missing_lines(document: Mapping[str, Any]) -> list[str]:
    """Return which trial is left out of which rows, a sentence each."""
    return [
        f"{each['trial']} is left out of {', '.join(each['statistics'])}: {each['why']}."
        for each in document["missing"]
    ]


def p_text(p: float | None) -> str:
    """Return a p as text."""
    if p is None:
        return _NONE
    return f"< {_LEAST_TO_SAY}" if p < _LEAST_TO_SAY else f"{p:.3f}"


def _verdict(document: Mapping[str, Any]) -> str:
    test = document["test"]
    if not test["tested"]:
        n_a, n_b = _sizes(document)
        return (
            f"Nothing is tested: {_trials(n_a)} and {_trials(n_b)}, and a test needs "
            f"{test['least_trials']} on each side. The table describes these trials."
        )
    found = [
        row
        for row in document["statistics"]
        if row["p_family"] is not None and row["p_family"] <= test["alpha"]
    ]
    if not found:
        return (
            f"No difference in {_of(test['tested'])} that trials alike would not show as often as "
            "once in twenty. That is no proof that the sets are alike: see the intervals."
        )
    names = ", ".join(f"{row['name']} (p {p_text(row['p_family'])})" for row in found)
    return f"A and B differ, with all {_of(test['tested'])} in view, in {names}."


def _how(document: Mapping[str, Any]) -> str:
    test = document["test"]
    n_a, n_b = _sizes(document)
    least = f"{test['smallest_p']:.2g}"
    if not test["tested"]:
        return (
            f"With {n_a} and {n_b} trials no p by relabelling could be below {least}, however "
            "large a difference is."
        )
    ways = "all there are" if test["exact"] else f"by chance, seed {test['seed']}"
    return (
        f"p: {test['relabellings']} relabellings of whole trials, {ways}; the smallest p is "
        f'{least}. "p of all" is over all statistics together and the one to judge by.'
    )


def _power(document: Mapping[str, Any]) -> Iterator[str]:
    test = document["test"]
    n_a, n_b = _sizes(document)
    often = f"{100 * test['power']:.0f} %"
    if not test["tested"]:
        yield (
            f"With {test['least_trials']} trials on each side a difference of g = "
            f"{test['detectable_g_with_least']:.1f} in a single statistic would be found in "
            f"{often} of experiments; smaller ones need more trials."
        )
    elif test["detectable_g"] is not None:
        yield (
            f"With {n_a} and {n_b} trials at least g = {test['detectable_g']:.1f} is found in "
            f"{often} of experiments in a single statistic, and about g = "
            f"{test['detectable_g_among_all']:.1f} among {_of(test['tested'])}."
        )


def _cells(row: Mapping[str, Any]) -> Sequence[str]:
    a, b = row["A"], row["B"]
    return (
        row["label"],
        row["unit"],
        f"{a['n']}, {b['n']}",
        _mean_sd(a),
        _mean_sd(b),
        _number(row["difference"]),
        _interval(row["interval"], _number),
        _signed(row["g"]),
        _interval(row["g_interval"], _signed),
        p_text(row["p"]),
        p_text(row["p_family"]),
    )


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if at < _LEFT else cell.rjust(width)
            for at, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _mean_sd(side: Mapping[str, Any]) -> str:
    if side["mean"] is None:
        return _NONE
    return _number(side["mean"]) + ("" if side["sd"] is None else f" ± {side['sd']:.2g}")


def _interval(ends: Sequence[float] | None, text: Any) -> str:
    return _NONE if ends is None else f"{text(ends[0])} to {text(ends[1])}"


def _number(value: float | None) -> str:
    return _NONE if value is None else f"{value:.3g}"


def _signed(value: float | None) -> str:
    return _NONE if value is None else f"{value:.1f}"


def _sizes(document: Mapping[str, Any]) -> tuple[int, int]:
    return len(document["sets"]["A"]), len(document["sets"]["B"])


def _trials(n: int) -> str:
    return "1 trial" if n == 1 else f"{n} trials"


def _of(n: int) -> str:
    return "1 statistic" if n == 1 else f"{n} statistics"
