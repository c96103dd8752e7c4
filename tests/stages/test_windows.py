"""Which windows a trial has."""

from zfcal.artifacts.settings import read_trial
from zfcal.stages.windows import starts_of, whole_segments, window_ends


def ends_of(root, heard):
    """Return where the windows of a trial end."""
    return window_ends(read_trial(root), heard.append)


def test_a_window_of_120_s_needs_two_segments():
    """The window to 180 s is made of the minutes that start at 60 and 120 s."""
    assert list(starts_of(180)) == [60, 120]


def test_a_window_ends_every_minute_from_the_second_on(make_trial, heard):
    """Five whole minutes end windows at 120, 180, 240 and 300 s."""
    assert ends_of(make_trial(seconds=300), heard) == [120, 180, 240, 300]
    assert heard == []


def test_no_window_ends_in_a_last_part_segment(make_trial, heard):
    """Of 3 minutes and 20 seconds the 20 seconds end nothing."""
    root = make_trial(seconds=200)
    assert whole_segments(read_trial(root)) == [0, 60, 120]
    assert ends_of(root, heard) == [120, 180]


def test_a_segment_that_lacks_its_last_frame_is_whole(make_trial, heard, wandering):
    """At 5 Hz a row at 179.6 s is within two frames of 180 s, one at 179.4 s is not."""
    assert ends_of(make_trial("a", seconds=179.8), heard) == [120, 180]
    assert ends_of(make_trial("b", seconds=179.4), heard) == [120]


def test_one_minute_has_no_window(make_trial, heard):
    """A window takes two minutes."""
    assert ends_of(make_trial(seconds=60), heard) == []


def test_windows_over_a_missing_segment_are_left_out_and_told(make_trial, heard):
    """Without the third of six minutes the windows to 180 and 240 s are missing."""
    root = make_trial(seconds=360)
    (root / "tracks" / "000120.parquet").unlink()
    assert ends_of(root, heard) == [120, 300, 360]
    assert "000120.parquet missing" in heard[0].text


def test_dot_files_and_odd_names_are_no_segments(make_trial, heard):
    """What a copy under way or a person left in tracks/ ends no window."""
    root = make_trial(seconds=120)
    (root / "tracks" / ".000120.parquet.part-1").write_bytes(b"")
    (root / "tracks" / "000121.parquet").write_bytes(b"")
    (root / "tracks" / "120.parquet").write_bytes(b"")
    assert ends_of(root, heard) == [120]
