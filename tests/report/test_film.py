"""The film of fish and model: what is where, in both kinds, the same every time."""

from io import BytesIO

import cv2
import numpy as np
import pytest
from PIL import Image

from zfcal.behaviour.located import locate
from zfcal.errors import InputError
from zfcal.report.figures import theme
from zfcal.report.film import Side, film_of, frames_of
from zfcal.report.options import ReportOptions
from zfcal.report.page import report_reason, write_report


@pytest.fixture
def sides(arenas, wander):
    """Return two halves of a film of 20 samples, the second begun later."""

    def make(name="two-rooms", **company):
        arena = arenas[name]
        parts = [
            locate(wander(arena, n_samples=20, seed=seed, first_k=k, **company), arena)
            for seed, k in ((1, 600), (2, 0))
        ]
        return (
            Side(title="Measured", colour=theme.FISH, located=parts[0]),
            Side(title="Model", colour=theme.MODEL, located=parts[1]),
        )

    return make


def has(frame, colour):
    """Whether a frame has enough of a colour for an animal."""
    bgr = [int(colour[at : at + 2], 16) for at in (5, 3, 1)]
    return (frame == bgr).all(axis=-1).sum() > 40


def test_each_half_has_its_animals(sides):
    """Fish of the one colour on the left, of the other on the right, a robot on both."""
    frames = list(frames_of(sides()))

    assert len(frames) == 20
    left, right = np.hsplit(frames[5], 2)
    assert has(left, theme.FISH)
    assert not has(left, theme.MODEL)
    assert has(right, theme.MODEL)
    assert not has(right, theme.FISH)
    assert has(left, theme.ROBOT)
    assert has(right, theme.ROBOT)


def test_an_animal_is_where_it_was_seen(arenas, wander):
    """At x = 0.25 m and y = 0.75 m of a tank of 1 m: a quarter across, a quarter down."""
    arena = arenas["open-square"]
    samples = wander(arena, n=1, n_samples=3, robot=False)
    samples.xy_m[:, 0] = (0.25, 0.75)
    side = Side(title="", colour=theme.FISH, located=locate(samples, arena))
    left, _ = np.hsplit(next(frames_of((side, side))), 2)
    rows, columns = np.nonzero((left == (0x7A, 0x49, 0x16)).all(axis=-1))

    # A margin of a twentieth on each side of 480 pixels; the tank begins below 44.
    assert columns.mean() == pytest.approx((0.25 + 0.05) / 1.1 * 480, abs=1.5)
    assert rows.mean() == pytest.approx((0.25 + 0.05) / 1.1 * 480 + 44, abs=1.5)


def test_who_was_lost_is_not_drawn(arenas, wander):
    """In the sample in which nobody was seen there is only the way."""
    arena = arenas["open-square"]
    samples = wander(arena, n=1, n_samples=20, robot=False)
    samples.xy_m[2:18] = np.nan
    side = Side(title="", colour=theme.FISH, located=locate(samples, arena))
    seen = [has(frame, theme.FISH) for frame in frames_of((side, side))]

    assert seen[1]
    assert not seen[12]
    assert seen[18]


@pytest.mark.parametrize("name", ["two-rooms", "ring", "narrow"])
def test_an_mp4_has_every_sample_five_times_as_fast(sides, tmp_path, name):
    """20 samples of 0.2 s at 25 a second, of even sides."""
    path = tmp_path / "film.mp4"
    path.write_bytes(film_of(sides(name), "mp4"))
    film = cv2.VideoCapture(str(path))

    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 20
    assert film.get(cv2.CAP_PROP_FPS) == pytest.approx(25)
    assert film.get(cv2.CAP_PROP_FRAME_HEIGHT) % 2 == 0
    assert film.read()[1].shape[1] == 960


def test_a_gif_has_every_other_sample(sides):
    """10 pictures of 80 ms, again and again."""
    film = Image.open(BytesIO(film_of(sides(), "gif")))

    assert film.n_frames == 10
    assert film.info["duration"] == 80
    assert film.info["loop"] == 0


@pytest.mark.parametrize("kind", ["mp4", "gif"])
def test_a_film_is_the_same_every_time(sides, kind):
    """Nothing of the day is in it."""
    assert film_of(sides(), kind) == film_of(sides(), kind)


@pytest.mark.slow
@pytest.mark.usefixtures("quick_model", "quick_pictures")
def test_a_film_is_a_part_of_the_report(small_trial, monkeypatch, two_rooms, wander):
    """It is up to date with it, and goes where it is no longer asked for."""
    model = locate(wander(two_rooms, n_samples=20), two_rooms)
    monkeypatch.setattr("zfcal.report.simulated.window_run", lambda *_: model)
    root, how = small_trial(), ReportOptions(film="gif")
    film = root / "report" / "film.gif"

    assert film in write_report([root], how=how)
    assert Image.open(film).n_frames == 10
    assert report_reason([root], how=how) is None
    assert report_reason([root]) is not None
    write_report([root])
    assert not film.exists()


@pytest.mark.usefixtures("quick_model", "quick_pictures")
def test_what_cannot_be_filmed_is_refused_before_anything_is_written(small_trial, tmp_path):
    """Neither several trials nor one without a model."""
    roots = [small_trial("one"), small_trial("two", calibrated=False)]
    how = ReportOptions(film="mp4")

    with pytest.raises(InputError, match="of one trial, got 2"):
        write_report(roots, tmp_path / "out", how=how)
    with pytest.raises(InputError, match="beside the calibrated model") as caught:
        write_report(roots[1:], how=how)
    assert caught.value.hint == "Make them first: zfcal calibrate two"
    assert not (tmp_path / "out").exists()
    assert not (roots[1] / "report").exists()
