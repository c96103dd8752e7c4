"""What the first images tell of the animals: their sign and their size."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.tracking.background import Background, BackgroundLearner
from zfcal.tracking.learning import Learnt, learn, pieces, standing_out


def tank_of(level):
    """Return a tank that a camera with a noise of two greys learnt."""
    return Background(level=level, low=level - np.uint8(8), high=level + np.uint8(8))


def learnt_from(images, n_agents=3):
    """Return what is learnt from images as a tracker learns it."""
    learner = BackgroundLearner(len(images))
    for image in images:
        learner.add(image)
    return learn(learner.samples, learner.usual(), n_agents=n_agents)


@pytest.fixture(scope="module")
def film(drawn):
    """Return what draws a film of three bodies on a circle."""

    def draw(n=50, bodies=None, **how):
        rng = np.random.default_rng(3)
        paths = drawn.circling(n, turn=0.1) if bodies is None else bodies
        return [drawn.image(each, rng=rng, **how) for each in paths]

    return draw


@pytest.mark.parametrize("n_agents", [3, None])
@pytest.mark.parametrize(("fish", "told"), [(80.0, "dark"), (250.0, "light"), (150.0, "dark")])
def test_a_film_tells_whether_animals_are_darker_or_lighter(film, fish, told, n_agents):
    """Strong or faint, and whether their number is known or not."""
    assert learnt_from(film(tank=180.0, fish=fish), n_agents).polarity == told


def test_the_negative_of_a_film_tells_the_opposite(film):
    """And the same size to a pixel or two."""
    images = film(noise=4.0)
    one, other = learnt_from(images), learnt_from([~image for image in images])
    assert (one.polarity, other.polarity) == ("dark", "light")
    assert (one.light_share, other.light_share) == (0.0, 1.0)
    assert one.area_px == pytest.approx(other.area_px, abs=2)


def test_animals_of_both_kinds_are_told(drawn):
    """One lighter than the tank and two darker."""
    images = []
    for paths in drawn.circling(50, turn=0.1):
        clean = 140.0 - 60.0 * drawn.coverage(paths[:2]) + 60.0 * drawn.coverage(paths[2:])
        noise = np.random.default_rng(len(images)).normal(0, 1.5, clean.shape)
        images.append(np.rint(clean + noise).astype(np.uint8))
    assert learnt_from(images).polarity == "either"


@pytest.mark.parametrize("noise", [1.5, 6.0])
def test_an_empty_tank_tells_nothing(film, noise):
    """Noise stands out to both sides alike."""
    found = learnt_from(film(bodies=[[]] * 50, noise=noise))
    assert found.polarity is None
    assert found.min_blob_px <= 12.0


def test_the_size_grows_with_the_image(film):
    """Twice as large, four times the pixels; the smallest blob too."""
    images = film()
    one = learnt_from(images)
    other = learnt_from([np.kron(image, np.ones((2, 2), np.uint8)) for image in images])
    assert other.area_px == pytest.approx(4 * one.area_px, rel=0.1)
    assert other.min_blob_px == pytest.approx(0.15 * other.area_px, rel=0.05)


def test_without_anything_the_smallest_blob_is_the_usual_one():
    """Twelve pixels; and never less than four."""
    assert Learnt().min_blob_px == 12.0
    assert Learnt(area_px=10.0).min_blob_px == 4.0


@given(light=st.booleans(), shade=st.integers(30, 90))
def test_a_ghost_speaks_for_the_animal_that_left_it(light, shade):
    """A tank that was learnt with an animal in it: where that was, the frame is plain."""
    tank = np.full((40, 40), 128, np.uint8)
    sat = tank.copy()
    sat[10:20, 10:20] = 128 + shade if light else 128 - shade
    (ghost,) = standing_out(tank, tank_of(sat))
    (animal,) = standing_out(sat, tank_of(tank))
    assert ghost.sign == animal.sign == (1 if light else -1)
    assert animal.area_px == 100
    assert animal.contrast == shade
    assert animal.mass == 100 * shade


def test_what_the_image_cuts_off_tells_nothing():
    """How large it is cannot be known."""
    tank = np.full((40, 40), 128, np.uint8)
    frame = tank.copy()
    frame[30:, 10:20] = 20
    assert standing_out(frame, tank_of(tank)) == []
    frame[37:] = 128
    assert len(standing_out(frame, tank_of(tank))) == 1


def test_what_lies_outside_the_region_tells_nothing():
    """A hand over the wall."""
    tank = np.full((40, 40), 128, np.uint8)
    frame = tank.copy()
    frame[10:20, 10:20] = 20
    region = np.ones((40, 40), bool)
    assert len(standing_out(frame, tank_of(tank), region)) == 1
    region[:, :30] = False
    assert standing_out(frame, tank_of(tank), region) == []


def test_a_pixel_alone_is_noise():
    """It does not outlast opening."""
    tank = np.full((20, 20), 128, np.uint8)
    frame = tank.copy()
    frame[10, 10] = 20
    assert pieces(frame, tank, (frame < 100).astype(np.uint8) * 255) == []
