"""The robot by its two LEDs: position, heading without flips, and which blob overhead it is."""

import math

import cv2
import numpy as np
import pytest

from zfcal.cameras.camera import Camera, Homography
from zfcal.cameras.frames import Frame
from zfcal.errors import InputError
from zfcal.tracking.robot import (
    Front,
    LedOptions,
    RobotFinder,
    RobotSeen,
    led_blobs,
    nearest_blob,
)

FPS = 15.0
GREEN = (30, 255, 20)
HALF_M = 0.015
NOISE = np.random.default_rng(1).normal(0, 6, (480, 640, 3)).clip(0).astype(np.uint8)

FISHEYE = Camera(
    size_px=(640, 480),
    model="fisheye",
    matrix=((300, 0, 320), (0, 300, 240), (0, 0, 1)),
    distortion=(-0.01, 0.003, 0, 0),
    rotation_rad=(0.01, -0.02, 0.03),
    translation_m=(-0.5, -0.5, 0.6),
)
FLAT = Homography(size_px=(640, 480), matrix=((0.002, 0, 0), (0, 0.002, 0), (0, 0, 1)))


def leds(xy_m, heading_rad):
    """Return where the LEDs of a robot are."""
    axis = np.array([math.cos(heading_rad), math.sin(heading_rad)])
    return np.array([xy_m + HALF_M * axis, xy_m - HALF_M * axis])


def picture(places_m, camera=FISHEYE, *, colour=GREEN, seed=1):
    """Return a dim image from below with a light at each place, with camera noise of 6 greys."""
    image = np.full((480, 640, 3), 25, np.uint8)
    for x, y in camera.to_pixels(np.asarray(places_m)):
        # Drawn eight times as large, so that places between pixels count.
        left, top = int(x) - 12, int(y) - 12
        patch = image[top : top + 24, left : left + 24]
        big = cv2.resize(patch, (192, 192), interpolation=cv2.INTER_NEAREST)
        place = (round((x - left + 0.5) * 8 - 0.5), round((y - top + 0.5) * 8 - 0.5))
        cv2.circle(big, place, 20, colour, -1, cv2.LINE_AA)
        cv2.circle(big, place, 8, (255, 255, 255), -1, cv2.LINE_AA)
        patch[:] = cv2.resize(big, (24, 24), interpolation=cv2.INTER_AREA)
    return cv2.add(image, np.roll(NOISE, 7919 * seed, axis=0))


def drive(steps, *, camera=FISHEYE, seed=1):
    """Return what a finder says of a robot that is at these places, with these headings."""
    finder = RobotFinder(LedOptions(), camera)
    return [
        finder.step(
            Frame(number=k, time_s=k / FPS, image=picture(leds(xy, heading), camera, seed=seed + k))
        )
        for k, (xy, heading) in enumerate(steps)
    ]


def circle(n, *, radius_m=0.25, speed_m_s=0.12, backwards=False):
    """Return places and headings of a robot on a circle, forwards or backwards."""
    turn = np.arange(n) / FPS * speed_m_s / radius_m
    places = 0.5 + radius_m * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return list(zip(places, turn + math.pi / 2 + math.pi * backwards, strict=True))


def away(one, other):
    """Return the angle between two directions."""
    return abs((one - other + math.pi) % (2 * math.pi) - math.pi)


def test_a_robot_on_a_circle_is_found_within_a_millimetre_and_never_flips():
    """All the way round, in every part of a fish-eye image that the circle reaches."""
    steps = circle(120, speed_m_s=0.2)
    seen = drive(steps)
    error_m = [math.dist((s.x_m, s.y_m), xy) for s, (xy, _) in zip(seen, steps, strict=True)]
    assert np.median(error_m) < 0.0005
    assert max(error_m) < 0.0015
    told = [
        away(s.heading_rad, heading)
        for s, (_, heading) in zip(seen, steps, strict=True)
        if math.isfinite(s.heading_rad)
    ]
    assert len(told) >= 118
    assert max(told) < math.radians(10)


def test_the_front_is_not_told_before_the_robot_moves():
    """NaN, not a guess; the position is known all the same."""
    seen = drive([((0.5, 0.5), 1.0)] * 5)
    assert all(math.isnan(s.heading_rad) for s in seen)
    assert all(math.dist((s.x_m, s.y_m), (0.5, 0.5)) < 0.001 for s in seen)


def test_driving_back_a_little_does_not_turn_the_front():
    """Five centimetres back off a wall, after as many forwards, are no reason."""
    forwards = [((0.3 + 0.004 * k, 0.5), 0.0) for k in range(13)]
    back = [((0.348 - 0.004 * k, 0.5), 0.0) for k in range(13)]
    seen = drive(forwards + back)
    assert max(away(s.heading_rad, 0.0) for s in seen[6:]) < math.radians(10)


def test_a_front_that_was_told_wrong_is_overruled_by_a_long_way():
    """Whoever was pushed backwards first and then drives a quarter of a metre looks ahead."""
    pushed = [((0.5 + 0.004 * k, 0.5), math.pi) for k in range(5)]
    driven = [((0.516 - 0.008 * k, 0.5), math.pi) for k in range(1, 32)]
    seen = drive(pushed + driven)
    assert away(seen[4].heading_rad, 0.0) < 0.2
    assert away(seen[-1].heading_rad, math.pi) < 0.2
    flips = np.abs(np.diff([math.cos(s.heading_rad) for s in seen[4:]])) > 1
    assert flips.sum() == 1


def test_a_robot_that_spins_keeps_its_front():
    """Two full turns on the spot, 8 degrees a frame, after it had driven."""
    drove = [((0.4 + 0.005 * k, 0.5), 0.0) for k in range(6)]
    spun = [((0.425, 0.5), math.radians(8 * k)) for k in range(1, 91)]
    seen = drive(drove + spun)
    errors = [away(s.heading_rad, heading) for s, (_, heading) in zip(seen[6:], spun, strict=True)]
    assert max(errors) < math.radians(12)


def test_one_led_is_a_position_without_heading():
    """That of the LED, and no LED is a robot that is lost."""
    finder = RobotFinder(LedOptions(), FISHEYE)
    place = np.array([[0.52, 0.47]])
    one = finder.step(Frame(number=0, time_s=0.0, image=picture(place)))
    none = finder.step(Frame(number=1, time_s=1 / FPS, image=picture(np.empty((0, 2)))))
    assert math.dist((one.x_m, one.y_m), place[0]) < 0.001
    assert math.isnan(one.heading_rad)
    assert len(one.leds_px) == 1
    assert none.is_lost
    assert math.isnan(none.x_m)


def test_a_bright_spot_far_away_is_no_led():
    """Two lights as far apart as the LEDs are, not the brightest two."""
    places = np.vstack([leds((0.6, 0.6), 0.5), [(0.2, 0.3)]])
    image = picture(places)
    spot = np.rint(FISHEYE.to_pixels(places[2])).astype(int).tolist()
    cv2.circle(image, spot, 8, GREEN, -1)
    seen = RobotFinder(LedOptions(), FISHEYE).step(Frame(number=0, time_s=0.0, image=image))
    assert math.dist((seen.x_m, seen.y_m), (0.6, 0.6)) < 0.001
    assert len(seen.leds_px) == 2


def test_nothing_is_looked_for_outside_the_mask():
    """A lamp beside the tank is not seen."""
    mask = np.full((480, 640), 255, np.uint8)
    mask[:, :320] = 0
    image = picture([(0.25, 0.5), (0.75, 0.5)])
    assert len(led_blobs(image, LedOptions())) == 2
    (found,) = led_blobs(image, LedOptions(), mask=mask)
    assert found[0] > 320


@pytest.mark.parametrize(
    ("colour", "hue", "found"),
    [
        (GREEN, 120, 1),
        (GREEN, 240, 0),
        ((255, 40, 20), 235, 1),
        ((20, 20, 255), 0, 1),
        ((20, 20, 255), 355, 1),
        ((20, 20, 255), 5, 1),
        (GREEN, None, 1),
    ],
)
def test_the_colour_counts_where_it_is_given(colour, hue, found):
    """Red lies on both sides of nought."""
    image = picture([(0.5, 0.5)], colour=colour)
    assert len(led_blobs(image, LedOptions(hue_deg=hue))) == found


def test_a_grey_camera_goes_by_brightness():
    """Positions are the same."""
    image = cv2.cvtColor(picture([(0.5, 0.5)]), cv2.COLOR_BGR2GRAY)
    (found,) = led_blobs(image, LedOptions())
    np.testing.assert_allclose(found, FISHEYE.to_pixels(np.array([0.5, 0.5])), atol=0.3)


@pytest.mark.parametrize("options", [{"hue_deg": 400.0}, {"hue_deg": math.nan}, {"blur_px": 4}])
def test_what_no_led_can_look_like_is_refused(options):
    """With the value."""
    with pytest.raises(InputError, match="got"):
        LedOptions(**options)


def seen_at(x_m, y_m, time_s=1.0):
    """Return a robot that was seen there."""
    return RobotSeen(
        time_s=time_s, x_m=x_m, y_m=y_m, heading_rad=0.0, leds_px=((0.0, 0.0), (1.0, 0.0))
    )


@pytest.mark.parametrize(
    ("robot", "which"),
    [
        (seen_at(0.50, 0.50), 1),
        (seen_at(0.545, 0.50), 1),
        (seen_at(0.56, 0.50), None),
        (seen_at(0.11, 0.10), 0),
        (seen_at(0.50, 0.50, 1.05), 1),
        (seen_at(0.50, 0.50, 0.94), None),
        (RobotSeen(time_s=1.0, x_m=math.nan, y_m=math.nan, heading_rad=math.nan, leds_px=()), None),
    ],
)
def test_the_nearest_blob_within_five_centimetres_and_fifty_milliseconds_is_the_robot(robot, which):
    """Of two blobs, half a metre apart; farther or later, none is."""
    blobs = np.array([[0.1, 0.1], [0.5, 0.5]])
    assert nearest_blob(robot, blobs, 1.0) == which


def test_without_blobs_nothing_is_the_robot():
    """Nobody was seen overhead."""
    assert nearest_blob(seen_at(0, 0), np.empty((0, 2)), 1.0) is None


def test_a_robot_that_was_lost_for_long_has_its_front_told_anew():
    """It may have been turned round by hand."""
    front = Front()
    for k in range(10):
        front.step(k / FPS, np.array([0.01 * k, 0.0]), 0.0)
    assert front.step(10 / FPS, np.array([0.1, 0.0]), 0.0) == pytest.approx(0.0)
    assert math.isnan(front.step(5.0, np.array([0.1, 0.0]), 0.0))
    for k in range(1, 4):
        heading = front.step(5.0 + k / FPS, np.array([0.1 - 0.01 * k, 0.0]), 0.0)
    assert away(heading, math.pi) < 1e-9


@pytest.mark.parametrize("with_mask", [True, False])
def test_looking_where_it_is_bright_finds_what_looking_everywhere_does(with_mask):
    """A light in a corner of the image makes it look everywhere: the others stay where they are."""
    mask = np.full((480, 640), 255, np.uint8) if with_mask else None
    some = picture([(0.5, 0.5), (0.53, 0.5), (0.2, 0.7)])
    corners = some.copy()
    for place in ((2, 2), (637, 477)):
        cv2.circle(corners, place, 2, GREEN, -1)
    few = led_blobs(some, LedOptions(), mask=mask)
    all_of_them = led_blobs(corners, LedOptions(), mask=mask)
    assert len(few) == 3
    away = np.linalg.norm(few[:, None] - all_of_them[None], axis=2)
    assert (away.min(axis=1) < 1e-6).all()


def test_an_image_without_any_light_has_no_blobs():
    """Quickly, too."""
    assert led_blobs(np.full((480, 640, 3), 60, np.uint8), LedOptions()).shape == (0, 2)


def wandering(seed, *, n=600, sharp=0.05):
    """Return places and headings of a robot that turns as sharply as a fish, every third image.

    Some turns, a share of them, are any; the others are small. It drives 5 mm from image to image.
    """
    rng = np.random.default_rng(seed)
    turns = np.where(
        rng.random(n) < sharp, rng.uniform(-math.pi, math.pi, n), rng.normal(0.0, 0.3, n)
    )
    heading = np.cumsum(np.where(np.arange(n) % 3 == 0, turns, 0.0))
    steps = 0.005 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return np.cumsum(steps, axis=0), heading


@pytest.mark.parametrize("seed", range(4))
def test_a_robot_that_turns_as_sharply_as_a_fish_has_its_front_told_soon(seed):
    """With LEDs right to 0.3 mm and axes to 2 degrees the other end is told in 2 % of images."""
    rng = np.random.default_rng(seed)
    places, headings = wandering(seed)
    seen_m = places + rng.normal(0.0, 3e-4, places.shape)
    axes = headings + rng.normal(0.0, 0.03, len(headings)) + math.pi * rng.integers(0, 2, 600)
    front = Front()

    told = [
        front.step(k / FPS, xy, (axis + math.pi) % (2 * math.pi) - math.pi)
        for k, (xy, axis) in enumerate(zip(seen_m, axes, strict=True))
    ]

    off = np.array([away(one, other) for one, other in zip(told, headings, strict=True)])
    assert np.isfinite(off).mean() > 0.99
    assert np.mean(off > math.pi / 2) < 0.02


def test_a_robot_that_stops_and_backs_off_by_eight_centimetres_keeps_its_front():
    """It stands for a third of a second, drives back; after 25 cm it has turned."""
    front = Front()
    x_m = np.concatenate([0.005 * np.arange(40), np.full(5, 0.195), 0.195 - 0.005 * np.arange(60)])

    told = [front.step(k / FPS, np.array([x, 0.0]), 0.0) for k, x in enumerate(x_m)]

    assert max(away(heading, 0.0) for heading in told[5 : 45 + 16]) < 1e-9
    assert away(told[-1], math.pi) < 1e-9
