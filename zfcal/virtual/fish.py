"""Fish of a virtual tank whose parameters differ from trial to trial and drift meanwhile."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import final

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.effects import less_attention_to_robots
from zfcal.model.fish_simulator import Shoal
from zfcal.parameters import ALPHA_MAX, KAPPA_0_MAX, KAPPA_F_MAX, Parameters, ZoneParameters
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

_SPECIES, _DRIFT, _MOVES, _NOISE = range(4)
"""Tell the random numbers of a tank from one another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FishOptions:
    """How the fish of a virtual tank differ, drift, and react to the robot.

    Parameters
    ----------
    between_sd
        Standard deviation from trial to trial of the log of each kappa_0, kappa_f, alpha
        and gamma of each zone.
    drift_sd, drift_s
        Standard deviation and correlation time, in seconds, of what drifts on top of it
        during a trial (an Ornstein-Uhlenbeck process, of the same logs).
    renewed_s
        So often the drift is carried on, in seconds.
    wariness
        Log of the attention that the robot loses; 0: it gets that of a fish.
    noise_m
        The tracker's position noise, standard deviation per coordinate.
    dropped
        Share of positions that the tracker loses.
    """

    between_sd: float = 0.2
    drift_sd: float = 0.1
    drift_s: float = 600.0
    renewed_s: float = 10.0
    wariness: float = 0.3
    noise_m: float = 0.0004
    dropped: float = 0.002

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or (value < 0 and field.name != "wariness"):
                raise InputError(
                    f"Virtual fish: {field.name} must be finite and not negative, got {value!r}."
                )
        if not (self.drift_s > 0 and self.renewed_s > 0 and self.dropped < 1):
            raise InputError(
                "Virtual fish: drift_s and renewed_s must be positive and dropped below 1, got "
                f"{self.drift_s!r}, {self.renewed_s!r} and {self.dropped!r}."
            )


def varied(base: Parameters, logs: Floats) -> Parameters:
    """Return a model whose parameters are those of another times exp(logs).

    Parameters
    ----------
    base
        The model in the middle.
    logs : ndarray, shape (zone, 3 + zone)
        Of kappa_0, kappa_f, alpha and the row of gamma of each zone. Values beyond what a
        calibration can reach are cut off there; a row of gamma is scaled to a maximum of 1.
    """
    zones = tuple(_varied(zone, row) for zone, row in zip(base.zones, np.exp(logs), strict=True))
    return dataclasses.replace(base, zones=zones)


def _varied(zone: ZoneParameters, factor: Floats) -> ZoneParameters:
    gamma = {to: g * float(f) for (to, g), f in zip(zone.gamma.items(), factor[3:], strict=True)}
    most = max(gamma.values())
    return dataclasses.replace(
        zone,
        kappa_0=min(KAPPA_0_MAX, zone.kappa_0 * float(factor[0])),
        kappa_f=min(KAPPA_F_MAX, zone.kappa_f * float(factor[1])),
        alpha=min(ALPHA_MAX, zone.alpha * float(factor[2])),
        gamma={to: g / most for to, g in gamma.items()},
    )


@final
class Truth:
    """The true parameters of one trial's fish over time.

    Parameters
    ----------
    base
        Parameters of the species.
    options
        How they differ and drift.
    seed
        Of the trial.
    """

    def __init__(self, base: Parameters, options: FishOptions, *, seed: int) -> None:
        size = (len(base.zones), 3 + len(base.zones))
        own = np.random.default_rng([seed, _SPECIES])
        self._rng = np.random.default_rng([seed, _DRIFT])
        effects = dict(base.effects)
        if options.wariness:
            effects |= less_attention_to_robots(options.wariness)
        self._base = dataclasses.replace(base, effects=effects)
        self._lasting = options.between_sd * own.standard_normal(size)
        self._drift = options.drift_sd * self._rng.standard_normal(size)
        self._options = options

    @property
    def parameters(self) -> Parameters:
        """The parameters of now."""
        return varied(self._base, self._lasting + self._drift)

    def carry_on(self, seconds: float) -> None:
        """Let time pass."""
        kept = math.exp(-seconds / self._options.drift_s)
        news = self._rng.standard_normal(self._drift.shape)
        self._drift = kept * self._drift + (
            self._options.drift_sd * math.sqrt(1 - kept * kept) * news
        )


@final
class VirtualFish:
    """The fish of one virtual trial, frame by frame.

    Between two of the model's steps fish swim straight, as the model defines. A step is
    decided at its beginning, from where the robot is then.

    Parameters
    ----------
    base
        Parameters of the species; its step is that of the trial.
    opened
        The trial: its arena, fish, frame rate and seed.
    options
        How the fish differ, drift and react.
    """

    def __init__(self, base: Parameters, opened: OpenTrial, options: FishOptions) -> None:
        trial = opened.trial
        seed = trial.seed
        self.truth = Truth(base, options, seed=seed)
        self._per_step = round(base.dt_s * trial.fps)
        self._fps, self._dt_s, self._options = trial.fps, base.dt_s, options
        self._renewed = max(1, round(options.renewed_s / base.dt_s))
        moves = int(np.random.SeedSequence([seed, _MOVES]).generate_state(1)[0])
        self._shoal = Shoal(
            self.truth.parameters, opened.arena, n_fish=trial.n_fish, n_robots=1, seed=moves
        )
        self._noise = np.random.default_rng([seed, _NOISE])
        self._frame = -1
        self._start_m = self._end_m = self._shoal.fish_xy_m
        self._heading = self._shoal.fish_heading_rad

    def next_frame(self, robot: Floats) -> FramePoses:
        """Return where everybody is in the next frame, exactly.

        Parameters
        ----------
        robot : ndarray, shape (3,)
            x and y in metres and heading in radians at that instant; NaN for none.
        """
        self._frame += 1
        step, share = divmod(self._frame, self._per_step)
        if share == 0:
            self._take_step(step, robot)
        xy_m = self._start_m + share / self._per_step * (self._end_m - self._start_m)
        # As the clock of simulated tracks: a step's time is a multiple of the step.
        return FramePoses(
            time_s=step * self._dt_s + share / self._fps,
            frame=self._frame,
            agents=(*_fish(xy_m, self._heading), *_robot(len(xy_m), robot)),
        )

    def _take_step(self, step: int, robot: Floats) -> None:
        if step and step % self._renewed == 0:
            self.truth.carry_on(self._renewed * self._dt_s)
            self._shoal.change(self.truth.parameters)
        self._start_m = self._end_m
        self._shoal.step(robot[None])
        self._end_m = self._shoal.fish_xy_m
        self._heading = self._shoal.fish_heading_rad

    def tracked(self, truth: FramePoses) -> FramePoses:
        """Return what a tracker makes of a frame: positions with noise, some lost."""
        size = len(truth.agents)
        noise_m = self._options.noise_m * self._noise.standard_normal((size, 2))
        seen = self._noise.random(size) >= self._options.dropped
        agents = tuple(
            dataclasses.replace(agent, x_m=agent.x_m + float(dx), y_m=agent.y_m + float(dy))
            for agent, (dx, dy), here in zip(truth.agents, noise_m, seen, strict=True)
            if here
        )
        return dataclasses.replace(truth, agents=agents)


def _fish(xy_m: Floats, heading_rad: Floats) -> list[AgentPose]:
    return [
        _pose(agent, FISH, (x, y), angle)
        for agent, ((x, y), angle) in enumerate(zip(xy_m, heading_rad, strict=True))
    ]


def _robot(agent: int, robot: Floats) -> list[AgentPose]:
    if not np.isfinite(robot).all():
        return []
    return [_pose(agent, ROBOT, (robot[0], robot[1]), robot[2])]


def _pose(agent: int, kind: int, xy_m: tuple[float, float], heading_rad: float) -> AgentPose:
    return AgentPose(
        agent=agent,
        kind=kind,
        x_m=float(xy_m[0]),
        y_m=float(xy_m[1]),
        heading_rad=float(heading_rad),
        confidence=1.0,
    )
