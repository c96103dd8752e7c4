"""Decides where the robot is to go and how fast its wheels turn; it knows no clock and no line.

All that it decides follows from what it is given: frames in order, the model of each step,
and at each tick the time and why the robot may not be driven on. Given the same again, it
decides the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from zfcal.arrays import Floats
from zfcal.errors import InputError
from zfcal.model.kernels.state import Packed
from zfcal.model.robot_agent import Among, Move
from zfcal.parameters import Parameters
from zfcal.robot.aseba import Frame
from zfcal.robot.body import RADIUS_M, Pose, Wheels, wheels_for
from zfcal.robot.confines import Confines
from zfcal.robot.fishbot import PATIENCE_S, FishBot
from zfcal.robot.motion import Gains, Goal, bearing, pattern_of
from zfcal.robot.plausible import Doubt, Plausibility, Reach
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

_DRAWS = 0x64726976
"""Key of the driver's random numbers among those that derive from a trial's seed."""

_SPARE = 4
"""Places beyond the number of agents, for ids that change while others still are there."""

_TURNING = "obstacle"
"""The one reason for which the robot still turns; for all others it stands."""

STALE_TARGET = "stale-target"


@dataclass(frozen=True, slots=True, kw_only=True)
class Manner:
    """How the robot is to be driven.

    Parameters
    ----------
    pattern
        ``fish`` or ``pid``.
    free_running
        Whether the model's agent runs by itself and the robot chases it; else it is
        re-placed at the tracked robot at each step.
    radius_m
        Of the robot: targets keep so far from the walls.
    letter
        The robot's name.
    gains
        Of the controller.
    """

    pattern: str = "fish"
    free_running: bool = False
    radius_m: float = RADIUS_M
    letter: str = "F"
    gains: Gains = Gains()  # noqa: RUF009 - frozen


@dataclass(frozen=True, slots=True, kw_only=True)
class InForce:
    """The model that drives.

    Parameters
    ----------
    name
        Its file, relative to the trial.
    sha256
        Of that file.
    text
        The file itself.
    parameters
        The model.
    packed
        The same, as it is stepped.
    """

    name: str
    sha256: str
    text: str
    parameters: Parameters
    packed: Packed


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where a step of the model leads the robot."""

    step: int
    frame: int
    time_s: float
    move: Move
    goal: Goal
    clamped: bool
    model: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """What the robot is to be told at a tick."""

    time_s: float
    frame: int
    step: int
    wheels: Wheels
    held: str
    message: Frame


@final
class Pilot:
    """Follows frames of poses and decides.

    Parameters
    ----------
    opened
        The trial.
    manner
        How to drive.
    robot
        Puts wheel speeds into messages; nothing is sent from here.

    Attributes
    ----------
    pose
        Where the robot was last seen; None before that.
    n_others
        How many others the last frame showed.
    doubts
        Who of the last frame was left out, and why: implausible poses are no poses.
    """

    def __init__(self, opened: OpenTrial, manner: Manner, robot: FishBot) -> None:
        trial = opened.trial
        self._opened = opened
        self._seed = trial.seed
        self._arena = opened.arena
        self._dt_s = trial.dt_s
        self._stride = round(trial.dt_s * trial.fps)
        self._manner = manner
        self._robot = robot
        self._confines = Confines(opened.arena.outline, manner.radius_m)
        self._pattern = pattern_of(manner.pattern, manner.gains)
        self._seats = Seats(trial.n_fish, max(0, trial.n_robots - 1))
        self._among = Among(opened.arena, self._seats.kinds, dt_s=trial.dt_s)
        self._target: Target | None = None
        self._step: int | None = None
        self._plausibility, self._reach = Plausibility(opened.arena), Reach()
        self.pose: Pose | None = None
        self._seen_s = 0.0
        self.n_others = 0
        self.doubts: list[tuple[AgentPose, Doubt]] = []
        self.frame = 0
        self.n_missed = 0

    @property
    def step(self) -> int:
        """Number of the last step that was due; -1 before the first."""
        return -1 if self._step is None else self._step

    def step_of(self, frame: int) -> int:
        """Return the number of the step in whose time a frame falls."""
        return frame // self._stride

    def is_due(self, frame: int) -> bool:
        """Return whether a step of the model falls on a frame, or between it and the last one.

        Also where the frames' numbers were set back: no target is kept because its number is high.
        """
        if self._step is None:
            return frame % self._stride == 0
        return frame // self._stride != self._step

    def warm_up(self, model: InForce) -> None:
        """Let a pilot that nobody follows decide: the first step compiles, or loads what is."""
        spare = Pilot(self._opened, self._manner, FishBot(self._manner.letter, self._robot.line))
        x, y = self._confines.inner.representative_point().coords[0]
        agents = tuple(
            AgentPose(agent=i, kind=kind, x_m=x, y_m=y, heading_rad=0.0, confidence=1.0)
            for i, kind in enumerate((FISH, ROBOT))
        )
        for step in range(2):
            time_s = step * self._dt_s
            spare.see(FramePoses(time_s=time_s, frame=step * self._stride, agents=agents), model)
            for held in ("", _TURNING, "stale-pose"):
                spare.tick(time_s, held)

    def see(self, poses: FramePoses, model: InForce) -> Target | None:
        """Take the next frame; return the new target where a step is due and one is found."""
        robot, others = self._tell_apart(self._plausible(poses.agents))
        if robot is not None and (doubt := self._reach.doubt(poses.time_s, robot.x_m, robot.y_m)):
            self.doubts.append((robot, doubt))
            robot = None
        self.n_others = len(others)
        self.frame, self._seen_s = poses.frame, poses.time_s
        if robot is not None:
            heading = robot.heading_rad
            if not math.isfinite(heading):
                heading = 0.0 if self.pose is None else self.pose.heading_rad
            self.pose = Pose(x_m=robot.x_m, y_m=robot.y_m, heading_rad=heading)
        if not self.is_due(poses.frame):
            return None
        step = poses.frame // self._stride
        if self._step is not None:
            self.n_missed += max(0, step - self._step - 1)
        self._step = step
        self._among.measure(poses.time_s, self._seats.take(others))
        if not self._place(seen=robot is not None):
            return None
        target = self._aim(poses, step, model)
        self._target = target or self._target
        return target

    def tick(self, time_s: float, held: str = "") -> Command:
        """Return what the robot is to be told now.

        Parameters
        ----------
        time_s
            Seconds since the start of the trial.
        held
            Why the robot may not be driven on; empty if it may.
        """
        target, pose = self._target, self.pose
        wheels, message = Wheels(), None
        if target is None or pose is None:
            held = held or "no-target"
        elif not held and self._seen_s - target.time_s > self._dt_s + PATIENCE_S:
            # A step's target holds until the next step's; none has come for long.
            held = STALE_TARGET
        elif held in {"", _TURNING}:
            try:
                wheels = self._wheels(pose, target.goal, time_s, turning=held == _TURNING)
                message = self._robot.frame_for(wheels)
            except InputError:
                wheels, held = Wheels(), "refused"
        if message is None:
            self._pattern.reset()
            message = self._robot.stop_frame()
        return Command(
            time_s=time_s,
            frame=self.frame,
            step=self.step,
            wheels=wheels,
            held=held,
            message=message,
        )

    def _wheels(self, pose: Pose, goal: Goal, time_s: float, *, turning: bool) -> Wheels:
        """Return the wheel speeds towards a goal; raise an `InputError` where it is none."""
        if not all(map(math.isfinite, (goal.x_m, goal.y_m, goal.speed_m_s))):
            raise InputError(f"A goal is a finite place with a finite speed, got {goal}.")
        if turning:
            # Not into what is in the way; the model's next targets lead elsewhere.
            _, error = bearing(pose, goal)
            return wheels_for(0.0, self._manner.gains.turn_p * error)
        return self._pattern.command(pose, goal, time_s)

    def _plausible(self, agents: tuple[AgentPose, ...]) -> list[AgentPose]:
        """Return those who can be where they are said to be, and note the others."""
        found = [(agent, self._plausibility.doubt(agent)) for agent in agents]
        self.doubts = [(agent, doubt) for agent, doubt in found if doubt is not None]
        return [agent for agent, doubt in found if doubt is None]

    def _tell_apart(self, agents: list[AgentPose]) -> tuple[AgentPose | None, list[AgentPose]]:
        """Return our robot, the one nearest to where it was, and all others."""
        robots = [agent for agent in agents if agent.kind == ROBOT]
        if not robots:
            return None, agents
        here = self.pose
        own = robots[0]
        if here is not None and len(robots) > 1:
            own = min(robots, key=lambda r: math.hypot(r.x_m - here.x_m, r.y_m - here.y_m))
        return own, [agent for agent in agents if agent is not own]

    def _place(self, *, seen: bool) -> bool:
        """Put the model's agent where it is; return whether it is anywhere."""
        if self._manner.free_running and self._target is not None:
            goal = self._target.goal
            if math.isfinite(goal.x_m + goal.y_m):
                self._among.place(goal.x_m, goal.y_m, self._target.move.heading_rad)
                if self._among.zone:
                    return True
            # No place in the tank: it begins anew at the robot.
        pose = self.pose
        if pose is None or not seen:
            return False
        self._among.place(pose.x_m, pose.y_m, pose.heading_rad)
        if self._among.zone == 0:
            # Tracked outside the tank, where no model leads anywhere: at the nearest place inside.
            x, y, _ = self._confines.clamp(pose.x_m, pose.y_m)
            self._among.place(x, y, pose.heading_rad)
        return True

    def _aim(self, poses: FramePoses, step: int, model: InForce) -> Target | None:
        key = np.random.SeedSequence(self._seed, spawn_key=(_DRAWS, step))
        move = self._among.step(model.packed, int(key.generate_state(1, np.uint64)[0]))
        if move is None or not all(map(math.isfinite, (move.x_m, move.y_m, move.speed_m_s))):
            return None
        x, y, clamped = self._confines.clamp(move.x_m, move.y_m)
        return Target(
            step=step,
            frame=poses.frame,
            time_s=poses.time_s,
            move=move,
            goal=Goal(x_m=x, y_m=y, speed_m_s=move.speed_m_s),
            clamped=clamped,
            model=model.name,
        )


@final
class Seats:
    """Gives each agent a place in the model's arrays, and keeps it as long as its id is seen.

    Parameters
    ----------
    n_fish, n_robots
        So many others at most, and some to spare.
    """

    def __init__(self, n_fish: int, n_robots: int) -> None:
        self.kinds = np.concatenate([np.zeros(n_fish + _SPARE), np.ones(n_robots)])
        self._who: list[int | None] = [None] * len(self.kinds)

    def take(self, others: list[AgentPose]) -> Floats:
        """Return x, y and heading by place, shape (place, 3); NaN where nobody is."""
        found = np.full((len(self.kinds), 3), np.nan)
        here = {agent.agent for agent in others}
        known = {who: seat for seat, who in enumerate(self._who) if who in here}
        for agent in others:
            seat = known.get(agent.agent)
            if seat is None:
                seat = self._free(agent.kind, here)
            if seat is not None:
                self._who[seat] = agent.agent
                found[seat] = agent.x_m, agent.y_m, agent.heading_rad
        return found

    def _free(self, kind: int, here: set[int]) -> int | None:
        """Return a place whose holder is not seen; None where all are."""
        for seat, who in enumerate(self._who):
            if self.kinds[seat] == (1.0 if kind == ROBOT else 0.0) and who not in here:
                return seat
        return None


def target_item(target: Target) -> dict[str, Any]:
    """Return a target as it stands in the log."""
    return {
        "what": "target",
        "time_s": target.time_s,
        "step": target.step,
        "frame": target.frame,
        "x_m": target.goal.x_m,
        "y_m": target.goal.y_m,
        "heading_rad": target.move.heading_rad,
        "speed_m_s": target.move.speed_m_s,
        "clamped": target.clamped,
        "model": target.model,
    }


def command_item(command: Command, letter: str) -> dict[str, Any]:
    """Return a command as it stands in the log, but for whether it was sent."""
    stands = command.held not in {"", _TURNING}
    return {
        "what": "command",
        "time_s": command.time_s,
        "step": max(0, command.step),
        "frame": command.frame,
        "left_m_s": command.wheels.left_m_s,
        "right_m_s": command.wheels.right_m_s,
        "held": command.held,
        "event": "STOP" if stands else f"MotorControl {letter}",
        "bytes": command.message.encode().hex(),
    }
