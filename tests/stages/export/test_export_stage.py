"""A trial in the forms of other programs: made once, made again, and what is said."""

import io
import json

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from mcap.writer import Writer

from zfcal.artifacts import drive_files
from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.inspecting import describe
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.pose_messages import register
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.errors import InputError, StorageError
from zfcal.readers import ImportOptions, import_foreign
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.events import LeftOut, Made, Note, Planned, UpToDate, say_nothing
from zfcal.stages.export.export import export
from zfcal.stages.export.options import ExportOptions
from zfcal.stages.import_ import Source, import_tracks
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.trial_context import Task

EVERY = ("csv", "parquet", "trex", "idtracker", "movement", "deeplabcut", "sleap")


@pytest.fixture
def trial(make_trial):
    """Return 130 s of 3 fish and a robot."""
    return make_trial(seconds=130, n_robots=1)


def asked(*formats, **options):
    """Return options with these formats."""
    return ExportOptions(formats=formats, **options)


def names_of(events, kind):
    """Return the names of the files that events of a kind tell of."""
    return [event.path.name for event in events if isinstance(event, kind)]


def told(events):
    """Return what notes say, in one text."""
    return "\n".join(event.text for event in events if isinstance(event, Note))


def sidecar(root, name):
    """Return what stands beside an export."""
    return json.loads((root / "export" / name / f"export-{name}.json").read_text())


@pytest.mark.parametrize("name", EVERY)
def test_an_export_is_made_once(name, trial, heard):
    """The second run finds all of it up to date, and says again what is lost."""
    export(trial, asked(name), heard.append)
    made, said = names_of(heard, Made), told(heard)
    assert made[-1] == f"export-{name}.json"
    heard.clear()
    export(trial, asked(name), heard.append)
    assert names_of(heard, Made) == []
    assert names_of(heard, UpToDate) == made
    assert told(heard) == said


def test_the_options_that_are_told_read_the_tracks_back(trial, tmp_path):
    """Into another trial, by the words of the sidecar: the same positions, kinds and times."""
    export(trial, asked("sleap"), say_nothing)
    back = sidecar(trial, "sleap")["read_back"]
    assert back == [*("--format", "sleap", "--mm-per-px", "1", "--origin", "0,1000", "--flip-y")]
    other = tmp_path / "other"
    create_trial(other, NewTrial(n_fish=3, n_robots=1, fps=5.0, side_m=1.0), say_nothing)
    options = {"m_per_px": 0.001, "origin": (0.0, 1000.0), "flip_y": True}
    path = trial / "export" / "sleap" / "tracks.analysis.h5"
    import_tracks(other, Source(path=path, format="sleap", options=options), say_nothing)
    for segment in ("000000", "000060", "000120"):
        one, two = (read_tracks(root / "tracks" / f"{segment}.parquet") for root in (trial, other))
        np.testing.assert_array_equal(one.agent, two.agent)
        np.testing.assert_array_equal(one.kind, two.kind)
        np.testing.assert_allclose(one.time_s, two.time_s)
        np.testing.assert_allclose(one.x_m, two.x_m, rtol=0, atol=1e-10)
        np.testing.assert_allclose(one.y_m, two.y_m, rtol=0, atol=1e-10)


def test_imported_pixels_go_back_to_the_pixels_of_their_image(tmp_path):
    """A file of DeepLabCut, at 2 mm a pixel and turned up, has the same numbers again."""
    csv = tmp_path / "in.csv"
    lines = ["scorer,net,net,net", "bodyparts,b,b,b", "coords,x,y,likelihood"]
    csv.write_text(
        "\n".join([*lines, *(f"{k},{100 + k},{300.25 - k},1" for k in range(10))]) + "\n"
    )
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=1, n_robots=0, fps=5.0, side_m=1.0), say_nothing)
    options = {"m_per_px": 0.002, "origin": (10.0, 490.0), "flip_y": True, "noise_m": 0.0015}
    import_tracks(root, Source(path=csv, format="deeplabcut", options=options), say_nothing)
    export(root, asked("deeplabcut"), say_nothing)
    path = root / "export" / "deeplabcut" / "tracksDLC_zfcal.csv"
    found = pd.read_csv(path, header=[0, 1, 2, 3], index_col=0)
    np.testing.assert_allclose(found.iloc[:, 0], 100 + np.arange(10), rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.iloc[:, 1], 300.25 - np.arange(10), rtol=0, atol=1e-9)
    back = " ".join(sidecar(root, "deeplabcut")["read_back"])
    assert back.endswith("--mm-per-px 2 --origin 10,490 --flip-y --noise-mm 1.5")
    assert "the position noise is lost, 1.5 mm" in " ".join(sidecar(root, "deeplabcut")["lost"])


def test_a_scale_and_an_origin_that_are_asked_for_are_taken(trial):
    """0.5 mm a pixel, (0, 0) m at (10, 2100) px."""
    options = asked("idtracker", m_per_px=0.0005, origin_px=(10.0, 2100.0))
    export(trial, options, say_nothing)
    first = read_tracks(trial / "tracks" / "000000.parquet")
    path = trial / "export" / "idtracker" / "trajectories.npy"
    found = np.load(path, allow_pickle=True).item()
    x_px, y_px = found["trajectories"][0, 0]
    assert x_px == pytest.approx(10 + first.x_m[0] / 0.0005)
    assert y_px == pytest.approx(2100 - first.y_m[0] / 0.0005)
    assert found["length_unit"] == 20
    assert found["identities_groups"] == {"fish": [1, 2, 3], "robot": [4]}


def test_tables_have_all_that_the_trial_has(trial, heard):
    """Tracks and the starting model first; statistics and scores once there are some."""
    export(trial, asked("csv"), heard.append)
    assert names_of(heard, Made) == ["tracks.csv", "parameters.csv", "export-csv.json"]
    analyse(trial, AnalyseOptions(), say_nothing)
    heard.clear()
    export(trial, asked("csv", "parquet"), heard.append)
    made = names_of(heard, Made)
    assert {"stats.csv", "scores.csv", "stats.parquet", "scores.parquet"} <= set(made)
    folder = trial / "export"
    for name in ("tracks", "stats", "scores", "parameters"):
        one = pd.read_csv(folder / "csv" / f"{name}.csv")
        two = pd.read_parquet(folder / "parquet" / f"{name}.parquet")
        assert list(one.columns) == list(two.columns)
        assert len(one) == len(two)
    assert read_lineage(folder / "parquet" / "stats.parquet").inputs.keys() >= {
        "stats/000120.parquet"
    }


def test_columns_of_parquet_have_their_types_whatever_they_hold(trial):
    """Nothing calibrated it: no intervals, no rule. Whole numbers are as wide as in the trial."""
    analyse(trial, AnalyseOptions(), say_nothing)
    export(trial, asked("parquet"), say_nothing)
    folder = trial / "export" / "parquet"
    types = {
        name: dict(zip(found.names, map(str, found.types), strict=True))
        for name in ("parameters", "stats", "scores")
        for found in [pq.read_schema(folder / f"{name}.parquet")]
    }
    assert "null" not in {each for table in types.values() for each in table.values()}
    assert types["parameters"]["low"] == types["parameters"]["high"] == "double"
    assert types["parameters"]["rule"] == types["parameters"]["parameter"]
    assert types["parameters"]["intervals_by"] == types["parameters"]["parameter"]
    assert types["stats"]["bin"] == "int32"


def test_a_table_for_others_is_no_damaged_one(trial):
    """`zfcal inspect` says what it is, and finds nothing wrong with it."""
    export(trial, asked("parquet"), say_nothing)
    found = describe(trial / "export" / "parquet" / "parameters.parquet")
    assert (found["schema"], found["problem"]) == ("zfcal.export/1", None)
    assert found["lineage"]["command"] == "export"


def test_a_layout_shows_what_lies_in_the_trial(trial, heard):
    """Poses, and the images of one camera; a drive is added when there is one."""
    for folder in ("poses", "frames/overhead"):
        (trial / folder).mkdir(parents=True)
        (trial / folder / "000000.mcap").touch()
    export(trial, asked(layout=True), heard.append)
    path = trial / "export" / "layout" / "foxglove-layout.json"
    panels = json.loads(path.read_text())["configById"]
    assert sorted(panels) == ["3D!tank", "Image!overhead", "RawMessages!agents"]
    assert panels["Image!overhead"]["imageMode"]["imageTopic"] == "/overhead/image"
    assert panels["RawMessages!agents"]["topicPath"] in pose_topics()
    assert set(panels["3D!tank"]["topics"]) <= set(pose_topics())
    (trial / "drive").mkdir()
    (trial / "drive" / "000000.mcap").touch()
    heard.clear()
    export(trial, asked(layout=True), heard.append)
    assert names_of(heard, Made) == ["foxglove-layout.json", "export-layout.json"]
    panels = json.loads(path.read_text())["configById"]
    topics = {path["value"].partition(".")[0] for path in panels["Plot!wheels"]["paths"]}
    assert topics <= set(drive_topics())


def pose_topics():
    """Return the topics that files of poses have."""
    return register(Writer(io.BytesIO()))


def drive_topics():
    """Return the topics of the messages in files of a drive."""
    return drive_files._TOPICS.values()


def test_the_csv_of_tracks_is_read_back_to_the_bit(trial):
    """Every column, and no note on what was passed over."""
    export(trial, asked("csv"), say_nothing)
    path = trial / "export" / "csv" / "tracks.csv"
    found = import_foreign(path, "csv", ImportOptions(fps=5.0))
    first = read_tracks(trial / "tracks" / "000000.parquet")
    for name in ("time_s", "frame", "agent", "kind", "x_m", "y_m", "heading_rad", "confidence"):
        column = getattr(found.tracks, name)[: len(first)]
        np.testing.assert_array_equal(column, getattr(first, name))
    assert found.notes == ()


def test_a_changed_input_an_edited_and_a_missing_file_are_made_again(trial, heard):
    """And the reason says which."""
    path = trial / "export" / "trex" / "tracks_fish1.npz"
    export(trial, asked("trex"), say_nothing)
    whole = path.read_bytes()

    def reason():
        heard.clear()
        export(trial, asked("trex"), heard.append)
        return {event.reason for event in heard if isinstance(event, Made)}

    path.write_bytes(b"mine")
    assert reason() == {"tracks_fish1.npz was changed"}
    path.unlink()
    assert reason() == {"missing"}
    assert path.read_bytes() == whole
    segment = trial / "tracks" / "000060.parquet"
    tracks = read_tracks(segment)
    write_tracks(segment, tracks.take(tracks.agent != 1), read_lineage(segment))
    assert reason() == {"input tracks/000060.parquet changed"}


def test_an_agent_that_is_gone_takes_its_file_along(trial, heard):
    """A file that was exported, and is no more, is removed and told; others' files stay."""
    export(trial, asked("trex"), say_nothing)
    folder = trial / "export" / "trex"
    (folder / "notes.txt").write_text("mine")
    for segment in (trial / "tracks").glob("*.parquet"):
        tracks = read_tracks(segment)
        write_tracks(segment, tracks.take(tracks.agent != 1), read_lineage(segment))
    export(trial, asked("trex"), heard.append)
    assert "tracks_fish1.npz: removed" in told(heard)
    assert not (folder / "tracks_fish1.npz").exists()
    assert (folder / "notes.txt").exists()


def test_a_dry_run_writes_nothing(trial, heard, read_all):
    """And says what would be made."""
    before = read_all(trial)
    export(trial, asked("sleap"), heard.append, task=Task(dry_run=True))
    assert names_of(heard, Planned) == ["export-sleap.json"]
    assert read_all(trial) == before
    assert not (trial / "export").exists()


@pytest.mark.parametrize("name", ["csv", "parquet"])
def test_a_dry_run_names_the_tables_that_are_made(name, trial, heard):
    """Before and after a first export: what a trial has tells which there are."""
    export(trial, asked(name), heard.append, task=Task(dry_run=True))
    planned = names_of(heard, Planned)
    heard.clear()
    export(trial, asked(name), heard.append)
    assert planned == names_of(heard, Made)
    assert len(planned) > 1
    heard.clear()
    export(trial, asked(name), heard.append, task=Task(dry_run=True, force=True))
    assert names_of(heard, Planned) == planned


@pytest.mark.parametrize("name", ["csv", "parquet", "sleap"])
def test_a_damaged_segment_is_left_out_and_told_each_time(name, trial, heard):
    """The other minutes are exported."""
    (trial / "tracks" / "000060.parquet").write_bytes(b"PAR1 and no more")
    for _ in range(2):
        heard.clear()
        export(trial, asked(name), heard.append)
        (left_out,) = [event for event in heard if isinstance(event, LeftOut)]
        assert "tracks/000060.parquet" in left_out.problem
        assert left_out.damaged
    assert len(sidecar(trial, name)["left_out"]) == 1


def test_a_folder_in_the_place_of_a_file_is_an_error(trial):
    """It stays, and so does what was exported before."""
    path = trial / "export" / "sleap" / "tracks.analysis.h5"
    path.mkdir(parents=True)
    with pytest.raises(StorageError, match=r"tracks\.analysis\.h5: cannot be written"):
        export(trial, asked("sleap"), say_nothing)
    assert path.is_dir()


def test_an_export_goes_where_it_is_asked_to(trial, tmp_path, heard):
    """Several formats share a folder: no two have files of one name."""
    folder = tmp_path / "far" / "away"
    export(trial, asked(*EVERY, folder=folder), heard.append)
    made = names_of(heard, Made)
    assert len(made) == len(set(made)) == len(list(folder.iterdir()))
    assert not (trial / "export").exists()
    heard.clear()
    export(trial, asked(*EVERY, folder=folder), heard.append)
    assert names_of(heard, Made) == []


def test_the_check_of_a_trial_knows_exports(trial):
    """They are no unknown files; one that is stale is told with the command that makes it."""
    export(trial, asked("csv", "sleap"), say_nothing)
    assert [f for f in check_trial(trial) if f.where.startswith("export/")] == []
    segment = trial / "tracks" / "000060.parquet"
    write_tracks(segment, read_tracks(segment).take(slice(0, 9)), read_lineage(segment))
    found = [f for f in check_trial(trial) if f.where == "export/sleap/export-sleap.json"]
    assert any("--to sleap" in f.hint for f in found)


def test_a_trial_without_anything_is_told_what_to_do_first(tmp_path):
    """With the command that does."""
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=3, n_robots=1, fps=5.0, side_m=1.0), say_nothing)
    with pytest.raises(InputError, match="has no tracks"):
        export(root, asked("sleap"), say_nothing)
    with pytest.raises(InputError, match="no MCAP files that a layout could show"):
        export(root, asked(layout=True), say_nothing)
    with pytest.raises(InputError, match="'ctrax' is unknown"):
        export(root, asked("ctrax"), say_nothing)
