"""Cutting a recording into closed segments."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.settings import read_trial
from zfcal.artifacts.tables import read_extra, read_tracks, write_tracks
from zfcal.errors import InputError
from zfcal.stages.events import Made, UpToDate
from zfcal.stages.making import run
from zfcal.stages.recording import (
    Recording,
    check_same_source,
    cut,
    has_ended,
    hash_sources,
    segmented,
    starts_between,
    starts_of_recording,
    stretch_of,
)
from zfcal.stages.stage import OneThing
from zfcal.stages.trial_context import Task
from zfcal.tracks import Tracks, concatenate

LINEAGE = Lineage(schema="zfcal.tracks/1", command="import", inputs={"a.csv": "0" * 64})


def tracks_at(times_s):
    """Return tracks of one fish, a row at each time."""
    n = len(times_s)
    return Tracks(
        time_s=np.array(times_s, dtype=float),
        frame=np.arange(n),
        agent=np.zeros(n, dtype=np.int32),
        kind=np.zeros(n, dtype=np.int8),
        x_m=np.full(n, 0.5),
        y_m=np.full(n, 0.5),
        heading_rad=np.full(n, np.nan, dtype=np.float32),
        confidence=np.ones(n, dtype=np.float32),
    )


@pytest.fixture
def trial(make_trial):
    """Return a trial without tracks."""
    root = make_trial(seconds=1)
    (root / "tracks" / "000000.parquet").unlink()
    return read_trial(root)


def write_segments(trial, recorded, tell, *, task=None):
    """Write the segments of a recording that are missing or stale."""
    tracks, end_s, lineage = recorded

    def item(run):
        return segmented(run, lineage, [], lambda: Recording(tracks=tracks, end_s=end_s))

    run(OneThing(name="import", item=item), trial.root, tell, task=task)


def recording_of(tracks, end_s, lineage=LINEAGE):
    """Return tracks, to when they go, and where they come from."""
    return tracks, end_s, lineage


def test_rows_fall_into_the_minute_in_which_they_are():
    """59.9 s into the first, 60 s and 119.9 s into the second, 120 s into the third."""
    parts = dict(cut(tracks_at([0.0, 59.9, 60.0, 119.9, 120.0]), 120.2))
    assert {start: list(part.time_s) for start, part in parts.items()} == {
        0: [0.0, 59.9],
        60: [60.0, 119.9],
        120: [120.0],
    }


def test_a_time_that_is_the_edge_but_for_rounding_is_the_edge():
    """1e-9 s before the minute is the minute: sample k * dt_s looks for it there."""
    parts = dict(cut(tracks_at([0.0, 60.0 - 1e-9]), 60.2))
    assert [len(part) for part in parts.values()] == [1, 1]


def test_a_minute_in_which_nobody_was_seen_has_an_empty_segment():
    """Rows at 10 s and 130 s: the minute between holds none, and is there."""
    parts = dict(cut(tracks_at([10.0, 130.0]), 130.2))
    assert {start: len(part) for start, part in parts.items()} == {0: 1, 60: 0, 120: 1}


def test_the_parts_together_are_the_whole(wandering):
    """No row is lost or doubled, in their order."""
    whole = wandering(200)
    parts = [part for _, part in cut(whole, 200.0)]
    for field in dataclasses.fields(Tracks):
        together = getattr(concatenate(parts), field.name)
        assert np.array_equal(together, getattr(whole, field.name), equal_nan=True)


def test_starts_by_hand():
    """A stretch that begins within a minute and one that ends on an edge."""
    assert starts_between(61.0, 180.0) == [60, 120]
    assert starts_between(0.0, 60.2) == [0, 60]
    assert starts_between(0.0, 0.2) == [0]


def test_segments_say_how_far_the_recording_goes(trial, heard, wandering):
    """So that an import that was killed half-way is known to be unfinished."""
    write_segments(trial, recording_of(wandering(150), 150.0), heard.append, task=Task())
    for name in ("000000", "000060"):
        (trial.root / "tracks" / f"{name}.parquet").unlink()
    assert starts_of_recording(trial.root) == [0, 60, 120]
    assert read_extra(trial.root / "tracks" / "000120.parquet")["end_s"] == 150.0


def test_only_missing_segments_are_written(trial, heard, wandering, read_all):
    """The others are found up to date, and all end in the same bytes."""
    recording = recording_of(wandering(150), 150.0)
    write_segments(trial, recording, heard.append, task=Task())
    whole = read_all(trial.root)
    (trial.root / "tracks" / "000060.parquet").unlink()
    heard.clear()
    write_segments(trial, recording, heard.append, task=Task())
    made = [event.path.name for event in heard if isinstance(event, Made)]
    fresh = [event.path.name for event in heard if isinstance(event, UpToDate)]
    assert (made, fresh) == (["000060.parquet"], ["000000.parquet", "000120.parquet"])
    assert read_all(trial.root) == whole


def test_what_a_longer_recording_left_is_removed_and_told(trial, heard, wandering):
    """Rows of another recording must not stand behind those of this one."""
    write_segments(trial, recording_of(wandering(150), 150.0), heard.append, task=Task())
    shorter = dataclasses.replace(LINEAGE, inputs={"a.csv": "1" * 64})
    write_segments(trial, recording_of(wandering(60), 60.0, shorter), heard.append, task=Task())
    assert [path.name for path in (trial.root / "tracks").glob("*")] == ["000000.parquet"]
    assert any("000120.parquet: removed" in getattr(event, "text", "") for event in heard)


def test_a_dry_run_writes_and_removes_nothing(trial, heard, wandering, read_all):
    """It says what it would do."""
    write_segments(trial, recording_of(wandering(150), 150.0), heard.append, task=Task())
    before = read_all(trial.root)
    shorter = dataclasses.replace(LINEAGE, inputs={"a.csv": "1" * 64})
    dry = Task(dry_run=True)
    write_segments(trial, recording_of(wandering(60), 60.0, shorter), heard.append, task=dry)
    assert read_all(trial.root) == before
    assert any("would remove" in getattr(event, "text", "") for event in heard)


def test_tracks_of_another_file_are_not_replaced(trial, heard, wandering):
    """One trial holds one recording; force is needed."""
    write_segments(trial, recording_of(wandering(60), 60.0), heard.append, task=Task())
    with pytest.raises(InputError, match=r"comes from import of a\.csv.*b\.csv"):
        check_same_source(trial, "import", sources=["b.csv"], task=Task())
    check_same_source(trial, "import", sources=["b.csv"], task=Task(force=True))
    check_same_source(trial, "import", sources=["a.csv"], task=Task())


def test_of_sources_of_many_files_a_few_are_named_and_the_others_counted(trial, heard, wandering):
    """Those first by which the two differ: 2000 images, and then 1999 of them and a new one."""
    images = [f"images/{number:06d}.png" for number in range(2000)]
    lineage = dataclasses.replace(LINEAGE, inputs=dict.fromkeys(images, "0" * 64))
    write_segments(trial, recording_of(wandering(60), 60.0, lineage), heard.append)
    with pytest.raises(InputError) as error:
        check_same_source(trial, "import", sources=[*images[1:], "images/new.png"], task=Task())
    path = trial.root / "tracks" / "000000.parquet"
    assert str(error.value) == (
        f"{path}: comes from import of {', '.join(images[:3])} and 1997 more, "
        f"expected none or {', '.join(['images/new.png', *images[1:3]])} and 1997 more."
    )


def test_a_source_outside_is_recorded_by_its_bare_name(tmp_path):
    """Where it lay does not bear on the result; inside the trial its place is known."""
    root = tmp_path / "trial"
    (root / "raw").mkdir(parents=True)
    (tmp_path / "a.csv").write_text("x")
    (root / "raw" / "b.csv").write_text("x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "c.npz").write_text("x")
    assert list(hash_sources(root, tmp_path / "a.csv")) == ["a.csv"]
    assert list(hash_sources(root, root / "raw" / "b.csv")) == ["raw/b.csv"]
    assert list(hash_sources(root, tmp_path / "folder")) == ["folder/c.npz"]


def test_an_empty_segment_can_be_read_back(trial, heard):
    """A table without rows is a table."""
    write_segments(trial, recording_of(tracks_at([10.0, 130.0]), 130.2), heard.append, task=Task())
    assert len(read_tracks(trial.root / "tracks" / "000060.parquet")) == 0


@pytest.mark.parametrize(
    "said",
    [["x", "y"], [0, 1e12], [-1, 60], [60, 0], [0, True], [0, 10**400], [0], 60],
)
def test_a_stretch_that_no_recording_has_is_none(tmp_path, said):
    """Neither an error nor a list of a thousand million minutes."""
    path = tmp_path / "tracks" / "000000.parquet"
    path.parent.mkdir()
    write_tracks(path, tracks_at([0.0]), LINEAGE, extra={"recording_s": said})
    assert stretch_of(path) is None
    assert starts_of_recording(tmp_path) == []
    assert not has_ended(tmp_path, [0])


@pytest.mark.parametrize("said", [[0.0, math.nan], [math.nan, 60.0], [0.0, math.inf]])
def test_a_stretch_without_an_end_is_none(monkeypatch, tmp_path, said):
    """Files of other programs may hold what zfcal never writes."""
    monkeypatch.setattr("zfcal.stages.recording.read_extra", lambda _: {"recording_s": said})
    assert stretch_of(tmp_path / "000000.parquet") is None
