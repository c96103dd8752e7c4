"""trajectorytools: bare arrays, dictionaries of idtracker.ai, and its own saved trajectories."""

import numpy as np
import pytest

PX = 0.001


def test_a_bare_array_is_positions(tmp_path, read, xy_px):
    """Shape (frame, animal, 2), NaN missing."""
    path = tmp_path / "a.npy"
    np.save(path, xy_px)

    tracks = read(path, "trajectorytools", m_per_px=PX).tracks

    assert len(tracks) == 7
    assert tracks.x_m[:2] == pytest.approx([0.1, 0.3])


def test_saved_trajectories_go_back_to_pixels(tmp_path, read, xy_px):
    """Moved by (-10, -20) px and in units of 50 px, as Trajectories.save leaves them."""
    saved = {
        "traj_data": {"_s": (xy_px + np.array([-10.0, -20.0])) / 50, "_v": xy_px, "_a": xy_px},
        "params": {"displacement": np.array([-10.0, -20.0]), "length_unit": 50, "frame_rate": 15},
        "class_name": "Trajectories",
    }
    path = tmp_path / "a.npy"
    np.save(path, saved, allow_pickle=True)

    tracks = read(path, "trajectorytools", m_per_px=PX).tracks

    assert tracks.x_m[:2] == pytest.approx([0.1, 0.3])
    assert tracks.y_m[:2] == pytest.approx([0.2, 0.4])


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ([1, 2], "expected an array or a dictionary, got list"),
        ({"traj_data": {"_s": 1}}, "expected traj_data with '_s' and params, got ['traj_data']"),
        (
            {"traj_data": {"_s": np.zeros((1, 1, 2))}, "params": {"length_unit": 1}},
            "expected params with length_unit and displacement, got ['length_unit']",
        ),
    ],
)
def test_other_content_is_refused(found, expected, tmp_path, refused):
    """What is there is listed."""
    path = tmp_path / "a.npy"
    wrapped = np.empty((), dtype=object)
    wrapped[()] = found
    np.save(path, wrapped, allow_pickle=True)

    assert expected in refused(path, "trajectorytools", m_per_px=PX)
