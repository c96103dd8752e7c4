"""A cluster of real worker processes: the same numbers as here, whoever dies on the way."""

import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
import shapely

from zfcal.arena import make_arena
from zfcal.calibrate import fingerprint as prints
from zfcal.calibrate import scheduler as scheduling
from zfcal.calibrate.cluster import (
    LEAST_STEPS,
    MOST_STEPS,
    ClusterGroup,
    assemble,
    pieces,
)
from zfcal.calibrate.fingerprint import fingerprint, refuse_other_bits, refuse_unlike
from zfcal.calibrate.group import Group, SeedSource, as_statistics, pool_runs
from zfcal.calibrate.rounds import calibrate_window
from zfcal.calibrate.scheduler import connect
from zfcal.calibrate.task import Settings, Task
from zfcal.errors import InputError, ZfcalError
from zfcal.model.simulate import Counts, Start, simulate_tracks
from zfcal.parameters import natural

distributed = pytest.importorskip("distributed", reason="the extra zfcal[cluster] is not there")

SEEDS = np.array([3, 4, 5], dtype=np.uint64)
BUSY = {"n_counted": 5, "n_steps": 18_000, "seeds": np.arange(6, dtype=np.uint64)}
"""Long enough that a worker can be killed in the middle."""


@pytest.fixture(scope="module")
def group():
    """Return four fish and a robot in a square."""
    arena = make_arena(name="test", outline=shapely.box(0, 0, 0.6, 0.6))
    zones = tuple((zone.name, zone.follows_walls) for zone in arena.zones)
    template = natural(zones, dt_s=0.2)
    return Group(arena=arena, template=template, n_fish=4, n_robots=1)


@pytest.fixture(scope="module")
def genes():
    """Return twelve random genomes of two zones."""
    return np.random.default_rng(0).random((12, 10))


@pytest.fixture(scope="module")
def undisturbed(group, genes):
    """Return what the long simulation counts here."""
    return replace(group, n_workers=2).simulate(genes, **BUSY)


@pytest.fixture(scope="module")
def local_cluster(tmp_path_factory):
    """Return what starts a scheduler with worker processes of one thread each."""
    place = tmp_path_factory.mktemp("workers")

    def start(n_workers):
        return distributed.LocalCluster(
            n_workers=n_workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",
            local_directory=str(place),
            silence_logs=logging.CRITICAL,
        )

    return start


@pytest.fixture(scope="module")
def two(local_cluster):
    """Return a cluster of two worker processes, connected."""
    with local_cluster(2) as made, connect(made.scheduler_address) as cluster:
        yield cluster


@pytest.fixture
def nobody(local_cluster):
    """Return the address of a scheduler without workers."""
    with local_cluster(0) as made:
        yield made.scheduler_address


@pytest.fixture
def scheduler():
    """Return a scheduler's process and its address."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", str(port)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([*command, "--no-dashboard"], **quiet) as process:
        yield process, f"tcp://127.0.0.1:{port}"
        process.kill()


@pytest.fixture
def worker_of(tmp_path):
    """Return what starts a worker whose zfcal lies in a folder of its own."""
    started = []

    def start(tree, address):
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny"]
        options = ["--no-dashboard", "--nthreads", "1", "--local-directory", str(tmp_path)]
        environment = {**os.environ, "PYTHONPATH": str(tree)}
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        started.append(subprocess.Popen(command + options, env=environment, cwd=tree, **quiet))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def without_zfcal(folder):
    """Return a tree whose zfcal cannot be loaded."""
    (folder / "tree" / "zfcal").mkdir(parents=True)
    (folder / "tree" / "zfcal" / "__init__.py").write_text('raise ImportError("too old")\n')
    return folder / "tree"


def same(first, second):
    """Tell whether all histograms are equal, in shape, type and every count."""
    return all(
        a.dtype == b.dtype and np.array_equal(a, b) for a, b in zip(first, second, strict=True)
    )


def in_the_background(simulate):
    """Return a thread that is at work, and the list that will hold the result or the error."""
    outcome = []

    def work():
        try:
            outcome.append(simulate())
        except ZfcalError as error:
            outcome.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    return thread, outcome


def wait_until(condition, *, patience_s=20.0):
    """Wait until something is the case."""
    end_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < end_s, "waited in vain"
        time.sleep(0.01)


@pytest.mark.slow
def test_a_population_counts_the_same_as_here(two, group, genes):
    """Every genome with every seed, in the order given, to the last count."""
    here = group.simulate(genes, n_counted=5, n_steps=300, seeds=SEEDS)
    there = ClusterGroup(group=group, cluster=two).simulate(
        genes, n_counted=5, n_steps=300, seeds=SEEDS
    )
    assert there.occupation.shape == (12, 3, 2)
    assert there.occupation.sum() == 12 * 3 * 300 * 5
    assert same(here, there)


@pytest.mark.slow
def test_a_group_begins_where_it_was_seen_there_as_well(two, group, genes):
    """Poses travel with the group."""
    xy_m, heading = simulate_tracks(group.template, group.arena, n_agents=5, n_steps=1, seed=4)
    start = Start(poses=np.column_stack([xy_m[0], heading[0]]), time_s=12.0)
    words = {"n_counted": 4, "n_steps": 100, "seeds": SEEDS}
    there = ClusterGroup(group=group, cluster=two).begun(start).simulate(genes, **words)
    assert same(there, group.begun(start).simulate(genes, **words))
    assert not same(there, group.simulate(genes, **words))


def test_the_many_windows_of_one_model_count_the_same_as_here(two, group, genes):
    """As for a ceiling: the runs of one genome are cut, each piece with its own seeds."""
    arguments = {"n_counted": 4, "n_steps": 300, "seeds": np.arange(60, dtype=np.uint64)}
    there = ClusterGroup(group=group, cluster=two).simulate(genes[:1], **arguments)
    assert len(pieces(1, 60, steps_each=3000, n_workers=2)) == 4
    assert same(there, group.simulate(genes[:1], **arguments))


def test_another_template_is_another_group(two, group, genes):
    """Speeds of the template reach the workers; the old group stays what it was."""
    zones = tuple(
        replace(zone, speed_frequency=(1.0, *(0.0,) * 9)) for zone in group.template.zones
    )
    slow = replace(group.template, zones=zones)
    remote = ClusterGroup(group=group, cluster=two)
    arguments = {"n_counted": 4, "n_steps": 50, "seeds": SEEDS}
    there = remote.with_template(slow).simulate(genes, **arguments)
    assert there.speed[..., 1:].sum() == 0
    assert same(there, group.with_template(slow).simulate(genes, **arguments))
    assert same(remote.simulate(genes, **arguments), group.simulate(genes, **arguments))


def test_the_group_says_what_the_local_one_says(two, group):
    """Template and agents are the trial's; as many simulations at a time as there are threads."""
    remote = ClusterGroup(group=group, cluster=two)
    assert (remote.template, remote.n_agents, remote.n_fish) == (group.template, 5, 4)
    assert remote.n_workers == two.n_threads == 2


def test_genomes_of_another_arena_are_refused_here(two, group):
    """Not by a worker, after a while."""
    remote = ClusterGroup(group=group, cluster=two)
    with pytest.raises(InputError, match="2 zones need 10 genes"):
        remote.simulate(np.zeros((4, 18)), n_counted=5, n_steps=10, seeds=SEEDS)


def test_an_error_on_a_worker_is_the_error_here(two, group):
    """A gene outside [0, 1] is refused with the same words."""
    with pytest.raises(InputError, match=r"genes in \[0, 1\]"):
        ClusterGroup(group=group, cluster=two).simulate(
            np.full((1, 10), 2.0), n_counted=5, n_steps=10, seeds=SEEDS
        )


def test_a_whole_round_ends_in_the_same_champion(two, group, genes):
    """Search, confirmation, ceiling and intervals: every number is equal."""
    counts = group.simulate(genes[:1], n_counted=4, n_steps=600, seeds=SEEDS[:1])
    control = as_statistics(pool_runs(counts), 0, group.arena.zone_names)
    seeds = SeedSource(trial_seed=7, window_end_s=120)
    settings = Settings(
        population=8, generations=3, steps=200, long_runs=2, long_s=60.0, n_windows=20
    )
    here, there = (
        calibrate_window(Task(group=each, control=control, seeds=seeds), settings)
        for each in (group, ClusterGroup(group=group, cluster=two))
    )
    assert here.champion == there.champion
    # By their text: a zone without a pair has no D, and NaN is not equal to NaN.
    assert repr(here.scores) == repr(there.scores)
    assert repr(here.ceiling) == repr(there.ceiling)
    assert repr(here.intervals) == repr(there.intervals)
    assert np.array_equal(here.population.genes, there.population.genes)


@pytest.mark.slow
@pytest.mark.parametrize("n_killed", [1, 2])
def test_a_killed_worker_loses_nothing(two, group, genes, undisturbed, n_killed):
    """SIGKILL in the middle, to one worker or to all: the rest, or their successors, do it."""
    remote = ClusterGroup(group=group, cluster=two)
    workers = two.client.run(os.getpid)
    thread, outcome = in_the_background(lambda: remote.simulate(genes, **BUSY))
    wait_until(lambda: any(two.client.has_what().values()))
    for process in list(workers.values())[:n_killed]:
        os.kill(process, signal.SIGKILL)
    assert outcome == [], "was done before anybody was killed"
    thread.join()
    wait_until(lambda: two.n_threads == 2)
    assert len(set(workers.values()) & set(two.client.run(os.getpid).values())) == 2 - n_killed
    assert same(outcome[0], undisturbed)


@pytest.mark.slow
def test_a_worker_that_dies_while_it_is_asked_is_passed_over(two, monkeypatch):
    """It is not taken for one that cannot load zfcal."""
    own = two.client.run(os.getpid)
    process = next(iter(own.values()))

    def dying():
        if os.getpid() == process:
            os.kill(process, signal.SIGKILL)
        return fingerprint()

    monkeypatch.setattr(scheduling, "fingerprint", dying)
    assert not two.check()
    monkeypatch.undo()
    # The scheduler may need a moment to forget the one that died.
    wait_until(lambda: two.n_threads == 2 and two.check())


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["scheduler", "worker"])
def test_a_lost_cluster_ends_the_work_in_time(lost, scheduler, worker_of, group, genes, repository):
    """With one line that says how to go on, within the patience."""
    process, address = scheduler
    worker = worker_of(repository, address)
    with connect(address, patience_s=20.0) as cluster:
        impatient = ClusterGroup(group=group, cluster=replace(cluster, patience_s=1.0))
        arguments = {**BUSY, "seeds": np.arange(99, dtype=np.uint64)}
        thread, outcome = in_the_background(lambda: impatient.simulate(genes, **arguments))
        wait_until(lambda: any(cluster.client.has_what().values()))
        (process if lost == "scheduler" else worker).kill()
        thread.join(30)
    assert not thread.is_alive()
    (error,) = outcome
    wanted = {"scheduler": "the scheduler has gone", "worker": "no worker is left"}
    assert wanted[lost] in str(error)
    assert "it goes on where it was" in error.hint


def test_every_pair_of_genome_and_run_is_in_one_piece():
    """Whatever the shape, the length of a run and the number of workers."""
    for n_genomes, n_runs in ((1, 1), (60, 1), (10, 10), (1, 200), (7, 3)):
        for steps_each in (1, 20_000, 10**9):
            for n_workers in (1, 2, 100):
                done = np.zeros((n_genomes, n_runs), dtype=int)
                for block in pieces(n_genomes, n_runs, steps_each=steps_each, n_workers=n_workers):
                    done[block] += 1
                assert (done == 1).all()


def test_pieces_are_neither_crumbs_nor_loaves():
    """Sixty genomes of 16,500 agent-steps: eight pieces for two threads, fifteen for many."""
    sizes = {n: pieces(60, 1, steps_each=16_500, n_workers=n) for n in (2, 1000)}
    assert len(sizes[2]) == 8
    assert len(sizes[1000]) == 15
    short = pieces(1, 200, steps_each=4800, n_workers=1000)
    assert all((runs.stop - runs.start) * 4800 >= LEAST_STEPS for _, runs in short[:-1])
    long = pieces(60, 10, steps_each=10_500, n_workers=1)
    assert all(
        (rows.stop - rows.start) * (runs.stop - runs.start) * 10_500 <= MOST_STEPS
        for rows, runs in long
    )


def test_parts_are_put_where_they_belong():
    """In whatever order the pieces stand."""
    shapes = ((2, 10), (2, 10), (2,), (2, 2), (2, 10))
    blocks = [(slice(1, 3), slice(0, 2)), (slice(0, 1), slice(0, 2))]
    parts = [
        Counts(*(np.full((rows.stop - rows.start, 2, *shape), number) for shape in shapes))
        for number, (rows, _) in enumerate(blocks)
    ]
    assert assemble(parts, blocks).occupation[:, 0, 0].tolist() == [1, 0, 0]


@pytest.mark.parametrize("address", ["host", "tcp://host", "http://host:80", "tcp://host:no", ""])
def test_an_address_that_is_none_is_refused(address):
    """With an example of one."""
    with pytest.raises(InputError, match="tcp://HOST:PORT"), connect(address):
        pass


def listening(answer):
    """Return a socket that listens and gives everybody the same answer, or none."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve():
        while answer:
            try:
                with server.accept()[0] as connection:
                    connection.sendall(answer)
            except OSError:
                return

    threading.Thread(target=serve, daemon=True).start()
    return server


@pytest.mark.parametrize("answer", [None, b"", b"HTTP/1.1 400 Bad Request\r\n\r\n"])
def test_where_no_scheduler_answers_it_is_said_in_time(answer):
    """A closed port, a silent one and another program's: one line, within the patience."""
    with listening(answer) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if answer is None:
            server.close()
        begin_s = time.monotonic()
        with (
            pytest.raises(InputError, match="no scheduler answers") as caught,
            connect(address, patience_s=0.5),
        ):
            pass
    assert time.monotonic() - begin_s < 30
    assert address in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "dask scheduler" in caught.value.hint


def test_a_workers_address_is_not_the_schedulers(two):
    """People copy the wrong line."""
    worker = next(iter(two.client.nthreads()))
    with pytest.raises(InputError, match="a worker answers there"), connect(worker):
        pass


def test_a_scheduler_without_workers_is_said_in_time(nobody):
    """And how to start one."""
    with (
        pytest.raises(InputError, match="it has no worker") as caught,
        connect(nobody, patience_s=0.5),
    ):
        pass
    assert "dask worker" in caught.value.hint


def test_without_the_package_the_extra_is_named(monkeypatch):
    """Before anything else is tried."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match="needs the package distributed") as caught,
        connect("tcp://127.0.0.1:8786"),
    ):
        pass
    assert "pip install 'zfcal[cluster]'" in caught.value.hint


def test_a_worker_with_other_sources_is_refused(nobody, worker_of, repository, tmp_path):
    """One changed comment in a kernel: worker, its digest and ours are named."""
    ignore = shutil.ignore_patterns("__pycache__", ".*")
    shutil.copytree(repository / "zfcal", tmp_path / "tree" / "zfcal", ignore=ignore)
    with (tmp_path / "tree" / "zfcal" / "model" / "geometry.py").open("a") as file:
        file.write("# changed\n")
    worker_of(tmp_path / "tree", nobody)
    with (
        pytest.raises(InputError, match=r"has sources (\w+); here it is sources (\w+)") as caught,
        connect(nobody, patience_s=20.0),
    ):
        pass
    assert "Worker tcp://" in str(caught.value)
    assert fingerprint().sources in str(caught.value)


def test_a_worker_with_an_older_zfcal_is_refused(nobody, worker_of, tmp_path):
    """One that knows nothing of clusters cannot even say its version."""
    worker_of(without_zfcal(tmp_path), nobody)
    with (
        pytest.raises(InputError, match=r"cannot load zfcal .*too old"),
        connect(nobody, patience_s=20.0),
    ):
        pass


@pytest.mark.slow
def test_a_late_worker_without_zfcal_ends_the_work(local_cluster, worker_of, group, tmp_path):
    """In an error that names it: it does not hang."""
    with local_cluster(1) as made, connect(made.scheduler_address) as cluster:
        worker_of(without_zfcal(tmp_path), made.scheduler_address)
        wait_until(lambda: cluster.n_threads == 2)
        made.scale(0)
        wait_until(lambda: cluster.n_threads == 1)
        with pytest.raises(InputError, match=r"cannot load zfcal .*too old"):
            ClusterGroup(group=group, cluster=cluster).simulate(
                np.full((1, 10), 0.5), n_counted=5, n_steps=10, seeds=SEEDS
            )


def test_a_late_worker_with_other_sources_does_no_work(two, group, genes, monkeypatch):
    """It compares itself before each piece, since it came after all were compared."""
    ours = replace(fingerprint(), sources="ours")
    monkeypatch.setattr(scheduling, "fingerprint", lambda: ours)
    with pytest.raises(InputError, match=r"Worker tcp.* has sources \w+; here it is sources ours"):
        ClusterGroup(group=group, cluster=two).simulate(genes, n_counted=5, n_steps=10, seeds=SEEDS)


def test_a_late_worker_with_another_processor_is_compared(two, group, genes, monkeypatch):
    """As good as ours if a short simulation ends in the same bits, refused otherwise."""
    remote = ClusterGroup(group=group, cluster=two)
    arguments = {"n_counted": 5, "n_steps": 20, "seeds": SEEDS}
    two._machines.clear()
    monkeypatch.setattr(prints, "_machine", lambda: "another")
    fingerprint.cache_clear()
    try:
        assert same(remote.simulate(genes, **arguments), group.simulate(genes, **arguments))
        two._machines.clear()
        nowhere = np.zeros((1, 1, 2)), np.zeros((1, 1))
        monkeypatch.setattr(prints.simulation, "simulate_tracks", lambda *_, **__: nowhere)
        prints.trace.cache_clear()
        with pytest.raises(InputError, match=r"ends in \w+ there, in \w+ here"):
            remote.simulate(genes, **arguments)
    finally:
        monkeypatch.undo()
        fingerprint.cache_clear()
        prints.trace.cache_clear()
        two.check()


def test_fingerprints_name_what_differs():
    """Only that; the machine alone is no reason."""
    here = fingerprint()
    refuse_unlike(here, replace(here, machine="another"), "tcp://there:1")
    with pytest.raises(InputError, match=r"there:1 has sources abc, numba 0\.1; here it is"):
        refuse_unlike(here, replace(here, numba="0.1", sources="abc"), "tcp://there:1")
    with pytest.raises(InputError, match=r"cannot load zfcal .*: No module"):
        refuse_unlike(here, ImportError("No module named 'zfcal'"), "tcp://there:1")


def test_a_trace_is_equal_to_itself_alone():
    """The same in every call; anything else is refused."""
    refuse_other_bits(prints.trace(), "tcp://there:1")
    with pytest.raises(InputError, match="computes otherwise"):
        refuse_other_bits("0" * 12, "tcp://there:1")
