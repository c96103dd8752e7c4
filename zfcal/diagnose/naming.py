"""Effects put into a model with their own mechanisms, and what they gain there.

Gains are compared sample by sample (Vuong 1989, Econometrica 57: 307-333).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zfcal.arrays import Floats
from zfcal.diagnose.candidates import Candidate
from zfcal.diagnose.scores import Score
from zfcal.diagnose.screening import Screen
from zfcal.diagnose.speeds import fit_speed
from zfcal.model.extended import bounds_of, maximise, nats_at, with_effect
from zfcal.model.fitted import Fitted, Free
from zfcal.model.kernels.curves import MORE, has_curve
from zfcal.model.kernels.state import TRAIT
from zfcal.model.scene import Moves, Scene, thin

_ROUNDS = 10
_SHARES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Of a strength worth noticing: where the search for the maximum begins."""

_FEW = 8000
"""Steps of which a fit's start is taken: twenty minutes of a fish."""

_BLOCK_S = 10.0

SURE = 2.0
"""Standard errors by which one effect must beat another."""

_OWN_SHARE = 0.5
"""Of what an effect gains alone, it gains so much beside another if both are there."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Refit:
    """A suspect in the model.

    Parameters
    ----------
    candidate
        What was added, at its shape.
    screen
        The model with it, ready to be asked further.
    values
        Its parameters at their maximum likelihood.
    interval
        95 % interval of each that was fitted.
    gain : ndarray, shape (sample,)
        Log likelihood that it adds, summed over the agents of each sample of the scene.
    n_free
        Parameters that were fitted.
    """

    candidate: Candidate
    screen: Screen
    values: dict[str, float]
    interval: dict[str, tuple[float, float]]
    gain: Floats
    n_free: int

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.candidate.name

    @property
    def is_generic(self) -> bool:
        """Whether it names no mechanism."""
        return self.candidate.effect.generic

    @property
    def looks_like(self) -> str | None:
        """Name of the effect that it may only seem to be, whatever form that one has."""
        like = self.candidate.effect.looks_like
        return None if like is None else like.name

    @property
    def nats(self) -> float:
        """Log likelihood gained, less what as many idle parameters would gain."""
        return float(self.gain.sum()) - self.n_free

    @property
    def worth(self) -> float:
        """Log likelihood gained, less half the log of the samples for each parameter.

        By this suspects are told apart (Schwarz 1978, Annals of Statistics 6: 461-464): where the
        true form is another one than both, the one with more parameters comes nearer to it.
        """
        return float(self.gain.sum() - 0.5 * self.n_free * np.log(len(self.gain)))

    def over(self, other: Refit) -> float:
        """Return by how many standard errors it is worth more than another (Vuong 1989)."""
        by = self.gain - other.gain
        spread = float(by.std()) * np.sqrt(len(by))
        ahead = self.worth - other.worth
        return ahead / spread if spread > 1e-9 else 0.0


def free_of(candidate: Candidate) -> Free:
    """Return the parameters of an effect that a fit moves."""
    effect = candidate.effect
    return tuple((effect.name, name) for name in effect.free(candidate.shape))


def refit(screen: Screen, score: Score, *, n_workers: int = 1) -> Refit:
    """Return the model with a suspect added, all parameters at their maximum likelihood.

    Parameters
    ----------
    screen
        The model so far.
    score
        Of the suspect: its shape, and a strength to start from.
    n_workers
        Threads; the numbers do not depend on them.
    """
    candidate = score.candidate
    if candidate.effect.on_speed:
        return _refit_speed(screen, score)
    scene = screen.scene
    if candidate.effect.by_trait:
        scene = with_traits(scene, score)
    free = free_of(candidate)
    start = _start(scene, screen.fitted, score)
    fitted = maximise(
        scene,
        with_effect(screen.fitted.parameters, candidate.name, start),
        free=(*screen.fitted.free, *free),
        start=screen.fitted.x,
        rounds=_ROUNDS,
        n_workers=n_workers,
    )
    by_step = np.nan_to_num(fitted.log_p - screen.fitted.log_p)
    values = dict(fitted.parameters.effects[candidate.name])
    return Refit(
        candidate=candidate,
        screen=Screen(scene=scene, fitted=fitted),
        values=values,
        interval=_intervals(fitted, free, values, scene),
        gain=by_sample(scene, scene.turns.at, by_step),
        n_free=max(1, len(free)),
    )


def by_sample(scene: Scene, at: NDArray[np.int64], values: Floats) -> Floats:
    """Return the sums over the agents of each sample, shape (sample,)."""
    return np.bincount(at, weights=values, minlength=len(scene.k)).astype(np.float64)


def _start(scene: Scene, fitted: Fitted, score: Score) -> dict[str, float]:
    """Return where a fit starts: the best of a few strengths on the side that is asked for.

    Near its null the likelihood of a mixture is so steep for a few headings that no
    slope there says where the maximum is.
    """
    candidate = score.candidate
    low, high = bounds_of(candidate.name, candidate.effect.strength)
    strengths = np.copysign(np.multiply(_SHARES, candidate.notable), candidate.side or score.z)
    tried = [candidate.values(float(value)) for value in np.clip(strengths, low, high)]
    models = [with_effect(fitted.parameters, candidate.name, values) for values in tried]
    share = max(1, len(scene.turns) // _FEW)
    few = thin(scene, _some_of(scene, scene.turns, share), _some_of(scene, scene.moves, share))
    return tried[int(np.argmax(nats_at(few, models, fitted.x)))]


def _some_of(scene: Scene, steps: Moves, share: int) -> NDArray[np.bool_]:
    """Return which steps lie in every so-many-th block of ten seconds."""
    block = (scene.time_s(steps) // _BLOCK_S).astype(np.int64)
    return np.asarray(block % share == 0)


def _intervals(
    fitted: Fitted, free: Free, values: dict[str, float], scene: Scene
) -> dict[str, tuple[float, float]]:
    first = len(fitted.free) - len(free)
    error = np.sqrt(np.maximum(np.diag(fitted.covariance), 0.0))[first:]
    found = {}
    for (name, key), half in zip(free, 1.96 * error, strict=True):
        low, high = bounds_of(name, key, scene.arena)
        # The place of a model that came from elsewhere may lie outside the tank.
        low, high = min(low, values[key]), max(high, values[key])
        found[key] = (max(low, values[key] - half), min(high, values[key] + half))
    return found


def _refit_speed(screen: Screen, score: Score) -> Refit:
    candidate = score.candidate
    found = fit_speed(screen, candidate, score.strength, bend=True)
    parameters = with_effect(screen.fitted.parameters, candidate.name, found.values)
    # Headings are judged given the speed: the rest of the fit stands.
    fitted = replace(screen.fitted, parameters=parameters)
    moves = screen.scene.moves
    return Refit(
        candidate=candidate,
        screen=Screen(scene=screen.scene, fitted=fitted),
        values=found.values,
        interval={candidate.effect.strength: found.interval},
        gain=by_sample(screen.scene, moves.at, found.gain),
        n_free=1 + (len(MORE) if has_curve(candidate.shape) else 0),
    )


def with_traits(scene: Scene, score: Score) -> Scene:
    """Return a scene whose agents have the traits that their scores ask for.

    Traits have mean zero and standard deviation one over the tracks that are long enough
    to tell.
    """
    ids, place = np.unique(scene.turns.track, return_inverse=True)
    sums = np.bincount(place, weights=score.steps)
    information = np.bincount(place, weights=score.steps**2)
    known = information > 0.02 * information.sum()
    traits = np.zeros(len(ids))
    if known.sum() > 1:
        each = sums[known] / information[known]
        shrunk = each - np.average(each, weights=information[known])
        spread = float(shrunk.std())
        traits[known] = shrunk / spread if spread > 0 else 0.0
    states = scene.states.copy()
    for track, trait in zip(ids, traits, strict=True):
        states[:, TRAIT][scene.tracks == track] = trait
    return replace(scene, states=states)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Choice:
    """What is named, and what cannot be told from it.

    Parameters
    ----------
    best
        The one that is worth most.
    ties
        The others.
    """

    best: Refit
    ties: tuple[Refit, ...] = ()


def ties_of(choice: Choice, later: Sequence[Choice]) -> tuple[str, ...]:
    """Return the names of those that cannot be told from a chosen suspect.

    One that was chosen later, with the first one in the model, and still gains what it is worth
    is no other name for it: both are there.

    Parameters
    ----------
    choice
        What was chosen.
    later
        What was chosen after it.
    """
    beside = {each.best.name: each.best.nats for each in later}
    return tuple(
        tie.name for tie in choice.ties if beside.get(tie.name, 0.0) < _OWN_SHARE * tie.nats
    )
