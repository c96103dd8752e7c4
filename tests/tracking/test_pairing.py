"""The image of another camera that belongs to a moment."""

import numpy as np
import pytest

from zfcal.cameras.stamps import Shot
from zfcal.tracking.pairing import Nearest

IMAGE = np.zeros((2, 2), np.uint8)


def nearest(times_s, **how):
    """Return what pairs with images of these times."""
    shots = iter([Shot(time_s=time_s, image=IMAGE) for time_s in times_s])
    return Nearest(None, shots, **how)


def paired(times_s, wanted_s):
    """Return the times of the images that belong to these; None where none does."""
    images = nearest(times_s)
    found = [images.at(time_s) for time_s in wanted_s]
    return [None if shot is None else shot.time_s for shot in found]


def test_cameras_in_step_pair_image_by_image():
    """Whatever the order of equal times."""
    times = [k / 15 for k in range(40)]
    assert paired(times, times) == times


@pytest.mark.parametrize("shift", [-0.03, -0.01, 0.01, 0.03])
def test_cameras_out_of_step_pair_with_the_nearest(shift):
    """At 15 Hz none is farther than half a period."""
    times = [k / 15 + shift + 1 for k in range(40)]
    assert paired(times, [k / 15 + 1 for k in range(2, 38)]) == times[2:38]


def test_nothing_within_fifty_milliseconds_is_nothing():
    """A gap of the camera below; it pairs again behind it."""
    times = [0.0, 0.1, 0.5, 0.6]
    wanted = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]
    assert paired(times, wanted) == [0.0, 0.1, None, None, None, 0.5, 0.6, None]


def test_an_image_may_belong_to_two_moments():
    """A camera at half the rate."""
    assert paired([0.0, 0.1, 0.2], [0.0, 0.04, 0.08, 0.12]) == [0.0, 0.0, 0.1, 0.1]


def test_every_image_is_recorded_once():
    """In order, those that pair with nothing too."""
    kept = []

    def keep(shot):
        kept.append(shot.time_s)
        return shot

    images = nearest([0.0, 0.01, 0.02, 0.5, 0.6], keep=keep)
    for time_s in (0.02, 0.3, 0.6):
        images.at(time_s)
    assert kept == [0.0, 0.01, 0.02, 0.5, 0.6]


def test_memory_holds_an_image_or_two():
    """However long it runs."""
    images = nearest([k / 15 for k in range(5000)])
    for k in range(5000):
        images.at(k / 15)
        assert len(images._known) <= 2
