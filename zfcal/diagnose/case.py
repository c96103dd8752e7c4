"""A question with its scene, the fitted model, and the families that are asked for."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zfcal.diagnose.candidates import (
    Candidate,
    askable,
    candidates_of,
    company_of,
    not_forms_of,
)
from zfcal.diagnose.features.law import Law
from zfcal.diagnose.features.noise import likely_noise_m
from zfcal.diagnose.heldout import own_speeds
from zfcal.diagnose.located import Residuals, residuals
from zfcal.diagnose.null import Chain, Measurement, check_length
from zfcal.diagnose.omnibus import Omnibus, statistics
from zfcal.diagnose.question import Question
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.selection import UNNAMED_LEVEL
from zfcal.diagnose.sharpening import sharpened
from zfcal.diagnose.standing import standing_of
from zfcal.model.effects import Effect, find_effect, generic_effects
from zfcal.model.extended import maximise
from zfcal.model.fitted import Fitted, Free
from zfcal.model.scene import Scene, make_scene
from zfcal.parameters import Parameters

LEAST_STEPS = 200
"""Fewer steps with a heading tell nothing of twenty-one parameters."""

QUICK_REPLICATES = 6

_ASSUMED_NOISE_M = 0.0

_SHARP_M = 1e-4
"""Positions so sharp are those of the theory."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A question, its scene, the fitted model, and the families that are asked for.

    Where the tracks do not show by how much positions err, ``noise_is_likely``, and the question
    has the noise that the law of headings is likeliest with.
    """

    question: Question
    scene: Scene
    screen: Screen
    listed: tuple[Candidate, ...]
    generic: tuple[Candidate, ...]
    lacks: dict[str, str]
    noise_is_likely: bool = False

    def at_large(self, number: int, screen: Screen) -> tuple[Residuals, dict[str, float]]:
        """Return the located residuals and the omnibus statistics of a screen."""
        standing = standing_of(screen.scene, screen.fitted, screen.probability)
        return residuals(standing), statistics(standing, self._lots(number))

    def ranks(self, number: int, screen: Screen) -> dict[str, float]:
        """Return the omnibus statistics of a screen alone."""
        standing = standing_of(screen.scene, screen.fitted, screen.probability)
        return statistics(standing, self._lots(number))

    def _lots(self, number: int) -> np.random.Generator:
        return np.random.default_rng([self.question.seed, 5, number])

    @cached_property
    def laws(self) -> dict[Screen, Law]:
        """Laws of exact positions that features were asked of, by model."""
        return {}

    @cached_property
    def chain(self) -> Chain:
        """What makes replicates of the fitted model."""
        question, fitted = self.question, self.screen.fitted
        chain = Chain(
            samples=question.samples,
            arena=question.arena,
            fitted=fitted,
            maker=own_speeds(self.screen, fitted.parameters, question.arena.bins.speed_m_s),
            measurement=Measurement(noise_m=noise_of(question), grain_m=question.grain_m),
            seed=question.seed,
            keeps=QUICK_REPLICATES if question.quick else 0,
        )
        return sharpened(chain) if has_noise(question) else chain


def is_suspicious(question: Question, omnibus: Omnibus) -> bool:
    """Tell whether model and data disagree at all; noise does, for the theory alone.

    A quick answer has no replicates of the omnibus test, which cost more than all the rest of it.
    """
    return can_suspect(question) and omnibus.p < UNNAMED_LEVEL


def can_suspect(question: Question) -> bool:
    """Tell whether the omnibus test has a null: positions are sharp, or replicates asked for."""
    return not question.quick or is_sharp(question)


def is_sharp(question: Question) -> bool:
    """Tell whether positions are known to err by so little that the theory alone is a null."""
    return question.noise_m is not None and question.noise_m <= _SHARP_M


def has_noise(question: Question) -> bool:
    """Tell whether positions are known to err by so much that the theory alone is no null."""
    return question.noise_m is not None and question.noise_m > _SHARP_M


def noise_of(question: Question) -> float:
    """Return the noise of positions per coordinate, in metres; none where it is not known."""
    return _ASSUMED_NOISE_M if question.noise_m is None else question.noise_m


def open_case(question: Question) -> Case:
    """Return a question with the model fitted to its tracks, and what can be asked of them.

    Raises
    ------
    InputError
        There are no fish, or too few of their steps have a heading.
    """
    model = dataclasses.replace(
        question.model,
        zones=tuple(dataclasses.replace(zone, kappa_w=None) for zone in question.model.zones),
    )
    scene = make_scene(question.samples, question.arena)
    check_length(question.samples, scene, LEAST_STEPS)
    fitted = maximise(scene, model, free=free_of_model(model), n_workers=question.n_workers)
    effects, lacks = askable(scene, model)
    own = tuple(model.effects)
    is_likely = question.noise_m is None
    if is_likely:
        question = _with_likely_noise(question, scene, fitted)
    return Case(
        question=question,
        scene=scene,
        screen=Screen(scene=scene, fitted=fitted),
        listed=candidates_of(effects, question.arena, without=own),
        generic=not_forms_of(candidates_of(_generic(scene), question.arena), own),
        lacks=lacks,
        noise_is_likely=is_likely,
    )


def _with_likely_noise(question: Question, scene: Scene, fitted: Fitted) -> Question:
    noise_m = likely_noise_m(scene, fitted, seed=question.seed)
    return dataclasses.replace(question, noise_m=noise_m, noise_source="the law of headings")


def free_of_model(model: Parameters) -> Free:
    """Return the parameters of a model's effects on heading that a fit moves."""
    return tuple(
        (name, key)
        for name in model.effects
        for effect in (find_effect(name),)
        if not effect.on_speed
        for key in effect.free(model.effects[name])
        if key in model.effects[name]
    )


def _generic(scene: Scene) -> tuple[Effect, ...]:
    company = company_of(scene)
    return tuple(effect for effect in generic_effects() if effect.lacks(company) is None)
