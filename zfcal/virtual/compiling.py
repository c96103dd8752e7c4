"""Compiles what commands use before they need it: ``python -m zfcal.virtual.compiling PART...``.

Each of `PARTS` runs a little of everything, so that the compiled code lies in the cache
(`zfcal.model.kernels.compiled`) when a command starts. Parts in different processes run side by
side; the order within one is that in which a demonstration needs them.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from zfcal.arena import Arena
from zfcal.arrays import Floats
from zfcal.artifacts.arenas import load_arena
from zfcal.errors import InputError
from zfcal.model.kernels.compiled import KEPT, cache_folder, is_warm
from zfcal.parameters import Parameters, natural
from zfcal.tracks import FISH, Samples

_DT_S = 0.2


def simulator() -> None:
    """Simulate a few steps of a few fish, recorded and counted."""
    from zfcal.model.simulate import simulate_tracks

    tank, fish = tank_and_fish()
    # Recorded first: a demonstration begins with it.
    simulate_tracks(fish, tank, n_agents=3, n_steps=2, seed=1)
    _count(3)


def crowd() -> None:
    """Simulate a few steps of more fish than are looked at one by one."""
    from zfcal.model.simulate import MOST_IN_FULL, simulate_tracks

    tank, fish = tank_and_fish()
    simulate_tracks(fish, tank, n_agents=MOST_IN_FULL + 1, n_steps=2, seed=1)
    _count(MOST_IN_FULL + 1)


def search() -> None:
    """Count a few steps, as the search of a round does."""
    _count(3)


def _count(n_agents: int) -> None:
    from zfcal.model.packing import pack
    from zfcal.model.simulate import simulate_counts

    tank, fish = tank_and_fish()
    simulate_counts(
        pack([fish], tank),
        tank,
        n_agents=n_agents,
        n_steps=2,
        seeds=np.arange(1, dtype=np.uint64),
        n_threads=1,
    )


def images() -> None:
    """Do what a drawn film and a tracker do before their first frames."""
    from zfcal.tracking.fitting import prepare
    from zfcal.virtual.images import _painting

    _painting.prepare()
    prepare()


def estimate() -> None:
    """Estimate the most likely parameters of a few fish, as a round does before its search."""
    from zfcal.model.likelihood import fit
    from zfcal.model.scene import make_scene

    tank, fish = tank_and_fish()
    # Not simulated: that is another part.
    steps_m = np.random.default_rng(1).normal(0.0, 0.004, (200, 3, 2))
    xy_m = np.array([0.24, 0.77]) + np.clip(np.cumsum(steps_m, axis=0), -0.05, 0.05)
    fit(make_scene(samples_of(xy_m), tank), fish)


def robot() -> None:
    """Draw one step of a robot among fish, and move a shoal around a robot."""
    from zfcal.model.fish_simulator import Shoal
    from zfcal.model.packing import pack
    from zfcal.model.robot_agent import Among

    tank, fish = tank_and_fish()
    among = Among(tank, np.zeros(1), dt_s=_DT_S)
    among.measure(0.0, np.array([[0.2, 0.77, 0.0]]))
    among.place(0.24, 0.77, 0.0)
    among.step(pack([fish], tank), 1)
    Shoal(fish, tank, n_fish=1, n_robots=1, seed=1)


PARTS: dict[str, Callable[[], None]] = {
    "simulator": simulator,
    "crowd": crowd,
    "images": images,
    "estimate": estimate,
    "robot": robot,
    "search": search,
}
"""What there is to compile, by its name."""

FIRST = ("simulator",)
"""What a demonstration compiles itself, since it begins with it."""

BESIDE = ("images", "estimate", "robot", "search")
"""What is compiled beside the simulator, in the order in which a demonstration needs it."""


def compile_all() -> Path:
    """Compile what the commands use, on two processors; return the folder that keeps it.

    A crowd and the effects of a diagnosis are compiled by the first command that needs them.

    Raises
    ------
    InputError
        When there is no folder to keep it in, or compiling failed.
    """
    folder = cache_folder()
    if not KEPT or folder is None:
        raise InputError(
            f"Compiled code cannot be kept: {folder or 'no home folder'} is not writable.",
            hint="Set NUMBA_CACHE_DIR to a folder that is.",
        )
    started = [_start(parts, stderr=subprocess.PIPE) for parts in (FIRST, BESIDE)]
    try:
        ends = [process.communicate()[1].strip().splitlines() for process in started]
    finally:
        for process in started:
            process.kill()
            process.wait()
    for process, lines in zip(started, ends, strict=True):
        if process.returncode:
            why = lines[-1] if lines else f"exit code {process.returncode}"
            raise InputError(
                f"Compiling failed: {why}",
                hint="Commands compile what they need themselves, if they can.",
            )
    return folder


@contextmanager
def compiled_beside() -> Iterator[None]:
    """Compile in a process of its own, at the first start of all, while the caller simulates.

    It ends with the caller. Where it fails, the caller compiles when the time comes.
    """
    if is_warm() or not KEPT:
        yield
        return
    process = _start(BESIDE, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def _start(parts: tuple[str, ...], *, stderr: int) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603 - this very Python, on this very module
        [sys.executable, "-m", "zfcal.virtual.compiling", *parts],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        text=True,
    )


def tank_and_fish() -> tuple[Arena, Parameters]:
    """Return the default arena, and natural fish for it."""
    tank = load_arena("two-rooms", Path())
    zones = tuple((zone.name, zone.follows_walls) for zone in tank.zones)
    return tank, natural(zones, dt_s=_DT_S)


def samples_of(xy_m: Floats) -> Samples:
    """Return positions at each step, shape (step, fish, 2), as samples of a recording."""
    return Samples(
        dt_s=_DT_S,
        k=np.arange(len(xy_m), dtype=np.int64),
        agent=np.arange(xy_m.shape[1], dtype=np.int32),
        kind=np.full(xy_m.shape[1], FISH, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones(xy_m.shape[:2], dtype=np.float32),
    )


if __name__ == "__main__":
    for name in sys.argv[1:]:
        PARTS[name]()
