"""The table of `bench_optimisers.py`, and what it says."""

from __future__ import annotations

import statistics
import textwrap
from collections.abc import Sequence
from typing import Any

from scipy.stats import wilcoxon

from benchmarks.shared.measuring import table

LEVEL = 0.05
FIXED = {
    "last window's parameters, unchanged": "unchanged",
    "the model that moved the fish": "model itself",
}
"""Rows without a search, and what they are called in the JSON."""


def _prose(text: str) -> str:
    return textwrap.fill(" ".join(text.split()), 120) + "\n"


def _pairs(found: dict[str, Any], name: str, key: str, part: str) -> list[tuple[float, float]]:
    """Return an optimiser's value and that of the first one, window by window.

    An optimiser that was too slow for all evaluations is compared with the first
    one after as many as it had.
    """
    pairs = []
    for window in found["windows"]:
        rows = window["optimisers"]
        first = next(iter(rows.values()))[key]
        if name in FIXED:
            pairs.append((window[FIXED[name]][part], first[part]))
            continue
        peer = rows[name]["peer"] if key == "evaluations" else None
        pairs.append((rows[name][key][part], (peer or first)[part]))
    return pairs


def _median(found: dict[str, Any], name: str, key: str, part: str) -> float:
    return statistics.median(value for value, _ in _pairs(found, name, key, part))


def _against(found: dict[str, Any], name: str, key: str, part: str = "S") -> str:
    """Return the median ratio to the first optimiser's, and on how many windows it is more."""
    pairs = _pairs(found, name, key, part)
    ratio = statistics.median(value / first for value, first in pairs)
    return f"{ratio:.3f} ({sum(value > first for value, first in pairs)} of {len(pairs)})"


def chance(pairs: Sequence[tuple[float, float]]) -> float:
    """Return how often luck alone would set two equals apart as much (Wilcoxon, two-sided)."""
    differences = [value - first for value, first in pairs]
    return float(wilcoxon(differences).pvalue) if any(differences) else 1.0


def winners(found: dict[str, Any]) -> list[str]:
    """Return who is ahead of the first at equal evaluations and at equal seconds, beyond luck."""

    def wins(name: str, key: str) -> bool:
        pairs = _pairs(found, name, key, "S")
        ahead = statistics.median(value / first for value, first in pairs) > 1
        return ahead and chance(pairs) < LEVEL

    _, *others = found["windows"][0]["optimisers"]
    return [name for name in others if wins(name, "evaluations") and wins(name, "seconds")]


def _row(found: dict[str, Any], name: str) -> list[object]:
    row: list[object] = [name]
    is_first = name == next(iter(found["windows"][0]["optimisers"]))
    for key in ("evaluations", "seconds"):
        for part in ("S", "held_out_S"):
            value = f"{_median(found, name, key, part):.3f}"
            row += [value, "" if is_first else _against(found, name, key, part)]
        row += ["", ""] if name in FIXED else _cost(found, name, key)
    return row


def _cost(found: dict[str, Any], name: str, key: str) -> list[str]:
    """Return the hypervolume, and the seconds of the evaluations or the other way round."""
    volume = f"{_median(found, name, key, 'hypervolume'):.3f}"
    if key == "seconds":
        return [volume, f"{_median(found, name, key, 'n'):,.0f}"]
    had, spent = (_median(found, name, key, part) for part in ("n", "s"))
    short = had < found["effort"]["evaluations"]
    return [volume, f"{had:.0f} in {spent:.1f}" if short else f"{spent:.1f}"]


def _head(found: dict[str, Any]) -> list[str]:
    effort = found["effort"]
    chosen = "; ".join(
        f"{name} ({len(seeds)})" for name, seeds in effort["chosen"].items()
    )  # fmt: skip
    return [
        "# Optimisers, compared\n",
        _prose(
            f"""Made by `benchmarks/calibration/bench_optimisers.py`; numbers in
            `benchmarks/results/optimisers.json`. Machine: {found["machine"]}; load
            {found["load_before"]:.1f} before, {found["load_after"]:.1f} after (its own included in
            the latter). All in one run, in turn. Seconds are those of a quiet machine: the
            processor time of the main thread, and that of simulations divided by as many cores as
            an optimiser keeps busy, so that others on the machine do not count."""
        ),
        _prose(
            f"""Windows of 120 s of four fish and a robot in two rooms, simulated; truths, and how
            many windows of each: {chosen}. `natural` is the model that `zfcal init` writes,
            `random` is uniform in the bounds, `aligned` follows an effect that no candidate has.
            Everybody maximises the same S: 1 x {effort["steps"]:,} steps of five agents with the
            same random numbers. NSGA-II, everywhere, has a population of 60 and the three published
            objectives; CMA-ES, the Gaussian process and random search have S alone. Settings were
            chosen on other windows (`--development`)."""
        ),
        _prose(
            f"""S is the confirmed one: the ten best are simulated anew, {effort["long_runs"]} x 30
            min with seeds that no search has seen, and the best of these counts. Held-out S is
            that of the same genome against the half hour that follows the window. Hypervolume is
            that of I_D, I_W, I_O, I_T of all genomes that were evaluated, as the search saw
            them. Medians over windows; against NSGA-II of zfcal the median of the ratios, and in
            brackets on how many windows it is more. The
            Gaussian process was stopped after {effort["slow_s"]:.0f} s, and is compared there with
            NSGA-II of zfcal after as many evaluations."""
        ),
    ]


def _table(found: dict[str, Any]) -> str:
    effort = found["effort"]
    parts = ("against", "held-out S", "against", "hypervolume")
    head = (
        "",
        f"{effort['evaluations']:,} evaluations: S", *parts, "seconds",
        f"{effort['seconds']:.0f} s: S", *parts, "evaluations",
    )  # fmt: skip
    names = [*found["windows"][0]["optimisers"], *FIXED]
    return table(head, [_row(found, name) for name in names])


def _verdict(found: dict[str, Any]) -> str:
    ahead = winners(found)
    said = "; ".join(
        f"{name}: {chance(_pairs(found, name, 'evaluations', 'S')):.2f} and "
        f"{chance(_pairs(found, name, 'seconds', 'S')):.2f}"
        for name in list(found["windows"][0]["optimisers"])[1:]
    )
    verdict = (
        f"Ahead of NSGA-II of zfcal at equal evaluations and at equal seconds: {', '.join(ahead)}."
        if ahead
        else "Nobody is ahead of NSGA-II of zfcal at equal evaluations and at equal seconds."
    )
    return _prose(
        f"""{verdict} Ahead means a median ratio above one that luck alone would bring about in
        fewer than {LEVEL:.0%} of cases (Wilcoxon's signed ranks over the windows). That
        chance, at equal evaluations and at equal seconds: {said}."""
    )


def _own(found: dict[str, Any]) -> str:
    names = found["windows"][0]["optimisers"]
    rows = [
        [name, *(f"{_median(found, name, 'seconds', part):.3f}" for part in ("own_S", "S"))]
        for name in names
    ]
    return table(("at equal seconds", "S as the search saw it", "S confirmed"), rows)


def _truth(found: dict[str, Any]) -> str:
    first, model = next(iter(found["windows"][0]["optimisers"])), list(FIXED)[-1]
    parts = ("S", "held_out_S")
    own, held_out = (_median(found, model, "seconds", part) for part in parts)
    best, kept = (_median(found, first, "seconds", part) for part in parts)
    return _prose(
        f"""And 120 s are partly luck: the very model that moved the fish scores {own:.3f} on the
        window and {held_out:.3f} on the half hour after it, the champion of NSGA-II {best:.3f} and
        {kept:.3f}. Where S on the window is above that of the true model, more of it is no better
        model; what carries over is the held-out S."""
    )


def markdown(found: dict[str, Any]) -> str:
    """Return the table of what was measured, and what it says."""
    return "\n".join(
        [
            *_head(found),
            _table(found),
            "## Who wins\n",
            _verdict(found),
            "## What luck adds\n",
            _prose(
                """The best of a thousand noisy scores is partly luck, so the search's own S is not
                what its model is worth."""
            ),
            _own(found),
            _truth(found),
        ]
    )
