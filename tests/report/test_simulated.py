"""What the calibrated model does, as the round saw it."""

from dataclasses import replace

import numpy as np

from zfcal.behaviour.statistics import measure
from zfcal.calibrate.group import Group, SeedSource, express
from zfcal.calibrate.task import Settings, Task
from zfcal.parameters import to_genes
from zfcal.report import simulated as module
from zfcal.report.simulated import long_run
from zfcal.trial import Trial


def test_the_model_is_simulated_as_the_round_confirmed_it(two_rooms, rounds_of, wander, tmp_path):
    """The same seeds and runs: the same counts as those that S was reported for."""
    start = rounds_of(two_rooms, 1)[-1]
    genes = to_genes(start.parameters)
    champion = replace(start, parameters=express(genes, start.parameters))
    trial = Trial(
        root=tmp_path, arena="two-rooms", n_fish=4, n_robots=1, fps=15.0, dt_s=0.2, seed=3
    )
    settings = Settings(long_runs=2, long_s=20.0)
    control = measure(wander(two_rooms), two_rooms)
    group = Group(arena=two_rooms, template=champion.parameters, n_fish=4, n_robots=1, n_workers=1)
    task = Task(
        group=group, control=control, seeds=SeedSource(trial_seed=3, window_end_s=champion.second)
    )
    confirmation = task.confirmation(settings)
    expected = group.simulate(
        genes[None], n_counted=5, n_steps=confirmation.n_steps, seeds=confirmation.seeds
    )

    names = ("residence", "neighbour")
    found = long_run(champion, trial, two_rooms, settings=settings, further=names)
    recorded = group.record(
        genes[None], names, n_counted=5, n_steps=confirmation.n_steps, seeds=confirmation.seeds
    )

    assert found.occupation.sum() == 2 * 100 * 5
    for name in ("distance", "wall", "occupation", "transition", "speed"):
        assert np.array_equal(getattr(found, name), getattr(expected, name).sum(axis=(0, 1))), name
    for name in names:
        assert np.array_equal(found.of(name), recorded[name].sum(axis=(0, 1))), name
    assert found.of("neighbour").sum() == 2 * 100 * 5


def test_the_map_of_a_model_is_of_its_fish_alone(two_rooms, rounds_of, tmp_path, monkeypatch):
    """Four runs of so many steps, of four fish and no robot; the same every time."""
    monkeypatch.setattr(module, "_MAP_RUN_S", 20.0)
    champion = rounds_of(two_rooms, 1)[-1]
    trial = Trial(
        root=tmp_path, arena="two-rooms", n_fish=4, n_robots=1, fps=15.0, dt_s=0.2, seed=3
    )

    found = module.long_visits(champion, trial, two_rooms)
    again = module.long_visits(champion, trial, two_rooms)
    other = module.long_visits(champion, replace(trial, seed=4), two_rooms)

    assert found.zones.sum() == 4 * 100 * 4
    assert found.cells.sum() == found.zones[1:].sum()
    assert np.array_equal(found.cells, again.cells)
    assert not np.array_equal(found.cells, other.cells)


def test_a_window_of_the_model_has_all_agents(two_rooms, rounds_of, tmp_path):
    """Two minutes of four fish and the robot."""
    champion = rounds_of(two_rooms, 1)[-1]
    trial = Trial(
        root=tmp_path, arena="two-rooms", n_fish=4, n_robots=1, fps=15.0, dt_s=0.2, seed=3
    )

    found = module.window_run(champion, trial, two_rooms)

    assert len(found) == 600 * 5
    assert (found.kind == 1).sum() == 600
    assert (found.zone > 0).all()
