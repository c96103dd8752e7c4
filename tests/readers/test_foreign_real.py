"""The real recordings, read whole, against numbers counted in them by other means."""

import gzip

import numpy as np
import pandas as pd
import pytest

from zfcal.readers import guess_format

MM_PER_PX = 0.35
"""A scale that makes the five zebrafish 30 mm long; the recording has none."""


@pytest.mark.parametrize(
    ("name", "n_rows", "n_missing"),
    [
        ("gt_2019-10-15", 69_371, 5),
        ("gt_2020-02-17", 75_000, 0),
        ("180101_idtracker.results", 61_368, 13_627),
        ("180101_toxtrac.results", 64_642, 0),
        ("191003_idtrackerai.results", 68_424, 6_576),
    ],
)
def test_five_zebrafish_in_mot_files(name, n_rows, n_missing, shared_data, read):
    """As many positions as the published evaluations counted predictions and objects."""
    path = shared_data / "zebrafish5-tracks" / f"{name}.csv.gz"

    imported = read(path, "mot", fps=32.0, m_per_px=MM_PER_PX / 1000, n_fish=5)

    assert guess_format(path) == "mot"
    assert len(imported.tracks) == n_rows
    assert set(np.unique(imported.tracks.agent)) == {1, 2, 3, 4, 5}
    assert any(note.startswith(f"{n_missing} of") for note in imported.notes) == (n_missing > 0)


def test_points_of_the_ground_truth_are_centres(shared_data, read):
    """The median point lies within a tenth of a body of the middle between head and tail."""
    folder = shared_data / "zebrafish5-tracks"
    tracks = read(folder / "gt_2020-02-17.csv.gz", "mot", fps=32.0, m_per_px=0.001).tracks
    pose = pd.read_csv(folder / "gt_pose.csv.gz")
    middle = pose.groupby(["frame", "id"])[["x", "y"]].mean().reset_index()
    middle = middle[middle.frame <= 2000]

    off_px = []
    for frame, found in middle.groupby("frame"):
        here = tracks.frame == frame - 1
        dx = found.x.to_numpy()[:, None] - tracks.x_m[here] * 1000
        dy = found.y.to_numpy()[:, None] - tracks.y_m[here] * 1000
        off_px += list(np.hypot(dx, dy).min(axis=1))

    assert np.median(off_px) < 8.6


def test_rough_points_of_the_ground_truth_are_guesses(shared_data, read):
    """Confidence 0.1 in the file stays below one half."""
    path = shared_data / "zebrafish5-tracks" / "gt_2020-02-17.csv.gz"

    tracks = read(path, "mot", fps=32.0, m_per_px=0.001).tracks

    assert int((tracks.confidence < 0.5).sum()) == 5116


def test_tracktor_is_read_as_csv_with_renamed_columns(shared_data, read):
    """Half-size video: 0.7 mm per px; it lies on the ground truth."""
    folder = shared_data / "zebrafish5-tracks"
    columns = (("agent", "id"), ("x_px", "pos_x"), ("y_px", "pos_y"))

    half = read(
        folder / "tracktor_halfscale.csv.gz",
        "csv",
        fps=32.0,
        m_per_px=2 * MM_PER_PX / 1000,
        first_frame=1,
        columns=columns,
    ).tracks
    truth = read(folder / "gt_2020-02-17.csv.gz", "mot", fps=32.0, m_per_px=MM_PER_PX / 1000).tracks

    assert len(half) == 74_990
    frame = half.frame[0]
    here, there = half.frame == frame, truth.frame == frame
    dx = half.x_m[here][:, None] - truth.x_m[there]
    dy = half.y_m[here][:, None] - truth.y_m[there]
    assert np.hypot(dx, dy).min(axis=1).max() < 0.005


def test_one_mouse_in_idtracker_text(shared_data, read):
    """9999 rows, none missing, none estimated."""
    path = shared_data / "mouse-disc" / "mouse_idtracked.txt.gz"

    tracks = read(path, "idtracker", fps=30.0, m_per_px=0.001, n_fish=1).tracks

    assert guess_format(path) == "idtracker"
    assert len(tracks) == 9999
    assert (tracks.confidence == 1).all()
    assert (tracks.x_m[0], tracks.y_m[0]) == pytest.approx((0.2539, 0.22126))


@pytest.mark.parametrize("name", ["mouse_toxtracked.txt.gz", "mouse_tracked.csv.gz"])
def test_formats_that_are_not_known_are_refused_with_what_was_expected(name, shared_data, refused):
    """ToxTrac's own text, and a csv without agents."""
    path = shared_data / "mouse-disc" / name
    chosen = "idtracker" if name.endswith(".txt.gz") else "csv"

    assert "line 1: expected" in refused(path, chosen, fps=30.0, m_per_px=0.001)


def test_eight_zebrafish_as_csv_are_those_of_the_dictionary(shared_data, read):
    """The csv was converted from the .npy: same agents, same places, 43 positions missing."""
    csv = read(
        shared_data / "zebrafish8-video" / "reference_test_B.csv",
        "csv",
        fps=28.07,
        m_per_px=0.0005,
        columns=(("agent", "id"), ("confidence", "id_prob")),
    ).tracks
    npy = read(
        shared_data / "trajectorytools" / "test_trajectories_idtrackerai_with_border.npy",
        "idtracker",
        fps=28.07,
        m_per_px=0.0005,
    )

    assert "The file states 28 frames per second, 28.07 is taken." in npy.notes
    assert len(csv) == 508 * 8 - 43
    assert csv.agent.tolist() == npy.tracks.agent.tolist()
    assert csv.x_m == pytest.approx(npy.tracks.x_m, abs=1e-6)
    assert int((npy.tracks.confidence < 0.5).sum()) == 225


@pytest.mark.parametrize(
    ("name", "fps", "n_frames", "n_fish", "n_rows"),
    [
        ("test_trajectories", 30.0, 300, 100, 28_256),
        ("test_trajectories_idtrackerai", 28.07, 508, 8, 4_021),
        ("trajectories_with_points", 32.0, 1000, 15, 14_993),
    ],
)
def test_the_samples_of_trajectorytools(name, fps, n_frames, n_fish, n_rows, shared_data, read):
    """Bare arrays and pickled dictionaries, of three ages; as numpy reads them."""
    path = shared_data / "trajectorytools" / f"{name}.npy"

    tracks = read(path, "trajectorytools", fps=fps, m_per_px=0.0001).tracks

    found = np.load(path, allow_pickle=True)
    found = found.item()["trajectories"] if found.dtype == object else found
    assert found.shape == (n_frames, n_fish, 2)
    assert len(tracks) == n_rows
    assert tracks.x_m == pytest.approx(found[..., 0][np.isfinite(found[..., 0])] * 0.0001)


def test_the_track_of_the_two_rooms(shared_data, read):
    """9022 points in metres at 15 Hz; 284 of them repeat the one before."""
    path = shared_data / "two-rooms" / "epfl-fish-two-rooms.xml"

    tracks = read(path, "cats").tracks

    assert guess_format(path) == "cats"
    assert len(tracks) == 9022
    assert tracks.time_s[-1] == pytest.approx(601.4, abs=0.01)
    assert int((tracks.confidence == 0).sum()) == 284
    assert (tracks.x_m.min(), tracks.x_m.max()) == pytest.approx((-0.342, 0.480), abs=1e-3)


@pytest.mark.parametrize("name", ["epfl-two-rooms.xml", "paris-two-rooms2.xml"])
def test_maps_of_the_two_rooms_are_no_tracks(name, shared_data, refused):
    """The same XML with the outline of the tank."""
    assert "got the map of a set-up" in refused(shared_data / "two-rooms" / name, "cats")


def test_a_real_file_cut_in_half_is_refused(shared_data, refused, tmp_path):
    """Half a compressed csv, half a .npy: named, never read as half a recording."""
    csv = (shared_data / "zebrafish5-tracks" / "gt_2019-10-15.csv.gz").read_bytes()
    npy = (shared_data / "trajectorytools" / "trajectories_with_points.npy").read_bytes()
    (tmp_path / "half.csv.gz").write_bytes(csv[: len(csv) // 2])
    (tmp_path / "half.npy").write_bytes(npy[: len(npy) // 2])
    (tmp_path / "half.csv").write_bytes(gzip.decompress(csv)[:30_000])

    assert "half.csv.gz" in refused(tmp_path / "half.csv.gz", "mot", fps=32.0, m_per_px=0.001)
    assert "expected a whole" in refused(
        tmp_path / "half.npy", "idtracker", fps=32.0, m_per_px=0.001
    )
    assert "cells, got" in refused(tmp_path / "half.csv", "mot", fps=32.0, m_per_px=0.001)
