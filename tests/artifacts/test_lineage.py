"""What every artifact says about where it comes from."""

import json
import math

import pytest

from zfcal.artifacts.lineage import Lineage, package_version, read_lineage, to_json
from zfcal.artifacts.models import write_model
from zfcal.artifacts.tables import write_tracks
from zfcal.errors import DamagedError, InputError
from zfcal.parameters import natural


def test_a_table_gives_back_its_lineage(tracks_file, lineage):
    """Parquet keeps it as key-value metadata."""
    assert read_lineage(tracks_file) == lineage


def test_a_model_gives_back_its_lineage_with_the_schema_of_its_head(tmp_path):
    """TOML keeps it as a table; the schema stands at the file's head, once."""
    lineage = Lineage(
        schema="zfcal.model/1", command="calibrate", seed=3, options={"generations": 20}
    )
    path = tmp_path / "000120.toml"
    write_model(path, natural((("centre", False),), dt_s=0.2), lineage)

    assert read_lineage(path) == lineage
    assert path.read_text().count("zfcal.model/1") == 1


def test_a_json_file_gives_back_its_lineage(tmp_path):
    """JSON keeps it under the key lineage."""
    lineage = Lineage(schema="zfcal.findings/1", command="diagnose", inputs={"a": "0" * 64})
    origin = lineage.as_dict()
    del origin["schema"]
    path = tmp_path / "findings.json"
    path.write_text(json.dumps({"schema": "zfcal.findings/1", "lineage": origin}))

    assert read_lineage(path) == lineage


@pytest.mark.parametrize("finish", [True, False])
def test_an_mcap_file_gives_back_its_lineage_also_while_it_grows(tmp_path, write_mcap, finish):
    """MCAP keeps it as a metadata record of text."""
    lineage = Lineage(
        schema="zfcal.poses/1", command="track", seed=5, options={"harris": True, "blur": 3}
    )
    path = tmp_path / "000000.mcap"
    write_mcap(path, metadata={"other": {}, "zfcal.lineage": lineage.as_text()}, finish=finish)

    assert read_lineage(path) == lineage


def test_options_that_are_not_given_are_the_same_as_none():
    """TOML has no word for None, so it is left out everywhere, also inside an option."""
    given = Lineage(schema="s", command="c", options={"a": None, "b": {"c": None, "d": 1}})

    assert given == Lineage(schema="s", command="c", options={"b": {"d": 1}})


def test_a_planned_lineage_equals_the_one_that_is_read_back(tmp_path, tracks):
    """Tuples become lists and inputs are sorted when it is made, not when it is written."""
    planned = Lineage(
        schema="zfcal.tracks/1",
        command="import",
        options={"origin": (1.5, 2)},
        inputs={"b": "2", "a": "1"},
    )
    path = tmp_path / "t.parquet"
    write_tracks(path, tracks, planned)

    assert read_lineage(path) == planned
    assert list(planned.inputs) == ["a", "b"]


def test_lineage_holds_nothing_of_the_moment_or_the_place(lineage):
    """Its keys are those that bear on the numbers."""
    assert set(lineage.as_dict()) == {"schema", "command", "version", "options", "inputs"}
    assert lineage.version == package_version()


@pytest.mark.parametrize("value", [math.nan, math.inf, object(), {1, 2}])
def test_an_option_that_json_cannot_hold_is_refused(value):
    """NaN would come back as another value, and a set in another order."""
    with pytest.raises(InputError, match="cannot be recorded as JSON"):
        Lineage(schema="s", command="c", options={"x": value})


def test_json_text_does_not_depend_on_the_order_of_keys():
    """The same value, the same text."""
    assert to_json({"b": 1, "a": [2.5, None]}) == '{"a": [2.5, null], "b": 1}'


def test_a_missing_file_is_an_input_error(tmp_path):
    """Not damage: it is not there."""
    for ending in ("parquet", "toml", "json", "mcap"):
        with pytest.raises(InputError, match="no such file"):
            read_lineage(tmp_path / f"x.{ending}")


def test_kinds_without_lineage_are_named(tmp_path):
    """A picture carries none."""
    with pytest.raises(InputError, match="carry no lineage") as caught:
        read_lineage(tmp_path / "x.png")
    assert ".parquet" in caught.value.hint


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("x.toml", b"schema = 'a'\n", "carries no lineage"),
        ("x.toml", b"schema = \n", "cannot be read whole"),
        ("x.toml", b"schema = 'a'\nlineage = 3\n", "expected a table"),
        ("x.toml", b"schema = 'a'\n[lineage]\nversion = '1'\n", "command missing"),
        ("x.toml", b"[lineage]\nversion = '1'\ncommand = 'c'\n", "schema missing"),
        (
            "x.json",
            b'{"schema": "a", "lineage": {"command": "c", "version": "1", "seed": "x"}}',
            "seed",
        ),
        ("x.json", b"[1]", "expected a table"),
        ("x.json", b"", "cannot be read whole"),
        ("x.json", b"\xff\xfe", "cannot be read whole"),
        ("x.parquet", b"", "cannot be read whole"),
        ("x.parquet", b"PAR1" + bytes(20), "cannot be read whole"),
        ("x.mcap", b"", "is empty"),
        ("x.mcap", b"GIF89a....", "not an MCAP file"),
    ],
)
def test_a_damaged_lineage_is_named(tmp_path, name, content, says):
    """A DamagedError with the path, whatever the file's kind."""
    path = tmp_path / name
    path.write_bytes(content)

    with pytest.raises(DamagedError, match=says) as caught:
        read_lineage(path)
    assert str(path) in str(caught.value)
