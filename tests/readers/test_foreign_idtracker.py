"""idtracker.ai and idTracker: the same tank in four kinds of file, and what is a guess."""

import numpy as np
import pytest

PX = 0.001


def _save(path, **more):
    np.save(path, {"trajectories": np.full((3, 2, 2), 100.0), **more}, allow_pickle=True)
    return path


def test_certainty_of_identity_tells_located_from_estimated(tmp_path, read):
    """A located animal is at least 0.5; NaN and 0 mean touching animals, taken apart."""
    certainty = np.array([[1.0, 0.2], [np.nan, 0.0], [0.8, 1.0]])
    path = _save(tmp_path / "a.npy", id_probabilities=certainty[..., np.newaxis])

    tracks = read(path, "idtracker", m_per_px=PX).tracks

    assert tracks.confidence == pytest.approx([1.0, 0.5, 0.4, 0.4, 0.8, 1.0])


def test_a_calibration_without_a_unit_is_noted_and_not_used(tmp_path, read):
    """47 px per what? The person has to say."""
    path = _save(tmp_path / "a.npy", length_unit=47.0)

    imported = read(path, "idtracker", m_per_px=PX)

    assert imported.tracks.x_m[0] == pytest.approx(0.1)
    assert any("47 px per unit of length, without naming the unit" in n for n in imported.notes)


def test_wide_csv_has_times_that_must_agree(write, read, refused):
    """time,x1,y1,x2,y2: animals keep their numbers."""
    rows = "".join(f"{k / 15:.3f},{100 + k},200,nan,nan\n" for k in range(30))
    path = write("trajectories.csv", "time,x1,y1,x2,y2\n" + rows)

    tracks = read(path, "idtracker", m_per_px=PX).tracks

    assert set(tracks.agent.tolist()) == {1}
    assert tracks.x_m[29] == pytest.approx(0.129)
    assert "advance at 15 Hz, expected fps = 30 Hz" in refused(
        path, "idtracker", m_per_px=PX, fps=30.0
    )


def test_tidy_csv_by_hand(write, read):
    """frame,time,individual,x,y,probability, in that order."""
    path = write(
        "trajectories_tidy.csv",
        "frame,time,individual,x,y,probability\n0,0.000,0,100,200,1.000e+00\n"
        "0,0.000,1,nan,nan,0.000e+00\n1,0.067,0,110,200,nan\n1,0.067,1,300,400,9.0e-01\n",
    )

    tracks = read(path, "idtracker", m_per_px=PX).tracks

    assert tracks.agent.tolist() == [0, 0, 1]
    assert tracks.confidence == pytest.approx([1.0, 0.4, 0.9])


def test_idtracker_text_by_hand(write, read):
    """A tab ends the header but no row; -1 and -2 are estimates, NaN is none."""
    path = write(
        "trajectories_nogaps.txt",
        "X1\tY1\tProbId1\tX2\tY2\tProbId2\t\n100\t200\t0.99\t300\t400\t-1\n"
        "NaN\tNaN\tNaN\t300\t400\t-2\n120\t200\tNaN\t300\t400\t0.3\n",
    )

    tracks = read(path, "idtracker", m_per_px=PX).tracks

    assert tracks.agent.tolist() == [1, 2, 2, 1, 2]
    assert tracks.confidence == pytest.approx([0.99, 0.4, 0.1, 1.0, 0.5])


def test_hdf5_without_probabilities_is_certain(tmp_path, read):
    """Older files have none."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "trajectories.h5"
    with h5py.File(path, "w") as file:
        file["trajectories"] = np.full((2, 3, 2), 50.0)
        file.attrs["frames_per_second"] = 15

    tracks = read(path, "idtracker", m_per_px=PX).tracks

    assert tracks.confidence.tolist() == [1.0] * 6
    assert tracks.agent.tolist() == [0, 1, 2] * 2


WRONG = {
    "no trajectories": ({"trajectory": 1}, "expected the key 'trajectories', got trajectory"),
    "flat": ({"trajectories": np.zeros((3, 4))}, "shape (frame, animal, 2), got (3, 4)"),
    "in space": ({"trajectories": np.zeros((3, 4, 3))}, "shape (frame, animal, 2), got (3, 4, 3)"),
    "nobody": ({"trajectories": np.zeros((3, 0, 2))}, "shape (frame, animal, 2), got (3, 0, 2)"),
    "words": ({"trajectories": [["a"]]}, "expected trajectories of numbers, got <U1"),
    "other size": (
        {"trajectories": np.zeros((3, 2, 2)), "id_probabilities": np.zeros((2, 3))},
        "expected id_probabilities, numbers of shape (3, 2), got float64 of (2, 3)",
    ),
    "other rate": (
        {"trajectories": np.zeros((3, 2, 2)), "frames_per_second": 30},
        "states 30 frames per second, expected fps = 15",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_dictionary_is_one_clear_line(case, tmp_path, refused):
    """Expected and got, by shape or by key."""
    found, expected = WRONG[case]
    path = tmp_path / "a.npy"
    np.save(path, found, allow_pickle=True)

    assert expected in refused(path, "idtracker", m_per_px=PX)


def test_other_text_is_refused_with_what_was_expected(write, refused):
    """Headers of other programs, and ragged numbering."""
    for name, text, expected in (
        ("a.txt", "X1\tY1\tX2\tY2\n1\t2\t3\t4\n", "tab-separated columns X1, Y1, ProbId1"),
        ("b.csv", "time,x1,y1,x2\n0,1,2,3\n", "expected columns time, x1, y1, x2, y2"),
        ("c.csv", "time,x1,y1\n0,1,2\n0,1,2\n", "expected times that advance, got 0 after 0"),
        ("d.dat", "x", "expected .h5, .npy, .csv or .txt, got .dat"),
    ):
        assert expected in refused(write(name, text), "idtracker", m_per_px=PX)


def test_a_bare_array_points_to_trajectorytools(tmp_path, refused):
    """The other format that reads .npy."""
    path = tmp_path / "a.npy"
    np.save(path, np.zeros((3, 2, 2)))

    assert "--format trajectorytools" in refused(path, "idtracker", m_per_px=PX)
