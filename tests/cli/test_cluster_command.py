"""`zfcal calibrate --cluster`: the bytes and the words of a run without it."""

import logging
import shutil

import pytest

distributed = pytest.importorskip("distributed", reason="the extra zfcal[cluster] is not there")

ROUND = ("--generations", "2", "--population", "8", "--steps", "200", "--no-seed-likelihood")


def artifacts(root):
    """Return every artifact's bytes; dot-files are nobody's artifacts."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and not path.name.startswith(".")
    }


@pytest.fixture
def one_window(zfcal, tracks_csv, tmp_path):
    """Return a trial with statistics of a single window."""
    tracks_csv(seconds=130)
    zfcal("init", "trial", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    zfcal("import", "tracks.csv", "trial", "--format", "csv")
    zfcal("analyse", "trial")
    return tmp_path / "trial"


@pytest.mark.slow
def test_an_archive_on_a_cluster_is_as_without_it(zfcal, one_window, tmp_path):
    """Two trials on two worker processes: same files, same paths in the same order."""
    shutil.copytree(one_window, tmp_path / "other")
    both = ("trial", "other")
    here = zfcal("calibrate", *both, *ROUND)
    assert here.code == 0
    wanted = [artifacts(tmp_path / name) for name in both]
    for name in both:
        for path in (
            *(tmp_path / name / "models").glob("0001*"),
            *(tmp_path / name).glob("s*/*-m*"),
        ):
            path.unlink()
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address=":0",
        local_directory=str(tmp_path / "workers"),
        silence_logs=logging.CRITICAL,
    ) as cluster:
        place = ("--cluster", cluster.scheduler_address)
        there = zfcal("calibrate", *both, "trial", *ROUND, *place)
        again = zfcal("calibrate", *both, *ROUND, *place)
        missing = zfcal("calibrate", "trial", "nowhere", *ROUND, *place)
    assert there.code == 0
    assert there.lines == here.lines
    assert "workers 2, threads 2" in there.err
    assert [artifacts(tmp_path / name) for name in both] == wanted
    assert again.lines == here.lines
    assert "nothing to do" in again.err
    assert missing.code == 1
    assert "nowhere" in missing.err
    assert missing.lines == here.lines[: len(here.lines) // 2]


def test_an_unreachable_cluster_is_one_line(zfcal, trial):
    """Exit code 1, and a hint; a dry run needs none."""
    place = ("--cluster", "tcp://127.0.0.1")
    done = zfcal("calibrate", trial, *place)
    assert done.code == 1
    assert done.lines == []
    assert "tcp://HOST:PORT" in done.err
    zfcal("analyse", trial)
    assert zfcal("calibrate", trial, *place, "--dry-run").code == 0


def test_threads_of_this_machine_have_no_meaning_there(zfcal, trial):
    """An option that cannot take effect is an error."""
    done = zfcal("calibrate", trial, "--cluster", "tcp://127.0.0.1:1", "--workers", "2")
    assert done.code == 2
    assert "--workers" in done.err
