"""MCAP files are read as far as they go."""

import contextlib

import pytest
from mcap.writer import Writer

from zfcal.artifacts.mcap_files import overview, read_metadata
from zfcal.errors import DamagedError, InputError


@pytest.fixture
def whole(tmp_path, write_mcap):
    """Return a whole file of 20 messages."""
    path = tmp_path / "000000.mcap"
    write_mcap(path, metadata={"zfcal.lineage": {"command": "track"}})
    return path


def test_a_whole_file_is_described(whole):
    """Topics with their schemas and counts, times, metadata, and nothing lost."""
    found = overview(whole)

    assert found.whole
    assert found.problem == ""
    assert found.lost_bytes == 0
    assert found.schemas == {"/agents": "zfcal.poses/1"}
    assert found.counts == {"/agents": 20}
    assert found.start_s == 0
    assert found.end_s == pytest.approx(19 / 15)
    assert found.metadata == {"zfcal.lineage": {"command": "track"}}
    assert (found.profile, found.library) == ("", "zfcal test")


def test_a_file_that_still_grows_gives_all_that_is_there(tmp_path, write_mcap):
    """Its last chunk is whole, the footer is missing."""
    path = tmp_path / "000000.mcap"
    write_mcap(path, finish=False)
    found = overview(path)

    assert not found.whole
    assert found.counts == {"/agents": 20}
    assert "cut short, or still grows" in found.problem
    assert found.lost_bytes == 0


def test_every_cut_loses_only_what_lies_behind_it(whole):
    """At each place: messages never rise when less is left, and lost bytes are few."""
    content = whole.read_bytes()
    counts = []
    for size in range(9, len(content), 37):
        whole.write_bytes(content[:size])
        found = overview(whole)
        assert not found.whole
        assert "cut short" in found.problem
        assert found.read_bytes + found.lost_bytes == size
        counts.append(found.counts.total())

    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == 20


def test_a_damaged_record_ends_the_reading_there(whole):
    """A flipped bit in a chunk is noticed by its checksum or its compression."""
    content = bytearray(whole.read_bytes())
    place = content.index(b"/agents") + 400
    content[place] ^= 0xFF
    whole.write_bytes(content)

    found = overview(whole)

    assert not found.whole
    assert found.problem
    assert 0 < found.counts.total() < 20


@pytest.mark.slow
def test_no_flipped_byte_makes_a_traceback(whole):
    """Each byte in turn, every fifth of them."""
    content = whole.read_bytes()
    for place in range(8, len(content), 5):
        broken = bytearray(content)
        broken[place] ^= 0xFF
        whole.write_bytes(broken)
        overview(whole)
        with contextlib.suppress(DamagedError):
            read_metadata(whole, "zfcal.lineage")


def test_metadata_is_found_by_name(whole):
    """None if there is no record of that name."""
    assert read_metadata(whole, "zfcal.lineage") == {"command": "track"}
    assert read_metadata(whole, "other") is None


def test_a_message_of_no_channel_is_damage(tmp_path):
    """The file says so instead of counting it."""
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start()
        writer.add_message(7, 0, b"", 0)
        writer.finish()

    assert "unknown channel 7" in overview(path).problem


@pytest.mark.parametrize(
    ("content", "says"), [(b"", "is empty"), (b"\x89PNG\r\n", "is not an MCAP file")]
)
def test_a_file_of_another_kind_is_named(tmp_path, content, says):
    """With what to do."""
    path = tmp_path / "x.mcap"
    path.write_bytes(content)

    for reader in (overview, lambda p: read_metadata(p, "x")):
        with pytest.raises(DamagedError, match=says):
            reader(path)


def test_a_missing_file_is_an_input_error(tmp_path):
    """And a folder too."""
    with pytest.raises(InputError, match="no such file"):
        overview(tmp_path / "x.mcap")
    with pytest.raises(InputError, match="cannot be read"):
        overview(tmp_path)
