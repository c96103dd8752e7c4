"""Files that are whole or absent, whatever happens while they are written."""

import errno
import os
import resource
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

from zfcal.artifacts.atomic import (
    append_bytes,
    is_orphan,
    is_part,
    storage_error,
    write_text_whole,
    write_whole,
)
from zfcal.artifacts.reading.contents import sha256_of
from zfcal.errors import InputError, StorageError, TakenError, ZfcalError


def names_in(folder):
    """Return the names of all that lies in a folder, dot-files as well."""
    return sorted(path.name for path in folder.iterdir())


def run(code, *arguments, **options):
    """Run Python code in a process of its own."""
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=60, check=False, **options
    )


def test_a_file_is_written_and_nothing_else_is_left(tmp_path):
    """Its folders are made, and the dot-file is gone."""
    path = tmp_path / "a" / "b" / "file.txt"
    write_text_whole(path, "höhe\n")

    assert path.read_bytes() == "höhe\n".encode()
    assert names_in(path.parent) == ["file.txt"]


def test_the_part_is_a_dot_file_in_the_same_folder(tmp_path):
    """A rename within one folder is atomic; rsync and people do not see the part."""
    parts = []

    def write(part):
        parts.append(part)
        part.write_text("x")

    write_whole(tmp_path / "000000.parquet", write)

    assert parts[0].parent == tmp_path
    assert parts[0].name.startswith(".000000.parquet.part-")
    assert is_part(parts[0].name)
    assert not is_part("000000.parquet")
    assert not is_part(".lock-analyse")


def test_the_old_content_stays_until_the_new_one_is_whole(tmp_path):
    """While it is written, the file reads as before."""
    path = tmp_path / "file"
    write_text_whole(path, "old")
    seen = []

    def write(part):
        part.write_text("ne")
        seen.append(path.read_text())
        part.write_text("new")

    write_whole(path, write)

    assert seen == ["old"]
    assert path.read_text() == "new"


def test_an_error_while_writing_keeps_the_old_content(tmp_path):
    """Whatever the writer raises comes through, and the part is removed."""
    path = tmp_path / "file"
    write_text_whole(path, "old")

    def write(part):
        part.write_text("half")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_whole(path, write)
    assert path.read_text() == "old"
    assert names_in(tmp_path) == ["file"]


KILLED = """
    import os, sys
    from pathlib import Path
    from zfcal.artifacts.atomic import write_whole

    path = Path(sys.argv[1])
    size = 200_000

    def write(part, letter):
        with part.open("wb") as file:
            for _ in range(20):
                file.write(letter * (size // 20))
                file.flush()

    for number in range(10**9):
        write_whole(path, lambda part: write(part, b"ABCDEFGH"[number % 8:][:1]))
        if number == 0:
            print("ready", flush=True)
"""


@pytest.mark.slow
def test_a_killed_writer_leaves_the_old_or_the_new_content_whole(tmp_path):
    """Twelve times SIGKILL at a random instant: never a half file, never two letters in one."""
    path = tmp_path / "file"
    delays_s = np.random.default_rng(1).uniform(0.0, 0.05, 12)
    for delay_s in delays_s:
        process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(KILLED), str(path)], stdout=subprocess.PIPE
        )
        process.stdout.readline()
        time.sleep(delay_s)
        process.kill()
        process.wait()
        process.stdout.close()
        content = path.read_bytes()
        assert len(content) == 200_000
        assert len(set(content)) == 1


def test_the_next_write_removes_what_a_killed_one_left(tmp_path):
    """Only parts of the same file, and only those of dead processes."""
    path = tmp_path / "file"
    stuck = """
        import os, signal, sys
        from pathlib import Path
        from zfcal.artifacts.atomic import write_whole

        def write(part):
            part.write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)

        write_whole(Path(sys.argv[1]), write)
    """
    for name in ("file", "other"):
        assert run(stuck, tmp_path / name).returncode == -signal.SIGKILL
    left = names_in(tmp_path)
    assert len(left) == 2
    assert all(is_orphan(tmp_path / name) for name in left)

    write_text_whole(path, "whole")

    assert len(names_in(tmp_path)) == 2
    assert not any(name.startswith(".file") for name in names_in(tmp_path))


def test_a_part_of_a_killed_process_of_the_same_number_is_removed(tmp_path):
    """In a container every run may be process number 1."""
    names = []
    write_whole(tmp_path / "other", lambda part: names.append(part.name) or part.touch())
    left = tmp_path / names[0].replace(".other.", ".file.")
    left.write_text("half")

    assert is_orphan(left)
    write_text_whole(tmp_path / "file", "whole")
    assert names_in(tmp_path) == ["file", "other"]


def test_the_part_of_a_living_process_is_left_alone(tmp_path):
    """Two writers of one file do not take each other's part away; the last one wins."""

    def write(part):
        part.write_text("outer")
        write_text_whole(tmp_path / "file", "inner")
        assert part.exists()
        assert not is_orphan(part)

    write_whole(tmp_path / "file", write)

    assert (tmp_path / "file").read_text() == "outer"


def test_on_windows_processes_are_listed_not_signalled(tmp_path, monkeypatch):
    """There signal 0 ends a process. A thread tells one way from the other: it is not listed."""
    pytest.importorskip("psutil")  # it asks which system this is
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    living = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    leave = threading.Event()
    thread = threading.Thread(target=leave.wait)
    thread.start()
    names = []
    write_whole(tmp_path / "file", lambda part: names.append(part.name) or part.touch())
    numbers = (ended.pid, living.pid, thread.native_id)
    parts = [tmp_path / names[0].replace(f"-{os.getpid()}-", f"-{n}-") for n in numbers]

    here = [is_orphan(part) for part in parts]
    with monkeypatch.context() as windows:
        windows.setattr(os, "name", "nt")
        there = [is_orphan(part) for part in parts]

    leave.set()
    living.communicate(b"\n")
    assert here == [True, False, False]
    assert there == [True, False, True]


@pytest.mark.parametrize("number", [errno.EISDIR, errno.EPERM, errno.EACCES])
def test_a_place_that_a_folder_has_taken_is_told_whatever_the_system_calls_it(tmp_path, number):
    """Linux says EISDIR where a folder is to be removed, macOS EPERM, Windows EACCES."""
    error = OSError(number, os.strerror(number))
    assert isinstance(storage_error(tmp_path, error), TakenError)
    assert isinstance(storage_error(tmp_path / "file", error), TakenError) == (
        number == errno.EISDIR
    )


def limit_file_size():
    """Let this process write no file longer than 64 KiB."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))


FULL = """
    import sys
    from pathlib import Path
    from zfcal.artifacts.atomic import write_whole
    from zfcal.errors import StorageError

    try:
        write_whole(Path(sys.argv[1]), lambda part: part.write_bytes(bytes(int(sys.argv[2]))))
    except StorageError as error:
        print(error, "|", error.hint)
        sys.exit(error.exit_code)
"""


def test_a_file_that_may_not_grow_is_an_error_that_says_so(tmp_path):
    """Over a limit on file sizes (EFBIG): what was there stays, and no part is left."""
    path = tmp_path / "file"
    path.write_text("old")

    result = run(FULL, path, 10**6, preexec_fn=limit_file_size)

    assert result.returncode == 1, result.stderr
    assert f"{path}: cannot be written (File too large)" in result.stdout
    assert "ulimit -f" in result.stdout
    assert path.read_text() == "old"
    assert names_in(tmp_path) == ["file"]


@pytest.fixture
def small_disk(tmp_path):
    """Return a file system of 256 KiB, or skip where none may be mounted."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)],
        capture_output=True,
        check=False,
    )
    if mounted.returncode:
        pytest.skip("a small file system cannot be mounted here: it needs root")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_is_an_error_that_says_so(small_disk):
    """ENOSPC for real: the old content stays, the part is removed, and there is room again."""
    path = small_disk / "tracks" / "000000.parquet"
    write_text_whole(path, "old")

    with pytest.raises(StorageError, match="No space left on device") as caught:
        write_whole(path, lambda part: part.write_bytes(bytes(10**6)))

    assert "make room" in caught.value.hint
    assert path.read_text() == "old"
    assert names_in(path.parent) == ["000000.parquet"]
    write_text_whole(path, "x" * 100_000)


def test_what_is_appended_follows_what_was_there(tmp_path):
    """A file that is not there begins with it."""
    path = tmp_path / "log"
    append_bytes(path, b"one")
    append_bytes(path, b"\x00two")
    assert path.read_bytes() == b"one\x00two"


def test_a_file_that_cannot_be_appended_to_is_an_error_that_says_so(tmp_path):
    """A folder stands there; what it holds stays."""
    (tmp_path / "log").mkdir()
    with pytest.raises(StorageError, match="log"):
        append_bytes(tmp_path / "log", b"x")


def test_a_file_in_place_of_a_folder_is_an_error_that_says_so(tmp_path):
    """A folder cannot be made under a file."""
    (tmp_path / "tracks").write_text("a file")

    with pytest.raises(StorageError, match="cannot be written") as caught:
        write_text_whole(tmp_path / "tracks" / "000000.parquet", "x")
    assert "A file stands where a folder is needed" in caught.value.hint


def test_a_folder_in_place_of_the_file_is_an_error(tmp_path):
    """It is not removed."""
    (tmp_path / "file").mkdir()

    with pytest.raises(StorageError, match="cannot be written"):
        write_text_whole(tmp_path / "file", "x")
    assert names_in(tmp_path) == ["file"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_closed_folder_is_an_error(tmp_path):
    """EACCES is named with what to do."""
    tmp_path.chmod(0o500)
    with pytest.raises(StorageError, match="Permission denied"):
        write_text_whole(tmp_path / "file", "x")
    tmp_path.chmod(0o700)


def test_sha256_by_the_standard(tmp_path):
    """The digest of "abc" is the first example of FIPS 180."""
    path = tmp_path / "abc"
    path.write_text("abc")

    assert sha256_of(path) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


@pytest.mark.parametrize("name", ["missing", "folder"])
def test_the_digest_of_what_is_no_file_is_an_error(tmp_path, name):
    """The path is named."""
    (tmp_path / "folder").mkdir()

    with pytest.raises(InputError, match=name):
        sha256_of(tmp_path / name)


def test_storage_errors_end_a_command_with_exit_code_one():
    """As the table of exit codes says."""
    assert issubclass(StorageError, ZfcalError)
    assert StorageError("x").exit_code == 1
