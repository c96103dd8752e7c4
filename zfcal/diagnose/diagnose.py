"""From a question to a diagnosis: fit, null, screen, selection, places, verdict."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from zfcal.diagnose.candidates import Candidate, askable, candidates_of, company_of
from zfcal.diagnose.confirming import Confirmed, confirm, halves_note
from zfcal.diagnose.controls import NAMES, ask_controls
from zfcal.diagnose.findings import (
    Diagnosis,
    EffectFound,
    Located,
    Note,
    Screened,
    Verdict,
)
from zfcal.diagnose.heldout import own_speeds
from zfcal.diagnose.located import Residuals, centre_and_spread, located, residuals
from zfcal.diagnose.naming import ties_of
from zfcal.diagnose.null import (
    Chain,
    Measurement,
    Null,
    check_length,
    from_replicates,
    run_null,
    theory,
)
from zfcal.diagnose.omnibus import Omnibus, judge, statistics
from zfcal.diagnose.question import Question, Tell
from zfcal.diagnose.screening import Score, Screen, ask_all
from zfcal.diagnose.selection import (
    LEVEL,
    RIVAL_Z,
    RIVALS,
    Asked,
    Best,
    Selection,
    Selector,
    Step,
    best_of,
)
from zfcal.diagnose.sharpening import sharpened
from zfcal.diagnose.telling import says
from zfcal.diagnose.tracing import trace
from zfcal.model.effects import Effect, find_effect
from zfcal.model.effects.generic import generic_effects
from zfcal.model.extended import maximise
from zfcal.model.fitted import Free
from zfcal.model.scene import Scene, make_scene
from zfcal.parameters import Parameters

Floats = NDArray[np.float64]

LEAST_STEPS = 200
"""Fewer steps with a heading tell nothing of twenty-one parameters."""

_GENERIC_REPLICATES = 8
_AT_LARGE_REPLICATES = 20
"""Replicates that are asked in general as well: where, and whether at all."""

_QUICK_REPLICATES = 6
_QUICK_Z = 2.5
"""Where positions are not sharp, a quick answer holds what is larger than that against a few
replicates."""

_NOTICED = 5.0
"""Standard errors at which an effect of notable strength must stand to be testable."""

_UNEXPLAINED = 1e-3
_CONTROL = 4.5
_ASSUMED_NOISE_M = 0.0
_SHARP_M = 1e-4
"""Positions so sharp are those of the theory."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Row:
    """What one replicate says, or the measured tracks themselves."""

    listed: Floats
    controls: Floats | None
    at_large: tuple[Residuals, dict[str, float]] | None


@dataclass(frozen=True, kw_only=True, eq=False)
class _Case:
    """A question, its scene, the fitted model, and the families that are asked for."""

    question: Question
    scene: Scene
    screen: Screen
    listed: tuple[Candidate, ...]
    generic: tuple[Candidate, ...]
    lacks: dict[str, str]

    def at_large(self, number: int, screen: Screen) -> tuple[Residuals, dict[str, float]]:
        """Return the located residuals and the omnibus statistics of a screen."""
        rng = np.random.default_rng([self.question.seed, 5, number])
        scene, fitted, table = screen.scene, screen.fitted, screen.probability
        return residuals(scene, fitted, table=table), statistics(scene, fitted, rng, table=table)

    @cached_property
    def chain(self) -> Chain:
        """What makes replicates of the fitted model."""
        question, fitted = self.question, self.screen.fitted
        chain = Chain(
            samples=question.samples,
            arena=question.arena,
            fitted=fitted,
            maker=own_speeds(self.screen, fitted.parameters, question.arena.bins.speed_m_s),
            measurement=Measurement(noise_m=_noise(question), grain_m=question.grain_m),
            seed=question.seed,
            keeps=_QUICK_REPLICATES if question.quick else 0,
        )
        return sharpened(chain) if _has_noise(question) else chain


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
    case = _open(question)
    tell("fitting", 1, 1)
    scores = ask_all(case.screen, case.listed, question.n_workers)
    asked = _asked(question, scores)
    rows = _null_rows(case, asked, tell)
    own = case.at_large(0, case.screen)
    omnibus = judge(own[1], [row.at_large[1] for row in rows if row.at_large])
    selector = Selector(
        listed=Asked(
            candidates=case.listed,
            held=asked,
            null=_null([row.listed for row in rows], len(asked)),
        ),
        rivals=lambda screen: _rivals(case, screen),
        suspicious=_is_suspicious(question, omnibus),
        n_workers=question.n_workers,
        told=tell,
    )
    selection = selector.select(case.screen, scores)
    confirmed = [confirm(step) for step in selection.steps]
    kept = _kept(selection.steps, confirmed)
    if kept:
        final = case.at_large(0, kept[-1].choice.best.screen)
        omnibus = judge(final[1], [row.at_large[1] for row in rows if row.at_large])
    where = _where(own[0], rows)
    return _diagnosis(case, rows, selection, (kept, confirmed), (where, omnibus))


def _is_suspicious(question: Question, omnibus: Omnibus) -> bool:
    """Tell whether model and data disagree at all; noise does, for the theory alone.

    A quick answer has no replicates of the omnibus test, which cost more than all the rest of it.
    """
    sharp = question.noise_m is not None and question.noise_m <= _SHARP_M
    return (not question.quick or sharp) and omnibus.p < _UNEXPLAINED


def _has_noise(question: Question) -> bool:
    """Tell whether positions are known to err by so much that the theory alone is no null."""
    return question.noise_m is not None and question.noise_m > _SHARP_M


def _asked(question: Question, scores: Sequence[Score]) -> tuple[Candidate, ...]:
    """Return which effects are held against replicates, each at its best shape.

    A quick answer asks those alone that would be taken for missing, and what is near that.
    """
    best = _best_shapes(scores)
    if not question.quick:
        return tuple(candidate for _, candidate in best)
    clear = -stats.norm.ppf(LEVEL / 2 / max(len(scores), 1))
    if not _has_noise(question) or not any(z > clear for z, _ in best):
        return ()
    return tuple(candidate for z, candidate in best if z > _QUICK_Z)


def _best_shapes(scores: Sequence[Score]) -> list[tuple[float, Candidate]]:
    """Return each effect at the shape that the recording asks for most, after its z."""
    best: dict[str, tuple[float, Candidate]] = {}
    for score in scores:
        z = abs(score.z) if score.candidate.signed else score.z
        if score.candidate.name not in best or z > best[score.candidate.name][0]:
            best[score.candidate.name] = (z, score.candidate)
    return list(best.values())


def _null_rows(case: _Case, asked: Sequence[Candidate], tell: Tell) -> list[_Row]:
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

    n = _QUICK_REPLICATES if question.quick else question.n_null
    return run_null(
        case.chain,
        ask,
        n,
        n_workers=question.n_workers,
        done=lambda done: tell("null replicates", done, n),
    )


def _noise(question: Question) -> float:
    return _ASSUMED_NOISE_M if question.noise_m is None else question.noise_m


def _null(rows: Sequence[Floats], n_statistics: int) -> Null:
    return from_replicates(np.array(rows)) if len(rows) > 2 else theory(n_statistics)


def _rivals(case: _Case, screen: Screen) -> list[Best]:
    """Return what beyond the list a model is asked for, held against a few replicates."""
    question = case.question
    alone = Asked(candidates=case.generic, held=(), null=theory(0))
    found = best_of(alone, ask_all(screen, case.generic, question.n_workers))
    found = [best for best in found if abs(best.z) > RIVAL_Z][: 2 * RIVALS]
    if not found or (question.quick and not _has_noise(question)):
        return found
    asked = tuple(best.score.candidate for best in found)

    def ask(_number: int, other: Screen) -> Floats:
        return np.array([other.ask(each).z for each in asked])

    n = _QUICK_REPLICATES if question.quick else _GENERIC_REPLICATES
    rows = run_null(case.chain, ask, n, n_workers=question.n_workers)
    family = Asked(candidates=case.generic, held=asked, null=_null(rows, len(asked)))
    return best_of(family, [best.score for best in found])


def _open(question: Question) -> _Case:
    model = dataclasses.replace(
        question.model,
        zones=tuple(dataclasses.replace(zone, kappa_w=None) for zone in question.model.zones),
    )
    scene = make_scene(question.samples, question.arena)
    check_length(question.samples, scene, LEAST_STEPS)
    fitted = maximise(scene, model, free=free_of_model(model))
    effects, lacks = askable(scene, model)
    own = tuple(model.effects)
    return _Case(
        question=question,
        scene=scene,
        screen=Screen(scene=scene, fitted=fitted),
        listed=candidates_of(effects, question.arena, without=own),
        generic=candidates_of(_generic(scene), question.arena, without=own),
        lacks=lacks,
    )


def free_of_model(model: Parameters) -> Free:
    """Return the parameters of a model's effects on heading that a fit moves."""
    return tuple(
        (name, key)
        for name in model.effects
        for effect in (find_effect(name),)
        if not effect.on_speed
        for key in effect.names
        if key not in effect.fixed and key in model.effects[name]
    )


def _generic(scene: Scene) -> tuple[Effect, ...]:
    company = company_of(scene)
    return tuple(effect for effect in generic_effects() if effect.lacks(company) is None)


def _kept(steps: Sequence[Step], confirmed: Sequence[Confirmed]) -> tuple[Step, ...]:
    """Return the effects up to the first that held-out steps or times do not bear out."""
    kept = []
    for step, told in zip(steps, confirmed, strict=True):
        if not (told.holds and told.steady):
            break
        kept.append(step)
    return tuple(kept)


def _diagnosis(
    case: _Case,
    rows: Sequence[_Row],
    selection: Selection,
    kept: tuple[tuple[Step, ...], Sequence[Confirmed]],
    at_large: tuple[tuple[Located, ...], Omnibus],
) -> Diagnosis:
    (steps, confirmed), (where, omnibus) = kept, at_large
    effects = tuple(
        _effect(step, held, ties_of(step.choice, [each.choice for each in steps[number:]]))
        for number, (step, held) in enumerate(zip(steps, confirmed, strict=False), start=1)
    )
    # What is there at times is something, though nothing that is listed.
    wavers = any(told.holds and not told.steady for told in confirmed)
    final = steps[-1].choice.best.screen if steps else case.screen
    screened = _screened(case, selection.screened)
    return Diagnosis(
        verdict=_verdict(
            effects, screened, suspicious=wavers or _is_suspicious(case.question, omnibus)
        ),
        where=where,
        effects=effects,
        screened=screened,
        notes=_notes(case, rows, final, omnibus),
        base=case.screen.fitted.parameters,
        extended=final.fitted.parameters,
        minutes=case.scene.duration_s / 60,
        n_steps=len(case.scene.turns),
    )


def _effect(step: Step, held: Confirmed, ties: tuple[str, ...]) -> EffectFound:
    best = step.choice.best
    return EffectFound(
        name=best.name,
        says=says(best.candidate, best.values, best.interval),
        strength=best.values,
        interval=best.interval,
        gain_nats_per_step=held.gain_nats_per_step,
        gain_se=held.gain_se,
        p=step.best.p,
        ties=ties,
        trace=trace(step.best.score, step.before, best),
    )


def _verdict(
    effects: tuple[EffectFound, ...], screened: tuple[Screened, ...], *, suspicious: bool
) -> Verdict:
    if effects:
        return Verdict.TIE if effects[0].ties else Verdict.NAMED
    if suspicious:
        return Verdict.UNEXPLAINED
    asked = [each for each in screened if each.lacks is None]
    blind = [each for each in asked if each.minutes_needed is not None]
    return Verdict.UNTESTABLE if 2 * len(blind) > len(asked) else Verdict.NO_EFFECT


def _screened(case: _Case, ranked: Sequence[Best]) -> tuple[Screened, ...]:
    minutes = case.scene.duration_s / 60
    made = [_as_screened(best, minutes) for best in ranked]
    made += [
        Screened(name=name, z=math.nan, p=1.0, minutes_needed=None, lacks=what)
        for name, what in case.lacks.items()
    ]
    return tuple(made)


def _as_screened(best: Best, minutes: float) -> Screened:
    candidate, score = best.score.candidate, best.score
    expected = abs(candidate.notable) * math.sqrt(max(score.information, 0.0))
    needed = minutes * (_NOTICED / max(expected, 1e-3)) ** 2
    enough = expected >= _NOTICED or best.p < LEVEL
    return Screened(
        name=candidate.name,
        z=best.z,
        p=best.p,
        minutes_needed=None if enough else needed,
        shape=candidate.shape,
    )


def _where(own: Residuals, rows: Sequence[_Row]) -> tuple[Located, ...]:
    nulls = [row.at_large[0] for row in rows if row.at_large]
    return located(own, *centre_and_spread(own, nulls)) if nulls else located(own)


def _notes(case: _Case, rows: Sequence[_Row], final: Screen, omnibus: Omnibus) -> tuple[Note, ...]:
    return (
        _noise_note(case.question),
        halves_note(case.screen),
        _controls_note(case, rows, final),
        Note(
            name="omnibus",
            says=f"Ranks of headings and speeds in the final model: largest is {omnibus.worst}.",
            values={"z": omnibus.z, "p": omnibus.p},
        ),
        Note(
            name="null",
            says="Replicates of the fitted model through the measurement."
            if rows
            else "The theory alone: tracking noise can pose as a turning memory.",
            values={"replicates": float(len(rows))},
        ),
    )


def _noise_note(question: Question) -> Note:
    if question.noise_m is None:
        text = "The noise of positions is not known; none was assumed."
        return Note(name="noise", says=text, values={})
    text = f"Positions err by {1000 * question.noise_m:.2g} mm per coordinate"
    source = question.noise_source
    return Note(name="noise", says=f"{text} ({source}).", values={"noise_m": question.noise_m})


def _controls_note(case: _Case, rows: Sequence[_Row], final: Screen) -> Note:
    z = ask_controls(final, case.question.seed)
    drawn = [row.controls for row in rows if row.controls is not None]
    null = from_replicates(np.array(drawn)) if drawn else theory(len(z))
    own = null.standardised(z)
    fired = [name for name, value in zip(NAMES, own, strict=True) if abs(value) > _CONTROL]
    text = "Negative controls are silent, as they must be."
    if fired:
        text = f"NEGATIVE CONTROL FIRES: {', '.join(fired)}. Do not trust this diagnosis."
    return Note(name="controls", says=text, values=dict(zip(NAMES, map(float, own), strict=True)))
