"""What an animal looks like is told by most of them, not by what is largest."""

import numpy as np
import pytest

from zfcal.tracking.blobs import Blob, Shape
from zfcal.tracking.trail import Detection, Trail
from zfcal.tracking.usual import Bodies, Body


def blob(area_px, darkness=0.5, width=5):
    """Return a blob of about as many pixels, as long as it has to be."""
    x, y = np.meshgrid(np.arange(max(area_px // width, 1)), np.arange(width))
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    return Blob(
        pixels=pixels,
        weights=np.ones(len(pixels)),
        shares=np.full(len(pixels), darkness),
        darkness=darkness,
        contour=np.zeros((4, 2), np.int32),
        corners=np.empty((0, 2)),
        box=(0, 0, 1, 1),
    )


@pytest.mark.parametrize("n_fish", [1, 2, 3, 7])
def test_fish_are_not_dropped_for_being_smaller_than_a_robot(n_fish):
    """Twelve times as large as a fish, among one or many."""
    bodies = Bodies()
    bodies.start([[blob(420), *[blob(35)] * n_fish]] * 20, n_fish + 1)
    assert bodies.usual.area_px == pytest.approx(35 if n_fish > 1 else 227.5, abs=1)


def test_what_is_far_smaller_than_animals_is_none():
    """Debris, in frames with more blobs than animals."""
    bodies = Bodies()
    bodies.start([[blob(40), blob(40), blob(5), blob(5), blob(5)]] * 20, 2)
    assert bodies.usual.area_px == 40


def test_of_an_unknown_number_the_large_ones_count():
    """Shadows may be more than half of all blobs."""
    bodies = Bodies()
    bodies.start([[blob(40), blob(40), blob(5), blob(5), blob(5)]] * 20, None)
    assert bodies.usual.area_px == 40


def test_nothing_tells_nothing():
    """It stays unknown."""
    bodies = Bodies()
    bodies.start([[]] * 5, 3)
    assert np.isnan(bodies.usual.area_px)


def test_a_large_animal_that_shares_a_blob_is_no_guess():
    """As large as it is known to be is as large as it should be; at first that is not known."""
    shape = Shape(
        x_px=0.0,
        y_px=0.0,
        axis_rad=0.0,
        head=0.0,
        length_px=60.0,
        width_px=10.0,
        area_px=420.0,
    )
    fish = Body(area_px=35.0, length_px=16.0, darkness=0.5)
    alone = Detection(shape=shape, blob=blob(420))
    trail = Trail(0, alone, 0.0)
    first = trail.confidence(fish)
    for k in range(1, 20):
        trail.update(alone, k / 15)
    trail.update(Detection(shape=shape, blob=blob(450), shared=2), 20 / 15)
    assert first < 0.6
    assert trail.confidence(fish) == pytest.approx(0.7)
