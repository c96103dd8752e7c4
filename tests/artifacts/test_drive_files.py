"""The log of a drive as a file: whole chunks, each of them once."""

import contextlib
import resource

import pytest

from zfcal.artifacts.drive_files import DRIVE, DriveWriter, read_drive
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.mcap_files import overview
from zfcal.errors import StorageError

LINEAGE = Lineage(schema=DRIVE, command="drive")


def pose(number):
    """Return what is logged of a frame."""
    place = {"x_m": 0.1, "y_m": 0.2, "heading_rad": 0.3}
    return {"what": "pose", "time_s": number / 15, "frame": number, "agents": 4} | place


def put(writer, items):
    """Write items as one chunk."""
    for item in items:
        writer.add(item)
    writer.flush()


@contextlib.contextmanager
def room_for(n_bytes):
    """Let no file of this process grow beyond a length, as on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_what_a_full_disk_kept_out_is_there_once_afterwards(tmp_path):
    """Wherever it is full, in chunk or index: what is written again is there once."""
    items = [pose(number) for number in range(60)]
    with contextlib.closing(DriveWriter(tmp_path / "whole.mcap", LINEAGE)) as writer:
        put(writer, items[:30])
        begins = writer.path.stat().st_size
        put(writer, items[30:])
        ends = writer.path.stat().st_size
    assert ends > begins + 500
    for limit in range(begins, ends, 7):
        path = tmp_path / f"{limit}.mcap"
        writer = DriveWriter(path, LINEAGE)
        put(writer, items[:30])
        with room_for(limit):
            with pytest.raises(StorageError):
                put(writer, items[30:])
            writer.abandon()
        assert list(read_drive(path)) == items[:30]
        again = DriveWriter(path, LINEAGE)
        put(again, items[30:])
        again.close()
        assert list(read_drive(path)) == items
        assert overview(path).whole


def test_a_file_that_cannot_be_taken_up_stays_as_it_is(tmp_path):
    """The disk is full before its copy is whole: nothing of it is cut off."""
    path = tmp_path / "000000.mcap"
    with contextlib.closing(DriveWriter(path, LINEAGE)) as writer:
        put(writer, [pose(number) for number in range(30)])
    before = path.read_bytes()
    with room_for(len(before) // 4), pytest.raises(StorageError):
        DriveWriter(path, LINEAGE)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
