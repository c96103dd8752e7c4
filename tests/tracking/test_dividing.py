"""Blobs of several fish are divided, and detections given to who is nearest."""

import math

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from zfcal.tracking.assign import assign
from zfcal.tracking.background import background_of
from zfcal.tracking.blobs import shape_of
from zfcal.tracking.detect import Corners, Limits, compare, find_blobs
from zfcal.tracking.dividing import by_clusters, by_darkness


def blobs_of(drawn, bodies, *, corners=None, min_blob_px=12.0):
    """Return the blobs of drawn bodies, without noise."""
    background = background_of(drawn.image([], noise=0.0))
    view = compare(drawn.image(bodies, noise=0.0), background, Limits(outer=background.low))
    return find_blobs(view, min_blob_px=min_blob_px, corners=corners)


def test_a_blob_covers_what_was_drawn_and_lies_where_it_was(drawn):
    """Area to a tenth, place to a fifth of a pixel, for a fish between the pixels."""
    body = (100.3, 80.7, 0.4)

    (blob,) = blobs_of(drawn, [body])
    shape = shape_of(blob.pixels, blob.weights)

    assert shape.area_px == pytest.approx(drawn.coverage([body]).sum(), rel=0.1)
    assert (shape.x_px, shape.y_px) == pytest.approx(body[:2], abs=0.3)


@pytest.mark.parametrize("heading", np.linspace(-3, 3, 7))
@pytest.mark.parametrize("harris", [False, True])
def test_the_thick_end_is_the_head(drawn, heading, harris):
    """All round the circle, with either measure of corners."""
    (blob,) = blobs_of(drawn, [(100.0, 100.0, heading)], corners=Corners(harris=harris))
    shape = shape_of(blob.pixels, blob.weights, blob.corners)

    assert len(blob.corners) > 0
    assert math.cos(shape.axis_rad - heading) > 0.99


def test_small_blobs_and_smooth_ones_are_dropped(drawn):
    """Below the least area; and a blob without any corner where corners are needed."""
    assert blobs_of(drawn, [(100.0, 100.0, 0.0)], min_blob_px=500.0) == []


def test_fish_that_touch_fall_apart_at_rising_darkness(drawn):
    """Side by side, half a pixel between them: one blob, two pieces, each where it was."""
    bodies = [(100.0, 100.0, 0.0), (104.0, 107.2, 0.0)]
    (blob,) = blobs_of(drawn, bodies)
    one = drawn.coverage(bodies[:1]).sum()

    parts = by_darkness(blob, 2, area_px=one)
    shapes = [shape_of(blob.pixels[part], blob.weights[part]) for part in parts]

    assert len(parts) == 2
    at = sorted((shape.y_px, shape.x_px) for shape in shapes)
    assert at[0] == pytest.approx((100.0, 100.0), abs=0.6)
    assert at[1] == pytest.approx((107.2, 104.0), abs=0.6)


def test_clusters_start_where_fish_are_expected(drawn):
    """In a row, head to tail: the halves, in the order of the seeds."""
    bodies = [(90.0, 100.0, 0.0), (112.0, 100.0, 0.0)]
    (blob,) = blobs_of(drawn, bodies)

    seeds = np.array([(115.0, 100.0), (85.0, 100.0)])
    right, left = (shape_of(blob.pixels[p], blob.weights[p]) for p in by_clusters(blob, 2, seeds))

    assert right.x_px == pytest.approx(112.0, abs=2.0)
    assert left.x_px == pytest.approx(90.0, abs=2.0)


def test_pairs_cost_least_together_and_stay_within_the_gate():
    """Two tracks, three detections, by hand; the third detection is nobody's."""
    cost = np.array([[1.0, 4.0, 9.0], [2.0, 3.0, 9.0]])

    pairs = assign(cost, np.array([10.0, 10.0]))

    assert [(m.track, m.detection, m.cost) for m in pairs] == [(0, 0, 1.0), (1, 1, 3.0)]
    # Exchanged they cost 4 + 2 against 1 + 3; with the third, 9 against 1 and 9 against 3.
    assert [m.margin for m in pairs] == [2.0, 2.0]
    assert [m.track for m in assign(cost, np.array([10.0, 1.5]))] == [0]
    assert assign(np.empty((0, 3)), np.empty(0)) == []


def test_assignment_is_the_best_of_all():
    """Against scipy's own on a hundred square tables, with a gate that keeps everybody."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        cost = rng.uniform(0, 1, (4, 4))
        best = cost[linear_sum_assignment(cost)].sum()
        assert sum(m.cost for m in assign(cost, np.full(4, 9.0))) == pytest.approx(best)
