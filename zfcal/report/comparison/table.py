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
    said = [_verdict(document), _how(document), *_power(document)]
    if not document["test"]["tested"]:
        return said
    reasons: dict[str, list[str]] = {}
    for row in document["statistics"]:
        if row["untested"]:
            reasons.setdefault(row["untested"], []).append(row["name"])
    return said + [f"Not tested: {', '.join(names)}: {why}." for why, names in reasons.items()]


def missing_lines(document: Mapping[str, Any]) -> list[str]:
    """Return which trials are left out of which rows, those of one reason in a sentence."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for each in document["missing"]:
        reasons.setdefault((", ".join(each["statistics"]), each["why"]), []).append(each["trial"])
    return [
        f"Left out of {names}: {', '.join(trials)}: {why}."
        for (names, why), trials in reasons.items()
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
            f"Nothing is tested: there are {n_a} and {_trials(n_b)}, and a test needs "
            f"{test['least_trials']} on each side that have a statistic. The table describes "
            "these trials."
        )
    found = [
        row
        for row in document["statistics"]
        if row["p_family"] is not None and row["p_family"] <= test["alpha"]
    ]
    if not found:
        return (
            f"No difference is found in {_of(test['tested'])} together. That is no proof that the "
            "sets are alike: the intervals say how far apart they may be."
        )
    names = ", ".join(f"{row['name']} (p {p_text(row['p_family'])})" for row in found)
    return f"A and B differ, over {_of(test['tested'])} together, in {names}."


def _how(document: Mapping[str, Any]) -> str:
    test = document["test"]
    n_a, n_b = _sizes(document)
    least = f"{test['smallest_p']:.2g}"
    if not test["tested"]:
        return (
            f"With {n_a} and {n_b} trials no p by relabelling could be below {least}, however "
            "large a difference is."
            if min(n_a, n_b) < test["least_trials"]
            else "There are trials enough, but in no row of the table."
        )
    ways = "all there are" if test["exact"] else f"by chance, seed {test['seed']}"
    return (
        f"p: {test['relabellings']} relabellings of whole trials, {ways}; the smallest p is "
        f'{least}. "p of all" is over all statistics together and the one to judge by.'
    )


def _power(document: Mapping[str, Any]) -> Iterator[str]:
    test = document["test"]
    n_a, n_b = _sizes(document)
    often = f"{100 * test['power']:.0f} % of experiments"
    if test["tested"]:
        yield (
            f"With {n_a} and {n_b} trials a difference of about g = {test['detectable_g']:.1f} "
            f"in a single statistic is found in {often}, and about g = "
            f"{test['detectable_g_among_all']:.1f} among {_of(test['tested'])}."
        )
        return
    if test["detectable_g_by_t"] is not None:
        yield (
            f"A t test, which trusts that trials are normal, would find g = "
            f"{test['detectable_g_by_t']:.1f} with these in {often}."
        )
    least = test["least_trials"]
    yield (
        f"With {least} trials on each side about g = {test['detectable_g_with_least']:.1f} in a "
        f"single statistic is found in {often}; smaller differences need more trials."
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
        _effect(row["g"]),
        _interval(row["g_interval"], _effect),
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


def _effect(value: float | None) -> str:
    return _NONE if value is None else f"{round(value, 1) + 0.0:.1f}"


def _sizes(document: Mapping[str, Any]) -> tuple[int, int]:
    return len(document["sets"]["A"]), len(document["sets"]["B"])


def _trials(n: int) -> str:
    return "1 trial" if n == 1 else f"{n} trials"


def _of(n: int) -> str:
    return "1 statistic" if n == 1 else f"{n} statistics"
