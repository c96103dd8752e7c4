"""Frames of known fish are tracked: where they are, who they are, where they head."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.cameras.frames import Frame
from zfcal.errors import InputError
from zfcal.tracking.background import background_of
from zfcal.tracking.seen import METHODS, TrackerOptions
from zfcal.tracking.tracker import FishTracker, follow


@pytest.fixture
def tracker(drawn):
    """Return a tracker of three fish."""
    return FishTracker(TrackerOptions(n_agents=3), drawn.PROJECTION)


def black(number, size=200):
    """Return a frame that shows nothing."""
    return Frame(number=number, time_s=number / 15, image=np.zeros((size, size), np.uint8))


def errors_px(told, bodies):
    """Return how far each sighting is from the nearest body."""
    at = np.array([body[:2] for body in bodies])
    return [float(np.hypot(*(at - (s.x_px, s.y_px)).T).min()) for s in told]


@pytest.mark.parametrize("method", METHODS)
def test_fish_apart_are_found_to_a_third_of_a_pixel_in_every_frame(drawn, method):
    """Three fish on a circle, one id each from the first frame to the last, none beside."""
    paths = drawn.circling(150)
    tracker = FishTracker(TrackerOptions(n_agents=3, method=method), drawn.PROJECTION)

    told = [seen for _, seen in follow(tracker, drawn.frames(paths))]

    errors = [e for seen, bodies in zip(told, paths, strict=True) for e in errors_px(seen, bodies)]
    assert {len(seen) for seen in told} == {3}
    assert {s.agent for seen in told for s in seen} == {0, 1, 2}
    assert np.median(errors) < 0.3
    assert max(errors) < 1.2
    assert tracker.take_bad_frames() == []


def test_headings_point_to_the_head_and_metres_run_up(drawn, tracker):
    """The circle turns clockwise in the image: in metres, y up, the other way."""
    paths = drawn.circling(130)

    *_, (_, seen) = follow(tracker, drawn.frames(paths))

    for s in seen:
        nearest = min(paths[-1], key=lambda b: math.hypot(b[0] - s.x_px, b[1] - s.y_px))
        assert math.cos(s.heading_rad + nearest[2]) > 0.98
        assert s.x_m == pytest.approx(s.x_px * drawn.M_PER_PX)
        assert s.y_m == pytest.approx((drawn.SIZE - s.y_px) * drawn.M_PER_PX)


def test_the_same_frames_give_the_same_tracks(drawn):
    """Nothing is drawn at random."""
    paths = drawn.circling(120, radius=14)

    runs = [
        [
            [(s.agent, s.x_m, s.y_m, s.heading_rad, s.confidence) for s in seen]
            for _, seen in follow(
                FishTracker(TrackerOptions(), drawn.PROJECTION), drawn.frames(paths)
            )
        ]
        for _ in range(2)
    ]

    assert runs[0] == runs[1]


def test_no_frame_is_lost_while_the_background_is_learnt(drawn, tracker):
    """`follow` holds the first hundred back, `step` alone says that there is none yet."""
    paths = drawn.circling(101)
    alone = FishTracker(TrackerOptions(n_agents=3), drawn.PROJECTION)

    numbers = [frame.number for frame, seen in follow(tracker, drawn.frames(paths)) if seen]
    told = [alone.step(frame) for frame in drawn.frames(paths)]

    assert numbers == list(range(101))
    assert [len(seen) for seen in told] == [0] * 100 + [3]
    assert {bad.reason for bad in alone.take_bad_frames()} == {"no background"}


def test_a_clip_shorter_than_the_learning_is_tracked(drawn, tracker):
    """Forty frames: the background is what they show."""
    told = [seen for _, seen in follow(tracker, drawn.frames(drawn.circling(40)))]

    assert [len(seen) for seen in told] == [3] * 40


def test_a_camera_that_shows_nothing_gives_every_frame_and_no_fish(tracker):
    """Black throughout: each frame is given back, empty, with the reason."""
    told = list(follow(tracker, map(black, range(20))))

    assert [(frame.number, seen) for frame, seen in told] == [(k, []) for k in range(20)]
    assert [bad.reason for bad in tracker.take_bad_frames()] == ["no background"] * 20


def test_black_frames_and_other_sizes_are_named_and_ids_outlast_them(drawn, tracker):
    """Three black frames and one of another size: no rows, reasons, the same ids after."""
    frames = list(drawn.frames(drawn.circling(130, turn=0.02)))
    frames[110:113] = [black(k) for k in range(110, 113)]
    frames[120] = black(120, size=64)

    told = [seen for _, seen in follow(tracker, frames)]

    bad = tracker.take_bad_frames()
    assert [(b.number, b.reason) for b in bad] == [
        (110, "black"),
        (111, "black"),
        (112, "black"),
        (120, "size"),
    ]
    assert bad[-1].says == "the image is 64 x 64 px, the background 200 x 200 px"
    assert tracker.take_bad_frames() == []
    assert told[110] == told[120] == []
    assert {s.agent for s in told[-1]} == {0, 1, 2}


def test_light_that_fades_by_a_quarter_changes_nothing(drawn, tracker):
    """The lamp dims after the background was learnt: as many fish, at the same places."""
    paths = drawn.circling(140)
    dimmed = [
        Frame(number=f.number, time_s=f.time_s, image=(f.image * 0.75).astype(np.uint8))
        if f.number >= 120
        else f
        for f in drawn.frames(paths)
    ]

    told = [seen for _, seen in follow(tracker, dimmed)]

    assert [len(seen) for seen in told[115:]] == [3] * 25
    assert max(errors_px(told[-1], paths[-1])) < 0.8


def test_light_fish_in_a_dark_tank_are_tracked_where_that_is_said(drawn):
    """The negative of a film, with polarity="light"."""
    paths = drawn.circling(110)
    tracker = FishTracker(TrackerOptions(n_agents=3, polarity="light"), drawn.PROJECTION)

    told = [seen for _, seen in follow(tracker, drawn.frames(paths, tank=60.0, fish=160.0))]

    assert [len(seen) for seen in told] == [3] * 110
    assert max(errors_px(told[-1], paths[-1])) < 0.8


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_light_fish_are_tracked_as_dark_ones_are_without_a_word(drawn, method):
    """The negative of a film: as sure, and at the same places to a fifth of a pixel."""
    paths = drawn.circling(120)
    dark = list(drawn.frames(paths))
    light = [dataclasses.replace(frame, image=~frame.image) for frame in dark]
    told = []
    for frames, polarity in ((dark, "dark"), (light, "light")):
        tracker = FishTracker(TrackerOptions(n_agents=3, method=method), drawn.PROJECTION)
        told.append([seen for _, seen in follow(tracker, frames)])
        assert tracker.polarity == polarity
        assert tracker.take_bad_frames() == []
    for one, other in zip(*told, strict=True):
        assert len(one) == len(other) == 3
        assert [s.confidence for s in other] == pytest.approx([s.confidence for s in one])
        for a, b in zip(one, other, strict=True):
            assert math.hypot(a.x_px - b.x_px, a.y_px - b.y_px) < 0.2


@pytest.mark.parametrize("negative", [False, True])
def test_fish_two_pixels_wide_are_tracked(drawn, negative):
    """Opening would drop them, and twelve pixels are more than some have."""
    paths, shape = drawn.circling(120), drawn.outline(length=9.0, width=1.5)
    frames = list(drawn.frames(paths, shape=shape, noise=1.0))
    if negative:
        frames = [dataclasses.replace(frame, image=~frame.image) for frame in frames]
    tracker = FishTracker(TrackerOptions(n_agents=3), drawn.PROJECTION)
    told = [seen for _, seen in follow(tracker, frames)]
    assert tracker.min_blob_px < 6
    assert [len(seen) for seen in told] == [3] * 120
    assert max(errors_px(told[-1], paths[-1])) < 1.2


def test_fish_of_both_kinds_are_tracked(drawn):
    """One lighter than the tank, two darker: learnt, and found in every frame."""
    paths = drawn.circling(120)
    rng = np.random.default_rng(0)
    frames = []
    for number, bodies in enumerate(paths):
        clean = 140.0 - 60.0 * drawn.coverage(bodies[:2]) + 60.0 * drawn.coverage(bodies[2:])
        image = np.rint(clean + rng.normal(0, 1.5, clean.shape)).astype(np.uint8)
        frames.append(Frame(number=number, time_s=number / 15, image=image))
    tracker = FishTracker(TrackerOptions(n_agents=3), drawn.PROJECTION)
    told = [seen for _, seen in follow(tracker, frames)]
    assert tracker.polarity == "either"
    assert [len(seen) for seen in told] == [3] * 120
    assert max(errors_px(told[-1], paths[-1])) < 1.2


@pytest.mark.parametrize(("fish", "wrong"), [(160.0, "dark"), (10.0, "light")])
def test_nonsense_is_never_believed(drawn, fish, wrong):
    """The wrong polarity was said: whatever is found, not one position is more than a guess."""
    rng = np.random.default_rng(1)
    paths = [
        [(60 + 20 * math.cos(k / 9), 60 + 20 * math.sin(k / 9), k / 9 + 1.6), (140.0, y, 1.0)]
        for k, y in enumerate(np.linspace(60, 140, 200) + rng.normal(0, 1, 200))
    ]
    options = TrackerOptions(n_agents=2, polarity=wrong)
    tracker = FishTracker(options, drawn.PROJECTION)
    frames = drawn.frames(paths, tank=60.0, fish=fish)
    told = [s.confidence for _, seen in follow(tracker, frames) for s in seen]
    assert tracker.learnt.polarity != tracker.polarity == wrong
    assert max(told, default=0.0) < 0.5


@pytest.mark.parametrize(("n_agents", "reason"), [(2, "unclaimed"), (4, "too few")])
def test_another_number_of_animals_than_was_said_is_named_in_every_frame(drawn, n_agents, reason):
    """Three in the tank; who is told is believed all the same."""
    tracker = FishTracker(TrackerOptions(n_agents=n_agents), drawn.PROJECTION)
    told = [seen for _, seen in follow(tracker, drawn.frames(drawn.circling(120)))]
    bad = {b.number for b in tracker.take_bad_frames() if b.reason == reason}
    assert bad == set(range(120))
    assert min(s.confidence for seen in told[10:] for s in seen) == 1.0


def test_a_fish_that_vanishes_into_another_s_blob_is_forced(drawn):
    """Two tracks, and the blob of one: it is named, until the second one is given up."""
    paths = [[(40.0 + k / 2, 100.0, 0.0), (160.0 - k / 2, 100.0, math.pi)] for k in range(118)]
    paths += [[(99.0, 100.0, 0.0)]] * 6
    tracker = FishTracker(TrackerOptions(n_agents=2), drawn.PROJECTION)
    list(follow(tracker, drawn.frames(paths)))
    bad = {b.number for b in tracker.take_bad_frames() if b.reason == "forced"}
    assert {119, 120, 121} <= bad
    assert min(bad) > 90


@pytest.mark.parametrize("fish", [20.0, 160.0])
def test_a_loaded_background_tells_at_the_first_sight(drawn, fish):
    """Light or dark: the first frame with somebody in it is tracked at once."""
    empty = background_of(drawn.image([], noise=0.0, tank=90.0))
    tracker = FishTracker(TrackerOptions(n_agents=3), drawn.PROJECTION, background=empty)
    paths = [[], [], *drawn.circling(5)]
    told = [tracker.step(frame) for frame in drawn.frames(paths, tank=90.0, fish=fish)]
    assert [len(seen) for seen in told[4:]] == [3] * 3
    assert tracker.polarity == ("dark" if fish < 90 else "light")


def test_with_a_loaded_background_the_first_frame_is_tracked_at_once(drawn):
    """An image of the empty tank makes learning needless."""
    empty = background_of(drawn.image([], noise=0.0))
    tracker = FishTracker(TrackerOptions(n_agents=3), drawn.PROJECTION, background=empty)
    paths = drawn.circling(5)

    told = [tracker.step(frame) for frame in drawn.frames(paths)]

    assert [len(seen) for seen in told] == [3] * 5


def test_what_lies_outside_the_region_is_not_seen(drawn):
    """The right half is masked out: only fish in the left half have rows."""
    region = np.zeros((drawn.SIZE, drawn.SIZE), bool)
    region[:, :100] = True
    tracker = FishTracker(TrackerOptions(), drawn.PROJECTION, region=region)

    told = [seen for _, seen in follow(tracker, drawn.frames(drawn.circling(60)))]

    assert max(s.x_px for seen in told for s in seen) < 101


@pytest.mark.slow
@pytest.mark.parametrize("corner", [0, 64, 96])
@pytest.mark.parametrize("method", METHODS)
def test_a_region_changes_nothing_about_those_within(drawn, method, corner):
    """The same poses as in an image that is cut to the region's surroundings, shifted by these."""
    region = np.zeros((drawn.SIZE, drawn.SIZE), bool)
    region[corner : corner + 100, corner : corner + 100] = True
    path = [[(corner + 50 + 30 * math.cos(k / 9), corner + 50.0, k / 9)] for k in range(120)]
    frames = list(drawn.frames(path, noise=0.6))

    told = []
    for cut in (0, corner // 2):
        part = np.s_[cut:, cut:]
        tracker = FishTracker(TrackerOptions(method=method), drawn.PROJECTION, region=region[part])
        images = [dataclasses.replace(f, image=f.image[part]) for f in frames]
        told.append([(cut, seen) for _, seen in follow(tracker, images)])

    places = [
        [[(round(s.x_px + cut, 6), round(s.y_px + cut, 6)) for s in seen] for cut, seen in each]
        for each in told
    ]
    assert places[0] == places[1]
    assert all(len(seen) == 1 for seen in places[0])


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"method": "hough"}, "A method must be shi-tomasi or silhouette, got 'hough'."),
        ({"n_agents": 0}, "A tracker's n_agents must be at least 1, got 0."),
        ({"min_blob_px": math.nan}, "A tracker's min_blob_px must be positive, got nan."),
        ({"learn_rate": 0.0}, "A tracker's learn_rate must be in (0, 1], got 0.0."),
        ({"coast_s": -1.0}, "A tracker's coast_s must be 0 or more seconds, got -1.0."),
    ],
)
def test_wrong_options_are_named(wrong, says):
    """One clear line each."""
    with pytest.raises(InputError) as caught:
        TrackerOptions(**wrong)
    assert str(caught.value) == says


def test_a_fish_takes_the_id_of_a_hand_that_has_left_and_keeps_it(drawn):
    """Known to be as large as a hand, it would be lost in each frame, for good."""
    paths = drawn.circling(140, turn=0.02)
    empty = drawn.image([], noise=0.0)
    tracker = FishTracker(
        TrackerOptions(n_agents=3), drawn.PROJECTION, background=background_of(empty)
    )

    told = []
    for frame in drawn.frames([bodies[:2] if k < 60 else bodies for k, bodies in enumerate(paths)]):
        if frame.number < 60:
            frame.image[85:115, 85:115] = 70
        told.append(tracker.step(frame))

    assert {len(seen) for seen in told[70:]} == {3}
    assert {s.agent for seen in told[70:] for s in seen} == {0, 1, 2}
    assert len({s.track for seen in told[70:] for s in seen}) == 3
