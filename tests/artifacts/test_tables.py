"""Tables go to disk and come back as they were, or an error says why not."""

import dataclasses
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from zfcal.artifacts.lineage import LINEAGE_KEY, Lineage, to_json
from zfcal.artifacts.tables import (
    SCORES,
    STATS,
    TRACKS,
    make_table,
    read_extra,
    read_table,
    read_tracks,
    write_table,
    write_tracks,
)
from zfcal.errors import DamagedError, InputError, SchemaError
from zfcal.tracks import Tracks


def parquet_of(path, table, schema=TRACKS):
    """Write any table as a file that says it is of a schema, without any check."""
    origin = Lineage(schema=schema, command="test")
    metadata = {LINEAGE_KEY.encode(): to_json(origin.as_dict()).encode()}
    pq.write_table(table.replace_schema_metadata(metadata), path)
    return path


def replaced(table, name, values):
    """Return a table with one column of other values."""
    return table.set_column(table.column_names.index(name), name, values)


@pytest.fixture
def table(tracks_file):
    """Return a whole table of tracks."""
    return read_table(tracks_file, TRACKS)


def test_tracks_come_back_as_they_were(tracks_file, tracks, assert_same_tracks):
    """Every column in type and value, and NaN headings as NaN."""
    assert_same_tracks(read_tracks(tracks_file), tracks)


def test_tracks_of_nobody_come_back_as_they_were(tmp_path, tracks, lineage, assert_same_tracks):
    """An empty segment is a whole file too."""
    nobody = tracks.take(slice(0, 0))
    write_tracks(tmp_path / "t.parquet", nobody, lineage)

    assert_same_tracks(read_tracks(tmp_path / "t.parquet"), nobody)


def test_the_file_has_the_columns_and_types_of_the_contract(tracks_file):
    """As any program sees them that reads Parquet."""
    found = pq.read_table(tracks_file).schema

    assert {field.name: str(field.type) for field in found} == {
        "time_s": "double",
        "frame": "int64",
        "agent": "int32",
        "kind": "dictionary<values=string, indices=int8, ordered=0>",
        "x_m": "double",
        "y_m": "double",
        "heading_rad": "float",
        "confidence": "float",
    }
    assert pq.read_table(tracks_file)["kind"].to_pylist()[:3] == ["fish", "fish", "robot"]


def test_equal_tables_make_equal_bytes(tmp_path, tracks, lineage):
    """In this process, and in another one with other hashes of text."""
    for name in ("a", "b"):
        write_tracks(tmp_path / f"{name}.parquet", tracks, lineage, extra={"z": 1, "a": [2]})
    again = (
        "import sys; from pathlib import Path;"
        "from zfcal.artifacts.tables import *; from zfcal.artifacts.lineage import read_lineage;"
        "old, new = map(Path, sys.argv[1:]);"
        "write_tracks(new, read_tracks(old), read_lineage(old), extra=read_extra(old))"
    )
    command = [
        sys.executable,
        "-c",
        again,
        str(tmp_path / "a.parquet"),
        str(tmp_path / "c.parquet"),
    ]
    subprocess.run(command, check=True, env={"PYTHONHASHSEED": "12345"})

    contents = {(tmp_path / f"{name}.parquet").read_bytes() for name in "abc"}
    assert len(contents) == 1


def test_scores_keep_their_empty_places(tmp_path, scores):
    """A value that is not known is null, not NaN, and comes back as such."""
    path = tmp_path / "000120.parquet"
    write_table(path, scores, Lineage(schema=SCORES, command="analyse"))
    rows = read_table(path, SCORES).to_pylist()

    assert rows[0]["zone"] == "corridor"
    assert rows[0]["ceiling"] is None
    assert rows[1]["value"] is None
    assert rows[1]["n_windows"] == 200


def test_extra_metadata_comes_back(tmp_path, tracks, lineage):
    """Values that JSON can hold, beside the lineage."""
    write_tracks(tmp_path / "a.parquet", tracks, lineage, extra={"moved": 3, "names": ["x"]})
    write_tracks(tmp_path / "b.parquet", tracks, lineage)

    assert read_extra(tmp_path / "a.parquet") == {"moved": 3, "names": ["x"]}
    assert read_extra(tmp_path / "b.parquet") == {}


@pytest.mark.parametrize("share", [0.001, 0.1, 0.5, 0.9, 0.999])
def test_a_file_that_was_cut_is_named(tracks_file, share):
    """At any place: the path, what is wrong, and how to make it again."""
    whole = tracks_file.read_bytes()
    tracks_file.write_bytes(whole[: int(len(whole) * share)])

    with pytest.raises(DamagedError, match=r"cut short|not a Parquet file") as caught:
        read_tracks(tracks_file)
    assert str(tracks_file) in str(caught.value)
    assert "again" in caught.value.hint or "Move it" in caught.value.hint


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "the file is empty"),
        (b"time_s,frame\n0,1\n", "not a Parquet file"),
        (bytes(4096), "not a Parquet file"),
        (b"PAR1PAR1", "cut short"),
        (b"PAR1" + bytes(100) + b"PAR1", "is damaged"),
    ],
)
def test_a_file_of_other_content_is_named(tmp_path, content, says):
    """Empty, a CSV file, zeros as a lost power leaves them, and ends without a middle."""
    path = tmp_path / "000000.parquet"
    path.write_bytes(content)

    with pytest.raises(DamagedError, match=says) as caught:
        read_tracks(path)
    assert str(path) in str(caught.value)


def test_no_flipped_bit_is_believed(tracks_file, tracks, assert_same_tracks):
    """At 300 places a bit is flipped: an error, or the very same tracks; never others."""
    whole = tracks_file.read_bytes()
    places = np.random.default_rng(1).integers(0, len(whole), 300)
    noticed = 0
    for place in places:
        broken = bytearray(whole)
        broken[place] ^= 1 << int(place % 8)
        tracks_file.write_bytes(broken)
        try:
            found = read_tracks(tracks_file)
        except (DamagedError, SchemaError):
            noticed += 1
        else:
            assert_same_tracks(found, tracks)
    assert noticed > 150


def test_a_missing_file_is_no_damage(tmp_path):
    """It is an input error that says so."""
    with pytest.raises(InputError, match="no such file"):
        read_tracks(tmp_path / "000000.parquet")


def test_a_folder_is_no_file(tmp_path):
    """The error says what it is."""
    with pytest.raises(InputError, match="cannot be read"):
        read_tracks(tmp_path)


@pytest.mark.parametrize(
    ("origin", "found"),
    [
        (None, "none: it carries no lineage"),
        (b"{", "none: its lineage is damaged"),
        (b'{"schema": "zfcal.tracks/2"}', "zfcal.tracks/2"),
        (b'{"schema": "zfcal.stats/1"}', "zfcal.stats/1"),
    ],
)
def test_a_table_of_another_schema_is_named(tmp_path, table, origin, found):
    """A foreign Parquet file, another version, another kind of table."""
    path = tmp_path / "000000.parquet"
    metadata = {} if origin is None else {LINEAGE_KEY.encode(): origin}
    pq.write_table(table.replace_schema_metadata(metadata), path)

    with pytest.raises(SchemaError) as caught:
        read_tracks(path)
    assert str(caught.value) == f"{path}: schema is {found!r}, expected 'zfcal.tracks/1'."


def test_a_missing_column_is_named(tmp_path, table):
    """With all that were expected, and all that are there."""
    path = parquet_of(tmp_path / "t.parquet", table.drop_columns(["x_m"]))

    with pytest.raises(DamagedError, match=r"column 'x_m' is missing \(expected time_s") as caught:
        read_tracks(path)
    assert "zfcal track or zfcal import" in caught.value.hint


def test_an_unknown_column_is_named(tmp_path, table):
    """A version of a schema has its columns and no others."""
    path = parquet_of(tmp_path / "t.parquet", table.append_column("z_m", table["x_m"]))

    with pytest.raises(DamagedError, match="column 'z_m' is unknown"):
        read_tracks(path)


def test_the_order_of_columns_does_not_matter(tmp_path, table, tracks, assert_same_tracks):
    """They are found by name."""
    path = parquet_of(tmp_path / "t.parquet", table.select(table.column_names[::-1]))

    assert_same_tracks(read_tracks(path), tracks)


def test_kinds_are_read_by_name_and_not_by_code(tmp_path, table, tracks, assert_same_tracks):
    """Another writer may have listed the robot first, or used longer codes."""
    kinds = table["kind"].cast(pa.string()).combine_chunks()
    turned = pa.DictionaryArray.from_arrays(
        pa.array([1 if kind.as_py() == "fish" else 0 for kind in kinds], type=pa.int32()),
        ["robot", "fish"],
    )
    path = parquet_of(tmp_path / "t.parquet", replaced(table, "kind", turned))

    assert_same_tracks(read_tracks(path), tracks)


def test_a_column_of_another_type_is_named(tmp_path, table):
    """Never converted silently."""
    path = parquet_of(tmp_path / "t.parquet", replaced(table, "x_m", table["x_m"].cast("float32")))

    with pytest.raises(DamagedError, match="column 'x_m' is of type float, expected double"):
        read_tracks(path)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("x_m", np.nan, "column 'x_m' is nan in row 4, expected a finite number"),
        ("y_m", np.inf, "column 'y_m' is inf in row 4, expected a finite number"),
        (
            "confidence",
            1.5,
            "column 'confidence' is 1.5 in row 4, expected at least 0 and at most 1",
        ),
        ("confidence", np.nan, "column 'confidence' is nan in row 4"),
        ("heading_rad", -np.inf, "column 'heading_rad' is -inf in row 4"),
        ("agent", -1, "column 'agent' is -1 in row 4, expected at least 0"),
        ("time_s", -1.0, "column 'time_s' is -1.0 in row 4"),
        ("x_m", None, "column 'x_m' is empty in row 4"),
        ("agent", 0, "row 4 repeats the frame and the agent of the row before|row 4 breaks"),
        ("frame", 0, "row 4 breaks the order .* frame, then agent"),
        ("time_s", 0.5, "time_s is 0.5 at frame 1 .* time must rise with the frame"),
        ("kind", "duck", "column 'kind' holds 'duck', expected one of fish, robot"),
    ],
)
def test_a_value_that_cannot_be_is_named(tmp_path, table, name, value, says):
    """The column, the row, the value, and what was expected; row 4 is agent 1 of frame 1."""
    values = table[name].to_pylist()
    values[4] = value
    kind = table[name].type if name != "kind" else pa.string()
    column = pa.array(values, type=kind)
    if name == "kind":
        column = column.dictionary_encode()
    path = parquet_of(tmp_path / "t.parquet", replaced(table, name, column))

    with pytest.raises(DamagedError, match=says) as caught:
        read_tracks(path)
    assert str(path) in str(caught.value)


def test_a_clock_that_stands_still_is_named(tmp_path, table):
    """Two frames at one time."""
    still = pa.array(np.zeros(table.num_rows))
    path = parquet_of(tmp_path / "t.parquet", replaced(table, "time_s", still))

    with pytest.raises(DamagedError, match="time must rise with the frame"):
        read_tracks(path)


def test_rows_in_another_order_are_named(tmp_path, table):
    """Readers rely on the order; none sorts silently."""
    path = parquet_of(tmp_path / "t.parquet", table.take(list(range(table.num_rows))[::-1]))

    with pytest.raises(DamagedError, match="row 1 breaks the order"):
        read_tracks(path)


def test_a_frame_that_stands_there_twice_is_named(tmp_path, table):
    """Such as after two recordings were joined without care."""
    path = parquet_of(tmp_path / "t.parquet", pa.concat_tables([table, table]))

    with pytest.raises(DamagedError, match="breaks the order"):
        read_tracks(path)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"x_m": np.nan}, "'x_m' is nan in row 0"),
        ({"confidence": 2.0}, "'confidence' is 2.0 in row 0"),
    ],
)
def test_what_would_not_be_read_is_not_written(tmp_path, tracks, lineage, change, says):
    """The same rules hold on the way out, and the file is not made."""
    columns = {f.name: getattr(tracks, f.name).copy() for f in dataclasses.fields(tracks)}
    for name, value in change.items():
        columns[name][0] = value

    with pytest.raises(InputError, match=says):
        write_tracks(tmp_path / "t.parquet", Tracks(**columns), lineage)
    assert list(tmp_path.iterdir()) == []


def test_a_table_is_not_written_under_the_name_of_another_schema(tmp_path, scores):
    """The lineage says what the table must be."""
    with pytest.raises(InputError, match=r"not a table of zfcal\.stats/1"):
        write_table(tmp_path / "t.parquet", scores, Lineage(schema=STATS, command="analyse"))


def test_a_score_beyond_its_limits_is_not_made(tmp_path, scores):
    """A similarity lies in [0, 1]."""
    wrong = replaced(scores, "value", pa.array([1.5, None]))

    with pytest.raises(
        InputError, match=r"'value' is 1\.5 in row 0, expected at least 0 and at most"
    ):
        write_table(tmp_path / "t.parquet", wrong, Lineage(schema=SCORES, command="analyse"))


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({}, "column 'window_end_s' is missing"),
        ({"bogus": [1]}, "is missing"),
    ],
)
def test_a_table_of_missing_columns_is_not_made(columns, says):
    """The first that is missing is named."""
    with pytest.raises(InputError, match=says):
        make_table(STATS, columns)


def test_a_table_of_columns_of_two_lengths_is_not_made(scores):
    """Nothing is cut or filled up."""
    columns = {name: scores[name].to_pylist() for name in scores.column_names}
    columns["value"] = [0.5]

    with pytest.raises(InputError, match="cannot be made"):
        make_table(SCORES, columns)


def test_an_unknown_schema_is_named():
    """With those that there are."""
    with pytest.raises(InputError, match="no schema of a table") as caught:
        make_table("zfcal.trucks/1", {})
    assert "zfcal.tracks/1" in caught.value.hint
