"""How quick the driver is: from a pose to its state, and from a tick to the last byte.

A tracker's poses are written at 15 Hz as a tracker writes them, `zfcal drive` follows them
as a process and talks to a virtual robot behind a pseudo-terminal. Beside it another trial is
calibrated again and again, on as many cores as are asked for, with the priority that `zfcal watch`
gives to rounds. The figures are those of the driver's own log.
"""

from __future__ import annotations

import contextlib
import json
import math
import statistics
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import load, machine, table, zfcal
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.arrays import Floats
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model, write_model
from zfcal.artifacts.pose_files import PoseWriter
from zfcal.artifacts.pose_messages import POSES
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner, Pilot
from zfcal.model.simulate import simulate_tracks
from zfcal.robot.fishbot import FishBot
from zfcal.stages.trial_context import open_trial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

TARGET_S = 0.020
MODEL = "zfcal.model/1"
FPS = 15
ZFCAL = (sys.executable, "-m", "zfcal_cli.main")
CALIBRATE = """
import os, sys
from zfcal_cli.main import run
os.nice(10)
while run(["calibrate", *sys.argv[1:], "--budget", "50s", "--force", "-q"]) == 0:
    pass
"""


def measure(seconds: int, busy: int) -> dict[str, Any]:
    """Drive for so long beside other work, and return what the driver's log says."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "trial"
        zfcal("init", root, "--arena", "two-rooms", "--fish", 4, "--robot", "--fps", FPS)
        with calibrating(root.with_name("other"), root / "models" / "000000.toml", busy):
            words = ["drive", str(root), "--port", "virtual", "--json", "-q"]
            words += ["--duration", str(seconds)]
            driver = subprocess.Popen([*ZFCAL, *words], stdout=subprocess.PIPE, text=True)
            write_poses(root, driver)
            document = json.loads(driver.communicate()[0])
    found: dict[str, Any] = document["results"][0]["latency"]
    return found


@contextlib.contextmanager
def calibrating(root: Path, model: Path, workers: int) -> Iterator[None]:
    """Calibrate two minutes of simulated fish again and again meanwhile."""
    if not workers:
        yield
        return
    zfcal("simulate", root, "--model", model, "--duration", "120s")
    zfcal("analyse", root)
    words = [sys.executable, "-c", CALIBRATE, str(root), "--workers", str(workers)]
    other = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    try:
        yield
    finally:
        is_alive = other.poll() is None
        other.kill()
        other.wait()
    if not is_alive:
        raise SystemExit("The calibration beside the driver has ended by itself.")


def markdown(found: dict[str, Any]) -> str:
    """Return the table of what was measured."""
    said = f"""Made by `benchmarks/drive/bench_drive.py`; numbers in
        `benchmarks/results/drive.json`. Machine: {found["machine"]}; load
        {found["load_before"]:.1f} before. {found["seconds"]} s of poses at {FPS} Hz, a
        virtual robot at a pseudo-terminal, a calibration with {found["busy"]} workers beside it.
        Wanted: 95 % within 20 ms, no step missed."""
    rows = [
        [says, *(1e3 * found["latency"][name][key] for key in ("median", "p95", "max"))]
        for name, says in (
            ("pose_to_state_s", "pose written to state"),
            ("tick_to_byte_s", "control tick to last byte"),
        )
    ]
    head = ("latency", "median (ms)", "95 % (ms)", "largest (ms)")
    missed = (
        f"Steps missed: {found['latency']['steps_missed']}, those included that came too late for "
        f"any command; ticks left out: {found['latency']['ticks_skipped']}, which count as late as "
        "the one after them. A pose that waited behind another one counts from its own time."
    )
    text = textwrap.fill(" ".join(said.split()), 120)
    return f"# The driver\n\n{text}\n\n{table(head, rows)}\n{textwrap.fill(missed, 120)}\n"


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return what is compared with the committed results."""
    return {
        f"{name}, 95 % over 20 ms": Ratio(value=found["latency"][name]["p95"] / TARGET_S)
        for name in ("pose_to_state_s", "tick_to_byte_s")
    }


class NoLine:
    """A line on which nothing is said."""

    is_open, is_guarded, n_opened = False, False, 0

    def write(self, data: bytes) -> bool:  # noqa: ARG002 - a line's signature
        """Send nothing."""
        return False

    def read(self) -> bytes:
        """Hear nothing."""
        return b""

    def beat(self, until_s: float) -> None:
        """Tell nobody."""

    def close(self) -> None:
        """Leave nothing."""


EFFECTS: dict[str, dict[str, dict[str, float]]] = {
    "none": {},
    "a component (alignment)": {"alignment": {}},
    "a tilt (turning-bias)": {"turning-bias": {}},
    "one on speed (crowding)": {"crowding": {}},
}


def cost_of_effects(rounds: int) -> dict[str, float]:
    """Return the median time of a step of the driver in microseconds, by effect and by turns."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "trial"
        zfcal("init", root, "--arena", "two-rooms", "--fish", 4, "--robot", "--fps", FPS)
        opened, own = open_trial(root), read_model(root / "models" / "000000.toml")
        pilot = Pilot(opened, Manner(), FishBot("F", NoLine()))
        models = {}
        for name, effects in EFFECTS.items():
            path = root / "models" / "extended.toml"
            write_model(
                path, replace(own, effects=effects), Lineage(schema=MODEL, command="extend")
            )
            models[name] = DriveModels(opened, only=path).first()
            pilot.warm_up(models[name])
        xy, heading = simulate_tracks(own, opened.arena, n_agents=5, n_steps=rounds, seed=1)
    taken: dict[str, list[float]] = {name: [] for name in models}
    number = 0
    for at, towards in zip(xy[:rounds], heading[:rounds], strict=True):
        for name, model in models.items():
            poses = frame_of(number, at, towards)
            began_s = time.perf_counter()
            pilot.see(poses, model)
            taken[name].append(1e6 * (time.perf_counter() - began_s))
            number += round(opened.trial.dt_s * FPS)
    return {name: statistics.median(values) for name, values in taken.items()}


def main() -> None:
    """Measure, write, compare."""
    made = parser(__doc__)
    made.add_argument("--seconds", type=int, default=60, help="How long to drive.")
    made.add_argument("--busy", type=int, default=2, help="Workers of the calibration beside it.")
    made.add_argument("--effects", action="store_true", help="What effects cost, and no more.")
    options = made.parse_args()
    if options.effects:
        cost = cost_of_effects(200 if options.tiny else 5000)
        print(table(("effect", "a step (us)"), [[name, taken] for name, taken in cost.items()]))
        return
    seconds = 5 if options.tiny else options.seconds
    found = {
        "machine": machine(),
        "load_before": load(),
        "seconds": seconds,
        "busy": options.busy,
        "latency": measure(seconds, options.busy),
    }
    conclude("drive", found, markdown(found), ratios=ratios, options=options)


def frame_of(number: int, xy_m: Floats, heading_rad: Floats) -> FramePoses:
    """Return a frame of four fish and a robot."""
    agents = tuple(
        AgentPose(
            agent=i,
            kind=ROBOT if i == 4 else FISH,
            x_m=float(xy_m[i, 0]),
            y_m=float(xy_m[i, 1]),
            heading_rad=math.remainder(float(heading_rad[i]), 2 * math.pi),
            confidence=1.0,
        )
        for i in range(5)
    )
    return FramePoses(time_s=number / FPS, frame=number, agents=agents)


def write_poses(root: Path, driver: subprocess.Popen[str]) -> None:
    """Write a frame every fifteenth of a second until the driver has ended."""
    opened = open_trial(root)
    model = read_model(root / "models" / "000000.toml")
    xy, heading = simulate_tracks(model, opened.arena, n_agents=5, n_steps=20_000, seed=1)
    stride = round(opened.trial.dt_s * FPS)
    origin = Lineage(schema=POSES, command="track")
    began_s, minute, writer, number = time.monotonic(), -1, None, 0
    while driver.poll() is None:
        k, share = divmod(number, stride)
        at = xy[k] + (xy[k + 1] - xy[k]) * share / stride
        if number // (60 * FPS) != minute:
            minute = number // (60 * FPS)
            if writer is not None:
                writer.close()
            writer = PoseWriter(root / "poses" / f"{60 * minute:06d}.mcap", origin)
        writer.add(frame_of(number, at, heading[k]))
        number += 1
        time.sleep(max(0.0, began_s + number / FPS - time.monotonic()))


if __name__ == "__main__":
    main()
