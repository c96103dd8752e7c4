"""A minute's files are closed once the poses of the next frame are out, and never forgotten."""

import dataclasses

import pytest

from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.pose_files import PoseWriter, read_poses
from zfcal.artifacts.pose_messages import POSES
from zfcal.artifacts.tables import TRACKS, read_extra, read_tracks
from zfcal.stages.events import LeftOut, Made, UpToDate, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.track.minutes import NEXT_KEY, Minutes, Origins, unfinished
from zfcal.stages.trial_context import Task, open_trial
from zfcal.tracks import FISH, AgentPose, FramePoses

FPS = 5.0


def frame(number):
    """Return the poses of one fish."""
    fish = AgentPose(
        agent=0, kind=FISH, x_m=0.1 + 1e-3 * number, y_m=0.2, heading_rad=0.0, confidence=1.0
    )
    return FramePoses(time_s=number / FPS, frame=number, agents=(fish,))


@pytest.fixture
def root(tmp_path):
    """Return a trial of one fish."""
    create_trial(tmp_path / "trial", NewTrial(n_fish=1, fps=FPS, side_m=1.0), say_nothing)
    return tmp_path / "trial"


@pytest.fixture
def minutes(root, heard):
    """Return what writes the files of a live camera, or of a recording."""

    def make(*, is_live=True):
        lineage = Lineage(schema=TRACKS, command="track")
        poses = dataclasses.replace(lineage, schema=POSES)
        origins = Origins(tracks=lineage, poses=poses, is_live=is_live)
        return Minutes(open_trial(root), origins, lambda _: {}, heard.append, task=Task(force=True))

    return make


def add(minutes, numbers, *, is_urgent=True):
    """Add frames, the first id that is free being the frame's number."""
    for number in numbers:
        minutes.add(frame(number), next_agent=number, is_urgent=is_urgent)


def segment(root, start_s=0):
    """Return the path of a segment."""
    return root / "tracks" / f"{start_s:06d}.parquet"


def test_poses_are_out_before_the_minute_before_is_closed(root, minutes):
    """The first pose of the second minute can be read while the first has no tracks yet."""
    live = minutes()
    add(live, range(301))

    assert [p.frame for p in read_poses(root / "poses" / "000060.mcap")] == [300]
    assert not segment(root).exists()
    live.close_passed()
    assert read_tracks(segment(root)).frame.tolist() == list(range(300))
    live.finish(60.2)


def test_without_urgency_the_minute_before_is_closed_first(root, minutes):
    """Its segment is there as soon as the frame of the next has been added."""
    written = minutes(is_live=False)
    add(written, range(301), is_urgent=False)

    assert len(read_tracks(segment(root))) == 300
    written.finish(60.2)


def test_a_segment_states_the_ids_of_its_own_minute(root, minutes):
    """Those of the frame that was added before it was closed are none of them."""
    live = minutes()
    add(live, range(301))
    live.close_passed()
    live.finish(60.2)

    assert [read_extra(segment(root, start_s))[NEXT_KEY] for start_s in (0, 60)] == [299, 300]


def test_a_minute_that_nobody_closed_is_closed_by_the_next(root, minutes, heard):
    """Each segment is told before the poses of its minute, in order, and once."""
    live = minutes()
    add(live, range(0, 901, 50))
    live.finish(180.2)

    made = [event.path.relative_to(root).as_posix() for event in heard if isinstance(event, Made)]
    assert made == [
        name
        for start_s in (0, 60, 120, 180)
        for name in (f"tracks/{start_s:06d}.parquet", f"poses/{start_s:06d}.mcap")
    ]


@pytest.mark.parametrize("is_live", [True, False])
def test_a_minute_that_passed_is_whole_after_an_interruption(root, minutes, is_live):
    """Of the next one a camera keeps the part that there is, a recording nothing but poses."""
    written = minutes(is_live=is_live)
    add(written, range(301))
    written.interrupt(60.2)

    assert len(read_tracks(segment(root))) == 300
    assert segment(root, 60).exists() == is_live
    assert len(list(read_poses(root / "poses" / "000060.mcap"))) == 1


def test_closing_what_has_not_passed_does_nothing(root, minutes):
    """Neither before the first frame nor within a minute."""
    live = minutes()
    live.close_passed()
    add(live, range(10))
    live.close_passed()

    assert not segment(root).exists()
    live.finish(2.0)
    assert len(read_tracks(segment(root))) == 10


@pytest.mark.parametrize(("folder", "ending"), [("tracks", ".parquet"), ("poses", ".mcap")])
def test_a_minute_one_of_whose_files_has_no_place_has_the_other(
    root, minutes, heard, folder, ending
):
    """A folder stands there: that file is left out and told once, the minutes go on."""
    taken = root / folder / f"000060{ending}"
    taken.mkdir(parents=True)
    live = minutes()
    add(live, range(0, 901, 50))
    live.finish(180.2)

    made = {event.path.relative_to(root).as_posix() for event in heard if isinstance(event, Made)}
    wanted = {f"tracks/{k:06d}.parquet" for k in (0, 60, 120, 180)}
    wanted |= {f"poses/{k:06d}.mcap" for k in (0, 60, 120, 180)}
    assert made == wanted - {f"{folder}/{taken.name}"}
    (left_out,) = [event for event in heard if isinstance(event, LeftOut)]
    assert left_out.path == taken
    assert not [event for event in heard if isinstance(event, UpToDate)]


def test_what_an_interrupted_minute_holds_behind_a_bad_frame_is_kept(root, heard):
    """A frame that is none and a fish that is none are left out, and the file is named once."""
    path = root / "poses" / "000000.mcap"
    far = dataclasses.replace(frame(1).agents[0], agent=1, x_m=1e308)
    beside = dataclasses.replace(frame(1), agents=(*frame(1).agents, far))
    late = dataclasses.replace(frame(2), time_s=500.0)
    with PoseWriter(path, Lineage(schema=POSES, command="track")) as writer:
        for poses in (frame(0), beside, late, frame(3)):
            writer.add(poses)

    assert unfinished(root, heard.append, also=0) == {0: [frame(0), frame(1), frame(3)]}
    (left_out,) = [event for event in heard if isinstance(event, LeftOut)]
    assert left_out.path == path
    assert "in frame 1 agent 1 has no pose" in left_out.problem
