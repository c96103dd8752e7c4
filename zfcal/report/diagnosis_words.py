"""A diagnosis in words and tables, for whoever keeps the fish."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from zfcal.diagnose.document import Findings, Sheet
from zfcal.diagnose.findings import EffectFound, Gap, Verdict
from zfcal.report.diagnosis_overview import MEASURES
from zfcal.report.numbers import Table
from zfcal.report.summary import Statement

_NONE = "–"
_MOST_OPEN = 12
"""A longer table is folded."""

_A_WEEK_MIN = 7 * 24 * 60
"""Nobody records for longer: the recording cannot show it at all."""


def verdict_sentence(findings: Findings) -> str:
    """Return what a diagnosis comes to, in one sentence."""
    match findings.verdict:
        case Verdict.NAMED:
            names = [_with_ties(effect) for effect in findings.effects]
            return f"The model lacks {_listed(names)}"
        case Verdict.TIE:
            best = findings.effects[0]
            others = " or ".join((best.name, *best.ties))
            return f"The model lacks {others}: this recording cannot tell them apart"
        case Verdict.UNEXPLAINED:
            return "Model and fish disagree, and no known effect explains it"
        case Verdict.UNTESTABLE:
            return f"{_minutes(findings)} of tracks are too little to say what the model lacks"
        case _:
            return f"The model lacks nothing that {_minutes(findings)} of tracks could show"


def statements(findings: Findings) -> list[Statement]:
    """Return what there is to say, a card each: the effects, the gap, how sure."""
    return [
        *(_of_effect(effect, number) for number, effect in enumerate(findings.effects, start=1)),
        *_of_gap(findings.gap),
        *_of_chance(findings),
    ]


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


def facts(sheet: Sheet) -> str:
    """Return the trial, the model and the recording in a line."""
    findings = sheet.findings
    return (
        f"Trial {sheet.trial}; model {sheet.model}; arena {sheet.arena.name}; "
        f"{_minutes(findings)} of tracks, {findings.n_steps} steps with a heading."
    )


def _minutes(findings: Findings) -> str:
    return "The" if math.isnan(findings.minutes) else f"{findings.minutes:.3g} min"


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _with_ties(effect: EffectFound) -> str:
    return " or ".join((effect.name, *effect.ties))


def _of_effect(effect: EffectFound, number: int) -> Statement:
    parts = [effect.says]
    if effect.ties:
        parts.append(f"On this recording it cannot be told from {_listed(effect.ties)}.")
    parts.append(f"By chance alone in {_percent(effect.p)} of recordings.")
    gain = f"{effect.gain_nats_per_step:+.4f} nats"
    return Statement(
        question=f"{number}. {_with_ties(effect)}",
        answer=" ".join(parts),
        figure=(gain, "log likelihood per step that it adds, held out"),
    )


def _percent(p: float) -> str:
    if math.isnan(p):
        return "an unknown share"
    return f"{100 * p:.2g} %" if p >= 1e-4 else "less than 0.01 %"


def _of_gap(gap: Sequence[Gap]) -> Iterator[Statement]:
    by_name = {each.measure: each for each in gap}
    likelihood = by_name.get("nats_per_step")
    if likelihood is None or math.isnan(likelihood.closed):
        return
    question = "How much better is the model with it?"
    low, high = likelihood.interval
    if low <= 0 and high >= 1:
        yield Statement(
            question=question,
            answer="On minutes that neither fit has seen, adding it closes anything from "
            f"{100 * low:.0f} to {100 * high:.0f} % of the gap in likelihood, so none or all of "
            "it: they are too few, or the gap is too small, to say.",
            figure=("unknown", "share of the gap closed, held out"),
        )
        return
    answer = (
        f"On minutes that neither fit has seen, adding it closes "
        f"{100 * likelihood.closed:.0f} %{_shares(likelihood.interval)} of the gap in likelihood"
    )
    if not math.isnan(likelihood.placebo):
        answer += f"; a wrong effect with as many parameters, {100 * likelihood.placebo:.0f} %"
    yield Statement(
        question=question,
        answer=f"{answer}.",
        figure=(f"{100 * likelihood.closed:.0f} %", "of the gap closed, held out"),
    )


def _shares(ends: tuple[float, float]) -> str:
    low, high = ends
    return "" if math.isnan(low) else f" ({100 * low:.0f} to {100 * high:.0f})"


def _of_chance(findings: Findings) -> Iterator[Statement]:
    asked = [each for each in findings.screened if not math.isnan(each.z)]
    untestable = [each for each in findings.screened if math.isnan(each.z)]
    if not findings.screened:
        return
    found = {effect.name for effect in findings.effects}
    rest = [each for each in asked if each.name not in found]
    said = [f"{len(asked)} candidates were asked for."]
    if rest:
        loudest = max(rest, key=lambda each: abs(each.z))
        said.append(f"Of those not missing the loudest is {loudest.name}, z = {loudest.z:.1f}.")
    waiting = [each for each in untestable if each.minutes_needed is not None]
    if waiting:
        soonest = min(waiting, key=lambda each: each.minutes_needed or 0.0)
        said.append(
            f"Asking needs a longer recording for {_listed([each.name for each in waiting])}: "
            f"at least {_needed(soonest.minutes_needed)} min for {soonest.name}."
        )
    lacking = [f"{each.name} ({each.lacks})" for each in untestable if each.lacks]
    if lacking:
        said.append(f"What the recording lacks: {'; '.join(lacking)}.")
    yield Statement(question="What else was asked?", answer=" ".join(said))


def _number(value: float, digits: int = 3) -> str:
    return _NONE if math.isnan(value) else f"{value:.{digits}g}"


def _needed(minutes: float | None) -> str:
    if minutes is None:
        return _NONE
    return f"{minutes:.0f}" if minutes < _A_WEEK_MIN else f"over {_A_WEEK_MIN:,}"


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
            *(_number(value) for value in (each.before, each.after, each.floor)),
            _NONE if math.isnan(each.closed) else f"{100 * each.closed:.0f} %",
            _shares(each.interval).strip(" ()") or _NONE,
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
        note="Held-out minutes. The floor is the model with the effects against itself: for the "
        "likelihood what it would score if the fish drew from it, under the same luck; for the "
        "others its ceiling. Where there may be no gap to close, there is no share.",
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
