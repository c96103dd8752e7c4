"""What a diagnosis says: verdict, places, effects, and what was asked."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.parameters import Parameters


class Verdict(StrEnum):
    """What a diagnosis comes to; each of them is an honest answer."""

    NAMED = "named"
    TIE = "tie"
    UNEXPLAINED = "unexplained"
    NO_EFFECT = "no-effect"
    UNTESTABLE = "untestable"


@dataclass(frozen=True, slots=True, kw_only=True)
class Located:
    """A statistic in which model and data disagree, and where.

    Parameters
    ----------
    statistic
        Such as ``turning`` or ``nearest-neighbour distance``.
    zone
        None for the whole tank.
    time_s
        From and to, since the trial's start.
    agents
        Track ids; None for all.
    observed, expected
        Per step, in the statistic's own unit.
    z
        Their difference in standard errors.
    q
        Share of false discoveries at which it is one.
    """

    statistic: str
    zone: str | None
    time_s: tuple[float, float]
    agents: tuple[int, ...] | None
    observed: float
    expected: float
    z: float
    q: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Screened:
    """A candidate that was asked for.

    Parameters
    ----------
    name
        Of the effect.
    z
        Of its efficient score at its best shape, as the null through the measurement
        chain has it; NaN where it cannot be asked.
    p
        Over the whole family.
    minutes_needed
        Of recording, where there is too little; None where there is enough.
    lacks
        What the recording lacks for it to show at all, such as ``a robot``.
    shape
        Parameters at which it was asked for.
    """

    name: str
    z: float
    p: float
    minutes_needed: float | None = None
    lacks: str | None = None
    shape: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """An effect's own statistic, step by step, in the model before and after it is added.

    Parameters
    ----------
    time_s, x_m, y_m : ndarray, shape (step,)
        When and where each step began.
    track : ndarray of int32, shape (step,)
    before, after : ndarray, shape (step,)
        Efficient scores: their sum over the root of the sum of their squares is z.
    cue, observed, expected_before, expected_after : ndarray, shape (bin,)
        The statistic against what the effect responds to: middle of the bin, mean of
        what was measured, and what the models expect.
    cue_name, response_name
        What these are, with units.
    """

    time_s: Floats
    x_m: Floats
    y_m: Floats
    track: NDArray[np.int32]
    before: Floats
    after: Floats
    cue: Floats
    observed: Floats
    expected_before: Floats
    expected_after: Floats
    cue_name: str
    response_name: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeatureCurve:
    """What an effect's best feature says, whatever the form in which fish have the effect.

    Parameters
    ----------
    label
        Of the feature.
    nats, form_nats
        Log likelihood gained by it, and by the form that goes into the model; less one for each
        strength of the feature.
    cue, strength_name
        What its strengths go by, and what they are, with units; empty where they are no curve.
    at, strength, low, high : ndarray, shape (knot,)
        The curve, linear between knots, and its 95 % interval.
    form : ndarray, shape (knot,)
        The same of headings drawn from the model with the effect.
    besides
        By name, further strengths that are no part of the curve, and their 95 % intervals.
    """

    label: str
    nats: float
    form_nats: float
    cue: str = ""
    strength_name: str = ""
    at: Floats = field(default_factory=lambda: np.zeros(0))
    strength: Floats = field(default_factory=lambda: np.zeros(0))
    low: Floats = field(default_factory=lambda: np.zeros(0))
    high: Floats = field(default_factory=lambda: np.zeros(0))
    form: Floats = field(default_factory=lambda: np.zeros(0))
    besides: dict[str, tuple[float, float, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EffectFound:
    """An effect that the model lacks.

    Parameters
    ----------
    name, says
        Its name, and a sentence in plain words with sign and size.
    strength, interval
        Its parameters and their 95 % intervals.
    gain_nats_per_step
        Log likelihood that it adds per step, held out.
    gain_se
        Standard error of that.
    p
        Over the whole family.
    ties
        Effects that cannot be told from it on this recording.
    trace
        For the pictures.
    by_features
        What its features say; None for an effect on speed, or one beyond the list.
    """

    name: str
    says: str
    strength: dict[str, float]
    interval: dict[str, tuple[float, float]]
    gain_nats_per_step: float
    gain_se: float
    p: float
    ties: tuple[str, ...] = ()
    trace: Trace | None = None
    by_features: FeatureCurve | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """How far a model is from the data before and after, on held-out blocks.

    Parameters
    ----------
    measure
        ``nats_per_step``, ``S_over_ceiling``, ``D``, ``W``, ``O``, ``T`` or ``effect``.
    before, after
        Of the model without and with the effects.
    floor
        Of the model with the effects against itself.
    closed
        ``(before - after) / (before - floor)``.
    interval
        Of ``closed``, 95 %.
    placebo
        ``closed`` of a wrong effect with the same budget.
    """

    measure: str
    before: float
    after: float
    floor: float
    closed: float
    interval: tuple[float, float]
    placebo: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """Something about the recording or the method that bears on the verdict.

    Parameters
    ----------
    name
        Such as ``noise``, ``halves`` (how far the fits of the two halves differ),
        ``controls`` (negative controls), ``omnibus``, ``left-out``.
    says
        In plain words.
    values
        Its numbers.
    """

    name: str
    says: str
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Diagnosis:
    """All that a diagnosis found.

    Parameters
    ----------
    verdict
        That of the first effect.
    where
        Disagreements, the clearest first.
    effects
        In the order of adding.
    screened
        Every candidate.
    notes
        What else to know.
    base
        The model without the effects, at its maximum likelihood.
    extended
        With them.
    minutes, n_steps
        Length of the recording, and steps with a heading.
    """

    verdict: Verdict
    where: tuple[Located, ...]
    effects: tuple[EffectFound, ...]
    screened: tuple[Screened, ...]
    notes: tuple[Note, ...]
    base: Parameters
    extended: Parameters
    minutes: float
    n_steps: int
