"""A diagnosis in tables, for whoever wants every number."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from zfcal.diagnose.document import Findings, Sheet
from zfcal.diagnose.findings import Gap
from zfcal.report.diagnosis.overview import MEASURES
from zfcal.report.diagnosis.words import A_WEEK_MIN, shares
from zfcal.report.numbers import Table

_NONE = "–"
_MOST_OPEN = 12
"""A longer table is folded."""

_DIGITS = 5
"""Of a gap: what an effect adds to the likelihood of a step is a thousandth of it."""


def tables(sheet: Sheet) -> list[Table]:
    """Return the tables of the page, empty ones left out."""
    findings = sheet.findings
    made = (
        _gap_table(findings.gap),
        _where_table(findings),
        _screened_table(findings),
        _notes_table(findings),
        _lineage_table(sheet.provenance),
    )
    return [table for table in made if table.rows]


def _number(value: float, digits: int = 3) -> str:
    return _NONE if math.isnan(value) else f"{value:.{digits}g}"


def _needed(minutes: float | None) -> str:
    if minutes is None:
        return _NONE
    return f"{minutes:.0f}" if minutes < A_WEEK_MIN else f"over {A_WEEK_MIN:,}"


def _folded(n: int, what: str) -> str:
    return "" if n <= _MOST_OPEN else f"{n} {what}"


def _where_table(findings: Findings) -> Table:
    rows = [
        [
            each.statistic,
            each.zone or "whole tank",
            f"{each.time_s[0]:.0f} to {each.time_s[1]:.0f}",
            "all" if each.agents is None else ", ".join(map(str, each.agents)),
            *(_number(value) for value in (each.observed, each.expected)),
            _number(each.z, 2),
            _number(each.q, 2),
        ]
        for each in findings.where
    ]
    return Table(
        name="where",
        title="Where they disagree",
        heads=("statistic", "zone", "time (s)", "tracks", "measured", "expected", "z", "q"),
        rows=rows,
        numbers=(4, 5, 6, 7),
        folded=_folded(len(rows), "disagreements"),
        note="Measured against what the model expects, given where everybody was. q is the share "
        "of false ones among all that are listed up to this one.",
    )


def _screened_table(findings: Findings) -> Table:
    ordered = sorted(
        findings.screened, key=lambda each: -abs(0.0 if math.isnan(each.z) else each.z)
    )
    rows = [
        [
            each.name,
            _number(each.z, 2),
            _number(each.p, 2),
            _needed(each.minutes_needed),
            each.lacks or _NONE,
        ]
        for each in ordered
    ]
    return Table(
        name="candidates",
        title="Every candidate",
        heads=("effect", "z", "p", "minutes needed", "lacks"),
        rows=rows,
        numbers=(1, 2, 3),
        wide=(4,),
        folded=_folded(len(rows), "candidates"),
        note="p is over the whole family: the chance that any of them stands out so far.",
    )


def _gap_table(gap: Sequence[Gap]) -> Table:
    rows = [
        [
            MEASURES[each.measure],
            *(_number(value, _DIGITS) for value in (each.before, each.after, each.floor)),
            _NONE if math.isnan(each.closed) else f"{100 * each.closed:.0f} %",
            shares(each.interval).strip(" ()") or _NONE,
            _NONE if math.isnan(each.placebo) else f"{100 * each.placebo:.0f} %",
        ]
        for each in gap
    ]
    return Table(
        name="gap-numbers",
        title="Before and after in numbers",
        heads=("measure", "before", "after", "floor", "closed", "95 %", "placebo"),
        rows=rows,
        numbers=(1, 2, 3, 4, 5, 6),
        note="Held-out minutes. Likelihood and the effect itself are of the models as fitted, "
        "before they are calibrated; the others are of the calibrated models. The floor is the "
        "model with the effects against itself: for the likelihood what it would score if the "
        "fish drew from it, under the same luck; for the effect itself what chance leaves; for "
        "the others its ceiling. Where there may be no gap to close, there is no share.",
    )


def _notes_table(findings: Findings) -> Table:
    rows = [
        [
            note.name,
            note.says,
            ", ".join(f"{key} = {_number(value)}" for key, value in note.values.items()),
        ]
        for note in findings.notes
    ]
    return Table(
        name="notes",
        title="What bears on the verdict",
        heads=("about", "what", "numbers"),
        rows=rows,
        wide=(1, 2),
    )


def _lineage_table(provenance: Mapping[str, object]) -> Table:
    lineage = provenance.get("lineage")
    inputs = lineage.get("inputs", {}) if isinstance(lineage, Mapping) else {}
    rows = [[name, str(digest)[:12]] for name, digest in inputs.items()]
    return Table(
        name="sources",
        title="Files",
        heads=("file", "SHA-256"),
        rows=rows,
        folded=f"{len(rows)} files",
    )
