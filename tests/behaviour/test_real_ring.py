"""Real zebrafish and a robot in a ring: statistics of the right size, scores in the right order."""

import numpy as np
import pytest
import shapely

from zfcal.arena import Zone, make_arena
from zfcal.behaviour.ceilings import halves_ceiling, robot_ceiling, summarise
from zfcal.behaviour.located import locate
from zfcal.behaviour.scores import compare
from zfcal.behaviour.statistics import measure, measure_robot
from zfcal.sampling import sample
from zfcal.tracks import FISH, Tracks

FPS = 15
M_PER_PX = 1.11 / 1024


def disc(radius_m):
    """Return a disc about the origin."""
    return shapely.Point(0, 0).buffer(radius_m, quad_segs=64)


def band(name, inner_m, outer_m):
    """Return a zone between two radii."""
    return Zone(name=name, follows_walls=True, polygon=disc(outer_m).difference(disc(inner_m)))


@pytest.fixture(scope="module")
def ring():
    """The corridor from 0.19 to 0.29 m, 5 mm wider on both sides for the fitted centre."""
    return make_arena(
        name="ring",
        outline=disc(0.295).difference(disc(0.185)),
        zones=(
            band("inner", 0.185, 0.22), band("middle", 0.22, 0.26), band("outer", 0.26, 0.295),
        ),
    )  # fmt: skip


@pytest.fixture(scope="module")
def run(recording, ring):
    """Return what locates a recording from 300 s on, the ring's centre put at the origin."""
    folder = recording("zebrafish-robot-ring")

    def load(name):
        with np.load(folder / f"{name}.npz") as archive:
            px = archive["pos_decipx"] / 10.0
            robot = int(archive["robot_index"]) if "robot_index" in archive else -1
        px[px < -3000] = np.nan
        xy_m = px * [M_PER_PX, -M_PER_PX]
        # A circle through all points: |p|^2 = 2 c.p + const.
        points = xy_m[~np.isnan(xy_m).any(axis=-1)]
        terms = np.column_stack([2 * points, np.ones(len(points))])
        xy_m -= np.linalg.lstsq(terms, (points**2).sum(axis=1), rcond=None)[0][:2]
        frame, agent = np.nonzero(~np.isnan(xy_m).any(axis=-1))
        x_m, y_m = xy_m[frame, agent].T
        tracks = Tracks(
            time_s=frame / FPS,
            frame=frame,
            agent=agent.astype(np.int32),
            kind=(agent == robot).astype(np.int8),
            x_m=x_m,
            y_m=y_m,
            heading_rad=np.full(len(frame), np.nan, dtype=np.float32),
            confidence=np.ones(len(frame), dtype=np.float32),
        )
        return locate(sample(tracks, fps=FPS, dt_s=0.2, start_s=300, end_s=1800), ring)

    return load


def test_real_fish_are_nearly_all_inside_and_like_themselves(run, ring):
    """Six fish for 25 min: one point in a thousand is void; one half is like the other."""
    located = run("fish_only_six")

    counts = measure(located, ring)

    assert counts.occupation.sum() + counts.n_void == pytest.approx(6 * 7500, rel=0.02)
    assert counts.n_void < 0.001 * counts.occupation.sum()
    assert halves_ceiling(located, ring).S > 0.95
    assert summarise(robot_ceiling(located, ring)).n_windows == 6


@pytest.mark.parametrize("name", ["Despotic_model_1", "Feedback_Initiative_model_1"])
def test_a_real_robot_is_less_like_the_fish_than_any_fish(name, run, ring):
    """Robot-vs-fish scores below the least of its ceiling."""
    located = run(name)

    robot = compare(measure_robot(located, ring), measure(located.of_kind(FISH), ring))

    fish = [one.S for one in robot_ceiling(located, ring)]
    assert len(fish) == 5
    assert 0.5 < robot.S < min(fish) - 0.1
