"""A robot seen by two cameras: clocks, turn and shift."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zfcal.cameras.alignment import Spots, align_spots
from zfcal.cameras.camera import Homography
from zfcal.cameras.registering import move, register
from zfcal.errors import InputError

FPS = 15.0


def path(rng, time_s, speed_m_s):
    """Return a wandering path of a metre's tank."""
    place, heading = rng.uniform(0.3, 0.7, 2), rng.uniform(-math.pi, math.pi)
    rows = np.empty((len(time_s), 2))
    for row, at in zip(rows, time_s, strict=True):
        away = np.array([0.5, 0.5]) - place
        if np.hypot(*away) > 0.38:
            heading += 0.25 * math.sin(math.atan2(away[1], away[0]) - heading)
        heading += rng.normal(0, 0.12)
        step = speed_m_s * (1 + 0.5 * math.sin(at)) / 60
        place = place + step * np.array([math.cos(heading), math.sin(heading)])
        row[:] = place
    return rows


def turned(xy, angle):
    """Return points turned counter-clockwise about the origin."""
    cos, sin = math.cos(angle), math.sin(angle)
    return xy @ np.array([[cos, sin], [-sin, cos]])


def seen(seed, *, offset_s=0.0, angle=0.0, shift=(0.0, 0.0), n_fish=3, noise_m=0.001, long_s=30):
    """Return blobs overhead and the robot below, whose frame and clock are off."""
    rng = np.random.default_rng(seed)
    fine = np.arange(-4, long_s + 4, 1 / 60)
    robot, *fish = [path(rng, fine, speed) for speed in (0.12, *(0.08,) * n_fish)]

    def at(xy, time_s):
        return np.column_stack([np.interp(time_s, fine, xy[:, i]) for i in (0, 1)])

    frames = np.arange(0, long_s, 1 / FPS)
    times, places = [], []
    for xy in (robot, *fish):
        kept = rng.random(len(frames)) > 0.1
        times.append(frames[kept])
        places.append(at(xy, frames[kept]) + rng.normal(0, noise_m, (kept.sum(), 2)))
    order = np.argsort(np.concatenate(times), kind="stable")
    overhead = Spots(time_s=np.concatenate(times)[order], xy_m=np.concatenate(places)[order])
    clock = np.arange(0, long_s, 1 / FPS) + 0.02
    clock = clock[rng.random(len(clock)) > 0.1]
    truth = at(robot, clock + offset_s)
    below = turned(truth - shift, -angle) + rng.normal(0, noise_m, truth.shape)
    return overhead, Spots(time_s=clock, xy_m=below)


@pytest.mark.parametrize("seed", range(3))
def test_clock_turn_and_shift_are_found(seed):
    """Among fish, with a tenth of the frames lost and a millimetre of noise."""
    known = {"offset_s": 0.13, "angle": 0.03, "shift": (0.02, -0.035)}
    found = align_spots(*seen(seed, **known))
    assert found.offset_s == pytest.approx(0.13, abs=0.005)
    assert found.angle_rad == pytest.approx(0.03, abs=0.002)
    np.testing.assert_allclose(found.shift_m, known["shift"], atol=0.001)
    assert found.share > 0.85
    assert np.median(np.hypot(*found.residual_m.T)) < 0.002
    assert np.median(np.hypot(*found.held_out_m.T)) < 0.0022
    assert np.median(np.hypot(*found.before_m.T)) > 0.01


@given(
    angle=st.floats(-math.pi, math.pi),
    x=st.floats(-1, 1),
    y=st.floats(-1, 1),
    offset_s=st.floats(-1.9, 1.9),
)
@settings(max_examples=4)
def test_no_first_guess_is_needed(angle, x, y, offset_s):
    """Whatever the turn, the shift and the clock: the same positions come out."""
    overhead, below = seen(5, angle=angle, shift=(x, y), offset_s=offset_s, n_fish=1)
    found = align_spots(overhead, below)
    assert found.offset_s == pytest.approx(offset_s, abs=0.01)
    away = (found.angle_rad - angle + math.pi) % (2 * math.pi) - math.pi
    assert abs(away) < 0.005
    np.testing.assert_allclose(
        found.moved(below.xy_m), turned(below.xy_m, angle) + np.array([x, y]), atol=0.003
    )


def test_without_noise_it_is_exact():
    """But for the corners that a line between two frames cuts: a quarter of a millimetre."""
    found = align_spots(*seen(1, offset_s=0.1, angle=0.2, noise_m=0.0, n_fish=0))
    assert found.offset_s == pytest.approx(0.1, abs=5e-4)
    assert found.angle_rad == pytest.approx(0.2, abs=2e-4)


def test_lost_positions_are_left_out():
    """NaN on either side changes nothing."""
    overhead, below = seen(2, angle=0.05)
    lost = Spots(
        time_s=np.append(below.time_s, below.time_s[-1]),
        xy_m=np.vstack([below.xy_m, [[np.nan, 0.0]]]),
    )
    assert align_spots(overhead, lost).angle_rad == align_spots(overhead, below).angle_rad


@pytest.mark.slow
def test_a_mirrored_camera_is_told_as_such():
    """No turn brings a mirror image onto the picture."""
    overhead, below = seen(3)
    mirrored = Spots(time_s=below.time_s, xy_m=below.xy_m * [1.0, -1.0])
    with pytest.raises(InputError, match="calibrated mirrored"):
        align_spots(overhead, mirrored)


@pytest.mark.slow
def test_another_recording_does_not_fit():
    """Fish of one, the robot of another: nothing is found rather than anything."""
    overhead, _ = seen(4)
    _, below = seen(6)
    with pytest.raises(InputError, match="is not among the blobs overhead"):
        align_spots(overhead, below)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda o, b: (o, Spots(time_s=b.time_s, xy_m=0.01 * b.xy_m)), "moved over"),
        (lambda o, b: (o, Spots(time_s=b.time_s + 100, xy_m=b.xy_m)), "together for 0.0 s"),
        (lambda o, b: (o, Spots(time_s=b.time_s[:5], xy_m=b.xy_m[:5])), "below saw .* 5 frames"),
        (lambda o, b: (Spots(time_s=o.time_s[:5], xy_m=o.xy_m[:5]), b), "overhead saw .* 5 frames"),
    ],
)
def test_too_little_to_go_by_is_refused(change, says):
    """A robot that stands, clocks far apart, hardly a frame."""
    with pytest.raises(InputError, match=says):
        align_spots(*change(*seen(1)))


@pytest.mark.parametrize(
    ("time_s", "xy_m"), [([0.0, 1.0], np.zeros((1, 2))), ([1.0, 0.0], np.zeros((2, 2)))]
)
def test_spots_must_be_in_order(time_s, xy_m):
    """As many times as positions, and never falling."""
    with pytest.raises(InputError):
        Spots(time_s=np.array(time_s), xy_m=xy_m)


@pytest.mark.parametrize("name", ["overhead", "below", "flat"])
def test_a_moved_camera_sees_everything_turned_and_shifted(rig, name):
    """The same pixel, the place turned and shifted; a homography too."""
    flat = Homography(size_px=(500, 500), matrix=((0.002, 0, 0), (0, -0.002, 1), (0, 0, 1)))
    camera = {**rig.cameras, "flat": flat}[name]
    px = np.array([[200.0, 220.0], [300.0, 260.0]])
    moved = move(camera, 0.3, np.array([0.1, -0.2]))
    np.testing.assert_allclose(
        moved.to_metres(px), turned(camera.to_metres(px), 0.3) + np.array([0.1, -0.2]), atol=1e-9
    )


def test_leds_below_the_plane_want_a_new_pose(rig):
    """Shining 3 cm nearer to the camera they are seen larger: a turn and a shift will not do."""
    overhead, below = seen(1, noise_m=0.0005)
    true = rig.below
    nearer = move(true, 0.02, np.array([0.01, 0.0]))
    lowered = nearer.translation_m[2] - 0.03
    lower = type(true).of(
        true.lens, np.array(true.rotation_rad), np.array([*true.translation_m[:2], lowered])
    )
    px = lower.to_pixels(below.xy_m)
    spots = Spots(time_s=below.time_s, xy_m=nearer.to_metres(px))
    found = register(nearer, align_spots(overhead, spots))
    assert found.method == "pose"
    errors_mm = 1000 * np.hypot(*(found.camera.to_metres(px) - below.xy_m).T)
    assert np.nanmedian(errors_mm) < 0.6


def test_what_is_only_turned_and_shifted_keeps_its_pose(rig):
    """A new pose foretells no better."""
    overhead, below = seen(2, noise_m=0.001)
    off = move(rig.below, 0.02, np.array([0.01, 0.0]))
    spots = Spots(time_s=below.time_s, xy_m=off.to_metres(rig.below.to_pixels(below.xy_m)))
    found = register(off, align_spots(overhead, spots))
    assert found.method == "turn and shift"
    np.testing.assert_allclose(found.camera.translation_m, rig.below.translation_m, atol=0.002)
