"""A diagnosis in words, for whoever keeps the fish."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from zfcal.diagnose.document import Findings, Sheet
from zfcal.diagnose.findings import EffectFound, Gap, Note, Screened, Verdict
from zfcal.report.contents import Statement

A_WEEK_MIN = 7 * 24 * 60
"""Nobody records for longer: the recording cannot show it at all."""

FIRES = "NEGATIVE CONTROL FIRES"
"""How the note of controls begins where one of them says yes."""

QUICK_REPLICATES = 6
SHARP_M = 1e-4
"""A quick look has no more replicates, and none of the omnibus test; positions that err by no more
are those of its theory. As in ``zfcal.diagnose.case``, which takes seconds to import."""

UNLIKE = 1e-3
"""Where p of the omnibus test is less, model and fish disagree: ``zfcal.diagnose.selection``."""


def verdict_sentence(findings: Findings) -> str:
    """Return what a diagnosis comes to, in one sentence."""
    match findings.verdict:
        case Verdict.NAMED | Verdict.TIE:
            return f"The model lacks {_lacking(findings.effects)}"
        case Verdict.UNEXPLAINED:
            return "Model and fish disagree, and no known effect explains it"
        case Verdict.UNTESTABLE:
            return f"{_minutes(findings)} of tracks are too little to say what the model lacks"
        case _:
            return f"The model lacks nothing that {_minutes(findings)} of tracks could show"


def statements(findings: Findings) -> list[Statement]:
    """Return what there is to say, a card each: the effects, what is left, the gap, how sure."""
    return [
        *_of_controls(findings),
        *(_of_effect(effect, number) for number, effect in enumerate(findings.effects, start=1)),
        *_of_rest(findings),
        *_of_gap(findings),
        *_of_chance(findings),
    ]


def fired_control(findings: Findings) -> str:
    """Return what the note says where a negative control fires; nothing where all are silent."""
    note = _note(findings, "controls")
    return note.says if note is not None and note.says.startswith(FIRES) else ""


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


def _lacking(effects: Sequence[EffectFound]) -> str:
    if len(effects) == 1 and effects[0].ties:
        return f"{_with_ties(effects[0])}: they cannot be distinguished in this recording"
    parts = [
        f"either {_with_ties(effect)}, which cannot be distinguished in this recording,"
        if effect.ties
        else effect.name
        for effect in effects
    ]
    return _listed(parts).replace(",,", ",").removesuffix(",")


def _note(findings: Findings, name: str) -> Note | None:
    return next((note for note in findings.notes if note.name == name), None)


def _noted(findings: Findings, name: str, key: str) -> float:
    """Return a number of a note; NaN where there is none."""
    note = _note(findings, name)
    return math.nan if note is None else note.values.get(key, math.nan)


def _of_controls(findings: Findings) -> Iterator[Statement]:
    says = fired_control(findings)
    if says:
        yield Statement(
            question="Warning",
            answer=f"{says} A control tests for something that no tank has. If it is found, the "
            "tracks, the assumed noise or the model are wrong.",
            figure=("Do not trust this page", "a negative control fires"),
            warns=True,
        )


def _of_effect(effect: EffectFound, number: int) -> Statement:
    parts = [effect.says, *_whither(effect.strength)]
    if effect.ties:
        parts.append(f"On this recording it cannot be distinguished from {_listed(effect.ties)}.")
    parts.append(f"By chance alone in {_percent(effect.p)} of recordings.")
    gain = f"{effect.gain_nats_per_step:+.4f} nats"
    return Statement(
        question=f"{number}. {_with_ties(effect)}",
        answer=" ".join(parts),
        figure=(gain, "log likelihood per step that it adds, held out"),
    )


def _whither(values: Mapping[str, float]) -> Iterator[str]:
    """Tell in which direction an effect goes, or where its place is; maps have y upwards."""
    if "direction_rad" in values:
        away = values.get("strength", 0.0) < 0.0
        degrees = round(math.degrees(values["direction_rad"]) + 180 * away) % 360
        yield f"It goes toward {degrees}° on the map: 0° is to the right, 90° up."
    if "x_m" in values and "y_m" in values:
        reach = f", and it reaches {values['reach_m']:.2f} m" if "reach_m" in values else ""
        yield f"The place is at x = {values['x_m']:.2f} m, y = {values['y_m']:.2f} m{reach}."


def _of_rest(findings: Findings) -> Iterator[Statement]:
    """Tell whether the model with all effects that were named still fails."""
    p = _noted(findings, "omnibus", "p")
    if not findings.effects or math.isnan(p):
        return
    several = len(findings.effects) > 1
    yield Statement(question="Is anything left?", answer=_rest(findings, p, several=several))


def _rest(findings: Findings, p: float, *, several: bool) -> str:
    it = "them" if several else "it"
    if not _has_null(findings):
        return (
            f"A quick look cannot show whether the model with {it} is right, unless positions "
            "are known to be sharp. Run zfcal diagnose without --quick."
        )
    if p >= UNLIKE:
        return (
            f"With {it} in the model, nothing is left that the ranks of headings and speeds "
            f"could show (by chance alone in {_percent(p)} of recordings). A rank says where a "
            "step falls among all that the model could have done."
        )
    return (
        f"Yes: with {it} in the model, model and fish still disagree (by chance alone in "
        f"{_percent(p)} of recordings). {_forms(several=several)}"
    )


def _forms(*, several: bool) -> str:
    if several:
        return (
            "The effects are there, but the true form of one may not be ours: its fitted size is "
            "then that of our form. Or another effect is beside them."
        )
    return (
        "The effect is there, but its true form may not be ours: its fitted size is then that of "
        "our form. Or another effect is beside it."
    )


def _has_null(findings: Findings) -> bool:
    """Tell whether the omnibus test was held against what a right model gives."""
    replicates = _noted(findings, "null", "replicates")
    return replicates > QUICK_REPLICATES or _noted(findings, "noise", "noise_m") <= SHARP_M


def _percent(p: float) -> str:
    if math.isnan(p):
        return "an unknown share"
    return f"{100 * p:.2g} %" if p >= 1e-4 else "less than 0.01 %"


def _of_gap(findings: Findings) -> Iterator[Statement]:
    by_name = {each.measure: each for each in findings.gap}
    likelihood = by_name.get("nats_per_step")
    if likelihood is None or math.isnan(likelihood.closed):
        return
    note = _note(findings, "extended")
    low, high = likelihood.interval
    is_open = low <= 0 and high >= 1
    share = f"{100 * likelihood.closed:.0f} %"
    added = "On minutes that neither fit has seen, adding it closes"
    if note is not None:
        added = f"{note.says} On minutes that neither fit has seen, what was added closes"
    yield Statement(
        question=f"How much better is the model with {'it' if note is None else 'what was added'}?",
        answer=f"{added} {_unsure(likelihood) if is_open else _closed(likelihood)} Only sizes "
        "were fitted without these minutes: a diagnosis chooses its effects on all.",
        figure=("unknown", "share of the gap closed, held out")
        if is_open
        else (share, "of the gap closed, held out"),
    )


def _unsure(gap: Gap) -> str:
    low, high = gap.interval
    return (
        f"anything from {100 * low:.0f} to {100 * high:.0f} % of the gap in likelihood, so none "
        "or all of it: they are too few, or the gap is too small, to say."
    )


def _closed(gap: Gap) -> str:
    said = f"{100 * gap.closed:.0f} %{shares(gap.interval)} of the gap in likelihood"
    if not math.isnan(gap.placebo):
        said += f"; a wrong effect with as many parameters, {100 * gap.placebo:.0f} %"
    return f"{said}."


def shares(ends: tuple[float, float]) -> str:
    """Return an interval of shares in per cent; nothing where it is not known."""
    low, high = ends
    return "" if math.isnan(low) else f" ({100 * low:.0f} to {100 * high:.0f})"


def _of_chance(findings: Findings) -> Iterator[Statement]:
    if not findings.screened:
        return
    asked = [each for each in findings.screened if not math.isnan(each.z)]
    found = {effect.name for effect in findings.effects}
    others = [each for each in asked if each.name not in found]
    waiting = [each for each in others if each.minutes_needed is not None]
    rest = [each for each in others if each.minutes_needed is None]
    said = [f"{len(asked)} candidates were tested."]
    if rest:
        loudest = max(rest, key=lambda each: abs(each.z))
        said.append(f"Of those not missing the loudest is {loudest.name}, z = {loudest.z:.1f}.")
    if waiting:
        said.append(_too_short(waiting))
    lacking = [f"{each.name} ({each.lacks})" for each in findings.screened if each.lacks]
    if lacking:
        said.append(f"What the recording lacks: {'; '.join(lacking)}.")
    yield Statement(question="What else was tested?", answer=" ".join(said))


def _too_short(waiting: Sequence[Screened]) -> str:
    """Tell which effects a recording is too short to show, and what would do for one of them."""
    names = _listed([each.name for each in waiting])
    soonest = min(waiting, key=lambda each: each.minutes_needed or 0.0)
    minutes = soonest.minutes_needed or 0.0
    enough = (
        f"{minutes:.0f} min would do for {soonest.name}"
        if minutes < A_WEEK_MIN
        else "a week would not do"
    )
    return f"This recording is too short to show these where they are faint: {names}; {enough}."
