"""kill -9 at random instants: what is run again ends in the bytes of an undisturbed run."""

import shutil
import signal
import subprocess
import time

import numpy as np
import pytest

# A round of half a second, so that kills fall into searches, conclusions and writes.
CALIBRATE = ("calibrate", "trial", "--generations", "6", "--population", "12", "--steps", "400")
IMPORT = ("import", "tracks.csv", "trial", "--format", "csv")
ANALYSE = ("analyse", "trial")


def contents(root):
    """Return every artifact's bytes; dot-files are nobody's artifacts."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and not path.name.startswith(".")
    }


@pytest.fixture
def run(command, tmp_path):
    """Run a command; with a time, kill it then. Return whether it had ended by itself."""

    def call(words, *, kill_after_s=None):
        with subprocess.Popen(
            [*command, *words],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        ) as process:
            if kill_after_s is not None:
                time.sleep(kill_after_s)
                process.send_signal(signal.SIGKILL)
            _, said = process.communicate(timeout=120)
            assert process.returncode in {0, -signal.SIGKILL}, said.decode()
            return process.returncode == 0

    return call


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "words", "seed"),
    [((), IMPORT, 1), ((IMPORT,), ANALYSE, 2), ((IMPORT, ANALYSE), CALIBRATE, 3)],
    ids=["import", "analyse", "calibrate"],
)
def test_a_killed_command_run_again_ends_in_the_same_bytes(
    run, tracks_csv, tmp_path, before, words, seed
):
    """Killed six times within the time that it takes, from start-up to the last write.

    Whatever stands there in between is whole: a half-written file would be read
    by the next run, or differ in the end.
    """
    tracks_csv(seconds=360)
    run(("init", "trial", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5", "--seed", "1"))
    for earlier in before:
        assert run(earlier)
    shutil.copytree(tmp_path / "trial", tmp_path / "start")
    started_s = time.monotonic()
    assert run(words)
    takes_s = time.monotonic() - started_s
    undisturbed = contents(tmp_path / "trial")
    shutil.rmtree(tmp_path / "trial")
    shutil.move(tmp_path / "start", tmp_path / "trial")

    rng = np.random.default_rng(seed)
    for _ in range(6):
        if run(words, kill_after_s=rng.uniform(0.3, 0.9) * takes_s):
            break
        found = contents(tmp_path / "trial")
        assert all(undisturbed[name] == found[name] for name in found)
    assert run(words)
    assert contents(tmp_path / "trial") == undisturbed
    assert not list((tmp_path / "trial").rglob(".*part-*"))
