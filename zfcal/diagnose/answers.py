"""What was found, as findings have it: effects, candidates and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence

from zfcal.diagnose.case import Case
from zfcal.diagnose.confirming import Confirmed
from zfcal.diagnose.findings import EffectFound, FeatureCurve, Screened, Verdict
from zfcal.diagnose.selection import LEVEL, Best, Step
from zfcal.diagnose.telling import says
from zfcal.diagnose.tracing import trace

_NOTICED = 5.0
"""Standard errors at which an effect of faint strength must stand to be testable."""


def effect_found(
    step: Step, held: Confirmed, ties: tuple[str, ...], by_features: FeatureCurve | None
) -> EffectFound:
    """Return an effect that was named.

    Parameters
    ----------
    step
        As it was added.
    held
        What it gains on held-out steps.
    ties
        What cannot be told from it.
    by_features
        What its features say.
    """
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
        by_features=by_features,
    )


def verdict_of(
    effects: tuple[EffectFound, ...], screened: tuple[Screened, ...], *, suspicious: bool
) -> Verdict:
    """Return the verdict: that of the first effect, or why there is none.

    Parameters
    ----------
    effects
        What was named.
    screened
        Every candidate.
    suspicious
        Whether something is wrong that nothing named explains.
    """
    if effects:
        return Verdict.TIE if effects[0].ties else Verdict.NAMED
    if suspicious:
        return Verdict.UNEXPLAINED
    asked = [each for each in screened if each.lacks is None]
    blind = [each for each in asked if each.minutes_needed is not None]
    return Verdict.UNTESTABLE if 2 * len(blind) > len(asked) else Verdict.NO_EFFECT


def screened_of(case: Case, ranked: Sequence[Best]) -> tuple[Screened, ...]:
    """Return every candidate as it was asked for, those that lack something last."""
    minutes = case.scene.duration_s / 60
    made = [_as_screened(best, minutes) for best in ranked]
    made += [
        Screened(name=name, z=math.nan, p=1.0, minutes_needed=None, lacks=what)
        for name, what in case.lacks.items()
    ]
    return tuple(made)


def _as_screened(best: Best, minutes: float) -> Screened:
    candidate = best.score.candidate
    expected = abs(candidate.faint) * math.sqrt(max(best.information, 0.0))
    # Of a change with the hour a recording twice as long tells eight times as much.
    power = 2 / 3 if candidate.is_slow else 2
    needed = minutes * (_NOTICED / max(expected, 1e-3)) ** power
    enough = expected >= _NOTICED or best.p < LEVEL
    return Screened(
        name=candidate.name,
        z=best.z,
        p=best.p,
        minutes_needed=None if enough else needed,
        shape=candidate.shape,
    )
