"""Notifications of changes in a trial, where the file system gives them."""

import importlib.util
import select

import pytest

from zfcal.online import hints as module
from zfcal.online.hints import POLL_S, RESCAN_S, Hints, reason_to_poll

needs_watchfiles = pytest.mark.skipif(
    importlib.util.find_spec("watchfiles") is None, reason="watchfiles is not installed"
)


@pytest.fixture
def listening(make_trial):
    """Return what starts to listen to a trial, and ends it after the test."""
    root = make_trial(seconds=60)
    made = []

    def listen(*, polls=False):
        made.append(Hints(root, polls=polls))
        return root, made[-1]

    yield listen
    for each in made:
        each.close()


def has_hint(hints, within_s):
    """Return whether a hint comes in time, and take it."""
    ready, _, _ = select.select([hints.pipe], [], [], within_s)
    hints.clear()
    return bool(ready)


def settle(hints):
    """Wait until the watching has begun, and no hint is left."""
    while has_hint(hints, 1.0):
        pass


def taken_away(root, hints):
    """Return where a trial is that was there, and went away."""
    settle(hints)
    away = root.rename(root.with_name("away"))
    settle(hints)
    return away


@needs_watchfiles
def test_a_new_file_is_a_hint_at_once_and_a_dot_file_none(listening):
    """Much sooner than the next look; what nobody reads wakes nobody."""
    root, hints = listening()
    settle(hints)
    (root / "tracks" / ".part").write_bytes(b"x")
    assert not has_hint(hints, 0.4)
    (root / "tracks" / ".part").rename(root / "tracks" / "000060.parquet")
    assert has_hint(hints, 0.5 * RESCAN_S)


@pytest.mark.slow
@needs_watchfiles
def test_folders_that_appear_or_are_replaced_are_watched(listening):
    """The first statistics make their folder."""
    root, hints = listening()
    settle(hints)
    (root / "stats").mkdir()
    assert has_hint(hints, RESCAN_S)
    settle(hints)
    (root / "stats" / "000120.parquet").write_bytes(b"x")
    assert has_hint(hints, RESCAN_S)


@pytest.mark.slow
@needs_watchfiles
def test_a_trial_that_goes_and_comes_is_no_error(listening):
    """The thread lives on, and hears of what comes later."""
    root, hints = listening()
    away = taken_away(root, hints)
    away.rename(root)
    settle(hints)
    (root / "tracks" / "000120.parquet").write_bytes(b"x")
    assert has_hint(hints, 2 * RESCAN_S)


@pytest.mark.slow
@needs_watchfiles
def test_what_came_before_it_listened_again_is_a_hint(listening):
    """A trial that comes back brings its news with it."""
    root, hints = listening()
    away = taken_away(root, hints)
    (away / "tracks" / "000120.parquet").write_bytes(b"x")
    away.rename(root)
    assert has_hint(hints, 2 * RESCAN_S)


def test_without_notifications_it_looks_more_often(listening):
    """And no thread runs."""
    root, hints = listening(polls=True)
    (root / "tracks" / "000060.parquet").write_bytes(b"x")
    assert not has_hint(hints, 0.3)
    assert hints.rescan_s == POLL_S < RESCAN_S


@pytest.mark.parametrize(
    ("kind", "polls"), [("ext4", False), ("nfs4", True), ("cifs", True), ("fuse.sshfs", True)]
)
def test_network_file_systems_are_polled(tmp_path, monkeypatch, kind, polls):
    """Changes made on other computers are not announced there, and the reason says so."""
    monkeypatch.setattr(module, "file_system", lambda _: kind)
    monkeypatch.setattr(module, "_library", object)
    reason = reason_to_poll(tmp_path, asked=False)
    assert (reason is not None) == polls
    assert not polls or kind in reason
    assert reason_to_poll(tmp_path, asked=True) == "--poll was given"


def test_without_the_library_it_polls(tmp_path, monkeypatch):
    """And says why."""
    monkeypatch.setattr(module, "file_system", lambda _: "ext4")
    monkeypatch.setattr(module, "_library", lambda: None)
    assert reason_to_poll(tmp_path, asked=False) == "watchfiles is not installed"
