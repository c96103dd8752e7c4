"""Print what an oracle sees of further forms: the median of seeds 9000 to 9002.

Half hours of four fish and a robot; the base law is refitted to each.

    .venv/bin/python tests/hidden/strengths.py
    .venv/bin/python tests/hidden/strengths.py alignment/flow fatigue/sudden
"""

import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from hidden.further import FURTHER, knob
from hidden.scenario import Scenario, make_trial

LEVELS = ("faint", "clear", "strong")
SEEDS = (9000, 9001, 9002)


def worth(key: str, level: str) -> float:
    """Return the median of the oracle's nats of a form at a level."""
    made = (make_trial(Scenario(effect=key, strength=level, seed=seed)) for seed in SEEDS)
    return statistics.median(trial.oracle_nats["total"] for trial in made)


def main() -> None:
    """Print a line for each form: its strengths, and the nats of each."""
    for key in sys.argv[1:] or FURTHER:
        said = (f"{level} {knob(key, level):g}: {worth(key, level):.0f}" for level in LEVELS)
        print(f"{key}: {', '.join(said)} nats", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
