"""Which of two images has an edge where they differ."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.tracking.ghosts import Piece, step_across, without_step

BOX = np.s_[10:20, 12:30]


def plain(grey=120):
    """Return an even image."""
    return np.full((40, 50), grey, np.uint8)


def piece_of(mask):
    """Return a mask as one piece with surroundings a pixel apart, two wide."""
    around = np.zeros_like(mask)
    around[7:23, 9:33] = True
    around[9:21, 11:31] = False
    return Piece(np.s_[:, :], mask, around, 1)


def masked():
    """Return a mask that holds one box."""
    mask = np.zeros((40, 50), bool)
    mask[BOX] = True
    return mask


@given(shade=st.integers(-60, 60))
def test_a_step_is_the_difference_at_the_border(shade):
    """By hand: an even image with an even box, darker or lighter."""
    image = plain()
    image[BOX] = 120 + shade
    assert step_across(image, piece_of(masked())) == pytest.approx(abs(shade), abs=1e-3)


def test_a_slope_of_light_and_a_wall_through_the_piece_are_no_steps():
    """Each place is compared with what is beside it, not the piece with all around it."""
    slope = np.tile(np.linspace(60, 200, 50).astype(np.uint8), (40, 1))
    wall = plain()
    wall[:, 25:] = 220
    assert step_across(slope, piece_of(masked())) < 2
    assert step_across(wall, piece_of(masked())) < 2


def test_the_inside_of_a_piece_does_not_matter():
    """A fish that swims over a ghost changes nothing that is far from its border."""
    image = plain()
    image[14:16, 16:26] = 10
    there = step_across(image, piece_of(masked()))
    image[BOX] = 60
    assert there < 15 < step_across(image, piece_of(masked()))


@given(shade=st.integers(20, 90), light=st.booleans())
def test_of_two_images_the_one_without_an_edge_is_smoother(shade, light):
    """Whatever the shade; in the other order nothing is found; alike, nothing either."""
    one, other = plain(), plain()
    other[BOX] = 120 + shade if light else 120 - shade
    mask = masked().astype(np.uint8)
    np.testing.assert_array_equal(without_step(mask, one, other), masked())
    assert not without_step(mask, other, one).any()
    assert not without_step(mask, one, one).any()


def test_each_piece_is_told_by_itself():
    """A hand that was in the one image and a fish that sat in the other."""
    one, other, mask = plain(), plain(), masked()
    other[BOX] = 220
    one[30:33, 20:40] = 40
    mask[30:33, 20:40] = True
    np.testing.assert_array_equal(without_step(mask.astype(np.uint8), one, other), masked())


def test_surroundings_that_are_not_asked_for_tell_nothing():
    """Beyond the border of a region neither image is to be believed."""
    one, other = plain(), plain()
    other[BOX] = 60
    # Outside, both hold what would make the right one look wrong.
    one[:, :12] = other[:, :12] = one[:, 30:] = other[:, 30:] = 60
    one[20:] = other[20:] = one[:10] = other[:10] = 60
    one[7:10, 12:30] = other[7:10, 12:30] = 120
    mask = masked().astype(np.uint8)
    where = np.zeros((40, 50), bool)
    where[:20, 12:30] = True
    assert without_step(mask, one, other, where=where).any()
    assert not without_step(mask, one, other).any()
    assert not without_step(mask, one, other, where=masked()).any()
