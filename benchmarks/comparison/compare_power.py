"""Measure how often `zfcal compare` finds a difference that is there, and one that is not.

Trials are normal numbers, drawn from one seed: no file is read and nothing is simulated. The
tables that are printed stand in docs/compare.md.

    .venv/bin/python benchmarks/comparison/compare_power.py
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from zfcal.report.comparison.differences import describe, permute
from zfcal.report.comparison.power import ALPHA, attainable_level, detectable_effect, smallest_p

SIZES = (3, 4, 5, 6, 8, 10, 15, 20)
UNEQUAL = ((4, 4), (5, 5), (6, 6), (8, 8), (4, 8), (5, 10))
RATIOS = (1.0, 3.0, 10.0)
N_AMONG = 20
"""Statistics of a trial with a model and a robot, about."""

_MOST_WAYS = 15_000
"""Relabellings up to which a power is measured: with more it takes long and is that of t."""


def main(argv: list[str] | None = None) -> None:
    """Print the two tables."""
    parser = argparse.ArgumentParser(description="Power and level of zfcal compare.")
    parser.add_argument("--sets", type=int, default=2000, help="pairs of sets for each figure")
    asked = parser.parse_args(argv)
    rng = np.random.default_rng(5)
    print("\n".join([*power_table(asked.sets, rng), "", *level_table(asked.sets, rng)]))


def power_table(n_sets: int, rng: np.random.Generator) -> Iterator[str]:
    """Yield what so many trials a side can show, and how often that was found."""
    yield (
        "| trials a side | smallest p | g of a t test | g, one statistic | found | "
        f"g among {N_AMONG} | found |"
    )
    yield "|---|---|---|---|---|---|---|"
    for n in SIZES:
        head = f"| {n} | {smallest_p(n, n):.2g} | {detectable_effect(n, n):.1f} |"
        level = attainable_level(n, n)
        if not level:
            yield f"{head} none | | none | |"
            continue
        one, among = (detectable_effect(n, n, alpha=level / m) for m in (1, N_AMONG))
        found = ("", "")
        if 1 / smallest_p(n, n) < _MOST_WAYS:
            found = (
                f"{_found(one, n, n_sets, rng):.0f} %",
                f"{_among(among, n, n_sets, rng):.0f} %",
            )
        yield f"{head} {one:.1f} | {found[0]} | {among:.1f} | {found[1]} |"


def level_table(n_sets: int, rng: np.random.Generator) -> Iterator[str]:
    """Yield how often sets of one mean are told apart where their spreads differ."""
    heads = "".join(f" spread {ratio:g}: p | interval |" for ratio in RATIOS)
    yield f"| trials |{heads}"
    yield "|---" * (1 + 2 * len(RATIOS)) + "|"
    for n_a, n_b in UNEQUAL:
        cells = ""
        for ratio in RATIOS:
            a, b = ratio * rng.normal(size=(n_sets, n_a)), rng.normal(size=(n_sets, n_b))
            rows = [describe(one, other) for one, other in zip(a, b, strict=True)]
            missed = np.mean([not row.low <= 0 <= row.high for row in rows])
            by_p = np.mean(permute(a, b, rng=rng)[0] <= ALPHA)
            cells += f" {100 * by_p:.1f} % | {100 * missed:.1f} % |"
        yield f"| {n_a} and {n_b} |{cells}"


def _found(effect: float, n: int, n_sets: int, rng: np.random.Generator) -> float:
    """Return in how many of a hundred sets an effect in a single statistic is found."""
    a, b = rng.normal(size=(n_sets, n)) + effect, rng.normal(size=(n_sets, n))
    return 100 * float(np.mean(permute(a, b, rng=rng)[0] <= ALPHA))


def _among(effect: float, n: int, n_sets: int, rng: np.random.Generator) -> float:
    """Return the same for an effect in one of several statistics, over all of them."""
    found = 0
    n_sets = max(1, n_sets // 5)
    for _ in range(n_sets):
        a, b = rng.normal(size=(N_AMONG, n)), rng.normal(size=(N_AMONG, n))
        a[0] += effect
        found += bool(permute(a, b, rng=rng)[1][0] <= ALPHA)
    return 100 * found / n_sets


if __name__ == "__main__":
    main()
