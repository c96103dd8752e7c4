"""The empty tank is learnt from frames with fish in them, or taken from an image."""

import cv2
import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.tracking.background import (
    BackgroundLearner,
    background_of,
    grey_of,
    shows_nothing,
)


def learnt(images, **how):
    """Return the background of some images."""
    learner = BackgroundLearner(n_frames=len(images))
    for image in images:
        learner.add(image)
    return learner.freeze(**how)


def test_what_is_read_off_the_frozen_mixture_is_what_it_calls_background(drawn):
    """Pixel by pixel the same as OpenCV's own answer, for greys about the tank's."""
    rng = np.random.default_rng(1)
    images = [drawn.image([], rng=rng, size=60) for _ in range(40)]
    mixture = cv2.createBackgroundSubtractorMOG2(history=40, varThreshold=16.0, detectShadows=False)
    mixture.setBackgroundRatio(0.5)
    for number, image in enumerate(images):
        mixture.apply(image, None, 0.05 if number else 1.0)

    background = learnt(images)

    for away in (-30, -9, -5, 0, 5, 9, 30):
        probe = np.clip(background.level.astype(int) + away, 0, 255).astype(np.uint8)
        asked = mixture.apply(probe, None, 0.0) == 0
        read = (probe >= background.low) & (probe <= background.high)
        np.testing.assert_array_equal(read, asked)


def test_in_a_region_each_pixel_is_learnt_as_without_one(drawn):
    """And where the gain is read; elsewhere any grey is tank. Fish rest, which is mended."""
    moving = drawn.circling(40, n=2)
    images = [drawn.image(bodies) for bodies in moving[:28] + [moving[28]] * 12]
    region = np.zeros(images[0].shape, bool)
    region[40:160, 30:150] = True
    everywhere, within = (BackgroundLearner(40, region=each) for each in (None, region))
    for image in images:
        everywhere.add(image)
        within.add(image)

    whole, part = everywhere.freeze(), within.freeze()

    assert whole.level[region].min() > 165
    region[8::16, 8::16] = True
    for name in ("level", "low", "high"):
        np.testing.assert_array_equal(getattr(part, name)[region], getattr(whole, name)[region])
    assert part.gain(images[0]) == whole.gain(images[0])
    assert (part.low[:20, :8].max(), part.high[:20, :8].min()) == (0, 255)


def test_a_frame_that_is_not_of_the_regions_size_is_not_learnt_from(drawn):
    """The first one as well."""
    learner = BackgroundLearner(region=np.ones((80, 80), bool))

    assert not learner.fits(drawn.image([], size=60))
    with pytest.raises(InputError, match="80 x 80 px, got one of 60 x 60 px"):
        learner.add(drawn.image([], size=60))


def test_fish_that_swim_leave_no_trace(drawn):
    """Three fish on a circle: the tank within its noise everywhere."""
    images = [drawn.image(bodies) for bodies in drawn.circling(100)]

    assert np.abs(learnt(images).level.astype(int) - 180).max() <= 8


@pytest.mark.parametrize("polarity", ["dark", "light"])
@pytest.mark.parametrize("frames", [range(60), range(20, 50), range(0, 100, 4)])
def test_a_hand_that_passed_is_no_tank(drawn, polarity, frames):
    """Lighter than the tank where fish are dark; in one pixel a fish that sat looks the same."""
    images = [drawn.image(bodies) for bodies in drawn.circling(100, turn=0.1)]
    for k in frames:
        images[k][40:120, 60:150] = 240
    if polarity == "light":
        images = [~image for image in images]

    level = learnt(images, polarity=polarity).level.astype(int)

    assert np.abs(level - (180 if polarity == "dark" else 75)).max() <= 8


def test_a_fish_that_rests_for_the_last_second_is_no_tank(drawn):
    """It swims for 70 frames and rests for 30: longer than the mixture remembers."""
    moving = drawn.circling(70, n=1)
    images = [drawn.image(bodies) for bodies in moving + [moving[-1]] * 30]

    assert learnt(images).level.min() > 165


def test_frames_that_show_nothing_are_not_learnt_from(drawn):
    """Black, and of one grey; a tank with a fish shows something."""
    learner = BackgroundLearner(n_frames=5)

    assert not learner.add(np.zeros((50, 50), np.uint8))
    assert not learner.add(np.full((50, 50), 128, np.uint8))
    assert learner.count == 0
    assert learner.add(drawn.image([(100, 100, 0)]))
    assert not shows_nothing(drawn.image([(100, 100, 0)]))


def test_without_a_frame_of_use_there_is_no_background():
    """One clear line, and what to do."""
    with pytest.raises(InputError, match="No frame shows a tank") as caught:
        BackgroundLearner().freeze()
    assert "--background" in caught.value.hint


def test_frames_of_two_sizes_do_not_mix(drawn):
    """What was expected and what came."""
    learner = BackgroundLearner()
    learner.add(drawn.image([], size=80))

    with pytest.raises(InputError, match="80 x 80 px, got one of 60 x 60 px"):
        learner.add(drawn.image([], size=60))


def test_a_negative_of_the_negative_is_the_same(drawn):
    """And what was darker than the tank is lighter in between."""
    background = background_of(drawn.image([], noise=0.0))
    twice = background.inverted().inverted()

    assert background.inverted().level[0, 0] == 255 - 180
    for name in ("level", "low", "high"):
        np.testing.assert_array_equal(getattr(twice, name), getattr(background, name))


@pytest.mark.parametrize("factor", [0.6, 1.0, 1.3])
def test_the_gain_is_how_much_brighter_an_image_is(drawn, factor):
    """Fish in it do not count."""
    background = background_of(drawn.image([], noise=0.0))
    image = drawn.image(drawn.circling(1)[0], noise=0.0)

    assert background.gain((image * factor).astype(np.uint8)) == pytest.approx(factor, rel=0.01)


def test_the_gain_is_the_median_ratio_of_greys_on_a_grid():
    """By NumPy, for images of any size: every sixteenth row and column, from the ninth on."""
    rng = np.random.default_rng(2)
    for size in ((9, 9), (16, 41), (50, 60), (25, 200)):
        tank, image = (rng.integers(0, 256, size).astype(np.uint8) for _ in range(2))
        some = np.s_[8::16, 8::16]

        ratio = (image[some] + 1.0) / (tank[some] + 1.0)

        assert background_of(tank).gain(image) == np.median(ratio)


def test_colour_becomes_grey_and_grey_stays():
    """OpenCV's weights for blue, green and red."""
    colour = np.zeros((4, 4, 3), np.uint8)
    colour[..., 1] = 100
    grey = np.full((4, 4), 7, np.uint8)

    assert grey_of(colour)[0, 0] == 59
    assert grey_of(grey) is grey
    assert grey_of(grey[..., None]).shape == (4, 4)
