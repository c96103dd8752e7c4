"""What one finished trial of the diagnosis says, and whether it is so.

Pure functions of the rows of `trial.run`. A share is never without its n.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from scipy.stats import binomtest

from benchmarks.diagnosis.plan import ALONE, LENGTHS, LISTED_SECTION, STRENGTHS

Row = Mapping[str, Any]
Rate = dict[str, Any]

NOTHING, TIE, BEYOND = "nothing", "tie", "beyond the list"
ERROR = "error"
SILENT = ("no-effect", "untestable", ERROR)
"""Verdicts that claim nothing; failures are counted by themselves."""

NAMELESS = (TIE, BEYOND, "unexplained", *SILENT)
"""Answers that are no effect's name."""

DESCRIBES = {
    "waxing-walls": ("wall-persistence",),
    "startle": ("burst-and-coast", "speed-matching"),
    "sound": ("place-preference",),
    "kept-distance": (),
    "one-eye": (),
    "lit-room": (),
}
"""Listed names that describe a part, at least, of an effect outside the list."""

FATES = ("right", "tie", "silent", "wrong")
"""What comes of a trial of a further form."""

SINGLE = (LISTED_SECTION, LENGTHS, STRENGTHS, ALONE)
"""Sections that hide one listed effect in each trial."""


def rate(n_hits: int, n: int) -> Rate:
    """Return a share with Wilson's 95 % interval; all None where n is 0."""
    if n == 0:
        return {"hits": 0, "n": 0, "share": None, "low": None, "high": None}
    interval = binomtest(n_hits, n).proportion_ci(0.95, method="wilson")
    low, high = round(float(interval.low), 4), round(float(interval.high), 4)
    return {"hits": n_hits, "n": n, "share": round(n_hits / n, 4), "low": low, "high": high}


def rate_of(rows: Iterable[Row], holds: Callable[[Row], bool]) -> Rate:
    """Return the share of rows of which something holds."""
    told = [holds(row) for row in rows]
    return rate(sum(told), len(told))


def names(row: Row) -> list[str]:
    """Return the effects that a trial's diagnosis names, without those that are tied."""
    return [effect["name"] for effect in row["effects"] if not effect["ties"]]


def answer(row: Row) -> str:
    """Return what the diagnosis says first: a name, a tie, beyond the list, or its verdict."""
    if row["verdict"] == "named":
        name = row["effects"][0]["name"]
        return BEYOND if name.startswith("generic:") else str(name)
    return str(row["verdict"])


def truth(row: Row) -> str:
    """Return what a trial hides, in words."""
    return " and ".join(row["truth"]) or NOTHING


def is_right(row: Row) -> bool:
    """Return whether the first effect is the hidden one, and tied with no other."""
    return row["verdict"] == "named" and row["effects"][0]["name"] in row["truth"]


def is_tie_with_truth(row: Row) -> bool:
    """Return whether the first effect is tied, and the hidden one is among the tied."""
    if row["verdict"] != TIE:
        return False
    first = row["effects"][0]
    return bool({first["name"], *first["ties"]} & set(row["truth"]))


def has_wrong_name(row: Row) -> bool:
    """Return whether any effect is named, the second or third as well, that is not hidden."""
    return bool(set(names(row)) - set(row["truth"]))


def has_wrong_listed_name(row: Row) -> bool:
    """Return whether any *listed* effect is named that is not hidden."""
    wrong = set(names(row)) - set(row["truth"])
    return any(not name.startswith("generic:") for name in wrong)


def names_first_wrong(row: Row) -> bool:
    """Return whether the first effect that is named is not hidden."""
    return row["verdict"] == "named" and not is_right(row)


def says_something(row: Row) -> bool:
    """Return whether the diagnosis claims anything, be it that something is unexplained."""
    return row["verdict"] not in SILENT


def names_something(row: Row) -> bool:
    """Return whether the diagnosis names an effect or a tie."""
    return bool(row["effects"])


def misdescribes(row: Row) -> bool:
    """Return whether an effect outside the list gets a listed name that does not describe it."""
    fitting = {name for hidden in row["truth"] for name in DESCRIBES[hidden]}
    return any(not name.startswith("generic:") and name not in fitting for name in names(row))


def fitting(row: Row) -> set[str]:
    """Return the names by which what a trial hides may be called, the second choices as well."""
    return {*row["truth"], *row.get("also", ())}


def fares(row: Row) -> str:
    """Return how a trial of a further form fared, as one of `FATES`.

    A tie of names that all fit is right. A tie that holds a name that fits is a tie, as is
    a second choice by itself. All else that is said is wrong: another name, a generic one,
    a tie without it, and that something is unexplained.
    """
    if row["verdict"] in SILENT:
        return "silent"
    first = row["effects"][0] if row["effects"] else {"name": "", "ties": []}
    said = {first["name"], *first["ties"]}
    if is_right(row) or (is_tie_with_truth(row) and said <= fitting(row)):
        return "right"
    return "tie" if said & fitting(row) else "wrong"


def nats(row: Row) -> float:
    """Return the oracle's nats of what is hidden; NaN where nobody counted them."""
    return float(row["nats"]["total"]) if row.get("nats") else math.nan


def is_standard(row: Row) -> bool:
    """Return whether a trial has 30 minutes of four fish and a robot, and one listed effect."""
    asked = row["scenario"]
    usual = asked["minutes"] == 30 and asked["n_fish"] == 4 and asked["robot"]
    return row["section"] in SINGLE and bool(usual)
