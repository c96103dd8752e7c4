"""Images that were cut short are tracked as far as they go, and nobody is left to guess."""

import math

import pytest

from zfcal.artifacts.frame_files import FrameWriter
from zfcal.artifacts.tables import read_extra, read_tracks
from zfcal.cameras.live import ArrivalClock
from zfcal.cameras.video import encoded
from zfcal.stages.camera.rig import CameraChoice
from zfcal.stages.camera.sources import source_of
from zfcal.stages.events import LeftOut, Made, Note, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.track.plan import TrackOptions
from zfcal.stages.track.track import track

FPS = 5.0
CORNERS = ((-0.5, 199.5), (199.5, 199.5), (199.5, -0.5), (-0.5, -0.5))


@pytest.fixture(scope="module")
def images(drawn_tank):
    """Return 28 s of three bodies, drawn."""
    paths = drawn_tank.circling(140, turn=2 * math.pi / 140)
    return [encoded(frame.image, "png") for frame in drawn_tank.frames(paths)]


@pytest.fixture
def frames(tmp_path, images):
    """Return a folder of two minutes, of which the first is cut at about 14 s."""
    folder = tmp_path / "frames"
    for start_s in (0, 60):
        with FrameWriter(folder / f"{start_s:06d}.mcap", "overhead") as writer:
            for number, image in enumerate(images):
                writer.add(start_s + number / FPS, image)
    path = folder / "000000.mcap"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    return folder


@pytest.fixture
def tracked(tmp_path, frames):
    """Return what tracks a stretch of them: the trial's directory, and what was told."""
    root = tmp_path / "trial"
    create_trial(root, NewTrial(n_fish=3, fps=FPS, side_m=0.4, dt_s=0.4), say_nothing)

    def run(**options):
        heard = []
        overhead = CameraChoice(source=str(frames), corners_px=CORNERS)
        track(root, TrackOptions(overhead=overhead, **options), heard.append)
        return root, heard

    return run


def left_out(heard):
    """Return the sentences on what was left out."""
    return [event.problem for event in heard if isinstance(event, LeftOut)]


def test_a_stretch_whose_images_are_cut_is_named_and_so_the_second_time(tracked, frames):
    """Reading stops at the images of the next minute: the cut has been told by then.

    The second run does nothing, and says what the tracks lack.
    """
    root, heard = tracked(duration_s=25.0)

    (problem,) = left_out(heard)
    assert problem.startswith(f"{frames / '000000.mcap'}: the file ends in the middle")
    assert "bytes are lost" in problem
    path = root / "tracks" / "000000.parquet"
    assert read_tracks(path).time_s[-1] < 15
    (lacks,) = read_extra(path)["lacks"]
    assert lacks.startswith("overhead: 000000.mcap: the file ends")
    _, again = tracked(duration_s=25.0)
    assert not [event for event in again if isinstance(event, Made | LeftOut)]
    (note,) = [event for event in again if isinstance(event, Note)]
    assert note.warning
    assert note.text == f"{path}: was tracked without what cannot be read. {lacks}"


@pytest.mark.parametrize("stretch", [{"duration_s": 8.0}, {"start_s": 60.0, "duration_s": 8.0}])
def test_a_stretch_before_or_behind_the_cut_lacks_nothing(tracked, stretch):
    """Nobody needs to copy anything again for it."""
    root, heard = tracked(**stretch)

    assert left_out(heard) == []
    (path,) = (root / "tracks").glob("*.parquet")
    assert "lacks" not in read_extra(path)
    assert [event.text for event in tracked(**stretch)[1] if isinstance(event, Note)] == []


def test_each_file_that_is_damaged_is_named(frames):
    """Not the last of them alone, and before the images of the next."""
    path = frames / "000060.mcap"
    path.write_bytes(path.read_bytes()[:-3000])
    source = source_of(str(frames), fps=FPS, clock=ArrivalClock())

    for shot in source.shots():
        assert len(source.problems) == (shot.time_s >= 60)

    first, last = source.problems
    assert (str(frames / "000000.mcap"), 60.0) == (first.says.partition(": ")[0], first.end_s)
    assert (str(path), math.inf) == (last.says.partition(": ")[0], last.end_s)
