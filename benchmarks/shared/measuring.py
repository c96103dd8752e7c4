"""What the benchmarks share: the machine, the clock, and where results go."""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"
DOCS = ROOT / "docs"


def machine() -> str:
    """Return what the numbers were measured on, and how busy it was with other things."""
    model = "unknown processor"
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.partition(":")[2].strip()
            break
    cores = len(os.sched_getaffinity(0))
    return f"{model}, {cores} cores, Python {platform.python_version()}"


def load() -> float:
    """Return the load of the last minute: above the number of cores others were at work."""
    return os.getloadavg()[0]


def zfcal(*words: object) -> None:
    """Run a command of zfcal to its end, silently."""
    line = [sys.executable, "-m", "zfcal_cli.main", *map(str, words), "-q"]
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL)


def median_s(run: Callable[[], object], *, repeats: int, clock: Callable[[], float]) -> float:
    """Return the median time of a call, after one that does not count."""
    run()
    times = []
    for _ in range(repeats):
        begin = clock()
        run()
        times.append(clock() - begin)
    return statistics.median(times)


def wall_s(run: Callable[[], object], *, repeats: int) -> float:
    """Return the median wall-clock time of a call."""
    return median_s(run, repeats=repeats, clock=time.perf_counter)


def processor_s(run: Callable[[], object], *, repeats: int) -> float:
    """Return the median processor time of a call, which others disturb less."""
    return median_s(run, repeats=repeats, clock=time.process_time)


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a Markdown table; numbers with three digits."""

    def cell(value: object) -> str:
        if isinstance(value, float):
            return f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}"
        return f"{value:,}" if isinstance(value, int) else str(value)

    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def keep(name: str, found: dict[str, Any], *, results: Path = RESULTS) -> None:
    """Write what was measured as JSON."""
    results.mkdir(parents=True, exist_ok=True)
    text = json.dumps(found, indent=1) + "\n"
    (results / f"{name}.json").write_text(text, encoding="utf-8")
