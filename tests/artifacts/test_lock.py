"""Two commands of one name never work on one trial at a time."""

import os
import signal
import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor

import pytest

from zfcal.artifacts.lock import lock
from zfcal.errors import LockedError, StorageError

HOLDER = """
    import sys, time
    from pathlib import Path
    from zfcal.artifacts.lock import lock

    with lock(Path(sys.argv[1]), sys.argv[2]):
        print("held", flush=True)
        time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """Return a process that holds the lock of analyse."""
    command = [sys.executable, "-c", textwrap.dedent(HOLDER), str(tmp_path), "analyse"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_the_second_of_one_command_is_refused(tmp_path, holder):
    """With the exit code of a temporary failure (EX_TEMPFAIL of sysexits.h is 75)."""
    with (
        pytest.raises(LockedError, match="another zfcal analyse is at work") as caught,
        lock(tmp_path, "analyse"),
    ):
        pytest.fail("the lock was held by another process")
    assert str(tmp_path) in str(caught.value)
    assert caught.value.exit_code == 75
    assert "Wait" in caught.value.hint


def test_another_command_goes_on(tmp_path, holder):
    """Calibrate runs beside analyse."""
    with lock(tmp_path, "calibrate"):
        pass


def test_the_lock_of_a_killed_process_is_free_at_once(tmp_path, holder):
    """The operating system frees it; no file has to be removed."""
    holder.send_signal(signal.SIGKILL)
    holder.wait()

    with lock(tmp_path, "analyse"):
        pass


def test_a_lock_is_freed_after_use_and_after_an_error(tmp_path):
    """It can be taken again in the same process."""
    with pytest.raises(ZeroDivisionError), lock(tmp_path, "analyse"):
        raise ZeroDivisionError
    with lock(tmp_path, "analyse"), lock(tmp_path, "track"):
        pass


def test_one_process_does_not_take_a_lock_twice(tmp_path):
    """A lock is held by an open file, not by a process."""
    with (
        lock(tmp_path, "analyse"),
        pytest.raises(LockedError),
        lock(tmp_path, "analyse"),
    ):
        pytest.fail("the lock was held")


def test_the_lock_file_says_nothing(tmp_path):
    """No process number that could be stale: its existence means nothing."""
    with lock(tmp_path, "analyse"):
        assert (tmp_path / ".lock-analyse").read_bytes() == b""
    with lock(tmp_path, "analyse"):
        pass


def test_a_place_that_cannot_be_locked_is_an_error(tmp_path):
    """Such as a trial that is not there."""
    with pytest.raises(StorageError, match="No such file"), lock(tmp_path / "x", "analyse"):
        pytest.fail("there is no such folder")
    # One that was moved away just now does not come into being again where it was.
    assert not (tmp_path / "x").exists()


def test_the_lock_file_stays_when_it_is_free(tmp_path):
    """Two processes never hold locks on two files of one name."""
    with lock(tmp_path, "analyse"):
        before = (tmp_path / ".lock-analyse").stat().st_ino
    with lock(tmp_path, "analyse"):
        pass
    assert (tmp_path / ".lock-analyse").stat().st_ino == before


def test_a_lock_file_with_content_and_one_that_is_a_pipe_lock_as_well(tmp_path):
    """What stands there is neither emptied nor waited for."""
    (tmp_path / ".lock-analyse").write_bytes(b"from elsewhere")
    os.mkfifo(tmp_path / ".lock-track")
    for command in ("analyse", "track"):
        with (
            lock(tmp_path, command),
            pytest.raises(LockedError),
            lock(tmp_path, command),
        ):
            pytest.fail("the lock was held")
    assert (tmp_path / ".lock-analyse").read_bytes() == b"from elsewhere"


def test_a_link_in_place_of_the_lock_file_is_refused(tmp_path):
    """The file would come into being wherever it leads."""
    (tmp_path / ".lock-analyse").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StorageError), lock(tmp_path, "analyse"):
        pytest.fail("a link was followed")
    assert not (tmp_path / "elsewhere").exists()


def test_another_thread_may_free_a_lock_and_none_may_take_it_before(tmp_path):
    """A lock is the trial's, whichever thread asks."""
    held = lock(tmp_path, "analyse")
    held.__enter__()

    def again():
        with lock(tmp_path, "analyse"):
            pass

    with ThreadPoolExecutor(1) as other:
        with pytest.raises(LockedError):
            other.submit(again).result()
        other.submit(held.__exit__, None, None, None).result()
    again()


FORKING = """
    import os, sys, time
    from pathlib import Path
    from zfcal.artifacts.lock import lock

    with lock(Path(sys.argv[1]), "analyse"):
        if not os.fork():
            print(os.getpid(), flush=True)  # By now the fork has let go of what it inherited.
        time.sleep(60)
"""


def test_a_fork_does_not_hold_the_lock_of_the_one_that_was_killed(tmp_path):
    """The lock is that of the process that took it, and dies with it."""
    command = [sys.executable, "-c", textwrap.dedent(FORKING), str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    child = int(process.stdout.readline())
    try:
        with pytest.raises(LockedError), lock(tmp_path, "analyse"):
            pytest.fail("the lock was held")
        process.kill()
        process.wait()

        os.kill(child, 0)
        with lock(tmp_path, "analyse"):
            pass
    finally:
        process.kill()
        process.wait()
        os.kill(child, signal.SIGKILL)
        process.stdout.close()
