"""Files are as large, and documents as deep, as they may be."""

import dataclasses
import io
import time
import tracemalloc

import lz4.frame
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import zstandard
from mcap.exceptions import McapError
from mcap.records import Chunk

from zfcal.artifacts import tables
from zfcal.artifacts.mcap_files import records_of
from zfcal.artifacts.reading import limits, opening
from zfcal.artifacts.reading.contents import read_bytes
from zfcal.artifacts.reading.limits import VARIABLE
from zfcal.artifacts.reading.parsing import json_of, toml_of
from zfcal.artifacts.reading.pixels import check_pixels
from zfcal.artifacts.tables import read_parquet
from zfcal.artifacts.validation import read_toml
from zfcal.errors import DamagedError, InputError


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = " + "[" * 100_000, "nests deeper"),
        ("a = " + "[" * 200 + "]" * 200, "nests deeper"),
        ("a = " + "9" * 5001, "digits"),
        ("a = " + "9" * 30, "more than 64 bits"),
        ("a." * 200_000 + "b = 1", "nests deeper"),
        ("[" + "a." * 200_000 + "b]", "nests deeper"),
    ],
)
def test_no_toml_ends_a_run(text, says):
    """Each is one kind of error, at once."""
    began_s = time.monotonic()
    with pytest.raises(ValueError, match=says):
        toml_of(text)
    assert time.monotonic() - began_s < 10


@pytest.mark.parametrize("later", [0, 1, 200_000, 3_000_000])
def test_a_file_is_read_whole_and_sets_aside_what_it_holds(tmp_path, monkeypatch, later):
    """Not the gigabyte that one of its kind may have; what is written meanwhile is read as well."""
    path, begun = tmp_path / "file.parquet", b"b" * 1000
    path.write_bytes(begun)

    def grown(file, size):
        with file.open("ab") as more:
            more.write(b"m" * later)
        limits.check_size(file, size)

    monkeypatch.setattr(opening, "check_size", grown)
    tracemalloc.start()
    data = opening.read_limited(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert data == begun + b"m" * later
    assert most < 3 * len(data) + 1_000_000


def test_a_file_that_grows_too_large_is_refused(tmp_path, monkeypatch):
    """Its size was checked before."""
    path = tmp_path / "file.parquet"
    path.write_bytes(b"b" * 1000)
    monkeypatch.setattr(opening, "most_bytes", lambda _path: 999)
    monkeypatch.setattr(opening, "check_size", lambda _path, _size: None)
    with pytest.raises(DamagedError):
        opening.read_limited(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"a":' * 100_000, "nests deeper"),
        ('{"a":' * 200 + "1" + "}" * 200, "nests deeper"),
        ('{"a":' + "9" * 5001 + "}", "digits"),
        ('{"a": NaN}', "NaN is not a number"),
        ('{"a": 1, "a": 2}', "'a' stands twice"),
    ],
)
def test_no_json_ends_a_run(text, says):
    """Each is one kind of error."""
    with pytest.raises(ValueError, match=says):
        json_of(text)


def test_what_is_not_finite_is_taken_where_it_is_asked_for():
    """As many programs write it; a document that is too deep stays an error."""
    found = json_of('{"a": [NaN, -Infinity, 1]}', not_finite=True)
    assert repr(found) == "{'a': [nan, -inf, 1]}"
    with pytest.raises(ValueError, match="nests deeper"):
        json_of("[" * 100_000, not_finite=True)


@pytest.mark.slow
def test_a_large_file_is_not_read_unless_the_limit_is_raised(tmp_path, monkeypatch):
    """The message says how."""
    path = tmp_path / "model.toml"
    path.write_text("a = 1\n# " + "x" * 2_000_000)
    with pytest.raises(DamagedError, match=r"too large \(2\.0 MB, expected at most 1\.0 MB"):
        read_toml(path)
    monkeypatch.setenv(VARIABLE, "3")
    assert read_toml(path) == {"a": 1}
    monkeypatch.setenv(VARIABLE, "0.001")
    with pytest.raises(DamagedError):
        read_toml(path)


@pytest.mark.parametrize("text", ["many", "-1", "nan", "inf", "0"])
def test_a_limit_must_be_a_number(tmp_path, monkeypatch, text):
    """It is named, with what was got."""
    (tmp_path / "a.toml").touch()
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(InputError, match=rf"{VARIABLE} must be a positive number .*{text}"):
        read_bytes(tmp_path / "a.toml")


def _chunk(compression, data, size):
    return Chunk(
        compression=compression,
        data=data,
        message_end_time=0,
        message_start_time=0,
        uncompressed_crc=0,
        uncompressed_size=size,
    )


@pytest.mark.parametrize("pack", [zstandard.compress, lz4.frame.compress])
def test_a_chunk_unpacks_to_what_it_claims(pack):
    """One that would unpack to more than its claim is let go as soon as that shows."""
    kind = "zstd" if pack is zstandard.compress else "lz4"
    assert records_of(_chunk(kind, pack(b""), 0)) == []
    bomb = pack(bytes(2**26))
    for size in (10, 2**26 + 1):
        with pytest.raises(McapError, match="another size"):
            records_of(_chunk(kind, bomb, size))


def test_a_chunk_claims_no_more_than_is_believed():
    """Nothing is unpacked before that."""
    with pytest.raises(McapError, match="claims to unpack to"):
        records_of(_chunk("lz4", b"", 2**40))
    with pytest.raises(McapError, match="rot13"):
        records_of(dataclasses.replace(_chunk("rot13", b"x", 1)))


def test_a_table_of_too_many_rows_is_not_unpacked(tmp_path, monkeypatch):
    """A few bytes may stand for a thousand million rows."""
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"x": np.zeros(100_000)}), path)
    assert read_parquet(path, "").num_rows == 100_000
    monkeypatch.setattr(tables, "TABLE_ROWS", 99_999)
    with pytest.raises(DamagedError, match="claims 100000 rows, expected at most 99999"):
        read_parquet(path, "")
    monkeypatch.setattr(tables, "TABLE_ROWS", limits.TABLE_ROWS)
    monkeypatch.setattr(tables, "TABLE_BYTES", 100)
    with pytest.raises(DamagedError, match="too large"):
        read_parquet(path, "")


def _png(width, height):
    head = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    return b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + head


def _jpeg(width, height):
    size = height.to_bytes(2, "big") + width.to_bytes(2, "big")
    return b"\xff\xd8\xff\xe0\0\4ab\xff\xc0\0\x0b\x08" + size + b"\x01"


@pytest.mark.parametrize("head", [_png, _jpeg])
def test_an_image_has_no_more_pixels_than_a_camera(tmp_path, head):
    """Its head says so: it is not decoded."""
    check_pixels(tmp_path, head(5000, 5000))
    with pytest.raises(DamagedError, match="60000 x 50000 pixels"):
        check_pixels(tmp_path, head(60_000, 50_000))


def test_bytes_that_are_no_image_have_no_pixels(tmp_path):
    """Whoever decodes them says what is wrong."""
    for data in (
        b"",
        b"\xff\xd8",
        b"\xff" * 1000,
        b"\xff\xd8" + b"\xff" * 1000,
        b"\x89PNG\r\n\x1a\n",
    ):
        check_pixels(tmp_path, io.BytesIO(data).read())
