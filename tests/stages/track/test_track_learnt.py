"""What a run learns of its animals: told, kept, taken up again, and what it counts by it."""

import json
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from zfcal.artifacts.frame_files import FrameWriter
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import read_extra, read_tracks, write_tracks
from zfcal.cameras.video import encoded
from zfcal.stages.camera.rig import CameraChoice
from zfcal.stages.events import Note, Result, say_nothing
from zfcal.stages.init import NewTrial, create_trial
from zfcal.stages.track.learnt import as_before, learnt_before
from zfcal.stages.track.plan import TrackOptions
from zfcal.stages.track.track import track
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracks import concatenate, tracks_of

FPS = 5.0
CORNERS = ((-0.5, 199.5), (199.5, 199.5), (199.5, -0.5), (-0.5, -0.5))
N = 320


@pytest.fixture(scope="module")
def images(drawn_tank):
    """Return images of three light bodies that go round a dark tank for 64 s."""
    once = drawn_tank.circling(120, turn=2 * math.pi / 120)
    drawn = [f.image for f in drawn_tank.frames(once, tank=60.0, fish=160.0)]
    return [drawn[k % 120] for k in range(N)]


@pytest.fixture(scope="module")
def film(tmp_path_factory, images):
    """Return them as a video without loss."""
    path = tmp_path_factory.mktemp("film") / "night.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), FPS, (200, 200), False)
    for image in images:
        writer.write(image)
    writer.release()
    return path


@pytest.fixture
def new(tmp_path):
    """Return what makes a trial of some fish in a square of 0.4 m."""

    def make(name="trial", n_fish=3):
        settings = NewTrial(n_fish=n_fish, fps=FPS, side_m=0.4, dt_s=0.4)
        create_trial(tmp_path / name, settings, say_nothing)
        return tmp_path / name

    return make


def tracked(root, source, **options):
    """Track, and return the notes and the numbers."""
    heard = []
    overhead = CameraChoice(source=str(source), corners_px=CORNERS)
    asked = TrackOptions(overhead=overhead, tracker=TrackerOptions(**options))
    track(root, asked, heard.append)
    (result,) = [event.value for event in heard if isinstance(event, Result)]
    return [event for event in heard if isinstance(event, Note)], result


def extras(root):
    """Return what each segment keeps of what was learnt."""
    return [read_extra(path)["learnt"] for path in sorted((root / "tracks").glob("*.parquet"))]


@pytest.mark.slow
def test_light_animals_need_no_word(new, film):
    """They are learnt, told, and kept with both segments."""
    root = new()
    notes, result = tracked(root, film)
    learnt = result["learnt"]
    assert (learnt["polarity"], learnt["polarity_from"]) == ("light", "film")
    assert learnt["light_share"] > 0.99
    assert (result["exact"], result["as_many_rows"], result["guesses"]) == (N, N, 0)
    assert extras(root) == [learnt, learnt]
    assert any("lighter than the tank (as the film shows)" in note.text for note in notes)
    assert not any(note.warning for note in notes)
    assert any("100.0% of them with exactly 3 animals seen" in note.text for note in notes)


@pytest.mark.slow
def test_a_word_against_the_film_wins_with_a_warning_and_is_not_believed(new, film):
    """No frame counts, no position is more than a guess."""
    root = new()
    notes, result = tracked(root, film, polarity="dark")
    warned = " ".join(note.text for note in notes if note.warning)
    assert "--dark was given, but the film shows animals that are lighter than the tank" in warned
    assert (result["learnt"]["polarity"], result["learnt"]["polarity_from"]) == ("dark", "option")
    assert result["exact"] == 0
    paths = sorted((root / "tracks").glob("*.parquet"))
    confidence = concatenate([read_tracks(path) for path in paths]).confidence
    assert np.all(confidence < 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("n_fish", [2, 4])
def test_frames_count_only_if_as_many_are_there(new, film, n_fish):
    """One more or one fewer in the tank than was said."""
    _, result = tracked(new(n_fish=n_fish), film)
    assert result["exact"] == 0


def test_an_empty_tank_has_no_exact_frame(new, drawn_tank, tmp_path):
    """Nobody, and a warning that the film does not tell what animals are."""
    folder = tmp_path / "images"
    folder.mkdir()
    for frame in drawn_tank.frames([[]] * 120, noise=5.0):
        cv2.imwrite(str(folder / f"{frame.number}.png"), frame.image)
    root = new()
    notes, result = tracked(root, folder)
    assert result["exact"] == 0
    assert np.all(read_tracks(root / "tracks" / "000000.parquet").confidence < 0.5)
    assert any("do not show whether" in note.text for note in notes if note.warning)


@pytest.mark.slow
def test_segments_that_arrive_one_by_one_give_what_the_video_gives(new, film, images, tmp_path):
    """The same is learnt from the first minute as from both, and all rows are the same."""
    folder = tmp_path / "overhead"
    for start in (0, 300):
        writer = FrameWriter(folder / f"{start // 5:06d}.mcap", "overhead")
        for k in range(start, min(start + 300, N)):
            writer.add(k / FPS, encoded(images[k], "png"))
        writer.close()
        root = new(f"until-{start}")
        tracked(root, folder)
    whole = new("whole")
    tracked(whole, film)
    assert extras(root) == extras(whole)
    assert extras(tmp_path / "until-0") == extras(whole)[:1]
    first, one, other = (
        concatenate([read_tracks(path) for path in sorted((r / "tracks").glob("*.parquet"))])
        for r in (tmp_path / "until-0", root, whole)
    )
    for column in ("frame", "agent", "x_m", "y_m", "heading_rad", "confidence"):
        assert np.array_equal(getattr(one, column), getattr(other, column)), column
        begun = getattr(one, column)[: len(first)]
        assert np.array_equal(getattr(first, column), begun), column


def test_a_recording_that_goes_on_takes_what_the_segment_before_knew(new):
    """What a person says now comes first."""
    root = new()
    assert learnt_before(root) is None
    lineage = Lineage(schema="zfcal.tracks/1", command="track")
    for start, polarity in ((0, "dark"), (60, "light")):
        extra = {"learnt": {"polarity": polarity, "min_blob_px": 17.5}}
        path = root / "tracks" / f"{start:06d}.parquet"
        write_tracks(path, tracks_of([]), lineage, extra=extra)
    before = learnt_before(root)
    taken = as_before(TrackerOptions(n_agents=3), before)
    assert (taken.polarity, taken.min_blob_px) == ("light", 17.5)
    said = TrackerOptions(n_agents=3, polarity="dark", min_blob_px=5.0)
    assert as_before(said, before) == said
    assert as_before(said, None) == said
    damaged = json.loads('{"polarity": "green", "min_blob_px": null}')
    assert as_before(replace(said, polarity=None), damaged).polarity is None
