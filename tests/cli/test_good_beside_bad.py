"""A file that is none ends no run: it is named, and the good ones beside it are worked on."""

import os
import signal

import pytest


@pytest.fixture(autouse=True)
def in_time():
    """End a test that waits for a pipe."""
    signal.alarm(100)
    yield
    signal.alarm(0)


def _put(path, kind):
    path.unlink(missing_ok=True)
    makes = {
        "pipe": lambda: os.mkfifo(path),
        "loop": lambda: path.symlink_to(path.name),
        "folder": path.mkdir,
        "device": lambda: path.symlink_to("/dev/zero"),
        "huge": lambda: (path.touch(), os.truncate(path, 600 * 10**6)),
    }
    makes[kind]()


@pytest.mark.parametrize("kind", ["pipe", "loop", "folder", "device", "huge"])
def test_analyse_and_check_name_what_is_no_segment(zfcal, trial, kind):
    """The window before it is analysed all the same."""
    _put(trial / "tracks" / "000120.parquet", kind)
    done = zfcal("analyse", "trial")
    assert done.code == 3
    what = "is too large (600.0 MB" if kind == "huge" else "cannot be read"
    assert f"tracks/000120.parquet: {what}" in done.err
    assert done.lines == ["trial/stats/000120.parquet", "trial/scores/000120.parquet"]
    checked = zfcal("check", "trial")
    assert checked.code == 3
    # Its end is looked at first, and is none of a table's.
    what = "is not a Parquet file" if kind == "huge" else what
    assert f"tracks/000120.parquet: {what}" in checked.out


def test_statistics_are_not_written_through_a_link_that_leads_outside(zfcal, trial, tmp_path):
    """The link is named, and nothing comes into being behind it."""
    (tmp_path / "theirs").mkdir()
    (trial / "stats").symlink_to(tmp_path / "theirs")
    done = zfcal("analyse", "trial")
    assert done.code == 1
    assert "stats" in done.err
    assert "leads outside the trial" in done.err
    assert list((tmp_path / "theirs").iterdir()) == []
    assert "leads outside the trial" in zfcal("check", "trial").out
