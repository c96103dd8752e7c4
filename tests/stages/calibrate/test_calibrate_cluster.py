"""Trials calibrated on a cluster, several at a time: the files of a run without it."""

import dataclasses
import functools
import logging

import pytest

from zfcal.calibrate.scheduler import connect
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.events import Made, Progress, say_nothing
from zfcal.stages.side_by_side import side_by_side

distributed = pytest.importorskip("distributed", reason="the extra zfcal[cluster] is not there")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Return a cluster of two worker processes."""
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            dashboard_address=":0",
            local_directory=str(tmp_path_factory.mktemp("workers")),
            silence_logs=logging.CRITICAL,
        ) as made,
        connect(made.scheduler_address) as connected,
    ):
        yield connected


@pytest.mark.slow
def test_trials_side_by_side_end_in_the_bytes_of_trials_in_turn(
    make_trial, copy_trial, quick, cluster, read_all
):
    """Rounds of a trial follow each other; what is told comes trial by trial."""
    roots = [make_trial(f"trial{seed}", seconds=180, seed=seed) for seed in (1, 2)]
    for root in roots:
        analyse(root, AnalyseOptions(), say_nothing)
    copies = [copy_trial(root, f"{root.name}-there") for root in roots]
    here, there = [], []
    for root in roots:
        calibrate(root, quick, here.append)
    jobs = [
        functools.partial(calibrate, root, dataclasses.replace(quick, cluster=cluster))
        for root in copies
    ]
    side_by_side(jobs, there.append, lambda part: part(), n_at_once=2)
    assert [read_all(root) for root in copies] == [read_all(root) for root in roots]
    made = [[e.path.name for e in events if isinstance(e, Made)] for events in (here, there)]
    assert made[0] == made[1]
    assert len(made[0]) == 2 * 2 * 3
    stages = [[e.stage for e in events if isinstance(e, Progress)] for events in (here, there)]
    assert stages[0] == stages[1]


@pytest.mark.slow
def test_another_number_of_threads_changes_no_lineage(make_trial, quick, cluster, heard):
    """What was made here is up to date there, and the other way round."""
    root = make_trial(seconds=120)
    analyse(root, AnalyseOptions(), say_nothing)
    calibrate(root, dataclasses.replace(quick, cluster=cluster), say_nothing)
    calibrate(root, dataclasses.replace(quick, n_workers=1), heard.append)
    assert [event for event in heard if isinstance(event, Made)] == []
