"""How far apart fish and robot are in the ring: by the authors' definition, run by run.

Of the article that came with the recordings no number is known here; this is what its numbers
could be held against. Writes

    benchmarks/results/ring_distances.json    every number
    docs/reproduce.md                         its table

    .venv/bin/python benchmarks/real/ring_distances.py --data ../shared/data
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.real.document import as_json, replaced, score, table
from benchmarks.real.recordings import RINGS, ROBOTS
from benchmarks.real.ring import M_PER_PX, RingRun, fit_ring, read_ring
from benchmarks.shared.measuring import DOCS, RESULTS, ROOT

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Distances:
    """Means over frames and pairs; NaN where there is no robot.

    Parameters
    ----------
    fish_turns, robot_turns
        Between two fish, and between robot and fish: the angle about the ring's centre, as a share
        of a full turn.
    fish_m, robot_m
        The same along a straight line, in metres.
    """

    fish_turns: float
    robot_turns: float
    fish_m: float
    robot_m: float


def mean_distances(xy_m: Floats, robot: int | None) -> Distances:
    """Return how far apart agents are.

    Parameters
    ----------
    xy_m : ndarray, shape (frame, agent, 2)
        About the ring's centre. A pair counts in the frames in which both have a position.
    robot
        The robot's column; None for fish alone.

    Notes
    -----
    The angle is the inter-individual distance of the laboratory's own code for the ring
    (epfl-mobots/aegean, ``inter_individual_distance.hpp``): the shorter way round, over 360
    degrees. There every agent counts alike; here pairs with the robot stand by themselves.
    """
    one, other = np.triu_indices(xy_m.shape[1], k=1)
    angle = np.arctan2(xy_m[..., 1], xy_m[..., 0])
    apart = angle[:, one] - angle[:, other]
    turns = np.abs((apart + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi)
    metres = np.hypot(*np.moveaxis(xy_m[:, one] - xy_m[:, other], -1, 0))
    has_robot = (one == robot) | (other == robot)
    found = [
        float(np.nanmean(each[:, pairs])) if pairs.any() else np.nan
        for each in (turns, metres)
        for pairs in (~has_robot, has_robot)
    ]
    return Distances(fish_turns=found[0], robot_turns=found[1], fish_m=found[2], robot_m=found[3])


def of_run(run: RingRun) -> Distances:
    """Return the distances of a run, guessed positions included, as the authors used them."""
    centre_px = np.asarray(fit_ring(run).centre_px)
    return mean_distances((run.xy_px - centre_px) * M_PER_PX, run.robot)


def measure(data: Path) -> dict[str, Any]:
    """Return the numbers of all runs."""
    found = {}
    for file, title in RINGS.items():
        run = read_ring(data / "zebrafish-robot-ring" / f"{file}.npz")
        distances = of_run(replace(run, robot=ROBOTS.get(file, run.robot)))
        known = {name: value for name, value in asdict(distances).items() if np.isfinite(value)}
        found[file] = {"title": title, **known}
    return found


def tables(found: dict[str, Any]) -> dict[str, str]:
    """Return the table of the document, by its name there."""
    head = ["run", "fish to fish", "robot to fish", "ratio", "fish, straight", "robot, straight"]
    rows = []
    for one in found.values():
        fish, robot = one["fish_turns"], one.get("robot_turns")
        ratio = None if robot is None else robot / fish
        metres = [None if m is None else 1000 * m for m in (one["fish_m"], one.get("robot_m"))]
        rows.append(
            [one["title"], score(fish), score(robot), score(ratio, 2)]
            + ["–" if mm is None else f"{mm:.0f} mm" for mm in metres]
        )
    return {"ring": table(head, rows)}


def main() -> None:
    """Measure all runs, write numbers and table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    shared = os.environ.get("ZFCAL_SHARED_DATA", ROOT.parent / "shared" / "data")
    parser.add_argument("--data", type=Path, default=Path(shared), help="folder of the recordings")
    options = parser.parse_args()
    found = measure(options.data)
    (RESULTS / "ring_distances.json").write_text(as_json(found), encoding="utf-8")
    document = DOCS / "reproduce.md"
    text = replaced(document.read_text(encoding="utf-8"), tables(found))
    document.write_text(text, encoding="utf-8")
    print(document)


if __name__ == "__main__":
    main()
