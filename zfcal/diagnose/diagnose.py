"""From a question to a diagnosis: fit, null, screen, selection, places, verdict."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from zfcal.arrays import Floats
from zfcal.diagnose.answers import effect_found, screened_of, verdict_of
from zfcal.diagnose.candidates import Candidate, in_model, not_forms_of
from zfcal.diagnose.case import (
    QUICK_REPLICATES,
    Case,
    can_suspect,
    comes_and_goes,
    has_noise,
    is_sharp,
    is_suspicious,
    open_case,
)
from zfcal.diagnose.confirming import Confirmed, confirm
from zfcal.diagnose.controls import ask_controls
from zfcal.diagnose.findings import (
    Diagnosis,
    Located,
    Note,
)
from zfcal.diagnose.heats import Sampled, hopeful
from zfcal.diagnose.located import Residuals, centre_and_spread, located
from zfcal.diagnose.looks import Found
from zfcal.diagnose.naming import ties_of
from zfcal.diagnose.notes import notes_of
from zfcal.diagnose.null import (
    Null,
    from_replicates,
    run_null,
    theory,
)
from zfcal.diagnose.omnibus import Omnibus, judge
from zfcal.diagnose.question import Question, Tell
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.diagnose.second_look import curves_of, look_again
from zfcal.diagnose.selection import (
    LEVEL,
    RIVALS,
    Asked,
    Best,
    Selection,
    Selector,
    Step,
    best_of,
)
from zfcal.diagnose.together import together

_GENERIC_REPLICATES = 8
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Judged:
    """Effects that stand, of those that were selected; the omnibus test with them in the model.

    ``confirmed`` holds what held-out steps say of all that were selected, ``halves`` how far the
    fits of the two halves differ; ``without_noise`` is of `Found`.
    """

    kept: tuple[Step, ...]
    confirmed: tuple[Confirmed, ...]
    halves: Note
    omnibus: Omnibus
    suspicious: bool
    without_noise: bool = False


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
    selector = Selector(
        listed=Asked(
            candidates=case.listed,
            held=asked,
            null=_null([row.listed for row in rows], len(asked)),
        ),
        rivals=lambda sampled, known, z: _rivals(case, sampled, known, z),
        suspicious=is_suspicious(question, omnibus),
        n_workers=question.n_workers,
        given=in_model(case.screen.fitted.parameters),
        told=tell,
    )
    selection, where = together(
        lambda: selector.select(case.screen, scores),
        lambda: _where(own[0], rows),
        n_workers=question.n_workers,
    )
    judged = _looked_again(case, _judged(case, rows, selection, omnibus))
    return _diagnosis(case, rows, selection, judged, where)


def _judged(case: Case, rows: Sequence[_Row], selection: Selection, omnibus: Omnibus) -> _Judged:
    """Return which of the effects that were selected stand, and what is left then."""
    steps = selection.steps

    def after(step: Step) -> Omnibus:
        return _omnibus(case.question, case.ranks(0, step.choice.best.screen), rows)

    (confirmed, halves), last = together(
        lambda: confirm(case.screen, steps, n_workers=case.question.n_workers),
        lambda: after(steps[-1]) if steps else omnibus,
        n_workers=case.question.n_workers,
    )
    explained = _explains(case.question, confirmed, last)
    kept = _kept(steps, confirmed, explained=explained)
    if kept:
        omnibus = last if len(kept) == len(steps) else after(kept[-1])
    # What is there at times is something, though nothing that is listed.
    wavers = not explained and any(told.holds and not told.steady for told in confirmed)
    return _Judged(
        kept=kept,
        confirmed=confirmed,
        halves=halves,
        omnibus=omnibus,
        suspicious=wavers or is_suspicious(case.question, omnibus),
    )


def _looked_again(case: Case, judged: _Judged) -> _Judged:
    """Return what stands once features were asked what the laws of speeds and headings lack."""
    n = len(judged.kept)
    found = look_again(case, Found(steps=judged.kept, confirmed=judged.confirmed[:n]))
    if found is None:
        return judged
    return dataclasses.replace(
        judged,
        kept=found.steps,
        confirmed=found.confirmed,
        suspicious=found.suspicious,
        without_noise=found.without_noise,
    )


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
        n,
        n_workers=question.n_workers,
        done=lambda done: tell("null replicates", done, n),
    )


def _null(rows: Sequence[Floats], n_statistics: int) -> Null:
    return from_replicates(np.array(rows)) if len(rows) > 2 else theory(n_statistics)


def _rivals(case: Case, sampled: Sampled, known: set[str], least_z: float) -> list[Best]:
    """Return what beyond the list a model is asked for, held against a few replicates."""
    question, generic = case.question, not_forms_of(case.generic, known)
    alone = Asked(candidates=generic, held=(), null=theory(0))
    clear = hopeful(sampled, generic, least_z, question.n_workers)
    found = best_of(alone, ask_all(sampled.whole, clear, question.n_workers))
    found = [best for best in found if abs(best.z) > least_z][: 2 * RIVALS]
    if not found or (question.quick and not has_noise(question)):
        return found
    asked = tuple(best.score.candidate for best in found)

    def ask(_number: int, other: Screen) -> Floats:
        return np.array([other.ask(each).z for each in asked])

    n = QUICK_REPLICATES if question.quick else _GENERIC_REPLICATES
    rows = run_null(case.chain, ask, n, n_workers=question.n_workers)
    family = Asked(candidates=generic, held=asked, null=_null(rows, len(asked)))
    return best_of(family, [best.score for best in found])


def _explains(question: Question, confirmed: Sequence[Confirmed], last: Omnibus) -> bool:
    """Return whether what seems to be there at times is all that there is.

    Where an effect is strong and its true form another one than ours, what is left over goes by the
    fish's distances, say, which change within a minute: it looks like an effect that comes
    and goes. With our form in the model nothing is left then that the omnibus test would notice; or
    beside another effect, one that is there all the time and leaves something over, at least
    nothing that comes and goes itself. This goes for seconds: what differs between minutes is not
    that. Nor is what comes in pulses at regular times, for distances do not.

    Parameters
    ----------
    question
        Says whether the omnibus test has a null.
    confirmed
        What held-out steps say of all that were selected.
    last
        The omnibus test with all of them in the model.
    """
    if all(told.steady for told in confirmed) or any(told.pulsed for told in confirmed):
        return False
    if not can_suspect(question):
        return False
    if not is_suspicious(question, last):
        return True
    beside = any(told.steady and told.lasting for told in confirmed)
    stand = all(told.holds and told.in_all_minutes for told in confirmed)
    return beside and stand and not comes_and_goes(question, last)


def _kept(
    steps: Sequence[Step], confirmed: Sequence[Confirmed], *, explained: bool
) -> tuple[Step, ...]:
    """Return the effects up to the first that held-out steps or times do not bear out."""
    kept = []
    for step, told in zip(steps, confirmed, strict=True):
        if not (told.holds and (told.steady or explained)):
            break
        kept.append(step)
    return tuple(kept)


def _diagnosis(
    case: Case,
    rows: Sequence[_Row],
    selection: Selection,
    judged: _Judged,
    where: tuple[Located, ...],
) -> Diagnosis:
    steps = judged.kept
    curves = curves_of(case, steps, without_noise=judged.without_noise)
    effects = tuple(
        effect_found(step, held, ties_of(step.choice, [each.choice for each in steps[n:]]), curve)
        for n, (step, held, curve) in enumerate(
            zip(steps, judged.confirmed[: len(steps)], curves, strict=True), start=1
        )
    )
    final = steps[-1].choice.best.screen if steps else case.screen
    question = case.question
    if judged.without_noise:
        question = dataclasses.replace(
            question, noise_m=0.0, noise_source="the law of headings, with what was found"
        )
    screened = screened_of(case, selection.screened)
    return Diagnosis(
        verdict=verdict_of(effects, screened, suspicious=judged.suspicious or selection.left_over),
        where=where,
        effects=effects,
        screened=screened,
        notes=notes_of(
            question, final, judged.halves, judged.omnibus, [row.controls for row in rows]
        ),
        base=case.screen.fitted.parameters,
        extended=final.fitted.parameters,
        minutes=case.scene.duration_s / 60,
        n_steps=len(case.scene.turns),
    )


def _where(own: Residuals, rows: Sequence[_Row]) -> tuple[Located, ...]:
    nulls = [row.at_large[0] for row in rows if row.at_large]
    return located(own, *centre_and_spread(own, nulls)) if nulls else located(own)
