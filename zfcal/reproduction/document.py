"""What a reproduction has found, as numbers for people and programs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from zfcal.artifacts.lineage import JSON, Lineage
from zfcal.report.comparison.power import ALPHA, POWER
from zfcal.report.numbers import mean_and_sd
from zfcal.reproduction.courses import FEATURES, Course
from zfcal.reproduction.reference import Reference
from zfcal.reproduction.verdict import Compared, Verdict, compare_all, error_of, judge

SCHEMA = "zfcal.reproduction/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """One way of computing scores, on all trials.

    Parameters
    ----------
    name
        What it is called.
    courses
        Of each trial, by its name.
    """

    name: str
    courses: Mapping[str, Course]

    @property
    def ends_s(self) -> list[int]:
        """The seconds at which windows end."""
        return sorted({end_s for course in self.courses.values() for _, end_s in course})

    def values(self, feature: str, end_s: int) -> list[float]:
        """Return a score of one window in each trial that has it."""
        found = (course.get((feature, end_s), math.nan) for course in self.courses.values())
        return [value for value in found if not math.isnan(value)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """One score at the end of one window, over trials; NaN where there is none.

    Parameters
    ----------
    feature, end_s
        Which score, and when.
    n
        Trials.
    mean, sd
        Ours.
    published
        The published mean.
    difference, standard_error
        Ours less the published one; where no standard deviation was published it is taken to be
        ours.
    """

    feature: str
    end_s: int
    n: int
    mean: float
    sd: float
    published: float
    difference: float
    standard_error: float


def intervals_of(way: Way, reference: Reference) -> list[Interval]:
    """Return every score of every window beside the published one, in the order of time."""
    return [
        _interval(way, reference, feature, end_s)
        for end_s in way.ends_s
        for feature in FEATURES
        if way.values(feature, end_s)
    ]


def _interval(way: Way, reference: Reference, feature: str, end_s: int) -> Interval:
    values = way.values(feature, end_s)
    n, (mean, sd) = len(values), mean_and_sd(values)
    published = reference.published(feature, end_s)
    error, _ = error_of(sd, n, math.nan, reference.n_trials)
    return Interval(
        feature=feature,
        end_s=end_s,
        n=n,
        mean=mean,
        sd=sd,
        published=published,
        difference=mean - published,
        standard_error=math.nan if math.isnan(published) else error,
    )


def judged(way: Way, reference: Reference) -> tuple[list[Compared], Verdict]:
    """Return all contrasts of a way, and the verdict over them."""
    compared = compare_all(reference, way.courses)
    return compared, judge(compared)


def document_of(
    ways: Sequence[Way],
    reference: Reference,
    lineage: Lineage,
    *,
    further: Mapping[str, JSON],
    files: Mapping[str, str],
) -> dict[str, Any]:
    """Return a reproduction as one document; the verdict is that of the first way.

    Parameters
    ----------
    ways
        At least one.
    reference
        What was published.
    lineage
        Of the reproduction.
    further
        What else there is to say, such as the statements that a twin is held against.
    files
        SHA-256 of table and picture, by name.

    Returns
    -------
    dict
        Fits ``schemas/reproduction.schema.json``; what is not known is null.
    """
    origin = lineage.as_dict()
    del origin["schema"]
    return {
        "schema": SCHEMA,
        "verdict": judged(ways[0], reference)[1],
        "reference": {
            "source": reference.source,
            "n_trials": reference.n_trials,
            "scoring": reference.scoring,
            "margin": reference.margin,
            "level": ALPHA,
            "power": POWER,
        },
        "ways": [_way(way, reference) for way in ways],
        **further,
        "files": dict(files),
        "lineage": origin,
    }


def _way(way: Way, reference: Reference) -> dict[str, Any]:
    compared, verdict = judged(way, reference)
    return {
        "name": way.name,
        "trials": list(way.courses),
        "verdict": verdict,
        "contrasts": [_contrast(each) for each in compared],
        "intervals": [
            {name: _plain(getattr(each, name)) for name in Interval.__slots__}
            for each in intervals_of(way, reference)
        ],
    }


def _contrast(compared: Compared) -> dict[str, Any]:
    contrast = compared.contrast
    own = ("name", "feature", "from_s", "to_s")
    numbers = [name for name in Compared.__slots__ if name != "contrast"]
    return {
        **{name: _plain(getattr(contrast, name)) for name in own},
        "published": contrast.value,
        **{name: _plain(getattr(compared, name)) for name in numbers},
        "is_within_margin": compared.is_within,
    }


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def intervals_csv(ways: Sequence[Way], reference: Reference) -> str:
    """Return all intervals of all ways as CSV, a row each; what is not known is empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["way", *Interval.__slots__])
    for way in ways:
        for each in intervals_of(way, reference):
            values = [getattr(each, name) for name in Interval.__slots__]
            writer.writerow([way.name, *(_cell(value) for value in values)])
    return out.getvalue()


def _cell(value: float | str) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return str(value)


def lines_of(document: Mapping[str, Any]) -> list[str]:
    """Return what was found as texts for a terminal, one for each way and each statement.

    Per window S beside the published one, then each contrast with what these trials could show.

    Parameters
    ----------
    document
        As `document_of` returns it.
    """
    found = [_way_text(way, document["reference"]) for way in document["ways"]]
    return [*found, *(_statement_text(each) for each in document.get("statements", ()))]


def _way_text(way: Mapping[str, Any], reference: Mapping[str, Any]) -> str:
    lines = [f"{way['name']}, {_count(len(way['trials']))}:"]
    lines += [
        f"  window to {each['end_s']:>5} s  S {_spread(each)}{_beside(each)}"
        for each in way["intervals"]
        if each["feature"] == "S"
    ]
    lines += [f"  {line}" for each in way["contrasts"] for line in _contrast_lines(each, reference)]
    return "\n".join([*lines, f"  verdict: {way['verdict']}"])


def _count(n: int) -> str:
    return "1 trial" if n == 1 else f"{n} trials"


def _spread(each: Mapping[str, Any]) -> str:
    return f"{each['mean']:.3f}" + ("" if each["sd"] is None else f" ± {each['sd']:.3f}")


def _beside(each: Mapping[str, Any]) -> str:
    if each["published"] is None:
        return ""
    error = "" if each["standard_error"] is None else f" (se {each['standard_error']:.3f})"
    return f"   published {each['published']:.3f}   difference {each['difference']:+.3f}{error}"


def _contrast_lines(each: Mapping[str, Any], reference: Mapping[str, Any]) -> list[str]:
    mean = "none" if each["mean"] is None else f"{each['mean']:.3f}"
    head = f"{each['name']}: {each['feature']} {mean}, published {each['published']:.3f}"
    n = _count(each["n"])
    if each["standard_error"] is None:
        return [f"{head}; with {n} there is no standard error, and no verdict"]
    span = f"{each['difference']:+.3f} ({each['low']:+.3f} to {each['high']:+.3f})"
    shown = f"{each['smallest_shown']:.3f} with a probability of {reference['power']:g}"
    margin = f"one of the margin, {reference['margin']:g}, with {each['power']:.2f}"
    return [
        f"{head}, difference {span}, p {each['p']:.2g}",
        f"  {n} show a difference of {shown}; {margin}",
    ]


def _statement_text(each: Mapping[str, Any]) -> str:
    mean = "none" if each["mean"] is None else f"{each['mean']:+.3f}"
    span = "" if each["low"] is None else f" ({each['low']:+.3f} to {each['high']:+.3f})"
    return f"{each['way']}: {each['says']}: {each['holds']}; {each['measured']} {mean}{span}"
