"""The picture and the tables of `bench_growth.py`."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from benchmarks.shared.measuring import table
from zfcal.report.figures.theme import FISH, GROUP, MODEL, MUTED, ROBOT, new_figure, save_png, style


def draw(found: dict[str, Any], path: Path) -> None:
    """Draw the four ways of growing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with style():
        figure = new_figure(8.0, 6.2)
        axes = figure.subplots(2, 2)
        _agents(axes[0, 0], found)
        _curve(
            axes[0, 1], found["duration"], "duration_s", {"simulate_s": ("simulate", FISH)},
            ("Duration", "simulated time (s)", "processor time (s)"),
        )  # fmt: skip
        _curve(
            axes[1, 0], found["population"], "population",
            {"generation_s": ("generation", FISH), "optimiser_s": ("optimiser alone", MODEL)},
            ("Population", "individuals", "processor time (s)"),
        )  # fmt: skip
        _curve(
            axes[1, 1], found["trials"], "trials", {"processor_s": ("calibrate", FISH)},
            ("Trials", "trials, a round each", "processor time (s)"),
        )  # fmt: skip
        save_png(figure, path)


def _curve(
    axes: Axes,
    rows: list[dict[str, float]],
    x: str,
    lines: dict[str, tuple[str, str]],
    titles: tuple[str, str, str],
) -> None:
    size = np.array([row[x] for row in rows])
    for number, (key, (label, colour)) in enumerate(lines.items()):
        cost = np.array([row[key] for row in rows])
        axes.loglog(size, cost, color=colour, marker="o^s"[number], label=label)
        axes.loglog(size, cost[-1] * size / size[-1], color=MUTED, linestyle=":")
    axes.set(title=titles[0], xlabel=titles[1], ylabel=titles[2])
    axes.legend(loc="upper left")
    _plain(axes, size)


def _plain(axes: Axes, sizes: np.ndarray) -> None:
    """Write numbers as they are: the theme sets no formulas."""
    far: list[float] = []
    for size in sizes[::-1]:
        far += [size] if not far or 2 * size <= far[-1] else []
    axes.set_xticks(far, [f"{size:,.0f}" for size in far], rotation=30)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _agents(axes: Axes, found: dict[str, Any]) -> None:
    rows = found["agents"]
    n = np.array([row["agents"] for row in rows])
    marks = {
        "two_rooms_ns": ("two rooms", FISH, "o-"),
        "roomy_ns": ("the same room for each", GROUP, "D-"),
        "two_rooms_all_pairs_ns": ("all pairs, two rooms", ROBOT, "s--"),
        "roomy_all_pairs_ns": ("all pairs, the same room", MODEL, "^--"),
    }
    for key, (label, colour, line) in marks.items():
        axes.loglog(n, [row[key] for row in rows], line, color=colour, label=label)
    axes.axvline(found["most_in_full"], color=MUTED, linestyle=":")
    axes.set(title="Agents", xlabel="agents", ylabel="ns per agent-step")
    axes.legend(loc="upper left")
    _plain(axes, n)


def _rows(rows: list[dict[str, float]], *keys: str) -> list[list[object]]:
    return [[row[key] for key in keys] for row in rows]


def _prose(text: str) -> str:
    return textwrap.fill(" ".join(text.split()), 120) + "\n"


def _head(found: dict[str, Any]) -> list[str]:
    only = found.get("only")
    again = f"Of the last run is the part on {only}; the rest is of a former one." if only else ""
    return [
        "# How the cost grows\n",
        _prose(
            f"""Made by `benchmarks/speed/bench_growth.py`; numbers in
            `benchmarks/results/growth.json`. Machine: {found["machine"]}; load
            {found["load_before"]:.1f} before, {found["load_after"]:.1f} after. Processor time, one
            thread; an exponent is the slope of cost over size on logarithmic scales, over the
            larger half of the sizes. {again}"""
        ),
        "![Cost over agents, duration, population and trials](pictures/growth.png)\n",
        "Dotted: in proportion to the size; upright, the group above which draws are thinned.\n",
    ]


def _by_agents(found: dict[str, Any]) -> list[str]:
    pairs, slopes = found["pairs"]["two_rooms"], found["slopes"]
    keys = ("two_rooms_ns", "two_rooms_all_pairs_ns", "two_rooms_ratio")
    keys += tuple(key.replace("two_rooms", "roomy") for key in keys)
    return [
        "## Agents\n",
        _prose(
            f"""Were all to look at all, an agent-step would cost {pairs["fixed_ns"]:.0f} ns, and
            {pairs["per_other_ns"]:.1f} ns for each other agent: a step's cost grows with the square
            of the group (exponents over the larger half {slopes["two_rooms_all_pairs"]:.2f} and
            {slopes["roomy_all_pairs"]:.2f}). So above {found["most_in_full"]} agents, unless a
            model has effects, neighbours are drawn by bounds of their solid angles and thinned by
            the true ones, which is the same law exactly; and distances are counted from sorted
            strips, with the same counts. Then the exponents are {slopes["two_rooms"]:.2f} in two
            rooms, ever more crowded, and {slopes["roomy"]:.2f} where each has the same room: there
            it is the number of agents close by that counts, and a group that swims together has
            more of them the larger it is."""
        ),
        _prose(
            """Both ways by turns in one run, ns per agent-step, least of several; "times" is all
            pairs over what is done. Up to the limit they are the same program."""
        ),
        table(
            (
                "agents",
                "two rooms",
                "all pairs",
                "times",
                "the same room for each",
                "all pairs",
                "times",
            ),
            _rows(found["agents"], "agents", *keys),
        ),
    ]


def _by_duration(found: dict[str, Any]) -> list[str]:
    slopes = found["slopes"]
    return [
        "## Duration\n",
        _prose(
            f"""Five agents; exponent {slopes["duration"]:.2f}. The first 60 s, which are dropped,
            come on top."""
        ),
        table(
            ("simulated (s)", "takes (s)"),
            _rows(found["duration"], "duration_s", "simulate_s"),
        ),
        _prose(f"""Analysing a trial on disk, with start-up: exponent {slopes["analysed"]:.2f}."""),
        table(
            ("recorded (s)", "processor time (s)", "largest memory (MB)"),
            _rows(found["analysed"], "duration_s", "processor_s", "peak_mb"),
        ),
    ]


def _by_number(found: dict[str, Any]) -> list[str]:
    slopes = found["slopes"]
    return [
        "## Population\n",
        _prose(
            f"""A generation at the default evaluation: exponent {slopes["population"]:.2f}. Ranking
            by fronts and both diversities compare all with all, and are small beside the
            simulations."""
        ),
        table(
            ("individuals", "generation (s)", "optimiser alone (s)"),
            _rows(found["population"], "population", "generation_s", "optimiser_s"),
        ),
        "## Trials\n",
        _prose(
            f"""One window each, five generations, in one command, with start-up: exponent
            {slopes["trials"]:.2f}."""
        ),
        table(
            ("trials", "processor time (s)", "largest memory (MB)"),
            _rows(found["trials"], "trials", "processor_s", "peak_mb"),
        ),
    ]


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was measured, and what they say."""
    parts = _head(found) + _by_agents(found) + _by_duration(found) + _by_number(found)
    return "\n".join(parts)
