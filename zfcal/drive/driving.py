"""One run of the driver: frames in, wheel speeds out, all of it logged."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, final

from zfcal.drive.clock import DriveClock, Lag
from zfcal.drive.events import DriveStatus
from zfcal.drive.log import POSE_TO_STATE, TICK_TO_BYTE, DriveLog
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import (
    STALE_TARGET,
    InForce,
    Manner,
    Pilot,
    Target,
    command_item,
    target_item,
)
from zfcal.robot.faults import Complaints
from zfcal.robot.fishbot import PATIENCE_S, FishBot, Watchdog
from zfcal.robot.motion import TICK_S
from zfcal.stages.events import Note, Tell
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import ROBOT, FramePoses

_MOST_HISTORIES = 5
"""Looks at which more than one step is due, after which ticks begin even so: poses come in lots."""

_IMPLAUSIBLE = "implausible-pose"

_SAYS = {
    "stale-pose": "The robot has not been seen for 0.5 s: it was stopped.",
    "port-lost": "The port has gone: nothing can be sent until it is back.",
    "helper-lost": "The process that stops a robot whose driver hangs has ended or hangs itself: "
    "the robot was stopped until another one is there.",
    "power-down": "The robot has lost its supply (PowerDown for 3 s): it was stopped.",
    "obstacle": "The robot met an obstacle: it turns, and does not go on.",
    STALE_TARGET: "The model has led nowhere for half a second: the robot was stopped.",
    "refused": "A wheel speed was refused: it is beyond what the robot can do.",
    "watchdog": "The driver itself was held up: its watchdog stopped the robot.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Crew:
    """What a driver works with.

    Parameters
    ----------
    robot
        The robot and the line to it.
    clock
        What its ticks are timed by.
    models
        Where models come from.
    log
        Where all of it is written.
    tell
        Hears of faults and of models.
    watchdog
        Stops the robot where nothing fresh comes; None for a clock that is not live.
    """

    robot: FishBot
    clock: DriveClock
    models: DriveModels
    log: DriveLog
    tell: Tell
    watchdog: Watchdog | None = None


@final
class Driver:
    """Drives a robot by a model, frame by frame.

    Parameters
    ----------
    opened
        The trial.
    manner
        How to drive.
    crew
        What it works with.
    """

    def __init__(self, opened: OpenTrial, manner: Manner, crew: Crew) -> None:
        self.pilot = Pilot(opened, manner, crew.robot)
        self._crew = crew
        self._letter = manner.letter
        self._complaints = Complaints(manner.letter)
        self._model = crew.models.first()
        self._begun = False
        self._is_driving = False
        self._n_histories = 0
        self._lag = Lag()
        self._ticked_s = math.inf
        self._seen_s = -math.inf
        self._held = ""
        self._doubted_s = -math.inf
        self._doubted: set[str] = set()
        self._n_bites = 0
        self.n_targets = 0
        self.n_commands = 0
        self.is_answered = False
        self._time_of_frame_s: float | None = None
        self._n_late = 0
        self.models_used: list[str] = []

    def warm_up(self) -> None:
        """Do what takes long the first time, before anything moves."""
        # The step's kernels are compiled or loaded by a pilot that nobody follows.
        self.pilot.warm_up(self._model)
        self._crew.log.warm_up()

    def take(
        self, frames: list[FramePoses], *, age_s: float | None = None, since_s: float | None = None
    ) -> None:
        """Take frames that have come, oldest first.

        Parameters
        ----------
        frames
            All of them: each step of the model that falls on one is done.
        age_s
            Seconds since the last one was written, where that is known.
        since_s
            When they were not there yet, by the steady clock: so old they may be, whatever holds
            the driver up meanwhile, and no other clock has to be right for that. None for now.
        """
        since_s = self._crew.clock.steady_s() if since_s is None else since_s
        if frames and not self._begun:
            self._begin(frames[0].time_s)
        if self._begun and not self._is_driving and self._crew.clock.is_live:
            self._catch_up(frames, age_s=age_s, since_s=since_s)
            return
        if self._crew.clock.is_live:
            self._count_late(frames)
        for poses in frames:
            self._crew.clock.take_frame(poses.time_s)
            # The first ones of several have waited for longer.
            waited_s = max(0.0, frames[-1].time_s - poses.time_s)
            self._take(poses, taken_s=self._taken_s(poses.time_s, since_s - waited_s))
            if age_s is not None:
                self._crew.log.measure(POSE_TO_STATE, age_s + waited_s)

    def _catch_up(self, frames: list[FramePoses], *, age_s: float | None, since_s: float) -> None:
        """Take what was written before the driver came, and while that was gone through.

        It is history: it is seen, and not driven by. Ticks begin with frames so few that none
        falls out over them.
        """
        n_due = self._n_due(frames)
        for poses in frames:
            waited_s = max(0.0, frames[-1].time_s - poses.time_s)
            waited_s = math.inf if age_s is None else age_s + waited_s
            self._take(poses, taken_s=self._taken_s(poses.time_s, since_s - waited_s))
        self._n_histories += 1
        if n_due > 1 and self._n_histories < _MOST_HISTORIES:
            return
        self._is_driving = True
        self._crew.clock.take_frame(self._time_of_frame_s or 0.0)

    def _taken_s(self, time_s: float, there_s: float) -> float:
        """Return when a frame's image was taken at the latest; now where time is not a clock's."""
        now_s = self._crew.clock.steady_s()
        if not self._crew.clock.is_live:
            return now_s
        return min(there_s, now_s - self._lag.of(time_s, now_s))

    def tick(self) -> None:
        """Do the ticks that are due."""
        began_s = time.perf_counter()
        for time_s in self._crew.clock.due():
            late_s = max(0.0, self._crew.clock.now_s() - time_s) if self._crew.clock.is_live else 0
            self._tick(time_s, began_s - late_s)
            began_s = time.perf_counter()
        self._crew.log.n_ticks_skipped = self._crew.clock.n_skipped
        self._crew.log.n_steps_missed = self.n_missed

    def listen(self) -> None:
        """Hear what the robot says."""
        now_s = self._crew.clock.steady_s()
        for said in self._crew.robot.listen():
            self._complaints.hear(said, now_s)
            if said.what == "described" and said.robot == self._letter and not self.is_answered:
                self.is_answered = True
                text = f"FishBot {self._letter} answers."
                self._crew.tell(Note(text=text, kind="answered", values={"robot": self._letter}))

    def status(self, total_s: float | None) -> DriveStatus:
        """Return the state of now.

        Parameters
        ----------
        total_s
            Seconds after which the driver is to end; None for no end.
        """
        log = self._crew.log
        return DriveStatus(
            time_s=self._time_of_frame_s,
            total_s=total_s,
            model=self._model.name,
            held=self._held,
            steps_missed=self.n_missed,
            pose_to_state_s=log.lately(POSE_TO_STATE),
            tick_to_byte_s=log.lately(TICK_TO_BYTE),
        )

    def _begin(self, time_s: float) -> None:
        self._begun = True
        self._log_model(time_s, self._model, begins=True)

    def _take(self, poses: FramePoses, *, taken_s: float) -> None:
        if self.pilot.is_due(poses.frame):
            self._look_for_model(poses.time_s)
        before, n_missed = self.pilot.pose, self.pilot.n_missed
        target = self.pilot.see(poses, self._model)
        pose, self._time_of_frame_s = self.pilot.pose, poses.time_s
        self._tell_missed(poses.time_s, self.pilot.n_missed - n_missed, "no frame came in time")
        seen = pose is not None and pose is not before
        if seen:
            self._freshen(taken_s)
        place: dict[str, float | None] = {"x_m": None, "y_m": None, "heading_rad": None}
        if seen and pose is not None:
            place = {"x_m": pose.x_m, "y_m": pose.y_m, "heading_rad": pose.heading_rad}
        item = {"what": "pose", "time_s": poses.time_s, "frame": poses.frame}
        self._crew.log.add(item | {"agents": self.pilot.n_others} | place)
        self._tell_doubts(poses.time_s)
        self._note(target)

    def _tell_doubts(self, time_s: float) -> None:
        """Say who was left out: of the robot as a fault, of fish once for each reason."""
        robots = [doubt for agent, doubt in self.pilot.doubts if agent.kind == ROBOT]
        if robots:
            if math.isinf(self._doubted_s):
                says = f"The robot's pose is implausible and not driven by: {robots[0].says}."
                self._fault(time_s, _IMPLAUSIBLE, says)
            self._doubted_s = time_s
        elif time_s - self._doubted_s > PATIENCE_S and not math.isinf(self._doubted_s):
            self._doubted_s = -math.inf
            self._fault(time_s, _IMPLAUSIBLE, f"No more {_IMPLAUSIBLE}.", ended=True)
        for agent, doubt in self.pilot.doubts:
            if agent.kind != ROBOT and doubt.kind not in self._doubted:
                self._doubted.add(doubt.kind)
                text = f"{time_s:.1f} s: fish {agent.agent} counts as absent: {doubt.says}."
                self._crew.tell(Note(text=text, warning=True))

    def _count_late(self, frames: list[FramePoses]) -> None:
        """Count steps that nobody swims by, since frames of the next one have come as well."""
        due = self._n_due(frames)
        if due > 1:
            self._n_late += due - 1
            self._tell_missed(frames[-1].time_s, due - 1, "the driver was held up")

    def _n_due(self, frames: list[FramePoses]) -> int:
        """Return how many steps of the model fall into the frames."""
        return len({self.pilot.step_of(poses.frame) for poses in frames} - {self.pilot.step})

    @property
    def n_missed(self) -> int:
        """Steps of the model that no command followed, though the trial went on."""
        return self.pilot.n_missed + self._n_late

    def _tell_missed(self, time_s: float, steps: int, because: str) -> None:
        if steps:
            text = f"{time_s:.1f} s: {steps} steps of the model were missed: {because}."
            values = {"time_s": time_s, "steps": steps, "total": self.n_missed, "because": because}
            self._crew.tell(Note(text=text, warning=True, kind="missed", values=values))

    def _freshen(self, at_s: float) -> None:
        """Take what is known of the robot as known at a time of the steady clock."""
        if not at_s > self._seen_s or self._crew.clock.steady_s() - at_s > PATIENCE_S:
            return
        watchdog = self._crew.watchdog
        if watchdog is not None:
            if math.isinf(self._seen_s):
                # Before the first pose it held the robot, as it should.
                self._n_bites = watchdog.n_bites
            watchdog.fresh(at_s)
        self._seen_s = at_s

    def _note(self, target: Target | None) -> None:
        if target is not None:
            self.n_targets += 1
            self._crew.log.add(target_item(target))

    def _tick(self, time_s: float, due_s: float) -> None:
        now_s = self._crew.clock.steady_s()
        was_held_up, self._ticked_s = now_s - self._ticked_s > PATIENCE_S, now_s
        held = self._reason()
        command = self.pilot.tick(time_s, held)
        sent = self._crew.robot.send(command.message)
        if sent and self._crew.clock.is_live:
            self._measure(time.perf_counter() - due_s)
        self.n_commands += 1
        is_explained = held in {"stale-pose", "port-lost", "helper-lost"} and not was_held_up
        self._tell_bites(time_s, is_explained=is_explained)
        by_itself = command.held in {"refused", STALE_TARGET}
        self._tell_changes(time_s, command.held if by_itself else held)
        told = {"sent": sent, "n_sent": self._crew.robot.n_sent}
        self._crew.log.add(command_item(command, self._letter) | told)

    def _measure(self, late_s: float) -> None:
        """Note how late a tick was, and those that fell out before it."""
        skipped = self._crew.clock.n_skipped - self._crew.log.n_ticks_skipped
        for before in range(skipped + 1):
            self._crew.log.measure(TICK_TO_BYTE, late_s + before * TICK_S)

    def _reason(self) -> str:
        """Return why the robot may not be driven on; empty if it may."""
        if not self._crew.robot.line.is_open:
            return "port-lost"
        # On the poses' clock nothing depends on how busy the computer is.
        if self._crew.clock.is_live and not self._crew.robot.line.is_guarded:
            return "helper-lost"
        now_s = self._crew.clock.steady_s()
        fault = self._complaints.fault(now_s)
        if fault == "power-down":
            return fault
        if self.pilot.pose is not None and now_s - self._seen_s > PATIENCE_S:
            return "stale-pose"
        return fault

    def _tell_bites(self, time_s: float, *, is_explained: bool) -> None:
        """Say that the watchdog had to stop the robot, where nothing else explains it."""
        watchdog = self._crew.watchdog
        if watchdog is not None and watchdog.n_bites != self._n_bites:
            self._n_bites = watchdog.n_bites
            if self.pilot.pose is not None and not is_explained:
                self._fault(time_s, "watchdog", _SAYS["watchdog"])

    def _tell_changes(self, time_s: float, held: str) -> None:
        if held == self._held:
            return
        if self._held:
            self._fault(time_s, self._held, f"No more {self._held}.", ended=True)
        if held:
            self._fault(time_s, held, _SAYS[held])
        self._held = held

    def _fault(self, time_s: float, fault: str, says: str, *, ended: bool = False) -> None:
        item = {"what": "fault", "time_s": time_s, "fault": fault, "says": says, "ended": ended}
        self._crew.log.add(item)
        values = {"time_s": time_s, "fault": fault, "ended": ended}
        text = f"{time_s:.1f} s: {says}"
        self._crew.tell(Note(text=text, warning=not ended, kind="fault", values=values))

    def _look_for_model(self, time_s: float) -> None:
        found = self._crew.models.look(time_s)
        if self._crew.models.problem:
            says = f"{self._crew.models.problem} The model before drives on."
            self._fault(time_s, "model", says)
        if found is not None:
            self._model = found
            self._log_model(time_s, found)

    def _log_model(self, time_s: float, model: InForce, *, begins: bool = False) -> None:
        self.models_used.append(model.name)
        item: dict[str, Any] = {
            "what": "model",
            "time_s": time_s,
            "model": model.name,
            "sha256": model.sha256,
            "parameters": model.text,
            "begins": begins,
        }
        self._crew.log.add(item)
        values = {"time_s": time_s, "model": model.name, "sha256": model.sha256}
        text = f"{time_s:.1f} s: {model.name} drives."
        self._crew.tell(Note(text=text, kind="model", values=values))
