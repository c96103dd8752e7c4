"""Draw what S of a model's own windows is: docs/pictures/score.png, and its figures.

Fish of one model in two rooms, in windows of different length, against that model and against
another one: by a long run from anywhere, and by windows from where the fish were.

    .venv/bin/python benchmarks/calibration/score_picture.py
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.shared.measuring import DOCS
from zfcal.arrays import Floats
from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.scores import population_scores
from zfcal.calibrate.group import Group, pool_runs, runs_of
from zfcal.model.simulate import Counts, simulate_tracks
from zfcal.model.start import Start
from zfcal.parameters import natural, to_genes
from zfcal.virtual.trial import starting_model

DT_S, N_FISH = 0.2, 4
LENGTHS_S = (30, 60, 120, 300, 600, 1800)
N_WINDOWS, FROM_START = 100, 60
FIRST_SEED = 9300
"""Of the windows; written down before the first."""


def scores(length_s: int, group: Group, genes: Floats, long: list[Counts]) -> Floats:
    """Return S of windows of the first model, shape (from anywhere or not, model, window)."""
    n_steps = round(length_s / DT_S)
    found = np.empty((2, len(genes), N_WINDOWS))
    for k in range(N_WINDOWS):
        xy_m, heading = simulate_tracks(
            group.template, group.arena, n_agents=N_FISH, n_steps=1, seed=FIRST_SEED + k
        )
        begun = group.begun(Start(poses=np.column_stack([xy_m[0], heading[0]]), time_s=0.0))
        words = {"n_counted": N_FISH, "n_steps": n_steps}
        seed = np.array([FIRST_SEED + 1000 + k], dtype=np.uint64)
        window = runs_of(begun.simulate(genes[:1], seeds=seed, **words), 0)
        n_runs = max(6, FROM_START * 120 // length_s)
        seeds = np.arange(n_runs, dtype=np.uint64) + FIRST_SEED + 5000
        here = pool_runs(begun.simulate(genes, seeds=seeds, **words))
        for model in range(len(genes)):
            found[0, model, k] = population_scores(window, long[model]).S[0]
            own = runs_of(here, model)
            found[1, model, k] = population_scores(window, own).S[0]
    return found


def main() -> None:
    """Print a table and draw it."""
    arena = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    true = natural(zones, dt_s=DT_S)
    other = starting_model(arena, dt_s=DT_S, robot="fixed")
    alike = tuple(
        replace(zone, speed_frequency=own.speed_frequency, kappa_w=None)
        for zone, own in zip(other.zones, true.zones, strict=True)
    )
    other = replace(other, zones=alike)
    genes = np.stack([to_genes(true), to_genes(other)])
    group = Group(arena=arena, template=true, n_fish=N_FISH, n_robots=0)
    runs = group.simulate(
        genes, n_counted=N_FISH, n_steps=9000, seeds=np.arange(10, dtype=np.uint64)
    )
    pooled = pool_runs(runs)
    long = [runs_of(pooled, k) for k in range(2)]
    table = np.stack([scores(length_s, group, genes, long) for length_s in LENGTHS_S])
    for row, length_s in zip(table, LENGTHS_S, strict=True):
        means = row.mean(axis=-1)
        low, high = np.quantile(row[0, 0], [0.025, 0.975])
        apart = row[:, 0] - row[:, 1]
        error = apart.std(axis=-1, ddof=1) / np.sqrt(N_WINDOWS)
        print(
            f"{length_s:5d} s: anywhere own {means[0, 0]:.3f} ({low:.3f} to {high:.3f}) other "
            f"{means[0, 1]:.3f} ({apart[0].mean():+.3f}, se {error[0]:.3f}); from there own "
            f"{means[1, 0]:.3f} other {means[1, 1]:.3f} ({apart[1].mean():+.3f}, se {error[1]:.3f})"
        )
    _draw(table).savefig(DOCS / "pictures" / "score.png", dpi=150)


def _draw(table: Floats) -> Figure:
    figure = Figure(figsize=(8.6, 3.4), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    titles = ("against a long run from anywhere", "against windows from where they were")
    minutes = np.array(LENGTHS_S) / 60
    for k, (panel, title) in enumerate(zip(panels, titles, strict=True)):
        for model, (name, colour, mark) in enumerate(
            (("the model of these fish", "#0072b2", "o"), ("another model", "#d55e00", "s"))
        ):
            values = table[:, k, model]
            panel.plot(minutes, values.mean(axis=-1), color=colour, marker=mark, label=name)
            low, high = np.quantile(values, [0.025, 0.975], axis=-1)
            if model == 0:
                panel.fill_between(
                    minutes, low, high, color=colour, alpha=0.15, lw=0, label="95 % of its windows"
                )
        panel.set_xscale("log")
        panel.set_xticks(minutes, [f"{m:g}" for m in minutes])
        panel.minorticks_off()
        panel.set_title(title, fontsize=10)
        panel.set_xlabel("length of a window (min)")
    panels[0].set_ylabel("S")
    panels[0].set_ylim(0, 1)
    panels[0].legend(loc="lower right", fontsize=8, frameon=False)
    figure.suptitle("Windows of four virtual fish in two rooms", fontsize=11)
    return figure


if __name__ == "__main__":
    main()
