"""How quick the driver is: from a pose to its state, and from a tick to the last byte.

A tracker's poses are written at 15 Hz as a tracker writes them, `zfcal drive` follows them
as a process and talks to a virtual robot behind a pseudo-terminal, and another process
keeps as many cores busy as is asked for. The figures are those of the driver's own log.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model
from zfcal.artifacts.pose_files import POSES, PoseWriter
from zfcal.model.simulate import simulate_tracks
from zfcal.online.opening import open_trial
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

TARGET_S = 0.020
FPS = 15
BUSY = "import os; os.nice(10)\nwhile True: sum(range(10000))"


def main() -> None:
    """Measure, print, and fail where a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=60, help="how long to drive")
    parser.add_argument("--busy", type=int, default=2, help="cores that other work keeps busy")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "trial"
        zfcal = [sys.executable, "-m", "zfcal_cli.main"]
        words = ["--arena", "two-rooms", "--fish", "4", "--robot", "--fps", str(FPS), "-q"]
        subprocess.run([*zfcal, "init", str(root), *words], check=True, stdout=subprocess.DEVNULL)
        others = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(given.busy)]
        words = ["drive", str(root), "--port", "virtual", "--json", "-q"]
        words += ["--duration", str(given.seconds)]
        driver = subprocess.Popen([*zfcal, *words], stdout=subprocess.PIPE, text=True)
        try:
            write_poses(root, driver)
            document = json.loads(driver.communicate()[0])
        finally:
            for other in others:
                other.kill()
                other.wait()
    found = document["results"][0]["latency"]
    print(json.dumps({"seconds": given.seconds, "busy": given.busy} | found, indent=2))
    slow = [n for n in ("pose_to_state_s", "tick_to_byte_s") if found[n]["p95"] > TARGET_S]
    if slow or found["steps_missed"]:
        sys.exit(f"missed: {', '.join(slow) or 'steps'}")


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
        agents = tuple(
            AgentPose(
                agent=i,
                kind=ROBOT if i == 4 else FISH,
                x_m=float(at[i, 0]),
                y_m=float(at[i, 1]),
                heading_rad=math.remainder(float(heading[k, i]), 2 * math.pi),
                confidence=1.0,
            )
            for i in range(5)
        )
        if number // (60 * FPS) != minute:
            minute = number // (60 * FPS)
            if writer is not None:
                writer.close()
            writer = PoseWriter(root / "poses" / f"{60 * minute:06d}.mcap", origin)
        writer.add(FramePoses(time_s=number / FPS, frame=number, agents=agents))
        number += 1
        time.sleep(max(0.0, began_s + number / FPS - time.monotonic()))


if __name__ == "__main__":
    main()
