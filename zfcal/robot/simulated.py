"""A FishBot that is not there: bytes in, bytes out, and where its wheels take it.

It keeps its own time, which whoever owns it moves on; with the same bytes at the same
times and the same seed it ends at the same place, however time is cut into pieces.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import final

import numpy as np

from zfcal.robot import events
from zfcal.robot.aseba import SYSTEM, Decoder, Frame
from zfcal.robot.body import (
    ACCELERATION_M_S2,
    TICK_M,
    WHEEL_BASE_M,
    WHEEL_LIMIT_M_S,
    Pose,
    Wheels,
    roll,
)
from zfcal.robot.confines import Confines
from zfcal.units import M_PER_CM

STEP_S = 0.005
_COMPLAINT_S = 0.2
_SLIP_S = 0.5
_TURNING_M_S = 0.08
_FACED_RAD = 0.02
_GLIDE_S = 0.5
_STILL_M_S = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Traits:
    """What is particular to a simulated robot.

    Parameters
    ----------
    letter
        Its name.
    noise
        Standard deviation of each wheel's slip, as a share of its speed; it lasts about
        half a second.
    lag_s
        From a command's last byte to its effect.
    """

    letter: str = "F"
    noise: float = 0.02
    lag_s: float = 0.03


@final
class SimulatedFishBot:
    """A FishBot on its own clock.

    Parameters
    ----------
    traits
        What is particular to it.
    pose
        Where it starts.
    seed
        Of its noise.
    confines
        What it cannot leave; None for an open plain.

    Attributes
    ----------
    pose, wheels
        Where it is, and how fast its wheels turn.
    way_m
        How far its wheels have gone.
    n_received
        Events that have come over the line; the network's own messages do not count.
    """

    def __init__(
        self,
        traits: Traits,
        pose: Pose,
        *,
        seed: int = 0,
        confines: Confines | None = None,
    ) -> None:
        self.traits = traits
        self.pose = pose
        self.wheels = Wheels()
        self.way_m = 0.0
        self.n_received = 0
        self._steps = 0
        self._asked = Wheels()
        self._behaviour: deque[tuple[str, float]] = deque()
        self._decoder = Decoder()
        self._due: deque[tuple[float, Frame]] = deque()
        self._output = bytearray()
        self._rng = np.random.default_rng(seed)
        self._slip = np.zeros(2)
        self._confines = confines
        self._starving_until_s = -math.inf
        self._complained_s = -math.inf

    @property
    def time_s(self) -> float:
        """What the robot's clock shows."""
        return self._steps * STEP_S

    def receive(self, data: bytes) -> list[Frame]:
        """Take bytes from the line, now; return the frames that they complete."""
        frames = self._decoder.feed(data)
        for frame in frames:
            if frame.type < SYSTEM:
                self.n_received += 1
            self._answer(frame)
            self._due.append((self.time_s + self.traits.lag_s, frame))
        return frames

    def take_output(self) -> bytes:
        """Return what it has said since the last question."""
        said, self._output = bytes(self._output), bytearray()
        return said

    def advance(self, to_s: float) -> None:
        """Move on until the clock shows this time."""
        while (self._steps + 1) * STEP_S <= to_s + 1e-9:
            self._step()

    def place(self, pose: Pose) -> None:
        """Put it down elsewhere."""
        self.pose = pose

    def meet_obstacle(self) -> None:
        """Say once that there is an obstacle."""
        self._say(events.OBSTACLE)

    def starve(self, for_s: float) -> None:
        """Lose the supply for a while: the wheels stand, and it says so again and again."""
        self._starving_until_s = self.time_s + for_s

    def _step(self) -> None:
        while self._due and self._due[0][0] <= self.time_s + 1e-9:
            self._obey(self._due.popleft()[1])
        self._behave()
        if self.time_s < self._starving_until_s:
            self._asked = Wheels()
            if self.time_s - self._complained_s >= _COMPLAINT_S - 1e-9:
                self._complained_s = self.time_s
                self._say(events.POWER_DOWN)
        self._roll()
        self._steps += 1

    def _roll(self) -> None:
        most = ACCELERATION_M_S2 * STEP_S
        left, right = (
            now + min(most, max(-most, asked - now))
            for now, asked in (
                (self.wheels.left_m_s, self._asked.left_m_s),
                (self.wheels.right_m_s, self._asked.right_m_s),
            )
        )
        self.wheels = Wheels(left_m_s=left, right_m_s=right)
        keep = math.exp(-STEP_S / _SLIP_S)
        noise = self.traits.noise * math.sqrt(1 - keep**2)
        self._slip = keep * self._slip + noise * self._rng.standard_normal(2)
        real = Wheels(
            left_m_s=left * (1 + float(self._slip[0])), right_m_s=right * (1 + float(self._slip[1]))
        )
        moved = roll(self.pose, real, STEP_S)
        self.way_m += real.speed_m_s * STEP_S
        if self._confines is not None:
            x, y, _ = self._confines.clamp(moved.x_m, moved.y_m)
            moved = Pose(x_m=x, y_m=y, heading_rad=moved.heading_rad)
        self.pose = moved

    def _answer(self, frame: Frame) -> None:
        node, name = events.node_of(self.traits.letter), events.node_name(self.traits.letter)
        asked = frame.arguments[0] if frame.arguments else -1
        if frame.type == events.LIST_NODES:
            self._output += events.node_present(node).encode()
        elif frame.type == events.GET_DESCRIPTION or (
            frame.type == events.GET_NODE_DESCRIPTION and asked == node
        ):
            self._output += events.description(node, name).encode()

    def _obey(self, frame: Frame) -> None:
        own = events.robot_index(self.traits.letter)
        arguments = frame.arguments
        if frame.type == events.STOP:
            self._behaviour.clear()
            self._asked = Wheels()
        elif frame.type == events.MOTOR_CONTROL + own and len(arguments) == 2:
            self._behaviour.clear()
            self._asked = _accepted(arguments[0] * M_PER_CM, arguments[1] * M_PER_CM)
        elif frame.type == events.FISH_BEHAVIOR + own and len(arguments) == 3:
            self._begin(*arguments)

    def _begin(self, turn_deg: int, ticks: int, speed_cm_s: int) -> None:
        """Turn, go so far, then glide: each part ends when nothing is left of it."""
        speed = speed_cm_s * M_PER_CM
        self._behaviour.clear()
        if _accepted(speed, speed).left_m_s == 0.0:
            self._asked = Wheels()
            return
        self._behaviour.extend((("turn", math.radians(turn_deg)), ("go", ticks * TICK_M)))
        self._behaviour.append(("glide", speed))

    def _behave(self) -> None:
        if not self._behaviour:
            return
        part, left = self._behaviour[0]
        if part == "turn":
            left -= self.wheels.turn_rad_s * STEP_S
            # Slowing down in time: the wheels have their inertia.
            braking = 0.7 * math.sqrt(ACCELERATION_M_S2 * WHEEL_BASE_M * abs(left))
            side = math.copysign(min(_TURNING_M_S, braking), left)
            self._asked = Wheels(left_m_s=-side, right_m_s=side)
            self._continue(part, left, ended=abs(left) < _FACED_RAD)
        elif part == "go":
            speed = self._behaviour[-1][1]
            self._asked = Wheels(left_m_s=speed, right_m_s=speed)
            left -= self.wheels.speed_m_s * STEP_S
            self._continue(part, left, ended=left <= 0)
        else:
            left *= math.exp(-STEP_S / _GLIDE_S)
            speed = left if left > _STILL_M_S else 0.0
            self._asked = Wheels(left_m_s=speed, right_m_s=speed)
            self._continue(part, left, ended=speed == 0.0)

    def _continue(self, part: str, left: float, *, ended: bool) -> None:
        self._behaviour.popleft()
        if not ended:
            self._behaviour.appendleft((part, left))

    def _say(self, event: int) -> None:
        node, index = events.node_of(self.traits.letter), events.robot_index(self.traits.letter)
        payload = index.to_bytes(2, "little")
        self._output += Frame(type=event, source=node, payload=payload).encode()


def _accepted(left_m_s: float, right_m_s: float) -> Wheels:
    """Return what the robot makes of wheel speeds: nothing, where one is too fast."""
    if max(abs(left_m_s), abs(right_m_s)) > WHEEL_LIMIT_M_S + 1e-9:
        return Wheels()
    return Wheels(left_m_s=left_m_s, right_m_s=right_m_s)
