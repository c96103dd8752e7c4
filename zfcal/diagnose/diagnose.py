"""From a question to a diagnosis: fit, null, scores, features, places, verdict."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from zfcal.arrays import Floats
from zfcal.diagnose.answers import effect_found, screened_of, verdict_of
from zfcal.diagnose.beyond import Unfeatured
from zfcal.diagnose.candidates import Candidate, in_model
from zfcal.diagnose.case import (
    QUICK_REPLICATES,
    Case,
    has_noise,
    is_sharp,
    is_suspicious,
    open_case,
)
from zfcal.diagnose.confirming import confirm
from zfcal.diagnose.controls import ask_controls
from zfcal.diagnose.findings import Diagnosis, Located
from zfcal.diagnose.heading_look import curves_of, heading_look
from zfcal.diagnose.located import Residuals, centre_and_spread, located
from zfcal.diagnose.looks import Found, clearest_first
from zfcal.diagnose.naming import ties_of
from zfcal.diagnose.notes import noise_note, notes_of
from zfcal.diagnose.null import Null, from_replicates, run_null, theory
from zfcal.diagnose.omnibus import Omnibus, judge
from zfcal.diagnose.question import Question, Tell
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.selection import LEVEL, Asked, best_of
from zfcal.diagnose.speed_look import gone_given, speed_look
from zfcal.diagnose.together import together

_AT_LARGE_REPLICATES = 20
"""Replicates that are asked in general as well: where, and whether at all."""

_QUICK_Z = 2.5
"""Where positions are not sharp, a quick answer holds what is larger than that against a few
replicates."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Row:
    """What one replicate says, or the measured tracks themselves."""

    listed: Floats
    controls: Floats | None
    at_large: tuple[Residuals, dict[str, float]] | None


def diagnose(question: Question, tell: Tell) -> Diagnosis:
    """Return where a model and measured tracks disagree, and which effects are missing.

    Parameters
    ----------
    question
        Model, tracks, and how sure the answer is to be.
    tell
        Hears how far it is.

    Raises
    ------
    InputError
        There are no fish, or too few of their steps have a heading.
    """
    tell("fitting", 0, 1)
    case = open_case(question)
    question = case.question
    tell("fitting", 1, 1)
    scores, own = together(
        lambda: ask_all(case.screen, case.listed, question.n_workers),
        lambda: case.at_large(0, case.screen),
        n_workers=question.n_workers,
    )
    asked = _asked(question, scores)
    rows = _null_rows(case, asked, tell)
    omnibus = _omnibus(question, own[1], rows)
    listed = Asked(
        candidates=case.listed, held=asked, null=_null([row.listed for row in rows], len(asked))
    )
    unfeatured = Unfeatured(
        case=case,
        listed=listed,
        screened=tuple(best_of(listed, scores)),
        suspicious=is_suspicious(question, omnibus),
    )
    found, where = together(
        lambda: _looked(case, unfeatured, tell),
        lambda: _where(own[0], rows),
        n_workers=question.n_workers,
    )
    return _diagnosis(case, rows, unfeatured, found, where)


def _looked(case: Case, unfeatured: Unfeatured, tell: Tell) -> Found:
    """Return what is missing of the law of speeds, and then of that of headings.

    Where headings turn out to depend on the speed, speeds may depend on all that turns fish. What
    they show no more once the turn is given is not named.
    """
    tell("asking features", 0, 2)
    on_speeds = speed_look(case, unfeatured)
    tell("asking features", 1, 2)
    found = heading_look(case, on_speeds, unfeatured)
    on_headings = found.steps[len(on_speeds.steps) :]
    named = [step.choice.best.candidate.effect for step in on_headings]
    joint = [effect for effect in named if effect.paces_given]
    gone = gone_given(on_speeds, case.screen, joint) if joint else []
    if gone:
        found = heading_look(case, speed_look(case, unfeatured, gone), unfeatured)
    tell("asking features", 2, 2)
    return found


def _omnibus(question: Question, own: Mapping[str, float], rows: Sequence[_Row]) -> Omnibus:
    nulls = [row.at_large[1] for row in rows if row.at_large]
    return judge(own, nulls, sharp=is_sharp(question))


def _asked(question: Question, scores: Sequence[Score]) -> tuple[Candidate, ...]:
    """Return which effects are held against replicates, each at its best shape.

    A quick answer asks those alone that would be taken for missing, and what is near that.
    """
    best = _best_shapes(scores)
    if not question.quick:
        return tuple(candidate for _, candidate in best)
    clear = -ndtri(LEVEL / 2 / max(len(scores), 1))
    if not has_noise(question) or not any(z > clear for z, _ in best):
        return ()
    return tuple(candidate for z, candidate in best if z > _QUICK_Z)


def _best_shapes(scores: Sequence[Score]) -> list[tuple[float, Candidate]]:
    """Return each effect at the shape that the recording asks for most, after its z."""
    best: dict[str, tuple[float, Candidate]] = {}
    for score in scores:
        z = score.clearness
        if score.candidate.name not in best or z > best[score.candidate.name][0]:
            best[score.candidate.name] = (z, score.candidate)
    return list(best.values())


def _null_rows(case: Case, asked: Sequence[Candidate], tell: Tell) -> list[_Row]:
    question = case.question
    if not asked:
        return []
    n_at_large = 0 if question.quick else _AT_LARGE_REPLICATES

    def ask(number: int, screen: Screen) -> _Row:
        return _Row(
            listed=np.array([screen.ask(each).z for each in asked]),
            controls=None if question.quick else ask_controls(screen, question.seed),
            at_large=case.at_large(number + 1, screen) if number < n_at_large else None,
        )

    n = QUICK_REPLICATES if question.quick else question.n_null
    return run_null(
        case.chain,
        ask,
        range(n),
        n_workers=question.n_workers,
        done=lambda done: tell("null replicates", done, n),
    )


def _null(rows: Sequence[Floats], n_statistics: int) -> Null:
    return from_replicates(np.array(rows)) if len(rows) > 2 else theory(n_statistics)


def _diagnosis(
    case: Case,
    rows: Sequence[_Row],
    unfeatured: Unfeatured,
    found: Found,
    where: tuple[Located, ...],
) -> Diagnosis:
    steps, question = found.steps, case.question
    final = found.screen(case.screen)
    (confirmed, halves), (own, curves) = together(
        lambda: confirm(case.screen, steps, n_workers=question.n_workers),
        lambda: (
            case.ranks(0, final),
            curves_of(case, steps, without_noise=found.without_noise),
        ),
        n_workers=question.n_workers,
    )
    omnibus = _omnibus(question, own, rows)
    made = [
        effect_found(step, held, ties_of(step.choice, [each.choice for each in steps[n:]]), curve)
        for n, (step, held, curve) in enumerate(zip(steps, confirmed, curves, strict=True), start=1)
    ]
    effects = tuple(made[n] for n in clearest_first(steps))
    # What stands out beside effects that the model has, and has no name, is theirs.
    is_left_over = unfeatured.stands_out and bool(in_model(case.screen.fitted.parameters))
    suspicious = found.suspicious or is_left_over or is_suspicious(question, omnibus)
    if found.without_noise:
        question = dataclasses.replace(
            question, noise_m=0.0, noise_source="the law of headings, with what was found"
        )
    screened = screened_of(case, unfeatured.screened)
    return Diagnosis(
        verdict=verdict_of(effects, screened, suspicious=suspicious),
        where=where,
        effects=effects,
        screened=screened,
        notes=(
            noise_note(question, found.hidden),
            *notes_of(question, final, halves, omnibus, [row.controls for row in rows]),
        ),
        base=case.screen.fitted.parameters,
        extended=final.fitted.parameters,
        minutes=case.scene.duration_s / 60,
        n_steps=len(case.scene.turns),
    )


def _where(own: Residuals, rows: Sequence[_Row]) -> tuple[Located, ...]:
    nulls = [row.at_large[0] for row in rows if row.at_large]
    return located(own, *centre_and_spread(own, nulls)) if nulls else located(own)
