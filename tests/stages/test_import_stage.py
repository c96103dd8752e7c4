"""From a file of another program to the segments of a trial."""

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.tables import read_tracks
from zfcal.errors import InputError
from zfcal.stages.events import Made, Note, UpToDate, say_nothing
from zfcal.stages.import_ import Source, import_tracks
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.trial_context import Task
from zfcal.tracks import KINDS, ROBOT


def write_csv(path, tracks, *, scale=1.0, shift=0.0):
    """Write tracks as CSV, with positions scaled and shifted."""
    lines = ["time_s,agent,kind,x_m,y_m"]
    for row in range(len(tracks)):
        x, y = scale * tracks.x_m[row] + shift, scale * tracks.y_m[row] + shift
        kind = KINDS[tracks.kind[row]]
        lines.append(f"{tracks.time_s[row]:.4f},{tracks.agent[row]},{kind},{x:.5f},{y:.5f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def csv_source(path, **options):
    """Return a CSV file as what to import."""
    return Source(path=path, format="csv", options=options)


@pytest.fixture
def trial(tmp_path):
    """Return an empty trial: 3 fish and a robot in a square metre, 5 Hz."""
    root = tmp_path / "trial"
    new = NewTrial(n_fish=3, n_robots=1, fps=5.0, side_m=1.0)
    create_trial(root, new, say_nothing)
    return root


@pytest.fixture
def csv(tmp_path, wandering):
    """Return 130 s of 3 fish and a robot as a CSV file."""
    return write_csv(tmp_path / "tracks.csv", wandering(130, n_robots=1))


def test_an_import_makes_closed_segments(trial, csv, heard, wandering):
    """130 s are two minutes and a part, with the file's positions and kinds."""
    import_tracks(trial, csv_source(csv), heard.append)
    names = [event.path.name for event in heard if isinstance(event, Made)]
    assert names == ["000000.parquet", "000060.parquet", "000120.parquet"]
    found, wanted = read_tracks(trial / "tracks" / "000060.parquet"), wandering(130, n_robots=1)
    rows = (wanted.time_s >= 60) & (wanted.time_s < 120)
    assert np.allclose(found.x_m, wanted.x_m[rows], atol=1e-5)
    assert np.array_equal(found.kind, wanted.kind[rows])


def test_what_a_file_is_not_sure_of_is_a_warning_also_of_the_robots_file(tmp_path, heard):
    """Poses of sleap-io that count frames as seconds, for fish and once more for robots."""
    pytest.importorskip("h5py")
    golden = Path(__file__).parents[1] / "readers" / "golden" / "sleap-io.nwb.gz"
    fish, robots = tmp_path / "fish.nwb", tmp_path / "robots.nwb"
    for path in (fish, robots):
        path.write_bytes(gzip.decompress(golden.read_bytes()))
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=1, n_robots=2, fps=5.0, side_m=1.0), say_nothing)
    options = {"m_per_px": 0.001, "keypoint": "head"}
    source = Source(path=fish, format="nwb", options=options, robot_tracks=robots)

    import_tracks(root, replace(source, options={**options, "robots": ("robot_3",)}), heard.append)

    warnings = [event.text for event in heard if isinstance(event, Note) and event.warning]
    for path in (fish, robots):
        assert any(f"{path}: Times are whole seconds" in text for text in warnings)


def test_lineage_names_the_file_by_its_hash_and_not_its_place(trial, csv, heard):
    """And the options that bear on the numbers."""
    import_tracks(trial, csv_source(csv), heard.append)
    lineage = read_lineage(trial / "tracks" / "000000.parquet")
    assert list(lineage.inputs) == ["tracks.csv"]
    assert (lineage.command, lineage.options) == ("import", {"format": "csv", "fps": 5.0})


def test_the_second_import_does_nothing(trial, csv, heard, read_all):
    """Nor does it read the file's rows again."""
    import_tracks(trial, csv_source(csv), heard.append)
    before = read_all(trial)
    heard.clear()
    import_tracks(trial, csv_source(csv), heard.append)
    assert {type(event) for event in heard} == {UpToDate}
    assert len(heard) == 3
    assert read_all(trial) == before


def test_an_import_that_was_killed_is_finished(trial, csv, heard, read_all):
    """Its last segments are missing, the first ones up to date."""
    import_tracks(trial, csv_source(csv), heard.append)
    whole = read_all(trial)
    (trial / "tracks" / "000120.parquet").unlink()
    import_tracks(trial, csv_source(csv), heard.append)
    assert read_all(trial) == whole


def test_a_changed_file_is_imported_anew(trial, csv, heard, wandering):
    """The reason names it."""
    import_tracks(trial, csv_source(csv), heard.append)
    heard.clear()
    write_csv(csv, wandering(130, n_robots=1, seed=2))
    import_tracks(trial, csv_source(csv), heard.append)
    reasons = {event.reason for event in heard if isinstance(event, Made)}
    assert reasons == {"input tracks.csv changed"}


def test_a_rate_that_is_not_the_trial_s_is_refused(trial, csv, heard):
    """Both are named."""
    with pytest.raises(InputError, match=r"fps is 5 Hz, --fps says 15"):
        import_tracks(trial, csv_source(csv, fps=15.0), heard.append)
    import_tracks(trial, csv_source(csv, fps=5.0), heard.append)


def test_tracks_that_all_lie_outside_are_refused_with_both_ranges(
    trial, tmp_path, heard, wandering
):
    """Somebody forgot the origin; nothing is written."""
    far = write_csv(tmp_path / "far.csv", wandering(70), shift=3.0)
    with pytest.raises(InputError, match=r"span x 3\.\d+ to 3\.\d+ m") as error:
        import_tracks(trial, csv_source(far), heard.append)
    assert "--origin" in error.value.hint
    assert not (trial / "tracks").exists()


def test_tracks_that_lie_outside_in_part_are_counted(trial, tmp_path, heard, wandering):
    """Shifted by half a metre about half the walk leaves the tank: a warning with the share."""
    off = write_csv(tmp_path / "off.csv", wandering(70, n_robots=1), shift=0.5)
    import_tracks(trial, csv_source(off), heard.append)
    warnings = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert len(warnings) == 1
    assert "positions lie outside the arena" in warnings[0]
    assert "--flip-y" in warnings[0]


def test_positions_just_outside_are_counted_as_at_the_wall(trial, tmp_path, heard):
    """One of two rows lies 5 mm outside the square metre: that is said, and no warning."""
    path = tmp_path / "near.csv"
    path.write_text("time_s,agent,x_m,y_m\n0.0,0,0.5,0.5\n0.2,0,1.005,0.5\n")
    import_tracks(trial, csv_source(path), heard.append)
    (note,) = [e for e in heard if isinstance(e, Note) and "positions lie" in e.text]
    assert note.text.startswith("1 of 2 positions lie up to 10 mm outside")
    assert not note.warning


def test_robots_can_come_from_a_file_of_their_own(trial, tmp_path, heard, wandering):
    """All of its agents are robots, under ids that no fish has."""
    fish = write_csv(tmp_path / "fish.csv", wandering(70))
    robot = write_csv(tmp_path / "robot.csv", wandering(70, n_fish=1, seed=5))
    source = Source(path=fish, format="csv", options={}, robot_tracks=robot)
    import_tracks(trial, source, heard.append)
    found = read_tracks(trial / "tracks" / "000000.parquet")
    assert set(found.agent[found.kind == ROBOT]) == {3}
    assert list(read_lineage(trial / "tracks" / "000000.parquet").inputs) == [
        "fish.csv",
        "robot.csv",
    ]


def with_confidence(path, value):
    """Give every row of a CSV file the same confidence."""
    first, *rows = path.read_text().splitlines()
    path.write_text("\n".join([f"{first},confidence", *(f"{row},{value}" for row in rows)]) + "\n")
    return path


def test_a_least_confidence_must_take_effect_in_one_of_two_files(trial, tmp_path, heard, wandering):
    """Robots that stand for certain beside fish that are tracked, but not both without any."""
    fish = write_csv(tmp_path / "fish.csv", wandering(70))
    robot = write_csv(tmp_path / "robot.csv", wandering(70, n_fish=1, seed=5))
    options = {"min_confidence": 0.5}
    source = Source(path=fish, format="csv", options=options, robot_tracks=robot)

    with pytest.raises(InputError, match=r"fish\.csv: min_confidence = 0\.5 cannot take effect"):
        import_tracks(trial, source, heard.append)
    assert not (trial / "tracks").exists()

    with_confidence(robot, 0.9)
    import_tracks(trial, source, heard.append)
    assert len(read_tracks(trial / "tracks" / "000000.parquet")) == 4 * 300


def test_a_column_of_confidences_that_says_nothing_is_told_when_it_is_read(trial, csv):
    """Its header looks as if the option could take effect."""
    with_confidence(csv, "")
    with pytest.raises(InputError, match=r"min_confidence = 0\.5 cannot take effect"):
        import_tracks(trial, csv_source(csv, min_confidence=0.5), say_nothing)
    assert not (trial / "tracks").exists()


@pytest.fixture
def no_hashing(monkeypatch):
    """Let nobody read a whole source to hash it."""

    def hashed(_root, path):
        pytest.fail(f"{path} was hashed before its mistake was told")

    monkeypatch.setattr("zfcal.stages.import_.hash_sources", hashed)


@pytest.mark.parametrize(
    ("header", "options", "problem"),
    [
        ("time_s,agent,x,y_m", {}, "expected columns"),
        ("time_s,agent,x_px,y_px", {}, "positions are in pixels"),
        ("time_s,agent,x_m,y_m", {"m_per_px": 0.001}, "cannot take effect"),
        ("time_s,agent,x_m,y_m", {"min_confidence": 0.5}, "cannot take effect"),
        ("time_s,agent,x_m,y_m", {"first_frame": 1}, "cannot take effect"),
        ("time_s,agent,x_m,y_m", {"box": "centre"}, "cannot take effect"),
        ("time_s,agent,x_m,y_m", {"columns": (("frame", "number"),)}, "expected a column 'number'"),
    ],
)
@pytest.mark.usefixtures("no_hashing")
def test_what_a_header_shows_is_told_before_the_file_is_hashed(
    trial, tmp_path, header, options, problem
):
    """A recording of gigabytes takes minutes."""
    path = tmp_path / "tracks.csv"
    path.write_text(f"{header}\n0.0,0,0.5,0.5\n")
    with pytest.raises(InputError, match=problem):
        import_tracks(trial, csv_source(path, **options), say_nothing)


@pytest.mark.parametrize("name", ["csv", "trex", "cats"])
@pytest.mark.usefixtures("no_hashing")
def test_a_folder_that_no_reader_takes_is_told_before_it_is_hashed(trial, tmp_path, name):
    """Somebody names the folder of all recordings."""
    (tmp_path / "all").mkdir()
    (tmp_path / "all" / "film.mp4").write_bytes(b"x")
    source = Source(path=tmp_path / "all", format=name, options={})
    with pytest.raises(InputError, match=r"all: expected (a file|the files of one video)"):
        import_tracks(trial, source, say_nothing)


def test_tracks_of_another_source_are_told_before_the_new_one_is_hashed(
    trial, csv, tmp_path, request
):
    """Names are enough to know."""
    import_tracks(trial, csv_source(csv), say_nothing)
    other = csv.rename(tmp_path / "other.csv")
    request.getfixturevalue("no_hashing")
    with pytest.raises(InputError, match=r"comes from import of tracks\.csv, .* other\.csv"):
        import_tracks(trial, csv_source(other), say_nothing)


def test_a_robot_in_a_trial_without_one_is_refused(tmp_path, csv, heard):
    """trial.toml says who is in the tank."""
    root = tmp_path / "alone"
    create_trial(root, NewTrial(n_fish=3, fps=5.0, side_m=1.0), heard.append)
    with pytest.raises(InputError, match="robot"):
        import_tracks(root, csv_source(csv), heard.append)


def test_without_a_format_the_file_s_looks_decide(trial, csv, tmp_path, heard):
    """What was taken is said; what looks like nothing is refused."""
    import_tracks(trial, Source(path=csv, format=None, options={}), heard.append)
    assert any("--format csv" in getattr(event, "text", "") for event in heard)
    (tmp_path / "poem.txt").write_text("Tyger Tyger\n")
    poem = Source(path=tmp_path / "poem.txt", format=None, options={})
    with pytest.raises(InputError, match="no known format"):
        import_tracks(trial, poem, heard.append, task=Task(force=True))


def test_into_no_trial_is_refused_with_the_command_that_makes_one(tmp_path, csv, heard):
    """An import does not guess the arena."""
    with pytest.raises(InputError, match="not a trial") as error:
        import_tracks(tmp_path / "nowhere", csv_source(csv), heard.append)
    assert "zfcal init" in error.value.hint


def test_a_dry_run_says_why_and_writes_nothing(trial, csv, heard):
    """Three segments are missing."""
    import_tracks(trial, csv_source(csv), heard.append, task=Task(dry_run=True))
    planned = [event.reason for event in heard if hasattr(event, "reason")]
    assert planned == ["missing"] * 3
    assert not (trial / "tracks").exists()


def test_fewer_agents_than_the_trial_states_are_told(trial, tmp_path, heard, wandering):
    """Three fish and no robot into a trial of three fish and a robot: only the robot is missed."""
    source = write_csv(tmp_path / "fish.csv", wandering(70))
    import_tracks(trial, csv_source(source), heard.append)
    (warning,) = [event.text for event in heard if isinstance(event, Note) and event.warning]
    assert "no frame holds more than 0 robots" in warning
    assert "states 1" in warning
