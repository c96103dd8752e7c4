"""How quick the robot was driven, from the files of its drives."""

import math

import pytest
from mcap.writer import Writer

from zfcal.artifacts.drive_files import LATENCY_KEY
from zfcal.report.driven import Driven, Latency, closed_drives, driven_of, driven_rows
from zfcal.report.gather import gather, input_files
from zfcal.report.numbers import tables
from zfcal.report.page import report_reason, write_report

SAID = {
    "steps_missed": "2",
    "ticks_skipped": "5",
    "pose_to_state_s.n": "900",
    "pose_to_state_s.median": "0.0021",
    "pose_to_state_s.p95": "0.0145",
    "pose_to_state_s.max": "0.3",
}


@pytest.fixture
def write_drive():
    """Return what writes a drive's file that says how quick it was, or is still open."""

    def write(root, start_s, said):
        path = root / "drive" / f"{start_s:06d}.mcap"
        path.parent.mkdir(exist_ok=True)
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start()
            if said is not None:
                writer.add_metadata(LATENCY_KEY, said)
                writer.finish()
        return path

    return write


def test_latencies_by_hand(tmp_path, write_drive):
    """What was not measured is unknown."""
    found = driven_of(120, write_drive(tmp_path, 120, SAID))

    assert found.seeing == Latency(median_s=0.0021, p95_s=0.0145, most_s=0.3)
    assert math.isnan(found.sending.median_s)
    assert (found.start_s, found.steps_missed, found.ticks_skipped) == (120, 2, 5)
    assert list(driven_rows((found,))) == [["120", "2.1", "14.5", "300.0", "–", "–", "–", "2", "5"]]


def test_numbers_that_are_none_are_unknown(tmp_path, write_drive):
    """A word, and what is not finite."""
    said = {"pose_to_state_s.median": "soon", "pose_to_state_s.p95": "inf"}
    found = driven_of(0, write_drive(tmp_path, 0, said))

    assert math.isnan(found.seeing.median_s)
    assert math.isnan(found.seeing.p95_s)
    assert found.steps_missed == 0


def test_a_file_that_still_grows_is_no_part_of_a_report(tmp_path, write_drive):
    """Nor is one that is no such file."""
    write_drive(tmp_path, 0, None)
    (tmp_path / "drive" / "000060.mcap").write_bytes(b"nothing")
    closed = write_drive(tmp_path, 120, SAID)

    assert closed_drives(tmp_path) == {120: closed}


@pytest.mark.usefixtures("quick_model", "quick_pictures")
def test_a_report_has_a_row_for_each_drive(small_trial, write_drive):
    """And is made again when another drive has ended."""
    root = small_trial()
    write_report([root])
    assert "drive" not in [table.name for table in tables(gather(root, print))]
    path = write_drive(root, 120, SAID)
    assert path in input_files(root)
    assert report_reason([root]) == "input drive/000120.mcap is new"

    (table,) = (table for table in tables(gather(root, print)) if table.name == "drive")

    assert [row[0] for row in table.rows] == ["120"]
    assert len(table.heads) == len(table.rows[0]) == len(table.numbers)


def test_no_drive_is_no_row():
    """Nothing is made up."""
    nothing = Driven(
        start_s=0, seeing=Latency(), sending=Latency(), steps_missed=0, ticks_skipped=0
    )

    assert list(driven_rows(())) == []
    assert list(driven_rows((nothing,))) == [["0", *["–"] * 6, "0", "0"]]
