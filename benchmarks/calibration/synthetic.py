"""Windows of groups whose model is known, for optimisers to be tried on.

Development windows are for choosing anything; what is reported comes from others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zfcal.arena import Arena
from zfcal.artifacts.arenas import load_arena
from zfcal.behaviour.statistics import Statistics, measure
from zfcal.calibrate.group import Group, SeedSource
from zfcal.calibrate.task import Task
from zfcal.model.simulate import simulate_tracks
from zfcal.parameters import Parameters, from_genes, n_genes, natural
from zfcal.tracks import FISH, ROBOT, Samples

DT_S = 0.2
WINDOW_STEPS = 600
HELD_OUT_STEPS = 9000
N_FISH = 4

DEVELOPMENT = {"natural": (101, 102), "random 1": (103,), "aligned": (104,)}
REPORTED = {"natural": (1, 2), "random 2": (3,), "random 3": (4,), "aligned": (5, 6)}
MORE = {name: tuple(range(10 * k, 10 * k + 6)) for k, name in enumerate(REPORTED, start=2)}
"""Truths, and the seeds of their windows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Two windows in a row, and what came after them.

    Parameters
    ----------
    name
        Of the model that moved the group.
    truth
        That model.
    seed
        Of its simulation and of all that is done with it.
    before, task
        The first window and the second.
    samples
        Of the second window, fish and robot.
    held_out
        Statistics of the half hour that follows.
    """

    name: str
    truth: Parameters
    seed: int
    before: Task
    task: Task
    samples: Samples
    held_out: Statistics


def two_rooms() -> tuple[Arena, Parameters]:
    """Return the default arena and its natural model."""
    arena = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    return arena, natural(zones, dt_s=DT_S)


def truth_of(name: str, template: Parameters) -> Parameters:
    """Return the model of a name.

    ``natural``; ``random N``, uniform in the bounds; ``aligned``, the natural model
    with an effect that no candidate has.
    """
    if name == "natural":
        return template
    if name == "aligned":
        return replace(template, effects={"alignment": {"weight": 20.0, "kappa": 8.0}})
    rng = np.random.default_rng([7, int(name.partition(" ")[2])])
    return from_genes(rng.random(n_genes(len(template.zones))), template)


def windows(chosen: dict[str, tuple[int, ...]], *, n_workers: int) -> Iterator[Window]:
    """Make the windows of some truths and seeds, one at a time."""
    for name, seeds in chosen.items():
        for seed in seeds:
            yield make_window(name, seed, n_workers=n_workers)


def make_window(name: str, seed: int, *, n_workers: int) -> Window:
    """Simulate four fish and a robot and cut out their windows."""
    arena, template = two_rooms()
    n_steps = 2 * WINDOW_STEPS + HELD_OUT_STEPS
    truth = truth_of(name, template)
    xy_m, _ = simulate_tracks(truth, arena, n_agents=N_FISH + 1, n_steps=n_steps, seed=seed)
    cuts = [xy_m[:WINDOW_STEPS], xy_m[WINDOW_STEPS : 2 * WINDOW_STEPS], xy_m[2 * WINDOW_STEPS :]]
    before, now, after = (samples_of(part) for part in cuts)
    group = Group(arena=arena, template=template, n_fish=N_FISH, n_robots=1, n_workers=n_workers)

    def task(samples: Samples, end_s: int) -> Task:
        return Task(
            group=group,
            control=measure(samples.of_kind(FISH), arena),
            seeds=SeedSource(trial_seed=seed, window_end_s=end_s),
        )

    return Window(
        name=name,
        truth=truth,
        seed=seed,
        before=task(before, 120),
        task=task(now, 240),
        samples=now,
        held_out=measure(after.of_kind(FISH), arena),
    )


def samples_of(xy_m: np.ndarray) -> Samples:
    """Return positions of four fish, and of robots after them, as samples."""
    n, agents = xy_m.shape[:2]
    return Samples(
        dt_s=DT_S,
        k=np.arange(n),
        agent=np.arange(agents, dtype=np.int32),
        kind=np.array([FISH] * N_FISH + [ROBOT] * (agents - N_FISH), dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones((n, agents), dtype=np.float32),
    )
