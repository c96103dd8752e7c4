"""Drawn film with what is no fish in it: hands, a large light object, a big robot.

Film of the rig's look, through the tracker as it is; the same again as a negative.
"""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.cameras.frames import Frame
from zfcal.cameras.rig import overhead_camera
from zfcal.tracking.region import region_of
from zfcal.tracking.seen import TrackerOptions
from zfcal.tracking.tracker import FishTracker, follow
from zfcal.tracks import FISH, ROBOT, Tracks
from zfcal.virtual.images.look import look_of
from zfcal.virtual.images.render import OverheadPainter
from zfcal.virtual.images.swimming import swimming

FPS, N, N_FISH = 15.0, 240, 4
LATE = 170
"""Frames after which everybody is found again: the tank is learnt in 100, a ghost gone in 60."""

ARENA = load_arena("open-square", Path())
CAMERA = overhead_camera(ARENA)
WHITE, DARK = 235, 20


def wandering(seed):
    """Return tracks of four fish, and of a robot as the last, that keep away from the walls."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = ARENA.outline.bounds
    middle, reach = np.array([(x0 + x1) / 2, (y0 + y1) / 2]), 0.36 * (x1 - x0)
    agents = []
    for _ in range(N_FISH + 1):
        place, heading = middle + rng.uniform(-0.7, 0.7, 2) * reach, rng.uniform(-math.pi, math.pi)
        rows = []
        for _ in range(N):
            if np.hypot(*(place - middle)) > reach:
                away = math.atan2(*(middle - place)[::-1]) - heading
                heading += 0.3 * math.sin(away) + 0.05
            heading += rng.normal(0, 0.1)
            place = place + 0.1 / FPS * np.array([math.cos(heading), math.sin(heading)])
            rows.append((*place, math.remainder(heading, math.tau)))
        agents.append(rows)
    x, y, heading = np.array(agents).transpose(1, 0, 2).reshape(-1, 3).T
    agent = np.tile(np.arange(N_FISH + 1, dtype=np.int32), N)
    frame = np.repeat(np.arange(N), N_FISH + 1)
    return Tracks(
        time_s=frame / FPS,
        frame=frame,
        agent=agent,
        kind=np.where(agent == N_FISH, ROBOT, FISH).astype(np.int8),
        x_m=x,
        y_m=y,
        heading_rad=heading.astype(np.float32),
        confidence=np.ones(len(frame), np.float32),
    )


@pytest.fixture(scope="module")
def film():
    """Return what draws a film: its images, and where everybody is, (frame, agent, xy), metres."""
    made = {}

    def draw(*, seed=21, robot_mm=None):
        if (seed, robot_mm) not in made:
            look = look_of("usual", {"lure_length_m": (robot_mm or 45) / 1e3, "jpeg_quality": None})
            tracks = wandering(seed)
            if robot_mm is None:
                tracks = tracks.take(tracks.kind == FISH)
            swum = swimming(tracks, look, fps=FPS, seed=seed)
            painter = OverheadPainter(ARENA, CAMERA, look, seed=seed)
            made[seed, robot_mm] = [painter.paint(swum.at(k)) for k in range(N)], swum.xy_m
        images, xy_m = made[seed, robot_mm]
        return [image.copy() for image in images], xy_m

    return draw


def put(images, first, last, draw):
    """Draw something over some images, with a camera's noise."""
    rng = np.random.default_rng(1)
    for k in range(first, min(last, len(images))):
        over = images[k].copy()
        draw(over, k)
        noise = np.rint(rng.normal(0, 2, over.shape))
        noisy = np.clip(over + noise, 0, 255).astype(np.uint8)
        images[k] = np.where(over != images[k], noisy, images[k])


def hand(grey, *, moves=False):
    """Return what draws a hand and its arm, which may stir the water."""

    def draw(image, k):
        size = image.shape[0]
        x, y = 0.4 * size, 0.45 * size
        if moves:
            x, y = x + 0.1 * size * math.sin(k / 8), y + 0.1 * size * math.cos(k / 11)
        cv2.ellipse(image, (int(x), int(y)), (size // 8, size // 12), 20, 0, 360, grey, -1)
        cv2.line(image, (int(x), int(y)), (int(x), 0), grey, size // 13)

    return draw


def disc(grey, share):
    """Return what draws a disc that lies in the tank."""

    def draw(image, _):
        size = image.shape[0]
        cv2.circle(image, (int(0.55 * size), int(0.5 * size)), int(share * size), grey, -1)

    return draw


def tracked(images, n_agents, *, negative=False):
    """Return the tracker and what it tells of each frame."""
    tracker = FishTracker(
        TrackerOptions(n_agents=n_agents), CAMERA, region=region_of(ARENA, CAMERA)
    )
    frames = [
        Frame(number=k, time_s=k / FPS, image=~image if negative else image)
        for k, image in enumerate(images)
    ]
    return tracker, [seen for _, seen in follow(tracker, frames)]


def found(told, xy_m, first, *, hides=lambda px: np.zeros(len(px), bool)):
    """Return the share of animals that are found within 15 mm, from a frame on."""
    hits = []
    for seen, real in zip(told[first:], xy_m[first:], strict=True):
        real = real[~hides(np.asarray(CAMERA.to_pixels(real)))]  # noqa: PLW2901
        at = np.array([(s.x_m, s.y_m) for s in seen]).reshape(-1, 2)
        away = np.hypot(*(at[:, None] - real[None]).transpose(2, 0, 1))
        hits += (away.min(axis=0, initial=1.0) < 0.015).tolist()
    return float(np.mean(hits))


@pytest.mark.slow
@pytest.mark.parametrize("negative", [False, True])
@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("grey", [WHITE, DARK])
@pytest.mark.parametrize("last", [60, 100])
def test_a_hand_in_the_first_frames_is_forgotten(film, last, grey, moves, negative):
    """For most of the time in which the tank is learnt or all of it; still or not."""
    images, xy_m = film()
    put(images, 0, last, hand(grey, moves=moves))
    tracker, told = tracked(images, N_FISH, negative=negative)
    assert tracker.polarity == ("light" if negative else "dark")
    assert found(told, xy_m, LATE) > 0.97


@pytest.mark.slow
@pytest.mark.parametrize("negative", [False, True])
@pytest.mark.parametrize(("first", "last"), [(0, 50), (0, 100), (30, 70), (0, N)])
def test_a_large_light_object_turns_no_polarity_round(film, first, last, negative):
    """Ten times as long as a fish: there at first, for a while, all the time. Dark in the negative.

    It stands over the fish that it covers.
    """
    images, xy_m = film()
    put(images, first, last, disc(WHITE, 0.12))
    tracker, told = tracked(images, N_FISH, negative=negative)
    size = images[0].shape[0]
    middle = np.array([0.55, 0.5]) * size

    def hides(px):
        there = last > LATE
        return (np.hypot(*(px - middle).T) < 0.14 * size) & there

    assert tracker.polarity == ("light" if negative else "dark")
    assert tracker.min_blob_px < 20
    assert found(told, xy_m, LATE, hides=hides) > 0.97


@pytest.mark.slow
@pytest.mark.parametrize("negative", [False, True])
@pytest.mark.parametrize("robot_mm", [45, 100])
def test_fish_beside_a_big_robot_are_found(film, robot_mm, negative):
    """Of their size and nearly three times as long; it is one of those who are counted."""
    images, xy_m = film(robot_mm=robot_mm)
    tracker, told = tracked(images, N_FISH + 1, negative=negative)
    assert tracker.polarity == ("light" if negative else "dark")
    assert tracker.min_blob_px < 20
    assert found(told, xy_m, 0) > 0.97
    known = [seen for seen in told if len(seen) == N_FISH + 1]
    believed = [min(s.confidence for s in seen) >= 0.5 for seen in known]
    assert np.mean(believed) * len(known) / len(told) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("robot_mm", [45, 160])
def test_a_robot_that_nobody_told_of_hides_no_fish(film, robot_mm):
    """One blob more than animals: the fish are not dropped for being smaller."""
    images, xy_m = film(robot_mm=robot_mm)
    _, told = tracked(images, N_FISH)
    assert found(told, xy_m[:, :N_FISH], 0) > 0.7
