"""Which trials the benchmark of the diagnosis makes, and in which order.

Every trial has a seed of its own, from `FIRST_SEED` on: nobody has tuned anything on
them. Sections take turns, each as often as its weight says, and within a section one trial of
every kind comes before the second of any, so that a run that was stopped early is balanced.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

FIRST_SEED = 320_000
FURTHER_SEED = 390_000
"""Of trials that hide further forms. No rule of the diagnosis was chosen on trials of either; one
that is asks for other seeds."""

FURTHER_NOISE_MM = 0.5
"""Of every third trial of a further form; the others have none."""

LISTED_SECTION, LENGTHS, STRENGTHS, ALONE = "listed", "lengths", "strengths", "without-robot"
FURTHER = "further"
NULLS, PAIRS, OUTSIDE = "nulls", "pairs", "outside"
EXTEND, VIDEO, TIME = "extend", "video", "time"
SECTIONS = (
    LISTED_SECTION, FURTHER, NULLS, OUTSIDE, PAIRS, STRENGTHS, LENGTHS, ALONE, EXTEND, VIDEO, TIME,
)  # fmt: skip

DECOYS = ("plain", "shifted", "arena", "noise", "drops-and-swaps")
"""What trials that hide nothing have instead, in equal parts."""

NOISE_MM = (0.3, 0.6, 1.0, 1.5, 2.0)

PAIRED = (
    ("alignment", "burst-and-coast"),
    ("wall-persistence", "crowding"),
    ("turning-memory", "fatigue"),
    ("place-preference", "speed-matching"),
    ("group-cohesion", "turning-bias"),
    ("leader-following", "freezing"),
    ("robot-avoidance", "habituation"),
    ("collective-departure", "speed-turn-coupling"),
    ("interaction-range", "directional-drift"),
    ("boldness", "rear-blind-zone"),
)

FILMED = ("wall-persistence", "burst-and-coast", "turning-bias", None, None)
"""What the trials hide that are rendered to video and tracked."""

WEIGHTS = {
    LISTED_SECTION: 1.0, FURTHER: 1.0, NULLS: 1.0, STRENGTHS: 0.5, LENGTHS: 0.5, OUTSIDE: 0.3,
    PAIRS: 0.25, ALONE: 0.2, EXTEND: 0.04, VIDEO: 0.02,
}  # fmt: skip
"""How often a section's turn comes. An extension takes as long as a dozen others."""

_NULLS_A_ROUND = 20
_SEEDS_PER_KIND = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """How many trials of each section.

    Parameters
    ----------
    seeds
        Of each listed effect, at 30 minutes and clear strength.
    few
        Of each listed effect at each other length and strength, and without robot.
    nulls
        Trials that hide nothing, all kinds together.
    pairs, outside
        Of each pair, and of each effect outside the list.
    extended
        Of each listed effect, to be extended.
    further
        Of each further form of a listed effect, faint and clear.
    """

    seeds: int = 20
    few: int = 5
    nulls: int = 400
    pairs: int = 5
    outside: int = 10
    extended: int = 3
    further: int = 3

    def __post_init__(self) -> None:
        most = max(
            self.seeds, self.few, self.pairs, self.outside, self.extended, self.further
        )  # fmt: skip
        if most > _SEEDS_PER_KIND:
            raise ValueError(f"At most {_SEEDS_PER_KIND} seeds of a kind, got {most}.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One trial to be made and asked about.

    Parameters
    ----------
    section
        One of `SECTIONS`.
    kind
        Within the section, such as ``alignment`` or ``noise``.
    round
        Trials of a lower round come first.
    scenario
        Arguments of the second simulator's ``Scenario``; ``chain`` is a table.
    quick
        Whether the null is that of theory, not of replicates.
    workers
        Threads of the diagnosis.
    """

    section: str
    kind: str
    round: int
    scenario: dict[str, Any] = field(hash=False)
    quick: bool
    workers: int = 1

    def said(self) -> dict[str, Any]:
        """Return what decides about the answer, as JSON has it."""
        return {
            "section": self.section,
            "kind": self.kind,
            "scenario": self.scenario,
            "quick": self.quick,
            "workers": self.workers,
        }


def scenario(seed: int, **changed: Any) -> dict[str, Any]:
    """Return a scenario with nothing left to its defaults."""
    chain = {"noise_mm": 0.0, "drops_per_min": 0.0, "renamed": 1.0, "swaps_per_min": 0.0}
    made = {
        "effect": None,
        "second": None,
        "strength": "clear",
        "minutes": 30.0,
        "seed": seed,
        "robot": True,
        "n_fish": 4,
        "arena": "two-rooms",
        "base": "natural",
        "chain": {**chain, **changed.pop("chain", {})},
        "fps": 15.0,
    }
    if unknown := set(changed) - set(made):
        raise ValueError(f"A scenario has no {', '.join(sorted(unknown))}.")
    return {**made, **changed}


def plan(
    scale: Scale,
    listed: Sequence[str],
    unlisted: Sequence[str],
    further: Sequence[str] = (),
    *,
    quick: bool,
) -> list[Job]:
    """Return all trials of a benchmark, in the order in which they are to be made.

    Parameters
    ----------
    scale
        How many.
    listed, unlisted
        Effects that the tool knows by name, and others that can be hidden.
    further
        Keys of further forms of listed effects, such as ``alignment/flow``.
    quick
        Whether nulls are those of theory.
    """
    made = [
        *_of_effects(scale, listed, quick=quick),
        *_of_forms(scale, further, quick=quick),
        *_of_nothing(scale, quick=quick),
        *_of_others(scale, unlisted, quick=quick),
        *_in_full(scale, listed, quick=quick),
    ]
    return _in_turns(made)


def _in_turns(jobs: Sequence[Job]) -> list[Job]:
    """Return trials so that any first part of them is balanced; those that are timed last."""
    sections: dict[str, list[Job]] = defaultdict(list)
    for job in jobs:
        sections[job.section].append(job)
    due: list[tuple[float, int, Job]] = []
    for section, weight in WEIGHTS.items():
        own = sections.pop(section, [])
        if section != NULLS:  # their kinds take turns as they are
            shuffled = np.random.default_rng(0).permutation(len(own))
            own = sorted((own[at] for at in shuffled), key=lambda job: job.round)
        number = SECTIONS.index(section)
        due += [((k + 0.5) / weight, number, job) for k, job in enumerate(own)]
    ordered = [job for _, _, job in sorted(due, key=lambda each: each[:2])]
    return [*ordered, *(job for rest in sections.values() for job in rest)]


def _of_effects(scale: Scale, listed: Sequence[str], *, quick: bool) -> Iterator[Job]:
    """Yield the trials of listed effects, one by one and at every length and strength."""
    kinds: list[tuple[str, str, int, int, dict[str, Any]]] = [
        (LISTED_SECTION, "", FIRST_SEED, scale.seeds, {}),
        (LENGTHS, " 2 min", FIRST_SEED + 3000, scale.few, {"minutes": 2.0}),
        (LENGTHS, " 10 min", FIRST_SEED + 6000, scale.few, {"minutes": 10.0}),
        (STRENGTHS, " faint", FIRST_SEED + 9000, scale.few, {"strength": "faint"}),
        (STRENGTHS, " strong", FIRST_SEED + 12_000, scale.few, {"strength": "strong"}),
        (ALONE, "", FIRST_SEED + 15_000, scale.few, {"robot": False}),
    ]
    for section, suffix, first, n, changed in kinds:
        for number, name in enumerate(listed):
            if section == ALONE and name == "robot-avoidance":
                continue
            for k in range(n):
                asked = scenario(first + _SEEDS_PER_KIND * number + k, effect=name, **changed)
                yield Job(
                    section=section, kind=f"{name}{suffix}", round=k, scenario=asked, quick=quick
                )


def _of_forms(scale: Scale, further: Sequence[str], *, quick: bool) -> Iterator[Job]:
    """Yield the trials of further forms, each faint and clear."""
    for number, key in enumerate(further):
        for k in range(scale.further):
            for level, strength in enumerate(("faint", "clear")):
                seed = FURTHER_SEED + _SEEDS_PER_KIND * (2 * number + level) + k
                noise_mm = FURTHER_NOISE_MM if k % 3 == 2 else 0.0
                asked = scenario(seed, effect=key, strength=strength, chain={"noise_mm": noise_mm})
                yield Job(
                    section=FURTHER, kind=f"{key} {strength}", round=k, scenario=asked, quick=quick
                )


def _of_nothing(scale: Scale, *, quick: bool) -> Iterator[Job]:
    """Yield the trials that hide nothing; every fourth has no robot."""
    for number in range(scale.nulls):
        decoy = DECOYS[number % len(DECOYS)]
        level = number // len(DECOYS)
        changed: dict[str, Any] = {
            "plain": {},
            "shifted": {"base": "shifted"},
            "arena": {"arena": "rectangle"},
            "noise": {"chain": {"noise_mm": NOISE_MM[level % len(NOISE_MM)]}},
            "drops-and-swaps": {
                "chain": {"noise_mm": 0.3, "drops_per_min": 1.0, "swaps_per_min": 0.5}
            },
        }[decoy]
        asked = scenario(FIRST_SEED + 20_000 + number, robot=level % 4 != 3, **changed)
        yield Job(
            section=NULLS, kind=decoy, round=number // _NULLS_A_ROUND, scenario=asked, quick=quick
        )


def _of_others(scale: Scale, unlisted: Sequence[str], *, quick: bool) -> Iterator[Job]:
    """Yield the trials of two effects at once, and of effects outside the list."""
    for number, (one, other) in enumerate(PAIRED):
        for k in range(scale.pairs):
            seed = FIRST_SEED + 30_000 + _SEEDS_PER_KIND * number + k
            asked = scenario(seed, effect=one, second=other)
            yield Job(
                section=PAIRS, kind=f"{one} and {other}", round=k, scenario=asked, quick=quick
            )
    for number, name in enumerate(unlisted):
        for k in range(scale.outside):
            seed = FIRST_SEED + 35_000 + _SEEDS_PER_KIND * number + k
            asked = scenario(seed, effect=name)
            yield Job(section=OUTSIDE, kind=name, round=k, scenario=asked, quick=quick)


def _in_full(scale: Scale, listed: Sequence[str], *, quick: bool) -> Iterator[Job]:
    """Yield the trials that are extended, filmed and timed."""
    for number, name in enumerate(listed):
        for k in range(scale.extended):
            seed = FIRST_SEED + 40_000 + _SEEDS_PER_KIND * number + k
            asked = scenario(seed, effect=name)
            yield Job(section=EXTEND, kind=name, round=k, scenario=asked, quick=quick)
    for number, filmed in enumerate(FILMED):
        asked = scenario(FIRST_SEED + 45_000 + number, effect=filmed, minutes=10.0)
        yield Job(section=VIDEO, kind=filmed or "nothing", round=0, scenario=asked, quick=quick)
    # Nobody else is at work in this program while these run, each on two threads.
    for k, name in enumerate(("wall-persistence", None)):
        asked = scenario(FIRST_SEED + 49_000 + k, effect=name)
        yield Job(
            section=TIME, kind=name or "nothing", round=10**6, scenario=asked, quick=quick,
            workers=2,
        )  # fmt: skip
