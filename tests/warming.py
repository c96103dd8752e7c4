"""Compile what most tests need: ``python warming.py PART`` for each of `PARTS`.

An empty cache is filled once, before there are workers, each of which would compile the
same kernels at the same time. What is missing here is compiled by the first test that
needs it. The parts share little; the first two take about as long as each other.
"""

import sys
from pathlib import Path

import numpy as np

TESTS = Path(__file__).resolve().parent
DT_S = 0.2


def tank_and_fish():
    """Return the default arena, and natural fish for it."""
    from zfcal.artifacts.arenas import load_arena
    from zfcal.parameters import natural

    tank = load_arena("two-rooms", Path())
    return tank, natural(tuple((zone.name, zone.follows_walls) for zone in tank.zones), dt_s=DT_S)


def simulator():
    """Simulate a few steps, counted and recorded, of a few fish and of a crowd."""
    from zfcal.model.simulate import MOST_IN_FULL, simulate_tracks

    tank, fish = tank_and_fish()
    for n_agents in (3, MOST_IN_FULL + 1):
        count(n_agents)
        simulate_tracks(fish, tank, n_agents=n_agents, n_steps=2, seed=1)


def count(n_agents):
    """Simulate two steps, and count them, as an evaluation does."""
    from zfcal.model.packing import pack
    from zfcal.model.simulate import simulate_counts

    tank, fish = tank_and_fish()
    simulate_counts(
        pack([fish], tank), tank, n_agents=n_agents, n_steps=2, seeds=np.arange(1), n_threads=1
    )


def estimate():
    """Estimate the most likely parameters of a few fish, as a round does before its search."""
    from zfcal.model.likelihood import fit
    from zfcal.model.scene import make_scene

    tank, fish = tank_and_fish()
    # Not simulated: that is another part.
    steps_m = np.random.default_rng(1).normal(0.0, 0.004, (200, 3, 2))
    xy_m = np.array([0.24, 0.77]) + np.clip(np.cumsum(steps_m, axis=0), -0.05, 0.05)
    fit(make_scene(_samples(xy_m), tank), fish)


def tracker():
    """Do what a tracker does before its first frame."""
    from zfcal.tracking.fitting import prepare

    prepare()


def observer():
    """Make a trial of the second simulator; draw one step; ask a short recording; estimate."""
    sys.path.insert(0, str(TESTS))
    from hidden.scenario import Scenario, make_trial

    made = make_trial(Scenario(minutes=2.0), oracle=False)
    _one_step()
    _one_recording(made.states_m)
    estimate()


def _one_step():
    """Draw a heading, move a shoal, and move a robot among fish."""
    from zfcal.model.fish_simulator import Shoal
    from zfcal.model.onestep import draw_headings
    from zfcal.model.packing import pack
    from zfcal.model.robot_agent import Among

    tank, fish = tank_and_fish()
    place = np.array([[0.2, 0.77], [0.24, 0.77]])
    draw_headings(fish, tank, xy_m=place, heading_rad=[0.0, 1.0], speed_m_s=0.05, n=1, seed=1)
    Shoal(fish, tank, n_fish=1, n_robots=1, seed=1)
    among = Among(tank, np.zeros(1), dt_s=DT_S)
    among.measure(0.0, np.array([[0.2, 0.77, 0.0]]))
    among.place(0.24, 0.77, 0.0)
    among.step(pack([fish], tank), 1)


def _one_recording(xy_m):
    """Fit the base model to a recording, and ask it for every effect."""
    from zfcal.diagnose.candidates import askable, candidates_of
    from zfcal.diagnose.screening import Screen, ask_all
    from zfcal.model.extended import maximise
    from zfcal.model.scene import make_scene

    tank, fish = tank_and_fish()
    scene = make_scene(_samples(xy_m), tank)
    screen = Screen(scene=scene, fitted=maximise(scene, fish))
    family = candidates_of(askable(scene, fish)[0], tank)
    kinds = {each.name: each for each in family}
    ask_all(screen, list(kinds.values()), 1)


def _samples(xy_m):
    """Return where fish are at each step, shape (step, fish, 2), as samples of a recording."""
    from zfcal.tracks import FISH, Samples

    return Samples(
        dt_s=DT_S,
        k=np.arange(len(xy_m), dtype=np.int64),
        agent=np.arange(xy_m.shape[1], dtype=np.int32),
        kind=np.full(xy_m.shape[1], FISH, dtype=np.int8),
        xy_m=xy_m,
        confidence=np.ones(xy_m.shape[:2], dtype=np.float32),
    )


PARTS = {"simulator": simulator, "observer": observer, "tracker": tracker}

if __name__ == "__main__":
    PARTS[sys.argv[1]]()
