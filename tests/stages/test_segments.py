"""Reading segments: each once, and no more of them in memory than is bearable."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.segments import segment_path
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.behaviour.located import join
from zfcal.behaviour.statistics import measure
from zfcal.errors import DamagedError, InputError
from zfcal.stages import segments as module
from zfcal.stages.segments import END_KEY, Segments, covered, guess_options, segment_hashes
from zfcal.tracks import FISH

STARTS = [0, 60, 120, 180]


@pytest.fixture
def reads(monkeypatch):
    """Return a list that hears which segments are read from the disk."""
    heard, read = [], module.read_segment

    def watch(opened, start_s):
        heard.append(start_s)
        return read(opened, start_s)

    monkeypatch.setattr(module, "read_segment", watch)
    return heard


def pooled(segments, root, starts, heard):
    """Return what a reader pools of some segments."""
    opened = segments.open(root)
    return segments.pool(opened, segment_hashes(root, starts), heard.append)


def fish_of(root, starts):
    """Return what the fish of some segments did, all points at once."""
    segments = Segments()
    opened = segments.open(root)
    points = join([segments.read(opened, start) for start in starts])
    return measure(points.of_kind(FISH), opened.arena)


def test_a_longer_pool_reads_only_what_is_new(make_trial, heard, reads):
    """Window after window, every segment is read once."""
    root, segments = make_trial(seconds=240, n_robots=1), Segments()
    for n in (2, 3, 4):
        found = pooled(segments, root, STARTS[:n], heard)
        assert (found.pool.fish().distance == fish_of(root, STARTS[:n]).distance).all()
    assert [reads.count(start) for start in STARTS] == [1 + 3, 1 + 3, 1 + 2, 1 + 1]


@pytest.mark.parametrize("starts", [STARTS[:2], STARTS[1:], [0, 60, 180]])
def test_another_stretch_is_pooled_anew(make_trial, heard, starts):
    """A shorter one, one that begins later, one with a gap."""
    root, segments = make_trial(seconds=240), Segments()
    pooled(segments, root, STARTS, heard)
    found = pooled(segments, root, starts, heard)
    assert list(found.hashes) == starts
    assert (found.pool.fish().transition == fish_of(root, starts).transition).all()


def test_a_segment_that_has_changed_is_not_in_the_pool_any_more(make_trial, heard):
    """Its hash is another: what was pooled with it is thrown away."""
    root, other, segments = make_trial("a"), make_trial("b", seed=2), Segments()
    before = pooled(segments, root, STARTS[:2], heard).pool.fish()
    segment_path(root, 60).write_bytes(segment_path(other, 60).read_bytes())
    after = pooled(segments, root, STARTS, heard).pool.fish()
    assert (after.distance == fish_of(root, STARTS).distance).all()
    assert (before.distance != fish_of(root, STARTS[:2]).distance).any()


def test_a_damaged_segment_is_told_each_time_and_counts_nothing(make_trial, heard):
    """Until it is mended; whoever asks again hears of it again."""
    root, segments = make_trial(seconds=240), Segments()
    path = segment_path(root, 60)
    whole = path.read_bytes()
    path.write_bytes(whole[:100])
    for n in (3, 4):
        found = pooled(segments, root, STARTS[:n], heard)
        assert list(found.problems) == [60]
    assert [event.path for event in heard] == [path, path]
    path.write_bytes(whole)
    assert pooled(segments, root, STARTS, heard).problems == {}
    assert len(heard) == 2


def test_no_more_points_are_remembered_than_is_bearable(make_trial, reads, monkeypatch):
    """Of four segments the last three stay, however little memory they may take."""
    monkeypatch.setattr(module, "_REMEMBERED", 1)
    root, segments = make_trial(seconds=240), Segments()
    opened = segments.open(root)
    for start in (*STARTS, *STARTS[1:], 0):
        segments.read(opened, start)
    assert reads == [*STARTS, 0]


def test_a_segment_that_is_missing_has_no_hash(make_trial):
    """It is named."""
    root = make_trial(seconds=120)
    with pytest.raises(InputError, match=r"tracks/000120.parquet: no such file"):
        segment_hashes(root, [0, 120])


def test_a_lineage_states_how_guesses_count_where_there_are_some(make_trial):
    """One of 0.49 in the second minute; one of a half is none, and a damaged file has none."""
    root = make_trial(seconds=180)
    paths = [segment_path(root, start) for start in STARTS[:3]]
    for path, confidence in zip(paths, (0.5, 0.49, 1.0), strict=True):
        rows = read_tracks(path)
        unsure = np.where(np.arange(len(rows)) == 7, confidence, 1.0).astype(np.float32)
        write_tracks(path, replace(rows, confidence=unsure), read_lineage(path))
    paths[2].write_bytes(paths[2].read_bytes()[:1000])

    assert guess_options([paths[0], paths[2]]) == {}
    assert guess_options(paths) == {"guesses": "seen"}


def test_tracks_cover_what_lies_between_their_first_and_last_row(make_trial):
    """A part begins with its first row, ends with its last, and a missing minute parts it."""
    root = make_trial(seconds=230)
    first = segment_path(root, 0)
    rows = read_tracks(first)
    write_tracks(first, rows.take(rows.time_s >= 35.4), read_lineage(first))
    assert covered(root, (0, 240), fps=5.0) == [(35, 230)]
    assert covered(root, (50, 200), fps=5.0) == [(50, 200)]
    segment_path(root, 120).unlink()
    assert covered(root, (0, 240), fps=5.0) == [(35, 120), (180, 230)]
    assert covered(root, (100, 200), fps=5.0) == [(100, 120), (180, 200)]
    assert covered(root, (120, 180), fps=5.0) == covered(root, (230, 900), fps=5.0) == []


def test_tracks_do_not_cover_what_lies_between_a_stop_and_a_restart(make_trial):
    """Neighbours by name: the one stops at 75 s, the other begins at 160 s."""
    root = make_trial(seconds=230)
    for start, kept in ((60, (60.0, 75.0)), (120, (160.0, 180.0))):
        path = segment_path(root, start)
        rows = read_tracks(path)
        lineage, own = read_lineage(path), (rows.time_s >= kept[0]) & (rows.time_s < kept[1])
        write_tracks(path, rows.take(own), lineage)
    assert covered(root, (0, 240), fps=5.0) == [(0, 75), (160, 230)]
    assert covered(root, (100, 150), fps=5.0) == []


def test_a_damaged_segment_beside_a_stretch_does_not_bear_on_it(make_trial):
    """Before it and behind it; within it the damage is an error."""
    root = make_trial(seconds=230)
    for start in (0, 180):
        segment_path(root, start).write_bytes(b"PAR1")
    assert covered(root, (60, 180), fps=5.0) == [(60, 180)]
    with pytest.raises(DamagedError):
        covered(root, (60, 181), fps=5.0)


def test_tracks_cover_no_more_than_their_segments(make_trial):
    """The times of a camera are some milliseconds late: the last frame ends behind its minute."""
    root = make_trial(seconds=120)
    path = segment_path(root, 60)
    rows = read_tracks(path)
    write_tracks(path, replace(rows, time_s=rows.time_s + 0.01), read_lineage(path))
    assert covered(root, (0, 240), fps=5.0) == [(0, 120)]


def test_tracks_cover_what_was_recorded_with_nobody_in_sight(make_trial):
    """The last segment states that the recording went on to 228.5 s, or that it did not."""
    root = make_trial(seconds=220)
    last = segment_path(root, 180)
    for end_s, covered_s in ((228.5, 229), (210.0000001, 210)):
        write_tracks(last, read_tracks(last), read_lineage(last), extra={END_KEY: end_s})
        assert covered(root, (0, 240), fps=5.0) == [(0, covered_s)]
