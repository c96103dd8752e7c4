"""TRex: one individual or a folder of them, .npz and csv, and its scale."""

import numpy as np
import pytest


def _columns(x_cm=(10.0, 10.1, 10.2), **more):
    x = np.array(x_cm)
    return {
        "frame": np.arange(len(x), dtype=float),
        "time": np.arange(len(x)) / 15,
        "missing": np.zeros(len(x)),
        "X#wcentroid": x,
        "Y#wcentroid": np.full(len(x), 20.0),
        "X": x + 1,
        "Y": np.full(len(x), 21.0),
        **more,
    }


def test_one_individual_by_hand(tmp_path, read):
    """Centimetres become metres; the number in the name is the agent."""
    path = tmp_path / "tank_fish7.npz"
    np.savez(path, **_columns())

    imported = read(path, "trex")

    assert imported.tracks.agent.tolist() == [7, 7, 7]
    assert imported.tracks.x_m == pytest.approx([0.100, 0.101, 0.102])
    assert imported.tracks.y_m == pytest.approx([0.2, 0.2, 0.2])
    assert any("it takes an arena 30 cm wide" in note for note in imported.notes)


def test_an_interpolated_position_is_missing(tmp_path, read):
    """The mark counts, even beside a finite position; infinity counts by itself."""
    path = tmp_path / "tank_id0.npz"
    columns = _columns(missing=np.array([0.0, 1.0, 0.0]))
    columns["X#wcentroid"][2] = np.inf
    np.savez(path, **columns)

    assert read(path, "trex").tracks.frame.tolist() == [0]


def test_frames_of_individuals_start_where_each_was_found(tmp_path, read):
    """An individual that comes late has fewer rows, with the video's frame numbers."""
    np.savez(tmp_path / "tank_id0.npz", **_columns())
    np.savez(
        tmp_path / "tank_id1.npz",
        **{k: v[1:] for k, v in _columns().items()},
    )
    np.savez(tmp_path / "tank_posture_id0.npz", frames=np.arange(3))
    (tmp_path / "tank_id0.csv").write_text("not,read\n")

    tracks = read(tmp_path, "trex").tracks

    assert tracks.frame.tolist() == [0, 1, 1, 2, 2]
    assert tracks.agent.tolist() == [0, 0, 1, 0, 1]


def test_another_part_of_the_body_can_be_chosen(tmp_path, read):
    """The head is in the columns without a mark."""
    path = tmp_path / "tank_id0.npz"
    np.savez(path, **_columns())

    assert read(path, "trex", keypoint="head").tracks.x_m[0] == pytest.approx(0.11)


def test_the_scale_of_the_file_can_be_replaced(tmp_path, read):
    """10 cm at 0.02 cm per px are 500 px; at 0.4 mm per px they are 0.2 m."""
    path = tmp_path / "tank_id0.npz"
    np.savez(path, **_columns(cm_per_pixel=np.array([0.02])))

    imported = read(path, "trex", m_per_px=0.0004)

    assert imported.tracks.x_m[0] == pytest.approx(0.2)
    assert any("0.02 cm per pixel" in note for note in imported.notes)


def test_the_id_in_the_file_goes_before_the_name(tmp_path, read):
    """Newer files carry it."""
    path = tmp_path / "renamed_id0.npz"
    np.savez(path, **_columns(id=np.array([12])))

    assert read(path, "trex").tracks.agent[0] == 12


def test_csv_names_carry_units(write, read):
    """X#wcentroid (cm), and infinity as text."""
    text = "frame,X#wcentroid (cm),Y#wcentroid (cm),SPEED#wcentroid (cm/s),missing\n"
    path = write("tank_id3.csv", text + "0,10,20,1,0\n1,inf,inf,inf,1\n")

    tracks = read(path, "trex").tracks

    assert tracks.agent.tolist() == [3]
    assert tracks.x_m.tolist() == [0.1]
    assert tracks.time_s.tolist() == [0.0]


def test_csv_in_pixels_needs_a_scale(write, read, refused):
    """A unit of px in the name is believed."""
    path = write("tank_id3.csv", "frame,X#wcentroid (px),Y#wcentroid (px)\n0,10,20\n")

    assert "positions are in pixels" in refused(path, "trex")
    assert read(path, "trex", m_per_px=0.01).tracks.x_m[0] == pytest.approx(0.1)


def test_no_centroid_points_to_the_part_that_is_there(tmp_path, refused):
    """Exports differ in their columns."""
    path = tmp_path / "tank_id0.npz"
    np.savez(path, frame=np.arange(2), X=np.zeros(2), Y=np.zeros(2))

    message = refused(path, "trex")

    assert "expected 'X#wcentroid', got X, Y, frame" in message
    assert "--keypoint head" in message


WRONG = {
    "frames backwards": ({"frame": np.array([0.0, 2.0, 1.0])}, "frame numbers that ascend"),
    "a frame that is none": ({"frame": np.array([0.0, np.inf, 2.0])}, "whole frame numbers"),
    "half a frame": ({"frame": np.array([0.0, 0.5, 2.0])}, "whole frame numbers"),
    "times backwards": ({"time": np.array([0.0, 0.2, 0.1])}, "times that advance from 0"),
    "other length": ({"X#wcentroid": np.zeros(5)}, "expected 3 values in 'X#wcentroid', got 5"),
    "other rate": ({"frame_rate": np.array([30.0])}, "states 30 frames per second, expected"),
    "pickled": ({"X#wcentroid": np.array([{}], dtype=object)}, "expected a whole .npz file"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_clear_line(case, tmp_path, refused):
    """The file of the individual is named."""
    columns, expected = WRONG[case]
    path = tmp_path / "tank_id0.npz"
    np.savez(path, **_columns(**columns))

    message = refused(path, "trex")

    assert "tank_id0.npz" in message
    assert expected in message


def test_folders_of_no_or_two_videos_are_refused(tmp_path, refused):
    """Which one is meant cannot be guessed."""
    assert "got those of 0" in refused(tmp_path, "trex")

    np.savez(tmp_path / "monday_id0.npz", **_columns())
    np.savez(tmp_path / "tuesday_id0.npz", **_columns())

    assert "got those of 2: monday, tuesday" in refused(tmp_path, "trex")


def test_a_part_that_trex_does_not_know_lists_those_it_does(tmp_path, refused):
    """As for any name that a person gives."""
    path = tmp_path / "tank_id0.npz"
    np.savez(path, **_columns())

    assert "no body part 'tail', expected one of wcentroid, centroid" in refused(
        path, "trex", keypoint="tail"
    )
