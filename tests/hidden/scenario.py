"""A trial that hides an effect, two, or none: asked for by a scenario, made from its seed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from hidden import kernels, states
from hidden.chain import Chain, measure, sampled
from hidden.effects import BOTH
from hidden.further import FORMS, FURTHER, drawn, knob, name_of
from hidden.law import Base, empty_past, law_of, natural, shifted, world_of
from hidden.oracle import acts_on, oracle_nats
from hidden.worlds import Floats, Tank, tank_of

BURN_IN_STEPS = 300
_STEPS_PER_MIN = 300
_NEAR_M = 0.3
_SELDOM = 0.1
_NORMAL_SCORES = {1: (1.0,), 2: (-0.8, 0.8), 3: (-1.0, 0.0, 1.0), 4: (-1.1, -0.4, 0.4, 1.1)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """What is asked for.

    Parameters
    ----------
    effect, second
        Keys of `hidden.further.FORMS`, such as ``alignment`` or ``alignment/flow``; None
        for none.
    strength
        ``faint``, ``clear`` or ``strong``, or the knob itself.
    minutes
        Length of the recording.
    seed
    robot
        Whether an agent of kind robot, driven by the base law, swims along.
    n_fish
    arena
        ``two-rooms`` or ``rectangle``.
    base
        ``natural`` parameters, or others ``shifted`` far and wide by the seed.
    chain
        What the tracker does.
    fps
        Frames per second of the recording.
    """

    effect: str | None = None
    second: str | None = None
    strength: str | float = "clear"
    minutes: float = 30.0
    seed: int = 0
    robot: bool = True
    n_fish: int = 4
    arena: str = "two-rooms"
    base: str = "natural"
    chain: Chain = field(default_factory=Chain)
    fps: float = 15.0

    @property
    def hidden(self) -> tuple[str, ...]:
        """The keys of the hidden effects."""
        return tuple(name for name in (self.effect, self.second) if name is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What came out.

    Parameters
    ----------
    tracks : DataFrame
        ``time_s``, ``agent``, ``kind``, ``x_m``, ``y_m``, as the tracker wrote them.
    samples_m : ndarray, shape (sample, track, 2)
        The same at 5 Hz; NaN where a track was not seen.
    track_ids, robot_tracks : ndarray, shape (track,)
        The tracks' ids, and whether each is a robot's.
    states_m, heading_rad : ndarray, shape (state, agent, 2) and (state, agent)
        Where the animals were at steps of 0.2 s, and their headings; robot last.
    oracle_nats : dict
        ``heading``, ``speed``, ``total``, ``steps``; empty where it was not asked for.
    truth : dict
        The scenario's effects with their strengths, parameters, places, the law's best fit.
    """

    tracks: pd.DataFrame
    samples_m: Floats
    track_ids: np.ndarray
    robot_tracks: np.ndarray
    states_m: Floats
    heading_rad: Floats
    oracle_nats: dict
    truth: dict


def _plan(scenario: Scenario, tank: Tank, rng) -> states.Plan:
    n = scenario.n_fish + scenario.robot
    strength = np.zeros((n, states.N_EFFECTS))
    constants = np.zeros((states.N_EFFECTS, states.N_CONSTANTS))
    for name in scenario.hidden:
        column, values = FORMS[name].column, list(drawn(name, scenario.seed).values())
        strength[: scenario.n_fish, column] = knob(name, scenario.strength)
        constants[column, : len(values)] = values
    bold = np.zeros(n)
    scores = _NORMAL_SCORES.get(scenario.n_fish, np.linspace(-1.3, 1.3, scenario.n_fish))
    bold[: scenario.n_fish] = rng.permutation(scores)
    place = tank.liked[rng.integers(len(tank.liked))]
    compass, phase = rng.uniform(-math.pi, math.pi, 2)
    robot = scenario.n_fish if scenario.robot else -1
    further = int(any(name in FURTHER for name in scenario.hidden))
    return states.Plan(
        strength, place, tank.speaker, compass, phase, bold, robot, constants, further
    )


def _truth(scenario: Scenario, base: Base, plan: states.Plan) -> dict:
    return {
        "effects": {name: knob(name, scenario.strength) for name in scenario.hidden},
        "names": sorted({name_of(name) for name in scenario.hidden}),
        "constants": {name: drawn(name, scenario.seed) for name in scenario.hidden},
        "arena": scenario.arena,
        "base": base.plain(),
        "place_m": plan.place.tolist(),
        "compass_rad": float(plan.compass_rad),
        "phase_rad": float(plan.phase_rad),
        "bold": plan.bold.tolist(),
    }


def _run(scenario: Scenario, tank: Tank, law, plan: states.Plan, seed):
    """Return what happened, and its plan: a liked place that fish hardly come by gives way.

    In a room that nobody enters a place hides nothing, however much it is liked.
    """
    world = world_of(tank)
    n_steps = BURN_IN_STEPS + round(scenario.minutes * _STEPS_PER_MIN)
    others = (place for place in tank.liked if not np.array_equal(place, plan.place))
    for place in (plan.place, *others):
        plan = plan._replace(place=place)
        past = empty_past(n_steps, len(plan.bold), first=BURN_IN_STEPS)
        kernels.run(world, law, past, plan, np.random.default_rng(seed))
        away = np.linalg.norm(past.xy[BURN_IN_STEPS:, : scenario.n_fish] - place, axis=-1)
        liked = "place-preference" in map(name_of, scenario.hidden)
        if not liked or (away < _NEAR_M).mean() >= _SELDOM:
            break
    return past, plan


def make_trial(scenario: Scenario, *, oracle: bool = True) -> Trial:
    """Simulate a scenario and measure it.

    Parameters
    ----------
    scenario
    oracle
        Whether to fit the base law and count the oracle's nats, which takes the longest.
    """
    seeds = np.random.SeedSequence([scenario.seed, 20170511]).spawn(4)
    rng_base, rng_plan, _, rng_chain = (np.random.default_rng(s) for s in seeds)
    base = shifted(rng_base) if scenario.base == "shifted" else natural()
    tank = tank_of(scenario.arena)
    world, law, plan = world_of(tank), law_of(base), _plan(scenario, tank, rng_plan)
    past, plan = _run(scenario, tank, law, plan, seeds[2])
    nats, truth = {}, _truth(scenario, base, plan)
    if oracle:
        on = acts_on(scenario.hidden) if scenario.hidden else BOTH
        nats, fitted = oracle_nats(base, world, past, n_fish=scenario.n_fish, on=on)
        truth["base_fitted"] = fitted.plain()
    states_m = past.xy[BURN_IN_STEPS:]
    tracks = measure(states_m, scenario.n_fish, scenario.chain, fps=scenario.fps, rng=rng_chain)
    xy, ids, robot = sampled(tracks, fps=scenario.fps)
    return Trial(
        tracks=tracks, samples_m=xy, track_ids=ids, robot_tracks=robot, states_m=states_m,
        heading_rad=past.heading[BURN_IN_STEPS:], oracle_nats=nats, truth=truth,
    )  # fmt: skip


def write_csv(trial: Trial, path) -> None:
    """Write a trial's tracks as zfcal imports them."""
    trial.tracks.to_csv(path, index=False, float_format="%.7g")
