"""Commands as processes, with a time limit, on trials in which something bad lies beside the good.

Each fault is one that once ended a run, or kept it waiting for ever.
"""

import os
import shutil

import pytest

from zfcal_cli.main import run

pytestmark = pytest.mark.slow

QUICK = ("--generations", "1", "--population", "4", "--steps", "20", "--seed", "1")
PLAIN = "--no-seed-likelihood"
END = {"stats/000120.parquet", "scores/000120.parquet", "models/000120.toml"}


@pytest.fixture(scope="module")
def analysed(tmp_path_factory, write_tracks):
    """Return a trial of two windows with statistics."""
    place = tmp_path_factory.mktemp("analysed")
    write_tracks(place / "tracks.csv", seconds=200)
    root = place / "trial"
    tank = ("--side-m", "1", "--fish", "3", "--robot", "--fps", "5", "-q")
    assert run(["init", str(root), *tank]) == 0
    assert run(["import", str(place / "tracks.csv"), str(root), "--format", "csv", "-q"]) == 0
    assert run(["analyse", str(root), "-q"]) == 0
    return root


@pytest.fixture
def trial(analysed, tmp_path):
    """Return a copy of it without statistics."""
    root = shutil.copytree(analysed, tmp_path / "trial")
    for folder in ("stats", "scores"):
        shutil.rmtree(root / folder)
    return root


def put(path, kind):
    """Put a pipe, a loop of links or a folder in the place of a file."""
    path.unlink(missing_ok=True)
    makes = {
        "pipe": lambda: os.mkfifo(path),
        "loop": lambda: path.symlink_to(path.name),
        "folder": path.mkdir,
    }
    makes[kind]()


def good_of(root):
    """Return those of the artifacts of the first window that are there."""
    return {name for name in END if (root / name).is_file()}


@pytest.mark.parametrize("kind", ["pipe", "loop", "folder"])
def test_the_first_window_is_made_whatever_lies_in_the_place_of_a_later_segment(
    process, trial, kind
):
    """Analyse, check and watch name it; watch does not say that the trial is gone."""
    put(trial / "tracks" / "000120.parquet", kind)
    for command in ("analyse", "check"):
        done = process(command, trial)
        assert done.code == 3, done.err
        assert "tracks/000120.parquet: cannot be read" in done.err + done.out
        assert "bug in zfcal" not in done.err
    for folder in ("stats", "scores"):
        shutil.rmtree(trial / folder)
    watched = process("watch", trial, "--once", *QUICK, PLAIN, "--json")
    assert watched.code == 3, watched.err
    assert '"gone"' not in watched.out
    assert "tracks/000120.parquet: cannot be read" in watched.out + watched.err
    assert good_of(trial) == END


@pytest.mark.parametrize("kind", ["pipe", "loop", "folder"])
def test_a_window_is_calibrated_without_the_estimate_where_a_segment_is_no_file(
    process, analysed, tmp_path, kind
):
    """The statistics are there, and the segment has gone bad since."""
    root = shutil.copytree(analysed, tmp_path / "trial")
    (root / "stats" / "000180.parquet").unlink()
    put(root / "tracks" / "000000.parquet", kind)
    done = process("calibrate", root, *QUICK)
    assert done.code == 3, done.err
    assert "tracks/000000.parquet: cannot be read" in done.err
    assert (root / "models" / "000120.toml").is_file()


@pytest.mark.parametrize("command", ["analyse", "watch"])
def test_nothing_is_written_behind_a_link_that_leads_outside(process, trial, tmp_path, command):
    """Stats leads there: it is named, once, and by watch without an end of its own."""
    (tmp_path / "theirs").mkdir()
    (trial / "stats").symlink_to(tmp_path / "theirs")
    words = ("watch", trial, "--once", *QUICK, PLAIN) if command == "watch" else ("analyse", trial)
    done = process(*words)
    assert done.code == 1
    assert "leads outside the trial" in done.err
    assert "Traceback" not in done.err
    assert list((tmp_path / "theirs").iterdir()) == []
    checked = process("check", trial)
    assert checked.code == 3
    assert "leads outside the trial" in checked.out


MODELS = {
    "deep": "a = " + "[" * 100_000,
    "long number": "schema = " + "9" * 5001,
    "large": "# " + "x" * 30_000_000,
}


@pytest.mark.parametrize("text", MODELS)
def test_a_model_that_cannot_be_read_is_named_and_made_anew(process, analysed, tmp_path, text):
    """Check says what is wrong; the round is made again, and the later one goes on from it."""
    root = shutil.copytree(analysed, tmp_path / "trial")
    path = root / "models" / "000120.toml"
    path.write_text(MODELS[text])
    checked = process("check", root)
    assert checked.code == 3
    assert "models/000120.toml" in checked.out
    done = process("watch", root, "--once", *QUICK, PLAIN)
    assert done.code == 0, done.err
    assert path.stat().st_size < 100_000
    assert process("check", root).code == 0
