"""One reader of tracks: a segment's samples are the same whoever asks for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.segments import segment_path
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.behaviour.located import join, locate
from zfcal.errors import InputError
from zfcal.stages.events import LeftOut, say_nothing
from zfcal.stages.recording import cut
from zfcal.stages.segments import Segments
from zfcal.stages.track_window import read_stretch
from zfcal.stages.trial_context import open_trial
from zfcal.tracks import concatenate

STARTS = (0, 60, 120)


def shake(root):
    """Move each frame's time by up to a third of a frame, also over the edges of minutes."""
    paths = [segment_path(root, start) for start in STARTS]
    rows = concatenate([read_tracks(path) for path in paths])
    frames, place = np.unique(rows.frame, return_inverse=True)
    late_s = np.random.default_rng(1).uniform(-0.33, 0.33, len(frames)) / 15
    time_s = np.maximum(rows.time_s + late_s[place], 0.0)
    for path, (_, part) in zip(paths, cut(replace(rows, time_s=time_s), 180.0), strict=True):
        write_tracks(path, part, read_lineage(path))


@pytest.mark.parametrize("window_s", [None, (60, 180), (60, 120)])
@pytest.mark.parametrize("is_shaken", [False, True])
def test_a_stretch_is_what_its_segments_are_one_by_one(make_trial, window_s, is_shaken):
    """Also where the camera's clock is uneven and the frame of second 60 came before it."""
    root = make_trial(seconds=180)
    if is_shaken:
        shake(root)
    opened, segments = open_trial(root), Segments()
    first, end = window_s or (0, 180)

    stretch = read_stretch(opened, window_s, say_nothing)

    found = locate(stretch.samples, opened.arena)
    wanted = join([segments.read(opened, start) for start in STARTS if first <= start < end])
    assert len(found) > 300
    for name in ("k", "agent", "kind", "xy_m", "zone"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name))


def test_a_segment_of_another_minute_is_left_out_by_whoever_reads(make_trial, heard):
    """A file that somebody gave another name: it counts nowhere, and the others do."""
    root = make_trial(seconds=180)
    segment_path(root, 60).write_bytes(segment_path(root, 0).read_bytes())
    opened, segments = open_trial(root), Segments()

    stretch = read_stretch(opened, None, heard.append)
    nobody = segments.read_or_tell(opened, 60, heard.append)

    assert nobody is None
    assert stretch.n_left_out == 1
    problems = [event.problem for event in heard if isinstance(event, LeftOut)]
    assert problems[0] == problems[1]
    assert "expected 60 s to 120 s" in problems[0]
    seen = ~np.isnan(stretch.samples.xy_m[..., 0]).all(axis=1)
    assert seen.tolist() == [True] * 300 + [False] * 300 + [True] * 300


@pytest.mark.parametrize("start", STARTS)
def test_a_folder_in_the_place_of_a_segment_is_told_once_and_none_of_the_files(
    make_trial, heard, start
):
    """What is made of the others is what would be made without it."""
    root = make_trial(seconds=180)
    path = segment_path(root, start)
    path.unlink()
    without = read_stretch(open_trial(root), None, say_nothing)
    path.mkdir()

    stretch = read_stretch(open_trial(root), None, heard.append)

    (told,) = [event for event in heard if isinstance(event, LeftOut)]
    assert told.problem.startswith(f"{path}: cannot be read (")
    assert stretch.files == tuple(segment_path(root, each) for each in STARTS if each != start)
    assert (stretch.n_left_out, stretch.n_segments) == (1, 3)
    assert np.array_equal(stretch.samples.k, without.samples.k)
    assert np.array_equal(stretch.samples.xy_m, without.samples.xy_m, equal_nan=True)


def test_tracks_of_which_nothing_can_be_read_are_one_error(make_trial, heard):
    """A folder and a damaged file: each is told, and both are counted."""
    root = make_trial(seconds=120)
    segment_path(root, 0).unlink()
    segment_path(root, 0).mkdir()
    segment_path(root, 60).write_bytes(b"PAR1 and no more")

    with pytest.raises(InputError, match="none of 2 segments of tracks can be read"):
        read_stretch(open_trial(root), None, heard.append)

    assert len([event for event in heard if isinstance(event, LeftOut)]) == 2
