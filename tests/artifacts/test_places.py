"""Files of a trial lie in it: a link that leads outside is refused by its name."""

import os

import pytest

from zfcal.artifacts.atomic import append_bytes, write_bytes_whole
from zfcal.artifacts.lock import lock
from zfcal.artifacts.places import numbered
from zfcal.artifacts.reading import numbered_of, open_regular, open_to_write, read_bytes
from zfcal.errors import InputError, StorageError


@pytest.fixture
def trial(tmp_path):
    """Return a trial, beside a folder with a file of somebody else."""
    root = tmp_path / "trial"
    root.mkdir()
    (root / "trial.toml").write_text("x = 1")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "file").write_bytes(b"theirs")
    return root


def test_a_link_to_a_file_outside_is_not_read(trial):
    """The message says where it leads."""
    (trial / "stats").mkdir()
    link = trial / "stats" / "000120.parquet"
    link.symlink_to("../../outside/file")
    with pytest.raises(InputError, match=r"leads outside the trial, to .*outside/file"):
        read_bytes(link)


def test_a_linked_folder_outside_is_neither_read_nor_written(trial, tmp_path):
    """The link is named, and nothing comes into being behind it."""
    (trial / "stats").symlink_to(tmp_path / "outside")
    with pytest.raises(InputError, match="leads outside the trial by the link stats"):
        read_bytes(trial / "stats" / "file")
    with pytest.raises(StorageError, match="leads outside the trial"):
        write_bytes_whole(trial / "stats" / "000120.parquet", b"ours")
    with pytest.raises(StorageError):
        append_bytes(trial / "stats" / "file", b"ours")
    with pytest.raises(OSError, match="leads outside"):
        open_to_write(trial / "stats" / "new")
    with pytest.raises(InputError, match="leads outside"):
        numbered_of(trial / "stats", ".parquet")
    assert [path.name for path in (tmp_path / "outside").iterdir()] == ["file"]
    assert (tmp_path / "outside" / "file").read_bytes() == b"theirs"


def test_settings_behind_a_link_do_not_make_it_a_trial(trial, tmp_path):
    """A folder of a trial that leads into another trial leads outside."""
    (tmp_path / "outside" / "trial.toml").write_text("x = 1")
    (trial / "stats").symlink_to(tmp_path / "outside")
    with pytest.raises(InputError, match="leads outside"):
        read_bytes(trial / "stats" / "file")


def test_a_link_within_the_trial_is_followed(trial):
    """People who move files within a trial may link them."""
    (trial / "kept").mkdir()
    (trial / "kept" / "a.bin").write_bytes(b"ours")
    (trial / "stats").symlink_to("kept")
    assert read_bytes(trial / "stats" / "a.bin") == b"ours"


def test_the_trial_itself_may_be_reached_by_a_link(trial, tmp_path):
    """On the way to its root there may be any."""
    (tmp_path / "today").symlink_to(trial)
    assert read_bytes(tmp_path / "today" / "trial.toml") == b"x = 1"
    write_bytes_whole(tmp_path / "today" / "stats" / "a.bin", b"ours")
    assert (trial / "stats" / "a.bin").read_bytes() == b"ours"


def test_what_lies_in_no_trial_may_be_a_link(tmp_path):
    """A film or a camera file that a person names."""
    (tmp_path / "a.bin").write_bytes(b"x")
    (tmp_path / "b.bin").symlink_to("a.bin")
    with open_regular(tmp_path / "b.bin") as file:
        assert file.read() == b"x"


def test_a_file_that_grows_is_not_written_through_a_link_or_a_pipe(trial):
    """Not even where the link leads to another file of the trial."""
    (trial / "a.mcap").symlink_to("trial.toml")
    os.mkfifo(trial / "b.mcap")
    for name in ("a.mcap", "b.mcap"):
        with pytest.raises(OSError, match=name):
            open_to_write(trial / name)
    assert (trial / "trial.toml").read_text() == "x = 1"


def test_a_lock_is_not_made_through_a_link(trial, tmp_path):
    """The file would come into being outside."""
    (trial / ".lock-analyse").symlink_to("../outside/lock")
    with pytest.raises(StorageError, match="lock-analyse"), lock(trial, "analyse"):
        pass
    assert not (tmp_path / "outside" / "lock").exists()


def test_each_second_has_one_name(tmp_path):
    """Other digits, more noughts, and numbers of no recording are no artifacts."""
    names = ("000060", "0000120", "1000000", "٠٠٠١٨٠", "99999999999999999999", "00000²")
    for name in names:
        (tmp_path / f"{name}.mcap").touch()
    assert list(numbered(tmp_path, ".mcap")) == [60, 1_000_000]


def test_a_folder_that_is_not_there_holds_nothing(tmp_path):
    """Nor does a file in its place."""
    (tmp_path / "stats").touch()
    assert numbered(tmp_path / "stats", ".parquet") == numbered(tmp_path / "x", ".parquet") == {}
