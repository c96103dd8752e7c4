"""Pipe, cron and watch end in the same artifacts, and a budget's rounds can be repeated."""

import shutil
import subprocess

import pytest

from zfcal.artifacts.models import read_result


@pytest.fixture
def three(trial, tmp_path):
    """Return three copies of a trial without segments, and what brings one to a copy."""
    waiting = tmp_path / "waiting"
    shutil.move(trial / "tracks", waiting)
    (trial / "tracks").mkdir()
    copies = [shutil.copytree(trial, tmp_path / name) for name in ("pipe", "cron", "watch")]

    def bring(root, start):
        part = root / "tracks" / ".part"
        shutil.copy(waiting / f"{start:06d}.parquet", part)
        return part.rename(root / "tracks" / f"{start:06d}.parquet")

    return copies, bring


def run_pipe(command, root, bring, quick):
    """Feed the paths to a pipe one by one, as they appear."""
    analyse = subprocess.Popen(
        [*command, "analyse", "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        bufsize=1,
    )
    calibrate = subprocess.Popen(
        [*command, "calibrate", "-", *quick],
        stdin=analyse.stdout,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    analyse.stdout.close()
    with analyse, calibrate:
        analyse.stdin.write(f"{bring(root, 0)}\n{bring(root, 60)}\n")
        assert calibrate.stdout.readline().endswith("models/000120.parquet\n")
        analyse.stdin.write(f"{bring(root, 120)}\n{bring(root, 180)}\n")
        analyse.stdin.close()
        assert "models/000180.toml" in calibrate.stdout.read()
    assert (analyse.returncode, calibrate.returncode) == (0, 0)


def run_cron(zfcal, root, bring, quick):
    """Run both commands, some segments later again, and once more.

    Not as processes: how cron starts them is tested with pipes.
    """
    for starts in ((0, 60), (120, 180), ()):
        for start in starts:
            bring(root, start)
        assert zfcal("analyse", root).code == 0
        assert zfcal("calibrate", root, *quick).code == 0


def run_watch(watching, root, bring):
    """Let a watch find the segments."""
    with watching.start(root, *watching.quick) as watch:
        watch.until("began")
        bring(root, 0)
        bring(root, 60)
        watch.until("finished", window_end_s=120)
        bring(root, 120)
        bring(root, 180)
        assert watch.wait() == 0


@pytest.mark.slow
def test_pipe_cron_and_watch_end_in_the_same_bytes(three, command, zfcal, watching):
    """While segments appear one after the other; offline gives that too, as other tests show."""
    (pipe, cron, watched), bring = three
    run_pipe(command, pipe, bring, watching.quick)
    run_cron(zfcal, cron, bring, watching.quick)
    run_watch(watching, watched, bring)
    found = [watching.contents(root) for root in (pipe, cron, watched)]
    assert "models/000180.toml" in found[0]
    assert found[0] == found[1] == found[2]


@pytest.mark.slow
def test_rounds_of_a_watch_with_a_budget_can_be_repeated(trial, zfcal, watching):
    """Each by the generations that it records, and the statistics that it is about."""
    again = shutil.copytree(trial, trial.parent / "again")
    shape = watching.quick[2:]
    watched = zfcal("watch", "trial", "--once", "--budget", "1s", *shape)
    assert watched.code == 0, watched.err
    assert zfcal("analyse", "again").code == 0
    for end in (120, 180):
        model = trial / "models" / f"{end:06d}.toml"
        n = read_result(model)["generations"]
        stats = f"again/stats/{end:06d}.parquet"
        assert zfcal("calibrate", stats, "--generations", n, *shape).code == 0
    assert watching.contents(trial) == watching.contents(again)
    untouched = zfcal("calibrate", "trial", "--budget", "1s", *shape)
    assert "nothing to do" in untouched.err
