"""Files of a trial lie in it: a link that leads outside is refused by its name."""

import os
import shlex
import subprocess

import pytest

from zfcal.artifacts.atomic import append_bytes, write_bytes_whole
from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.reading.contents import numbered_of, read_bytes
from zfcal.artifacts.reading.opening import open_regular, open_to_write
from zfcal.artifacts.reading.places import numbered, way_back
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


NAMED = {
    "frames": "zfcal track {root} --overhead {out}/overhead",
    "frames/below": "zfcal track {root} --below {out}",
    "frames/below/000000.mcap": "zfcal track {root} --below {out}",
    "film.avi": "Name it where it lies: {out}",
    "stats": "Put the files there, or mount their folder: rm {link}; mkdir {link}; mount --bind",
    "stats/000120.parquet": "Put the file itself there: cp --remove-destination",
    "arena.geojson": "Put the file itself there: cp --remove-destination",
}


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("target", ["outside", "outside/file", "outside/gone"])
def test_the_hint_says_what_to_do_about_a_link(trial, tmp_path, name, target):
    """Images and films are named where they lie, what belongs to a trial is put there."""
    link, out = trial / name, tmp_path / target
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(out)
    hint = way_back(link)
    if target.endswith("gone"):
        assert "Nothing lies there, maybe its disk is not mounted" in hint
        assert hint.endswith(f"rm {link}.")
        return
    if (target == "outside") == name.endswith((".parquet", ".mcap", ".avi", ".geojson")):
        return
    place = out.parent if name.endswith(".mcap") else out
    assert NAMED[name].format(root=trial, out=place, link=link) in hint


@pytest.mark.parametrize("name", ["stats/000120.parquet", "film.avi"])
def test_the_command_of_the_hint_puts_the_file_there(trial, tmp_path, name):
    """As a person would do it, in a folder whose name needs quotes."""
    theirs = tmp_path / "the disk"
    theirs.mkdir()
    (theirs / "file").write_bytes(b"theirs")
    link = trial / name
    link.parent.mkdir(exist_ok=True)
    link.symlink_to(theirs / "file")
    with pytest.raises(InputError) as refused:
        read_bytes(link)
    command = refused.value.hint.partition("ut the file itself there: ")[2].removesuffix(".")
    subprocess.run(shlex.split(command), check=True)
    assert not link.is_symlink()
    assert read_bytes(link) == b"theirs"


@pytest.mark.parametrize("write", [write_bytes_whole, append_bytes])
def test_who_may_not_write_behind_a_link_hears_the_same(trial, tmp_path, write):
    """As who may not read there."""
    (trial / "stats").symlink_to(tmp_path / "outside")
    with pytest.raises(StorageError) as refused:
        write(trial / "stats" / "000120.parquet", b"ours")
    assert f"mount --bind {tmp_path / 'outside'} {trial / 'stats'}" in refused.value.hint


@pytest.mark.parametrize("ending", [".parquet", ".toml", ".json", ".mcap"])
def test_who_asks_where_an_artifact_comes_from_hears_the_same(trial, ending):
    """The lineage of a file behind a link is not that of a damaged file."""
    (trial / "stats").mkdir()
    link = trial / "stats" / f"000120{ending}"
    link.symlink_to("../../outside/file")
    with pytest.raises(InputError, match="leads outside") as refused:
        read_lineage(link)
    assert "cp --remove-destination" in refused.value.hint
