"""Files of a trial are regular ones, and hold one content for one piece of work."""

from __future__ import annotations

import hashlib
import os

import pytest

from zfcal.artifacts.atomic import write_bytes_whole
from zfcal.artifacts.reading import contents as reading
from zfcal.artifacts.reading.contents import (
    check_contents,
    hash_of,
    hold_steady,
    one_content,
    read_bytes,
    sha256_of,
)
from zfcal.artifacts.reading.opening import open_regular
from zfcal.artifacts.settings import read_trial, write_trial
from zfcal.errors import ChangedError, InputError
from zfcal.trial import Trial


def digest(data):
    """Return the SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


@pytest.fixture
def place(tmp_path):
    """Return a file that holds ``old``."""
    path = tmp_path / "tracks.bin"
    path.write_bytes(b"old")
    return path


@pytest.fixture
def make_settings(tmp_path):
    """Return what makes a trial of four fish."""

    def make():
        write_trial(
            Trial(
                root=tmp_path, arena="two-rooms", n_fish=4, n_robots=0, fps=15.0, dt_s=0.2, seed=1
            )
        )
        return tmp_path

    return make


def test_the_hash_is_that_of_the_bytes(place):
    """`hash_of`, `sha256_of` and the standard library agree."""
    assert hash_of(place) == sha256_of(place) == digest(b"old")


def test_a_hash_follows_two_writes_within_one_tick_of_the_clock(place, monkeypatch):
    """A content of the same length, written at once in the same inode, has a hash of its own."""
    tick_ns, exact = 20_000_000, reading.looks_of

    def coarse(path):
        device, inode, modified_ns, changed_ns, size = exact(path)
        ticks = (modified_ns // tick_ns * tick_ns, changed_ns // tick_ns * tick_ns)
        return (device, inode, *ticks, size)

    monkeypatch.setattr(reading, "looks_of", coarse)
    for n in range(50):
        data = f"{n:03d}".encode()
        with place.open("r+b") as file:
            file.write(data)
        assert hash_of(place) == digest(data)


def test_a_file_read_after_it_was_hashed_must_be_the_same(place):
    """What was hashed before it was read and what was read are one content."""
    with one_content():
        hash_of(place)
        place.write_bytes(b"new")
        with pytest.raises(ChangedError, match=r"tracks\.bin: has changed"):
            read_bytes(place)


def test_a_file_hashed_after_it_was_read_must_be_the_same(place):
    """A hash that is taken after the reading is that of what was read, or none."""
    with one_content():
        assert read_bytes(place) == b"old"
        place.write_bytes(b"new")
        with pytest.raises(ChangedError):
            hash_of(place)


@pytest.mark.parametrize("look", [hash_of, read_bytes, hold_steady])
def test_what_has_changed_by_the_end_is_not_published(place, tmp_path, look):
    """Nothing stands at the place of the result, nor beside it."""
    made = tmp_path / "made" / "result.bin"
    with one_content():
        look(place)
        place.write_bytes(b"new")
        with pytest.raises(ChangedError):
            write_bytes_whole(made, b"from the old one")
    assert list(made.parent.iterdir()) == []


@pytest.mark.parametrize("look", [hash_of, read_bytes, hold_steady])
def test_what_is_gone_by_the_end_has_changed(place, tmp_path, look):
    """A missing input is no input."""
    with one_content():
        look(place)
        place.unlink()
        with pytest.raises(ChangedError):
            write_bytes_whole(tmp_path / "result.bin", b"x")


def test_a_file_that_a_library_reads_by_name_may_not_be_touched_at_all(place):
    """There and back again is a change, since nobody knows which bytes the library saw."""
    with one_content():
        hold_steady(place)
        place.write_bytes(b"new")
        place.write_bytes(b"old")
        with pytest.raises(ChangedError):
            check_contents()


def test_a_file_that_was_read_may_be_written_again_with_the_same_content(place):
    """A mirror that copies a file once more changes nothing."""
    with one_content():
        read_bytes(place)
        place.unlink()
        place.write_bytes(b"old")
        check_contents()


def test_a_link_that_is_made_to_a_film_is_no_change(place, tmp_path):
    """A snapshot by hard links, or other permissions, write nothing."""
    with one_content():
        hold_steady(place)
        (tmp_path / "snapshot").hardlink_to(place)
        place.chmod(0o600)
        check_contents()


def test_of_settings_the_values_count(tmp_path, make_settings):
    """A comment changes nothing, another value does, as soon as it is read again."""
    root = make_settings()
    path = root / "trial.toml"
    with one_content():
        read_trial(root)
        path.write_text(path.read_text() + "# a word\n")
        check_contents()
        read_trial(root)
        path.write_text(path.read_text().replace("n_fish = 4", "n_fish = 5"))
        with pytest.raises(ChangedError):
            read_trial(root)


def test_what_a_part_of_the_work_writes_is_no_change_for_the_whole(place):
    """The part may write what the whole has read."""
    with one_content():
        read_bytes(place)
        with one_content():
            write_bytes_whole(place, b"new")
        check_contents()


def test_work_may_change_what_it_writes_itself(place):
    """The file that a command reads and then writes is no input that has changed."""
    with one_content():
        read_bytes(place)
        write_bytes_whole(place, b"new")
        check_contents()
        assert read_bytes(place) == b"new"


def test_work_that_builds_on_other_work_keeps_to_what_that_has_seen(place):
    """The settings that a run read at its start hold for each of its items."""
    with one_content() as start:
        read_bytes(place)
    place.write_bytes(b"new")
    with one_content(start), pytest.raises(ChangedError):
        hash_of(place)
    with one_content():
        hash_of(place)


def test_a_part_of_the_work_is_held_to_what_the_whole_has_seen(place):
    """What a part has seen counts for the whole, unless the part failed and is done again."""

    def fail():
        with one_content():
            read_bytes(place)
            raise KeyError

    with one_content():
        with pytest.raises(KeyError):
            fail()
        place.write_bytes(b"new")
        with one_content():
            read_bytes(place)
        place.write_bytes(b"newer")
        with pytest.raises(ChangedError):
            hash_of(place)


def test_nobody_is_held_to_anything_outside():
    """Without `one_content` there is nothing to check."""
    check_contents()


def test_a_pipe_a_folder_and_a_device_keep_nobody_waiting(tmp_path):
    """Each is refused at once, by what it is."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, kind in ((pipe, "a named pipe"), (tmp_path, "a folder"), ("/dev/zero", "a device")):
        with pytest.raises(OSError, match=f"expected a regular file, got {kind}"):
            open_regular(path)
        with pytest.raises(InputError, match=f"expected a regular file, got {kind}"):
            read_bytes(path)
