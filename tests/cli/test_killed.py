"""kill -9 at random instants: what is run again ends in the bytes of an undisturbed run."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

KILLS = 20

# A round of a third of a second, so that kills fall into searches, conclusions and writes.
CALIBRATE = ("calibrate", "trial", "--generations", "6", "--population", "12", "--steps", "400")
CALIBRATE += ("--no-seed-likelihood",)
IMPORT = ("import", "tracks.csv", "trial", "--format", "csv")
ANALYSE = ("analyse", "trial")


def contents(root):
    """Return every artifact's bytes; dot-files are nobody's artifacts."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and not path.name.startswith(".")
    }


class Forks:
    """Runs commands in forks of a process that has loaded what they need."""

    def __init__(self, script):
        self._process = subprocess.Popen(
            [sys.executable, str(script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, folder, words, *, kill_after_s=None):
        """Run a command; with a time, kill it then. Return whether it had ended by itself."""
        print(
            json.dumps({"words": words, "cwd": str(folder)}), file=self._process.stdin, flush=True
        )
        process = json.loads(self._process.stdout.readline())["process"]
        if kill_after_s is not None:
            time.sleep(kill_after_s)
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        code = json.loads(self._process.stdout.readline())["code"]
        assert code in {0, -signal.SIGKILL}
        return code == 0

    def close(self):
        """End the process."""
        self._process.stdin.close()
        assert self._process.wait(60) == 0
        self._process.stdout.close()


@pytest.fixture(scope="module")
def forks(repository):
    """Return what runs commands and kills them."""
    made = Forks(repository / "tests" / "forks.py")
    yield made
    made.close()


@pytest.mark.parametrize(
    ("before", "words", "seed"),
    [((), IMPORT, 1), ((IMPORT,), ANALYSE, 2), ((IMPORT, ANALYSE), CALIBRATE, 3)],
    ids=["import", "analyse", "calibrate"],
)
def test_a_command_killed_twenty_times_ends_in_the_same_bytes(
    forks, tracks_csv, tmp_path, before, words, seed
):
    """At random instants of its work, from its first read to its last write.

    Whatever stands there in between is whole: a half-written file would be read by the next
    run, or differ in the end. A run that comes to its end begins anew.
    """
    tracks_csv(seconds=250)
    tank = ("--side-m", "1", "--fish", "3", "--robot", "--fps", "5", "--seed", "1")
    for earlier in (("init", "trial", *tank), *before):
        assert forks.run(tmp_path, earlier)
    root, start = tmp_path / "trial", tmp_path / "start"
    shutil.copytree(root, start)
    began_s = time.monotonic()
    assert forks.run(tmp_path, words)
    takes_s = time.monotonic() - began_s
    undisturbed = contents(root)

    rng = np.random.default_rng(seed)
    n_killed, n_ended = 0, 1
    while n_killed < KILLS:
        if n_ended:
            shutil.rmtree(root)
            shutil.copytree(start, root)
        n_ended = forks.run(tmp_path, words, kill_after_s=rng.uniform(0.0, 0.9) * takes_s)
        n_killed += not n_ended
        found = contents(root)
        assert all(undisturbed[name] == found[name] for name in found)
    assert forks.run(tmp_path, words)
    assert contents(root) == undisturbed
    assert not list(root.rglob(".*part-*"))
