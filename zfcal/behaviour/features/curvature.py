"""Curvature: how much a path turns on its way.

The paper names it as what similarity scores should take into account next (Cazenille et al.,
discussion: "curvature of trajectories").

At each sample between two steps of one track id: the angle between the steps over the mean
of their lengths, in rad/m, which is one over the radius of the path. It is taken without its
sign, since left and right turns are alike for a tank and a model that are. Curvature, and not
turning per time, is what stays the same at another speed (Gautrais et al. 2009, J. Math. Biol.
58: turning speed over swimming speed). Turns of zebrafish have a heavy tail (Mwaffo et al. 2015,
J. R. Soc. Interface 12: 20140884), so the bins grow as 1, 2, 5, 10.

A step shorter than 2 mm has no direction beyond the noise of tracking: with it there is no
observation. The value belongs to the zone of the sample in the middle.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from zfcal.behaviour.features.statistic import Observed, Points, Statistic, lengths
from zfcal.units import HEADING_MIN_STEP_M

EDGES_RAD_M = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


def observe(points: Points) -> Iterator[Observed]:
    """Yield the curvature between each two steps that follow each other, in rad/m."""
    start, end = points.moves
    step_m = points.located.xy_m[end] - points.located.xy_m[start]
    length_m = lengths(step_m)
    # Steps stand agent by agent: where one ends at a point the next one starts there.
    follows = np.flatnonzero(end[:-1] == start[1:])
    long_enough = np.minimum(length_m[follows], length_m[follows + 1]) >= HEADING_MIN_STEP_M
    before = follows[long_enough]
    (ax, ay), (bx, by) = step_m[before].T, step_m[before + 1].T
    turn_rad = np.abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))
    way_m = (length_m[before] + length_m[before + 1]) / 2
    yield Observed(at=end[before], value=turn_rad / way_m)


STATISTICS = (
    Statistic(
        name="curvature",
        label="Curvature of paths",
        phrase="the curvature of paths",
        observe=observe,
        edges=lambda _: np.array(EDGES_RAD_M),
        unit="rad/m",
        title="Curvature of the path",
        axis="curvature",
        source="Gautrais et al. 2009; Cazenille et al., discussion",
    ),
)
