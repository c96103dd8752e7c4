"""Reading a trial for its report: all of it, or all that can be read."""

import sys

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.report.gather import gather, input_files
from zfcal.report.views import MODEL, ROBOT

pytestmark = pytest.mark.usefixtures("quick_model")


def unexpected(damage):
    """Fail: nothing was damaged."""
    raise AssertionError(damage)


def test_a_trial_is_read_whole(small_trial):
    """Four minutes: three windows, three rounds, all agents of all segments."""
    view = gather(small_trial(), unexpected)

    assert view.course(MODEL, "S").end_s.tolist() == [120, 180, 240]
    assert view.course(ROBOT, "S").mark(0).n == 4
    assert [r.second for r in view.rounds] == [120, 180, 240]
    assert view.calibrated.unidentified == {"walls.alpha"}
    assert view.calibrated.intervals["walls.alpha"] == (0.1, 0.9)
    assert [r.hypervolume for r in view.rounds] == [(0.2, 0.4)] * 3
    assert set(view.statistics) == {(240, "control"), (240, "robot")}
    assert view.seen.n_points == 1200 * 5
    assert view.tracked_s == pytest.approx(240)
    assert view.integration.start_s == 120
    assert view.model_statistics is not None


def test_every_artifact_is_a_source_with_its_hash(small_trial):
    """4 segments, 3 of statistics, 6 of scores, 3 models."""
    sources = gather(small_trial(), unexpected).sources

    assert len(sources) == 4 + 3 + 6 + 3
    assert {len(source.sha256) for source in sources} == {64}
    assert sources[0].path == "tracks/000000.parquet"


def test_inputs_are_settings_and_artifacts(small_trial):
    """What bears on the report is what makes it stale."""
    root = small_trial()

    names = [path.relative_to(root).as_posix() for path in input_files(root)]

    assert names[0] == "trial.toml"
    assert len(names) == 1 + 16


def test_a_trial_that_was_only_begun_is_read_too(small_trial):
    """Tracks alone: no scores, no model, nothing simulated."""
    view = gather(small_trial(analysed=False, calibrated=False), unexpected)

    assert view.courses == {}
    assert view.rounds == []
    assert view.model_statistics is None
    assert view.statistics == {}


@pytest.mark.parametrize(
    "name",
    [
        "tracks/000060.parquet",
        "stats/000240.parquet",
        "scores/000180.parquet",
        "scores/000180-model.parquet",
        "models/000180.toml",
    ],
)
def test_a_file_cut_in_half_is_named_and_left_out(small_trial, name):
    """The others are shown; the message is the same wherever the trial lies."""
    root = small_trial()
    path = root / name
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    heard = []

    view = gather(root, heard.append)

    assert heard
    assert all(str(path) in str(damage) for damage in heard)
    assert len(view.left_out) == len(heard)
    assert all(name in line and str(root) not in line for line in view.left_out)
    assert name not in [source.path for source in view.sources]
    assert view.course(MODEL, "S").last is not None or "model" in name


def test_without_the_last_rounds_window_the_last_one_is_shown(small_trial):
    """The model of 180 s is the newest: its window first, and any other if that is gone."""
    root = small_trial()
    (root / "models" / "000240.toml").unlink()
    assert set(gather(root, unexpected).statistics) == {(180, "control"), (180, "robot")}

    (root / "stats" / "000180.parquet").unlink()

    assert set(gather(root, unexpected).statistics) == {(240, "control"), (240, "robot")}


def test_foreign_files_and_dot_files_are_passed_over(small_trial):
    """Notes of people and writes under way are no artifacts."""
    root = small_trial()
    (root / "models" / "extended.toml").write_text("not a round\n", encoding="utf-8")
    (root / "tracks" / ".000240.parquet.part-1").write_bytes(b"half")
    (root / "stats" / "notes.parquet").write_bytes(b"")

    assert len(gather(root, unexpected).sources) == 16


def test_no_trial_is_an_error_that_says_how_to_make_one(tmp_path):
    """A folder without trial.toml."""
    with pytest.raises(InputError, match="is not a trial"):
        gather(tmp_path, unexpected)


def test_a_gap_in_the_tracks_is_a_gap(small_trial):
    """A missing segment is missing: the samples around it keep their time."""
    root = small_trial()
    (root / "tracks" / "000060.parquet").unlink()

    seen = gather(root, unexpected).seen

    assert (seen.first_k, seen.last_k) == (0, 1199)
    assert seen.n_points == 900 * 5
    assert np.unique(seen.last.k).tolist() == [*range(600, 1200)]


def test_of_several_trials_no_model_is_simulated(small_trial, monkeypatch):
    """A report over several shows nothing of what the models do."""
    root = small_trial()
    monkeypatch.setitem(sys.modules, "zfcal.report.simulated", None)

    assert gather(root, unexpected, alone=False).model_statistics is None


def test_a_segment_of_another_minute_is_left_out_as_by_every_stage(small_trial):
    """A file that somebody gave another name; one between two minutes is no segment."""
    root = small_trial()
    whole = (root / "tracks" / "000000.parquet").read_bytes()
    for name in ("000060.parquet", "000090.parquet"):
        (root / "tracks" / name).write_bytes(whole)
    heard = []

    view = gather(root, heard.append)

    assert view.seen.n_points == 900 * 5
    (line,) = view.left_out
    assert "tracks/000060.parquet: holds the times" in line
    assert "expected 60 s to 120 s" in line
