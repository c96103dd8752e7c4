"""Measure how often the intervals of a window's estimate hold the truth.

Simulation-based calibration (Talts et al. 2018, arXiv 1804.06788): truths are drawn, windows
simulated, parameters estimated, and it is counted how many intervals hold their truth. Makes
``coverage.json`` and ``benchmarks-coverage.md``: in ``build/benchmarks``, with ``--write`` in
``benchmarks/results`` and ``docs``.

    .venv/bin/python benchmarks/calibration/bench_coverage.py
"""

from __future__ import annotations

import os
import sys
import textwrap
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import betaincinv, ndtri

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.calibration.synthetic import DT_S, N_FISH, WINDOW_STEPS, samples_of, two_rooms
from benchmarks.shared.measuring import machine, table
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.model.extended import GENES, maximise
from zfcal.model.fitted import SCALES, Fitted, ZoneTurns, zone_scores
from zfcal.model.likelihood import fit
from zfcal.model.reach import within_reach
from zfcal.model.scene import Scene, make_scene
from zfcal.model.simulate import simulate_tracks
from zfcal.model.views import View
from zfcal.parameters import Parameters, from_genes, gene_names, gene_scales, to_genes

REPORTED = range(1, 241)
"""Seeds of the trials; intervals were developed on seeds from 1000 on."""

LEVELS = (0.5, 0.8, 0.95)
SPREAD = 0.3
"""Standard deviation of the log of each parameter about the natural model's."""

KINDS = ("kappa_0", "kappa_f", "alpha", "gamma")
BEFORE, NOW = "symmetric", "profile"
_SAYS = {BEFORE: "symmetric", NOW: "by profile"}
_SURE = 0.95
_NO_INFORMATION = 1e-9
_DIFFERENCE = 1e-4

Ends = dict[str, tuple[float, float]]


def truth_of(seed: int, template: Parameters) -> Parameters:
    """Return the model of a trial; what a genome cannot hold is drawn again."""
    rng = np.random.default_rng([41, seed])
    centre, made = to_genes(template), []
    for gene in centre:
        value = np.inf
        while value > 1.0:
            value = gene * np.exp(SPREAD * rng.standard_normal())
        made.append(value)
    return from_genes(np.array(made), template)


def values_of(model: Parameters, arena: Arena) -> dict[str, float]:
    """Return a model's parameters, each gamma over the largest of those within a step's reach.

    Those that no step leads to bear on nothing and are left out.
    """
    names, n = arena.zone_names, len(arena.zones)
    values = to_genes(model) * gene_scales(n)
    gamma, near = values[3 * n :].reshape(n, n), within_reach(arena, model.dt_s)
    gamma = np.where(near, gamma, np.nan)
    values[3 * n :] = (gamma / np.nanmax(gamma, axis=1, keepdims=True)).ravel()
    named = dict(zip(gene_names(names), values.tolist(), strict=True))
    return {name: value for name, value in named.items() if not np.isnan(value)}


def rows_of(seed: int) -> Iterator[dict[str, Any]]:
    """Yield what was found of each parameter of a trial, and whether its intervals hold it."""
    arena, template = two_rooms()
    truth = truth_of(seed, template)
    xy_m, _ = simulate_tracks(truth, arena, n_agents=N_FISH + 1, n_steps=WINDOW_STEPS, seed=seed)
    scene = make_scene(samples_of(xy_m), arena)
    fits = {level: fit(scene, template, level=level) for level in LEVELS}
    found = {NOW: {level: one.interval for level, one in fits.items()},
             BEFORE: symmetric(scene, template)}  # fmt: skip
    fitted = fits[LEVELS[-1]].lapse
    for name, value in values_of(truth, arena).items():
        zone, kind, *_ = name.split(".")
        if zone not in fitted:
            continue
        kinds = dict(zip(KINDS, (*SCALES, 1.0), strict=True))
        yield {
            "seed": seed,
            "name": name,
            "kind": kind,
            "truth": value,
            **{
                way: {
                    "held": [
                        bool(ends[level][name][0] - 1e-9 <= value <= ends[level][name][1] + 1e-9)
                        for level in LEVELS
                    ],
                    "width": float(np.diff(ends[LEVELS[-1]][name])[0] / kinds[kind]),
                }
                for way, ends in found.items()
            },
        }


def symmetric(scene: Scene, template: Parameters) -> dict[float, Ends]:
    """Return intervals by the curvature at the maximum, cut at bounds; the largest gamma fixed."""
    found = maximise(scene, template, bounds=GENES, n_workers=os.cpu_count() or 1)
    return {level: _symmetric(found, scene.arena.zone_names, level) for level in LEVELS}


def _symmetric(found: Fitted, names: Sequence[str], level: float) -> Ends:
    ends: Ends = {}
    for zone, x, turns in zip(names, found.x, found.turns, strict=True):
        if not turns.enough:
            continue
        half = ndtri(0.5 + level / 2) * _errors(x, _information(x, turns, found.view))
        low, high = x - half, x + half
        for k, key in enumerate(KINDS[:3]):
            pair = np.clip([low[k], high[k]], 0.0, 1.0) * SCALES[k]
            ends[f"{zone}.{key}"] = (float(pair[0]), float(pair[1]))
        for e, to in enumerate(names, start=3):
            with np.errstate(over="ignore"):
                pair = np.exp([low[e], high[e]])
            ends[f"{zone}.gamma.{to}"] = (float(pair[0]), min(1.0, float(pair[1])))
    return ends


def _errors(x: Floats, information: Floats) -> Floats:
    told = np.diag(information)[3:-1] > _NO_INFORMATION
    top = 3 + int(np.argmax(np.where(told, x[3:-1], -np.inf)))
    free = [p for p in range(x.size) if p != top and information[p, p] > _NO_INFORMATION]
    error = np.full(x.size, np.inf)
    covariance = np.linalg.pinv(information[np.ix_(free, free)])
    error[free] = np.sqrt(np.clip(np.diag(covariance), 0, None))
    error[top] = 0.0
    return error


def _information(x: Floats, turns: ZoneTurns, view: View) -> Floats:
    """Return the observed information, by differences of the exact slope."""
    matrix = np.empty((x.size, x.size))
    for p in range(x.size):
        up, down = x.copy(), x.copy()
        up[p] += _DIFFERENCE
        down[p] -= _DIFFERENCE
        if p < len(SCALES) or p == x.size - 1:
            down[p] = max(down[p], 1e-9)
        before, after = (zone_scores(at, turns, view)[1].sum(axis=0) for at in (down, up))
        matrix[p] = (before - after) / (up[p] - down[p])
    return (matrix + matrix.T) / 2


def share_and_ends(held: int, n: int) -> tuple[float, float, float]:
    """Return a share and the ends of its binomial interval (Clopper and Pearson 1934).

    >>> tuple(round(each, 3) for each in share_and_ends(9, 10))
    (0.9, 0.555, 0.997)
    """
    tail = (1 - _SURE) / 2
    low = betaincinv(held, n - held + 1, tail) if held else 0.0
    high = betaincinv(held + 1, n - held, 1 - tail) if held < n else 1.0
    return held / n, float(low), float(high)


def counted(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return, by kind of parameter and kind of interval, how many hold the truth."""
    made: dict[str, Any] = {}
    for kind in KINDS:
        own = [row for row in rows if row["kind"] == kind]
        if not own:
            continue
        made[kind] = {"n": len(own)}
        for way in (BEFORE, NOW):
            held = np.array([row[way]["held"] for row in own]).sum(axis=0).tolist()
            made[kind][way] = {
                "held": held,
                "shares": [share_and_ends(h, len(own)) for h in held],
                "width": float(np.median([row[way]["width"] for row in own])),
            }
    return made


def measure(seeds: Sequence[int]) -> dict[str, Any]:
    """Simulate, estimate and count."""
    begun = time.perf_counter()
    rows = [row for seed in seeds for row in rows_of(seed)]
    below = [row for row in rows if row["kind"] == "gamma" and row["truth"] < 1.0]
    return {
        "machine": machine(),
        "seeds": [min(seeds), max(seeds)],
        "trials": len(seeds),
        "levels": LEVELS,
        "kinds": counted(rows),
        "gamma_below_the_largest": counted(below)["gamma"],
        "wall_s": time.perf_counter() - begun,
    }


def ratios(found: dict[str, Any]) -> dict[str, Ratio]:
    """Return how many more 95 % intervals fail to hold the truth than should."""
    return {
        f"{kind}: share outside 95 % over 0.05": Ratio(value=(1 - one[NOW]["shares"][-1][0]) / 0.05)
        for kind, one in found["kinds"].items()
    }


def _table_of(kinds: dict[str, Any]) -> str:
    rows = []
    for kind, one in kinds.items():
        for way in (BEFORE, NOW):
            cells = [f"{s:.3f} ({low:.3f} to {high:.3f})" for s, low, high in one[way]["shares"]]
            rows.append([kind, one["n"], _SAYS[way], *cells, f"{one[way]['width']:.2f}"])
    heads = [f"{100 * level:.0f} % intervals" for level in LEVELS]
    return table(("parameter", "numbers", "interval", *heads, "width of 95 %"), rows)


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was counted."""
    first, last = found["seeds"]
    return "\n".join(
        [
            "# Do intervals hold the truth?\n",
            _prose(
                f"""Made by `benchmarks/calibration/bench_coverage.py` in
                {found["wall_s"] / 60:.0f} min; numbers in `benchmarks/results/coverage.json`.
                Machine: {found["machine"]}."""
            ),
            _prose(
                f"""Simulation-based calibration ([Talts et al. 2018](https://arxiv.org/abs/1804.06788))
                over {found["trials"]} trials, seeds {first} to {last}; intervals were developed on
                others. The truth of each trial is the natural model of `two-rooms` with the log of
                each parameter moved by a normal number of standard deviation {SPREAD:g}; what a
                genome cannot hold is drawn again. {N_FISH} fish and a robot move by it for
                {WINDOW_STEPS * DT_S:.0f} s in steps of {DT_S:g} s. The estimate of `calibrate`
                gives an interval for each parameter of each zone with 30 steps or more."""
            ),
            "## Share of intervals that hold the truth\n",
            _prose(
                """With the binomial interval (95 %) of the share. "By profile" is what a model file
                states. "Symmetric" are those that were stated before, for comparison: by the
                curvature at the maximum, cut at bounds, with the largest gamma of a row fixed. The
                width is the median, as a share of the parameter's range. A gamma is one over the
                largest of those within a step's reach."""
            ),
            _table_of(found["kinds"]),
            "## Gammas that are not the largest of their row\n",
            _prose(
                """The largest one is 1, which is the end of many intervals: of these, the shorter
                ones hold the truth more often than they say. All others:"""
            ),
            _table_of({"gamma": found["gamma_below_the_largest"]}),
            _prose(
                """Numbers of one window hang together, so that the binomial intervals are a little
                narrow. The law is right here; where fish move by another one, as real fish do, an
                interval is for the parameter under which the law comes nearest to them."""
            ),
        ]
    )


def _prose(text: str) -> str:
    return textwrap.fill(" ".join(text.split()), 120, break_long_words=False) + "\n"


def main() -> None:
    """Measure, write both files, and compare with the committed results."""
    options = parser(__doc__).parse_args()
    found = measure(REPORTED[:3] if options.tiny else REPORTED)
    conclude("coverage", found, markdown(found), ratios=ratios, options=options)


if __name__ == "__main__":
    main()
