"""Compile what most tests need: ``python warming.py PART`` for each of `PARTS`.

An empty cache is filled once, before there are workers, each of which would compile the
same kernels at the same time. What is missing here is compiled by the first test that
needs it. The parts share little; the first two take about as long as each other.

What commands need is in `zfcal.virtual.compiling`; here is what tests need beside it.
"""

import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parent


def simulator():
    """Simulate a few steps, counted and recorded, of a few fish and of a crowd."""
    from zfcal.virtual import compiling

    compiling.simulator()
    compiling.crowd()


def tracker():
    """Do what a tracker does before its first frame."""
    from zfcal.tracking.fitting import prepare

    prepare()


def observer():
    """Make a trial of the second simulator; draw one step; test a short recording; estimate."""
    sys.path.insert(0, str(TESTS))
    from hidden.scenario import Scenario, make_trial

    from zfcal.virtual import compiling

    made = make_trial(Scenario(minutes=2.0), oracle=False)
    _one_heading()
    compiling.robot()
    _one_recording(made.states_m)
    compiling.estimate()


def _one_heading():
    """Draw a heading of each of two fish."""
    from zfcal.model.onestep import draw_headings
    from zfcal.virtual.compiling import tank_and_fish

    tank, fish = tank_and_fish()
    draw_headings(
        fish,
        tank,
        xy_m=[[0.2, 0.77], [0.24, 0.77]],
        heading_rad=[0.0, 1.0],
        speed_m_s=0.05,
        n=1,
        seed=1,
    )


def _one_recording(xy_m):
    """Fit the base model to a recording, and test it for every effect."""
    from zfcal.diagnose.candidates import askable, candidates_of
    from zfcal.diagnose.screening import Screen, ask_all
    from zfcal.model.extended import maximise
    from zfcal.model.scene import make_scene
    from zfcal.virtual.compiling import samples_of, tank_and_fish

    tank, fish = tank_and_fish()
    scene = make_scene(samples_of(xy_m), tank)
    screen = Screen(scene=scene, fitted=maximise(scene, fish))
    family = candidates_of(askable(scene, fish)[0], tank)
    kinds = {each.name: each for each in family}
    ask_all(screen, list(kinds.values()), 1)


PARTS = {"simulator": simulator, "observer": observer, "tracker": tracker}

if __name__ == "__main__":
    PARTS[sys.argv[1]]()
