"""Pictures by which a person judges the tracking."""

import math

import cv2
import numpy as np
import pytest

from zfcal.cameras.camera import Homography
from zfcal.cameras.frames import Frame
from zfcal.errors import StorageError
from zfcal.tracking.overlay import OverlayVideo, Painter, Scene, WorstFrames, badness, colour_of
from zfcal.tracks import FISH, ROBOT, AgentPose, FramePoses

GRID = Homography(size_px=(200, 100), matrix=((0.01, 0, 0), (0, -0.01, 1), (0, 0, 1)))


def agent(x_m, y_m, *, number=0, kind=FISH, heading_rad=0.0, confidence=0.95):
    """Return an agent at a place."""
    return AgentPose(
        agent=number, kind=kind, x_m=x_m, y_m=y_m, heading_rad=heading_rad, confidence=confidence
    )


def scene(*agents, number=0, grey=100, bad=()):
    """Return a grey image of 200 x 100 px with these agents."""
    image = np.full((100, 200), grey, np.uint8)
    poses = FramePoses(time_s=number / 15, frame=number, agents=agents)
    frame = Frame(number=number, time_s=number / 15, image=image)
    return Scene(frame=frame, poses=poses, outlines=[], bad=bad)


def painted(image, colour):
    """Return rows and columns of pixels of about a colour: lines have soft edges."""
    return np.argwhere(np.abs(image.astype(int) - colour).sum(axis=2) < 120)


def test_an_agent_is_drawn_in_its_place_and_looks_ahead():
    """At (1.0, 0.5) m, which is pixel (100, 50); ahead is to the right."""
    seen = agent(1.0, 0.5)
    rows, columns = painted(Painter(GRID).paint(scene(seen)), colour_of(seen)).T
    assert (50, 100) in zip(rows, columns, strict=True)
    assert np.max(columns[rows == 50]) > 108
    assert np.min(columns[rows == 50]) > 96


@pytest.mark.parametrize("grey", [True, False])
def test_the_image_itself_is_not_drawn_on(grey):
    """Grey or colour: the tracker's image stays as it was."""
    given = scene(agent(1.0, 0.5))
    if not grey:
        image = cv2.cvtColor(given.frame.image, cv2.COLOR_GRAY2BGR)
        frame = Frame(number=0, time_s=0.0, image=image)
        given = Scene(frame=frame, poses=given.poses, outlines=[], bad=())
    before = given.frame.image.copy()
    drawn = Painter(GRID).paint(given)
    assert np.array_equal(given.frame.image, before)
    assert drawn.shape == (100, 200, 3)


def test_robots_have_a_colour_of_their_own():
    """No fish has it, whatever its id."""
    colours = {colour_of(agent(0, 0, number=n)) for n in range(50)}
    assert colour_of(agent(0, 0, kind=ROBOT)) not in colours


def test_a_guess_is_a_ring():
    """Its middle shows the image."""
    sure, guess = agent(1.0, 0.5), agent(1.0, 0.5, confidence=0.3, heading_rad=math.nan)
    assert tuple(Painter(GRID).paint(scene(sure))[50, 100]) == colour_of(sure)
    assert tuple(Painter(GRID).paint(scene(guess))[50, 100]) == (100, 100, 100)


def test_the_way_of_the_last_two_seconds_is_drawn():
    """And none that is older."""
    painter = Painter(GRID)
    for number in range(60):
        here = scene(agent(0.1 + 0.03 * number, 0.5), number=number)
        painter.follow(here.poses)
    columns = painted(painter.paint(here), colour_of(here.poses.agents[0]))[:, 1]
    # Thirty frames of 3 px before pixel 187.
    assert columns.min() == pytest.approx(97, abs=2)


def test_close_is_the_square_around_the_least_sure_enlarged():
    """The others are not in it."""
    unsure = agent(0.3, 0.6, number=3, confidence=0.2)
    image = Painter(GRID).paint(scene(agent(1.8, 0.5), unsure), close=True)
    assert image.shape == (320, 320, 3)
    assert len(painted(image, colour_of(unsure)))
    assert not len(painted(image, colour_of(agent(0, 0))))


def test_close_without_anybody_is_the_middle():
    """Nothing to look at is no error."""
    assert Painter(GRID).paint(scene(), close=True).shape == (320, 320, 3)


def test_an_agent_outside_the_image_of_a_lens_is_not_drawn():
    """Its pixel is not known."""
    painter = Painter(GRID)
    lost = scene(agent(math.nan, 0.5))
    painter.follow(lost.poses)
    assert painter.paint(lost).shape == (100, 200, 3)


def test_badness_grows_with_what_is_wrong():
    """Nobody missing and all sure is hardly bad; missing agents are worse than guesses."""
    four = [agent(0, 0, number=n, confidence=1.0) for n in range(4)]
    guess = agent(0, 0, number=3, confidence=0.3)
    values = [
        badness(scene(*four).poses, (), 4),
        badness(scene(*four[:3], guess).poses, (), 4),
        badness(scene(*four[:3]).poses, (), 4),
        badness(scene(*four[:3]).poses, ("too few", "merged"), 4),
        badness(scene().poses, (), 4),
    ]
    assert values[0] == 0
    assert values == sorted(values)


def test_the_worst_frame_of_a_second_is_kept():
    """Of ten minutes the twelve worst seconds, the worst first."""
    worst = WorstFrames()
    rng = np.random.default_rng(1)
    bad = rng.uniform(0, 5, 9000)
    for number, value in enumerate(bad):
        if worst.wants(value, number / 15):
            worst.add(value, number / 15, np.full((320, 320, 3), number % 251, np.uint8))
    sheet = worst.sheet()
    assert sheet.shape == (960, 1280, 3)
    by_second = bad.reshape(600, 15)
    best = np.argsort(by_second.max(axis=1))[::-1][:12]
    expected = [second * 15 + by_second[second].argmax() for second in best]
    tiles = [sheet[320 * (k // 4), 320 * (k % 4), 0] for k in range(12)]
    assert tiles == [number % 251 for number in expected]


def test_a_sheet_without_frames_is_none():
    """A frame with which nothing is wrong is not wanted, one with a little is."""
    worst = WorstFrames()
    assert worst.sheet() is None
    assert not worst.wants(0.0, 1.0)
    assert worst.wants(0.1, 1.0)


def test_a_video_appears_when_it_is_closed(tmp_path):
    """Before that there is nothing under its name."""
    path = tmp_path / "pictures" / "o.mp4"
    video = OverlayVideo(path, fps=15.0, size_px=(200, 100))
    for number in range(10):
        video.add(Painter(GRID).paint(scene(number=number)))
    assert not path.exists()
    video.close()
    assert cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT) == 10
    assert list(path.parent.iterdir()) == [path]


def test_a_video_of_an_unknown_kind_is_refused(tmp_path):
    """With the endings that are known."""
    with pytest.raises(StorageError, match="cannot be written as a video") as error:
        OverlayVideo(tmp_path / "o.txt", fps=15.0, size_px=(200, 100))
    assert ".mp4" in error.value.hint
