"""What grows frame by frame, followed: poses, targets and faults."""

from contextlib import closing
from pathlib import Path

from zfcal.view.live import Live


def descriptors():
    """Return the descriptors that this process has open."""
    return {path.name for path in Path("/proc/self/fd").iterdir()}


def test_the_newest_frame_comes_and_the_next_minute_follows(empty, made):
    """Nothing new is None; a file that is closed gives way to the next one."""
    live = Live(empty)
    assert live.poll() is None
    with made["poses"](empty, 0) as writer:
        writer.add(made["poses_at"](0.0))
        writer.add(made["poses_at"](0.2))
        found = live.poll()
        assert found["time_s"] == 0.2
        assert [row[:2] for row in found["agents"]] == [[0, "fish"], [1, "fish"], [2, "robot"]]
        assert live.poll() is None
    with made["poses"](empty, 60) as writer:
        writer.add(made["poses_at"](60.0))
        assert live.poll()["time_s"] == 60.0


def test_no_file_stays_open(empty, made):
    """Between looks the descriptors are those of before."""
    live = Live(empty)
    with made["poses"](empty, 0) as writer, closing(made["drive"](empty, 0)) as drive:
        before = descriptors()
        writer.add(made["poses_at"](0.0))
        drive.add(made["target"](0.0, 0.5, 0.5))
        drive.flush()
        assert live.poll()["time_s"] == 0.0
        assert descriptors() == before


def test_a_target_is_shown_while_it_is_new(empty, made):
    """Not two seconds later, when the driver has gone."""
    live = Live(empty)
    with made["poses"](empty, 0) as writer, closing(made["drive"](empty, 0)) as drive:
        drive.add(made["target"](0.1, 0.25, 0.75))
        drive.flush()
        writer.add(made["poses_at"](0.2))
        assert live.poll()["target"] == [0.25, 0.75]
        writer.add(made["poses_at"](3.0))
        assert live.poll()["target"] is None


def test_faults_of_all_minutes_are_told_once(empty, made):
    """Also where a driver that was killed goes on in a new file of the same name."""
    live = Live(empty)
    with closing(made["drive"](empty, 0)) as drive:
        drive.add(made["fault"](10.0))
    with closing(made["drive"](empty, 60)) as drive:
        for time_s in (61.0, 62.0, 63.0):
            drive.add(made["fault"](time_s))
            drive.flush()
            live.poll()
        assert [fault["time_s"] for fault in live.faults] == [10.0, 61.0, 62.0, 63.0]
    with closing(made["drive"](empty, 60)) as drive:
        drive.add(made["fault"](70.0, ended=True))
        drive.flush()
        live.poll()
    found = [(fault["time_s"], fault["ended"]) for fault in live.faults]
    assert found == [(10.0, False), (61.0, False), (62.0, False), (63.0, False), (70.0, True)]


def test_what_is_no_file_of_poses_hides_no_good_one(empty, made):
    """It is passed over, and so is a damaged log."""
    (empty / "poses").mkdir()
    (empty / "poses" / "000000.mcap").write_bytes(b"not this")
    (empty / "drive").mkdir()
    (empty / "drive" / "000000.mcap").write_bytes(b"nor this")
    live = Live(empty)
    live.poll()
    with made["poses"](empty, 60) as writer:
        writer.add(made["poses_at"](60.0))
        assert live.poll()["time_s"] == 60.0
