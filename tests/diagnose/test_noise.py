"""What a tracker did to positions, found from the positions alone."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import shapely
from scipy import stats

from zfcal.diagnose import noise
from zfcal.diagnose.noise import beyond_wall, estimate_noise, from_frames, quantum_of

FPS = 15.0


@pytest.fixture(scope="module")
def walk(worlds):
    """Return five minutes of four fish of the base model."""
    return worlds.base_walk(31, fish=4)


@pytest.mark.parametrize("noise_mm", [0.3, 0.7, 2.0])
@pytest.mark.parametrize("fps", [10.0, 15.0, 30.0])
def test_noise_of_straight_steps_is_found_to_a_twentieth(worlds, walk, noise_mm, fps):
    """White noise on paths that are straight between steps, at three frame rates."""
    tracks = worlds.filmed(walk, fps=fps, noise_m=noise_mm / 1000, rng=np.random.default_rng(1))

    found = estimate_noise(tracks, fps=fps, dt_s=0.2)

    assert found.sd_m == pytest.approx(noise_mm / 1000, rel=0.08)


def test_no_noise_is_no_noise(worlds, walk):
    """Straight steps without noise: less than a nanometre."""
    found = estimate_noise(worlds.filmed(walk, fps=FPS, noise_m=0.0, rng=None), fps=FPS, dt_s=0.2)

    assert found.sd_m < 1e-9
    assert found.how == "straight steps"


def smooth_paths(*, seconds=300, fps=FPS, fish=4):
    """Return fish that glide on circles of 5 to 20 cm, 10 s round, (frame, fish, xy)."""
    at = np.arange(round(seconds * fps)) / fps
    radius = np.linspace(0.05, 0.2, fish)
    angle = 2 * np.pi * at[:, None] / 10 + np.arange(fish)
    return np.stack([0.5 + radius * np.cos(angle), 0.5 + radius * np.sin(angle)], axis=2)


@pytest.mark.parametrize("noise_mm", [0.3, 1.0])
def test_noise_on_smooth_paths_is_found_to_a_tenth(worlds, noise_mm):
    """Circles bend by up to 0.35 mm a frame, which is no noise."""
    rng = np.random.default_rng(2)
    tracks = worlds.tracks_of(smooth_paths(), fps=FPS, noise_m=noise_mm / 1000, rng=rng)

    sd_m, how = from_frames(tracks, fps=FPS, per_step=3)

    assert how == "quiet stretches"
    assert sd_m == pytest.approx(noise_mm / 1000, rel=0.1)


def test_fish_that_dart_now_and_then_do_not_pose_as_noise(worlds):
    """Bursts of acceleration in half of all seconds: the quiet ones count."""
    rng = np.random.default_rng(3)
    xy = smooth_paths()
    busy = np.repeat(rng.random((len(xy) // 30 + 1, 4, 1)) < 0.5, 30, axis=0)[: len(xy)]
    xy = xy + np.cumsum(busy * rng.normal(0, 0.003, xy.shape), axis=0)
    tracks = worlds.tracks_of(xy, fps=FPS, noise_m=0.0005, rng=rng)

    assert estimate_noise(tracks, fps=FPS, dt_s=0.2).sd_m == pytest.approx(0.0005, rel=0.2)


def test_a_stated_noise_counts_before_any_estimate(worlds, walk):
    """What a person says of the source wins."""
    tracks = worlds.filmed(walk, fps=FPS, noise_m=0.001, rng=np.random.default_rng(4))

    found = estimate_noise(tracks, fps=FPS, dt_s=0.2, stated_m=0.0004)

    assert (found.sd_m, found.how) == (0.0004, "stated")


def test_the_depth_beyond_a_straight_wall_by_hand(worlds):
    """Fish spread evenly in a square to its wall: with noise of 2 mm those beyond lie
    2 mm * sqrt(2 pi) / 4 = 1.25 mm deep in the mean; corners add little.
    """
    arena = worlds.two_rooms()
    rng = np.random.default_rng(5)
    x0, y0, x1, y1 = arena.outline.bounds
    xy = rng.uniform((x0, y0), (x1, y1), (60_000, 2))
    xy = xy[shapely.contains_xy(arena.outline, xy)][:, None]
    tracks = worlds.tracks_of(xy, fps=5.0, noise_m=0.002, rng=rng)

    assert beyond_wall(tracks, arena) == pytest.approx(0.002, rel=0.1)
    found = estimate_noise(tracks, fps=5.0, dt_s=0.2, arena=arena)
    assert found.how == "beyond the wall"


def test_without_frames_between_steps_and_without_arena_nothing_is_known(worlds, walk):
    """5 Hz and a step of 0.2 s: None, unless the noise is stated."""
    assert estimate_noise(worlds.tracks_of(walk, fps=5.0), fps=5.0, dt_s=0.2) is None


def test_losses_by_hand(worlds):
    """Two fish, 100 frames; one is away from frame 40 to 49 and returns under another id."""
    xy = np.full((100, 3, 2), 0.5)
    xy[40:, 1] = np.nan
    xy[:50, 2] = np.nan

    found = estimate_noise(worlds.tracks_of(xy, fps=10.0), fps=10.0, dt_s=0.2, stated_m=0.0)

    assert found.missing == pytest.approx(10 / 200)
    assert found.gap_s == pytest.approx(1.0)
    assert found.swaps == 1


@pytest.mark.parametrize(("quantum", "found"), [(0.001, 0.001), (None, 0.0)])
def test_positions_on_a_grid_show_its_spacing(quantum, found):
    """Rounded to millimetres, or not."""
    values = np.random.default_rng(6).uniform(0, 0.3, 5000)
    values = values if quantum is None else np.rint(values / quantum) * quantum

    assert quantum_of(values) == pytest.approx(found, rel=1e-6)


def test_two_frames_tell_nothing(worlds):
    """Fewer than three frames: None."""
    assert (
        estimate_noise(worlds.tracks_of(np.full((2, 2, 2), 0.5), fps=15.0), fps=15.0, dt_s=0.2)
        is None
    )


def test_an_empty_recording_tells_nothing(worlds):
    """No rows at all: None."""
    assert (
        estimate_noise(worlds.tracks_of(np.zeros((0, 1, 2)), fps=15.0), fps=15.0, dt_s=0.2) is None
    )


def test_a_real_recording_is_exact_to_a_fraction_of_a_pixel(recording, worlds):
    """Six zebrafish in a ring, filmed at 1.08 mm a pixel: 0.2 to 0.8 mm, on a grid of 0.1 px."""
    raw = np.load(recording("zebrafish-robot-ring") / "fish_only_six.npz")["pos_decipx"]
    xy = np.where(raw == np.int16(-32768), np.nan, raw.astype(float)) / 10 * 1.11 / 1024

    found = estimate_noise(worlds.tracks_of(xy[:9000], fps=FPS), fps=FPS, dt_s=0.2)

    assert found.how == "quiet stretches"
    assert 2e-4 < found.sd_m < 8e-4
    assert found.quantum_m == pytest.approx(1.11 / 10240, rel=1e-6)


@pytest.mark.parametrize(("share", "df"), [(0.1, 3.0), (0.25, 29.9), (0.5, 120.0)])
def test_quantiles_of_chi_square_are_those_of_scipy(share, df):
    """They are taken where scipy.stats need not be imported."""
    assert noise._chi2_quantile(share, df) == pytest.approx(stats.chi2.ppf(share, df))


@pytest.mark.slow
def test_a_tracker_starts_without_the_statistics_of_scipy():
    """Their import takes as long as that of all the rest."""
    line = "import sys, zfcal.stages.track.track; print('scipy.stats' in sys.modules)"

    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "False"


def filmed_with(worlds, walk, errors_of):
    """Return tracks of a film of the walk, with errors of position."""
    tracks = worlds.filmed(walk, fps=FPS, noise_m=0.0, rng=None)
    off = errors_of(tracks)
    return dataclasses.replace(tracks, x_m=tracks.x_m + off[:, 0], y_m=tracks.y_m + off[:, 1])


def test_noise_that_differs_from_time_to_time_counts_in_the_mean_square(worlds, walk):
    """Half of the time 0.5 mm, half 1.5 mm: the mean square is that of 1.118 mm, to a twentieth."""

    def errors(tracks):
        sd_m = np.where(tracks.frame // 60 % 2 == 0, 0.5e-3, 1.5e-3)
        return np.random.default_rng(4).normal(0, 1, (len(tracks), 2)) * sd_m[:, None]

    sd, how = from_frames(filmed_with(worlds, walk, errors), fps=FPS, per_step=3)

    assert how == "straight steps"
    assert sd == pytest.approx(np.sqrt((0.5e-3**2 + 1.5e-3**2) / 2), rel=0.05)


def test_a_jump_now_and_then_is_no_noise(worlds, walk):
    """One fish is taken for another, 5 cm off, from six times on: 3 % more at most."""

    def errors(tracks):
        at = np.searchsorted(np.linspace(100, 4000, 6), tracks.frame)
        noise = np.random.default_rng(4).normal(0, 1e-3, (len(tracks), 2))
        return noise + 0.05 * ((at % 2 == 1) & (tracks.agent == tracks.agent[0]))[:, None]

    sd, _ = from_frames(filmed_with(worlds, walk, errors), fps=FPS, per_step=3)

    assert sd == pytest.approx(1e-3, rel=0.03)
