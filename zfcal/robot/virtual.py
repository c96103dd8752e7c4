"""A FishBot behind a pseudo-terminal, as a process of its own: ``python -m zfcal.robot.virtual``.

Its terminal is a link in the file system that stays when the robot is unplugged and comes
back on another terminal. A Unix socket takes and gives JSON, one object a line.
`docs/drive.md` lists what it understands.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import selectors
import socket
import sys
import time
import tty
from collections.abc import Sequence
from pathlib import Path
from typing import Any, final

import shapely

from zfcal.robot.body import RADIUS_M, Pose
from zfcal.robot.confines import Confines
from zfcal.robot.simulated import STEP_S, SimulatedFishBot, Traits

_PATIENCE_S = 60.0
"""How long an advance waits for the events that are to come before it."""

_HEARD = 100_000
"""Frames that are remembered."""


@final
class _Terminal:
    """The robot's end of the line."""

    def __init__(self, link: Path) -> None:
        self._link = link
        self._ends: tuple[int, int] | None = None
        self.plug()

    @property
    def descriptor(self) -> int | None:
        """The robot's side; None while it is unplugged."""
        return None if self._ends is None else self._ends[0]

    def plug(self) -> None:
        """Open a terminal, and let the link point to it."""
        if self._ends is not None:
            return
        robot, computer = os.openpty()
        tty.setraw(computer)
        os.set_blocking(robot, False)
        # The computer's side stays open here: the line does not hang up when a driver leaves.
        self._ends = (robot, computer)
        part = self._link.with_name(f".{self._link.name}.part")
        part.unlink(missing_ok=True)
        part.symlink_to(os.ttyname(computer))
        part.replace(self._link)

    def unplug(self) -> None:
        """Take the terminal away from whoever has it open."""
        if self._ends is not None:
            self._link.unlink(missing_ok=True)
            for end in self._ends:
                os.close(end)
            self._ends = None

    def read(self) -> bytes:
        """Return what has come, maybe nothing."""
        try:
            return b"" if self._ends is None else os.read(self._ends[0], 4096)
        except OSError:
            return b""

    def write(self, data: bytes) -> None:
        """Say something; what nobody takes is lost, as on the air."""
        if self._ends is not None and data:
            with contextlib.suppress(OSError):
                os.write(self._ends[0], data)


@final
class _VirtualRobot:
    """Serves one simulated robot to a line and to those who watch it.

    Parameters
    ----------
    robot
        The robot.
    link, control
        Where its terminal and its socket appear.
    stepped
        Whether time moves only when the socket says so.
    """

    def __init__(
        self, robot: SimulatedFishBot, link: Path, control: Path, *, stepped: bool
    ) -> None:
        self._robot = robot
        self._stepped = stepped
        self._terminal = _Terminal(link)
        self._control = control
        self._server = socket.socket(socket.AF_UNIX)
        control.unlink(missing_ok=True)
        self._server.bind(str(control))
        self._server.listen()
        self._began_s = time.monotonic()
        self._heard: list[tuple[float, str]] = []
        self._clients: dict[socket.socket, bytearray] = {}
        self._watching: dict[socket.socket, tuple[float, float]] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._server, selectors.EVENT_READ)
        self._ended = False

    def serve(self, *, until_eof: bool) -> None:
        """Work until told to end; with ``until_eof`` also until standard input ends."""
        if until_eof:
            self._selector.register(sys.stdin, selectors.EVENT_READ)
        self._listen()
        try:
            while not self._ended:
                for key, _ in self._selector.select(None if self._stepped else STEP_S):
                    self._serve(key.fileobj)
                self._move_on()
        finally:
            self._terminal.unplug()
            self._control.unlink(missing_ok=True)

    def _serve(self, source: Any) -> None:
        if source is self._server:
            client, _ = self._server.accept()
            self._clients[client] = bytearray()
            self._selector.register(client, selectors.EVENT_READ)
        elif source is sys.stdin:
            self._ended = not os.read(sys.stdin.fileno(), 4096)
        elif isinstance(source, socket.socket):
            self._hear_client(source)
        else:
            self._hear_line()

    def _move_on(self) -> None:
        if not self._stepped:
            self._robot.advance(time.monotonic() - self._began_s)
        self._terminal.write(self._robot.take_output())
        for client, (every_s, last_s) in list(self._watching.items()):
            if self._robot.time_s - last_s >= every_s - 1e-9:
                self._watching[client] = (every_s, self._robot.time_s)
                self._reply(client, self._where())

    def _hear_line(self) -> None:
        for frame in self._robot.receive(self._terminal.read()):
            self._heard.append((self._robot.time_s, frame.encode().hex()))
        del self._heard[:-_HEARD]

    def _hear_client(self, client: socket.socket) -> None:
        try:
            data = client.recv(65536)
        except OSError:
            data = b""
        if not data:
            self._leave(client)
            return
        *lines, rest = (self._clients[client] + data).split(b"\n")
        self._clients[client] = bytearray(rest)
        for line in lines:
            try:
                answer = self._do(client, json.loads(line))
            except (ValueError, KeyError, TypeError) as error:
                answer = {"error": f"{type(error).__name__}: {error}"}
            self._reply(client, answer)

    def _reply(self, client: socket.socket, answer: dict[str, Any]) -> None:
        try:
            client.sendall(json.dumps(answer).encode() + b"\n")
        except OSError:
            self._leave(client)

    def _leave(self, client: socket.socket) -> None:
        if client in self._clients:
            self._selector.unregister(client)
            self._clients.pop(client)
            self._watching.pop(client, None)
            client.close()

    def _do(self, client: socket.socket, asked: dict[str, Any]) -> dict[str, Any]:
        match asked["do"]:
            case "advance":
                self._await(int(asked.get("received", 0)))
                self._robot.advance(float(asked["to_s"]))
            case "place":
                self._robot.place(Pose(**{k: float(asked[k]) for k in Pose.__slots__}))
            case "power-down":
                self._robot.starve(float(asked["for_s"]))
            case "obstacle":
                self._robot.meet_obstacle()
            case "unplug":
                self._deafen()
            case "plug":
                self._terminal.plug()
                self._listen()
            case "watch":
                self._watching[client] = (float(asked["every_s"]), self._robot.time_s)
            case "heard":
                heard, self._heard = self._heard, []
                return {**self._where(), "heard": heard}
            case "end":
                self._ended = True
            case "pose":
                pass
            case other:
                message = f"nothing is known of {other!r}"
                raise ValueError(message)
        return self._where()

    def _where(self) -> dict[str, Any]:
        robot = self._robot
        return {
            "time_s": robot.time_s,
            "x_m": robot.pose.x_m,
            "y_m": robot.pose.y_m,
            "heading_rad": robot.pose.heading_rad,
            "left_m_s": robot.wheels.left_m_s,
            "right_m_s": robot.wheels.right_m_s,
            "received": robot.n_received,
        }

    def _await(self, received: int) -> None:
        """Read until so many events have come: a terminal passes them on in its own time."""
        end_s = time.monotonic() + _PATIENCE_S
        while self._robot.n_received < received:
            self._hear_line()
            if time.monotonic() > end_s:
                message = f"only {self._robot.n_received} of {received} events have come"
                raise ValueError(message)
            time.sleep(0.0002)

    def _listen(self) -> None:
        if self._terminal.descriptor is not None:
            with contextlib.suppress(KeyError):
                self._selector.register(self._terminal.descriptor, selectors.EVENT_READ)

    def _deafen(self) -> None:
        if self._terminal.descriptor is not None:
            with contextlib.suppress(KeyError):
                self._selector.unregister(self._terminal.descriptor)
        self._terminal.unplug()


def main(argv: Sequence[str] | None = None) -> None:
    """Run a virtual robot until it is told to end."""
    parser = argparse.ArgumentParser(prog="zfcal.robot.virtual", description=__doc__)
    parser.add_argument("--link", type=Path, required=True, help="where its terminal appears")
    parser.add_argument("--control", type=Path, required=True, help="where its socket appears")
    parser.add_argument("--robot", default="F", help="its letter")
    parser.add_argument("--noise", type=float, default=Traits().noise, help="slip of the wheels")
    parser.add_argument("--lag-s", type=float, default=Traits().lag_s, help="lag of commands")
    parser.add_argument("--seed", type=int, default=0, help="of its noise")
    parser.add_argument(
        "--pose", default="0,0,0", help="where it starts: x, y in m, heading in rad"
    )
    parser.add_argument("--walls", default="", help="rings of the wall as JSON, in metres")
    parser.add_argument("--radius-m", type=float, default=RADIUS_M, help="how near it gets to them")
    parser.add_argument("--stepped", action="store_true", help="time moves by the socket alone")
    parser.add_argument("--until-eof", action="store_true", help="end when standard input does")
    given = parser.parse_args(argv)
    x, y, heading = (float(word) for word in given.pose.split(","))
    walls = json.loads(given.walls) if given.walls else None
    confines = walls and Confines(shapely.Polygon(walls[0], walls[1:]), given.radius_m)
    robot = SimulatedFishBot(
        Traits(letter=given.robot, noise=given.noise, lag_s=given.lag_s),
        Pose(x_m=x, y_m=y, heading_rad=heading),
        seed=given.seed,
        confines=confines,
    )
    served = _VirtualRobot(robot, given.link, given.control, stepped=given.stepped)
    print(json.dumps({"port": str(given.link)}), flush=True)  # noqa: T201 - it is ready
    with contextlib.suppress(KeyboardInterrupt):
        served.serve(until_eof=given.until_eof)


if __name__ == "__main__":
    main()
