"""Compare optimisers on the same windows: the same evaluations, and the same seconds.

Makes ``optimisers.json`` and ``benchmarks-optimisers.md``: in ``build/benchmarks``, with
``--write`` in ``benchmarks/results`` and ``docs``. Needs ``requirements-bench.lock``.

    .venv/bin/python benchmarks/calibration/bench_optimisers.py
"""

from __future__ import annotations

import math
import os
import statistics
import sys
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.calibration import optimisers_document
from benchmarks.calibration.optimisers import OPTIMISERS, SLOW
from benchmarks.calibration.recorder import EnoughError, Outcome, QuietClock, Recorder
from benchmarks.calibration.synthetic import DEVELOPMENT, MORE, REPORTED, Window, windows
from benchmarks.shared.measuring import load, machine
from benchmarks.shared.regressions import Ratio, conclude, parser
from zfcal.behaviour.scores import compare
from zfcal.calibrate.baselines import unchanged
from zfcal.calibrate.confirm import Confirmed, best_distinct, confirm
from zfcal.calibrate.evolve import overall_score
from zfcal.calibrate.history import hypervolume
from zfcal.calibrate.search import search
from zfcal.calibrate.task import Settings
from zfcal.parameters import to_genes

FIRST = next(iter(OPTIMISERS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much is measured.

    Parameters
    ----------
    chosen
        Truths, and the seeds of their windows.
    evaluations, seconds
        What everybody gets.
    slow_s
        The one that is too slow for all evaluations is stopped then.
    long_runs
        Simulations of half an hour that confirm the ten best.
    steps
        Of an evaluation.
    """

    chosen: dict[str, tuple[int, ...]]
    evaluations: int = 960
    seconds: float = 4.0
    slow_s: float = 10.0
    long_runs: int = 3
    steps: int = 3000

    @property
    def settings(self) -> Settings:
        """The same as those of a round."""
        return Settings(steps=self.steps, long_runs=self.long_runs)


USUAL = Effort(chosen=REPORTED)
FULL = Effort(chosen=MORE, seconds=20.0, slow_s=60.0, long_runs=10)
TINY = Effort(
    chosen={"natural": (101,)}, evaluations=120, seconds=0.2, slow_s=1.5, long_runs=1, steps=100
)


def measure_window(window: Window, effort: Effort, order: int) -> dict[str, Any]:
    """Return what every optimiser reached on a window.

    Parameters
    ----------
    window, effort
        What, and how much.
    order
        Who begins: everybody in turn.
    """
    names = list(OPTIMISERS)
    names = names[order % len(names) :] + names[: order % len(names)]
    asked = {name: _run(name, window, effort) for name in names}
    rows: dict[str, Any] = {}
    for name in OPTIMISERS:
        had = asked[name].until(evaluations=effort.evaluations)
        # Who is slow has had fewer evaluations: the first one, with as many, beside it.
        peer = asked[FIRST].until(evaluations=len(had.genes))
        rows[name] = {
            "evaluations": _worth(window, effort, had),
            "peer": _worth(window, effort, peer) if len(had.genes) < effort.evaluations else None,
            "seconds": _worth(window, effort, asked[name].until(seconds=effort.seconds)),
        }
    return {
        "truth": window.name,
        "seed": window.seed,
        "optimisers": rows,
        "unchanged": _scores(window, _last_window(window, effort)),
        "model itself": _scores(window, _truth(window, effort)),
    }


def _run(name: str, window: Window, effort: Effort) -> Recorder:
    ask = Recorder(
        evaluate=window.task.evaluation(effort.settings),
        evaluations=effort.evaluations,
        seconds=effort.seconds,
        at_most_s=effort.slow_s if name == SLOW else math.inf,
        clock=QuietClock(_cores()),
    )
    try:
        OPTIMISERS[name](ask, window)
    except EnoughError:
        return ask
    raise AssertionError("A search ended before it had enough.")


def _worth(window: Window, effort: Effort, had: Outcome) -> dict[str, float]:
    """Return what a search is worth, by long simulations with seeds that it has not seen."""
    scores = overall_score(had.features)
    best = best_distinct(had.genes, scores, effort.settings.n_confirmed)
    confirmed = confirm(window.task.confirmation(effort.settings), best)
    return {
        **_scores(window, confirmed),
        "own_S": float(np.nanmax(scores)),
        "hypervolume": hypervolume(had.features),
        "n": len(had.genes),
        "s": had.seconds,
    }


def _scores(window: Window, confirmed: Confirmed) -> dict[str, float]:
    held_out = compare(window.held_out, confirmed.long_run).S
    return {"S": confirmed.scores.S, "held_out_S": held_out}


def _last_window(window: Window, effort: Effort) -> Confirmed:
    """Return what the champion of the window before scores on this one."""
    settings = replace(effort.settings, generations=max(1, effort.evaluations // 60 - 1))
    progress = search(window.before, settings)
    best = best_distinct(progress.genes, progress.scores, settings.n_confirmed)
    champion = confirm(window.before.confirmation(settings), best)
    return unchanged(window.task, settings, genes=champion.genes)


def _truth(window: Window, effort: Effort) -> Confirmed:
    """Return what the model that moved the fish scores: no more is there to be found."""
    task = replace(window.task, group=window.task.group.with_template(window.truth))
    return unchanged(task, effort.settings, genes=to_genes(window.truth))


def measure(effort: Effort) -> dict[str, Any]:
    """Measure all optimisers on all windows."""
    found: dict[str, Any] = {
        "machine": machine(),
        "effort": asdict(effort),
        "load_before": load(),
        "windows": [],
    }
    _warm_up()
    for number, window in enumerate(windows(effort.chosen, n_workers=_cores())):
        print(f"{window.name}, seed {window.seed} ...", file=sys.stderr)
        found["windows"].append(measure_window(window, effort, number))
    found["load_after"] = load()
    return found


def _warm_up() -> None:
    """Have everything imported and compiled before the clock runs."""
    for window in windows(TINY.chosen, n_workers=_cores()):
        measure_window(window, TINY, 0)


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def ratios(found: Mapping[str, Any]) -> dict[str, Ratio]:
    """Return by how much zfcal's own optimiser is ahead of the others, medians over windows."""
    made: dict[str, Ratio] = {}
    for name in OPTIMISERS:
        if name == FIRST:
            continue
        for key, part in (("evaluations", "S"), ("seconds", "S"), ("seconds", "n")):
            values = [
                window["optimisers"][FIRST][key][part] / window["optimisers"][name][key][part]
                for window in found["windows"]
            ]
            what = "evaluations in the same time" if part == "n" else f"S at the same {key}"
            made[f"{what}, over {name}"] = Ratio(value=statistics.median(values), better="more")
    return made


def main() -> None:
    """Measure, write both files, and compare with the committed results."""
    options_of = parser(__doc__)
    options_of.add_argument("--full", action="store_true", help="More windows and more time.")
    options_of.add_argument(
        "--development", action="store_true", help="On the windows that settings are chosen on."
    )
    options = options_of.parse_args()
    effort = TINY if options.tiny else FULL if options.full else USUAL
    if options.development:
        effort = replace(effort, chosen=DEVELOPMENT)
    # A Gaussian process warns of points that it has seen: all ends in S, which is looked at.
    warnings.filterwarnings("ignore", module="skopt")
    found = measure(effort)
    conclude(
        "optimisers",
        found,
        optimisers_document.markdown(found),
        ratios=ratios,
        options=options,
    )


if __name__ == "__main__":
    main()
