"""Bodies that lie across each other are found by the shades of their blob."""

import math

import numpy as np
import pytest

from zfcal.tracking.fitting import Build, fit

FISH = Build(length_px=21.5, width_px=7.8, darkness=0.5)


def scene(drawn, bodies, shades):
    """Return the pixels of drawn bodies and how dark each is; the darkest is seen."""
    each = [shade * drawn.coverage([body]) for body, shade in zip(bodies, shades, strict=True)]
    dark = np.max(each, axis=0)
    low, high = (
        np.array([body[:2] for body in bodies]).min(axis=0) - 20,
        np.array([body[:2] for body in bodies]).max(axis=0) + 20,
    )
    y, x = np.mgrid[int(low[1]) : int(high[1]), int(low[0]) : int(high[0])]
    return np.column_stack([x.ravel(), y.ravel()]).astype(float), dark[y, x].ravel()


def off(bodies, *, by=(2.0, -2.0, 0.3)):
    """Return where bodies are thought to be: beside where they are."""
    return np.array(bodies) + by


def test_one_body_is_found_between_the_pixels(drawn):
    """Three pixels and 0.3 rad off: to half a pixel and 0.05 rad."""
    body = (100.3, 80.7, 0.4)
    pixels, shares = scene(drawn, [body], [0.5])

    found = fit(pixels, shares, [FISH], off([body]), off([body]))

    assert found.poses[0, :2] == pytest.approx(body[:2], abs=0.7)
    assert found.poses[0, 2] == pytest.approx(0.4, abs=0.08)


@pytest.mark.parametrize("angle", [0.9, 1.5, 2.4])
def test_two_that_cross_come_within_two_pixels(drawn, angle):
    """At any angle, from 3 px and 0.3 rad beside."""
    bodies = [(100.0, 100.0, 0.5), (101.0, 103.0, 0.5 - angle)]
    pixels, shares = scene(drawn, bodies, [0.5, 0.5])

    found = fit(pixels, shares, [FISH, FISH], off(bodies), off(bodies))

    for pose, (x, y, heading) in zip(found.poses, bodies, strict=True):
        assert math.hypot(pose[0] - x, pose[1] - y) < 1.5
        assert abs(pose[2] - heading) < 0.3


def test_what_explains_the_shades_costs_less(drawn):
    """A dark lure and a pale fish: their exchange costs more, by far."""
    bodies = [(100.0, 100.0, 0.0), (106.0, 104.0, 1.5)]
    lure = Build(length_px=21.5, width_px=7.8, darkness=0.8)
    pixels, shares = scene(drawn, bodies, [0.8, 0.4])
    pale = Build(length_px=21.5, width_px=7.8, darkness=0.4)

    right = fit(pixels, shares, [lure, pale], np.array(bodies), np.array(bodies))
    wrong = fit(pixels, shares, [pale, lure], np.array(bodies), np.array(bodies))

    assert right.cost < wrong.cost - 5


def test_bodies_that_nothing_shows_stay_where_they_are_due():
    """In light water without a trace of them the expectation alone counts."""
    y, x = np.mgrid[0:40, 0:40]
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    due = np.array([[200.0, 200.0, 1.0]])

    found = fit(pixels, np.zeros(len(pixels)), [FISH], due, due)

    assert found.poses[0] == pytest.approx([200.0, 200.0, 1.0, 0.0])
    assert found.cost == 0.0


def test_a_build_is_that_of_its_silhouette(drawn):
    """A drawn body's moments give its length and its width to an eighth."""
    covered = drawn.coverage([(100.0, 100.0, 0.0)])
    y, x = np.nonzero(covered)
    weights = covered[y, x]
    middle = weights @ x / weights.sum()
    sd = math.sqrt(weights @ (x - middle) ** 2 / weights.sum())

    build = Build.of(sd_length_px=4 * sd, area_px=weights.sum(), darkness=0.5)

    assert build.length_px == pytest.approx(24.0, rel=0.125)
    assert build.width_px == pytest.approx(7.0, rel=0.125)


def test_a_turned_scene_gives_a_turned_pose(drawn):
    """A quarter turn of pixels and expectation turns what is found, to a tenth of a pixel."""
    body = (100.0, 100.0, 0.5)
    pixels, shares = scene(drawn, [body], [0.5])
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    due = off([body])
    turned = np.column_stack([due[:, :2] @ turn, due[:, 2] + math.pi / 2])

    plain = fit(pixels, shares, [FISH], due, due)
    other = fit(pixels @ turn, shares, [FISH], turned, turned)

    assert other.poses[0, :2] == pytest.approx(plain.poses[0, :2] @ turn, abs=0.1)
    assert other.poses[0, 2] == pytest.approx(plain.poses[0, 2] + math.pi / 2, abs=0.02)
