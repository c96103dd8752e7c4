"""CATS2: its text files and its trajectory XML."""

import numpy as np
import pytest

HEAD = "timeStep\trobot0X\trobot0Y\trobot0Direction\tfish0X\tfish0Y\tfish0Direction\t\n"


def test_robots_and_fish_by_hand(write, read):
    """Columns in the file's order, kinds by their names, directions in radians, times from 0."""
    path = write(
        "positions-1.txt",
        HEAD + "12.500\t0.1\t0.2\t-1.5\t0.3\t0.4\t3\t\n12.567\tNaN\tNaN\tNaN\t0.31\t0.4\t0\t\n",
    )

    imported = read(path, "cats")
    tracks = imported.tracks

    assert tracks.agent.tolist() == [0, 1, 1]
    assert tracks.kind.tolist() == [1, 0, 0]
    assert tracks.frame.tolist() == [0, 0, 1]
    assert tracks.time_s == pytest.approx([0.0, 0.0, 0.067])
    assert tracks.x_m.tolist() == [0.1, 0.3, 0.31]
    # A direction of exactly 0 is the tracker's word for an unknown one.
    assert tracks.heading_rad == pytest.approx([-1.5, 3.0, np.nan], nan_ok=True)
    assert "Agents are numbered: robot0 = 0, fish0 = 1." in imported.notes
    assert "Times are counted from the first row, 12.5 s in the file." in imported.notes


def test_exactly_zero_is_missing(write, read):
    """An invalid position is written as its default."""
    path = write("positions-1.txt", HEAD + "0.000\t0\t0\t0\t0.3\t0.4\t3\t\n")

    imported = read(path, "cats")

    assert imported.tracks.kind.tolist() == [0]
    assert "1 positions at exactly (0, 0) are taken as missing." in imported.notes


def test_a_wavering_clock_gives_each_row_its_own_frame(write, read):
    """Times half way between frames, give or take 8 ms: rounding them would share frames."""
    rng = np.random.default_rng(1)
    times = (np.arange(2000) + 0.5) / 15 + rng.uniform(-0.008, 0.008, 2000)
    rows = "".join(f"{t:.3f}\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n" for t in times)
    path = write("positions-1.txt", HEAD + rows)

    tracks = read(path, "cats").tracks

    assert (np.diff(np.unique(tracks.frame)) == 1).all()
    assert len(np.unique(tracks.frame)) == 2000


def test_a_gap_in_time_is_a_gap_in_frames(write, read):
    """One second without rows is 15 frames."""
    times = [0.0, 0.067, 0.133, 1.133, 1.2]
    rows = "".join(f"{t:.3f}\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n" for t in times)
    path = write("positions-1.txt", HEAD + rows)

    assert np.unique(read(path, "cats").tracks.frame).tolist() == [0, 1, 2, 17, 18]


def test_two_rows_close_in_time_have_two_frames(write, read):
    """20 ms apart at 15 Hz: less than half a frame, but two pictures."""
    times = [0.0, 0.067, 0.133, 0.153, 0.22, 0.287, 0.353]
    rows = "".join(f"{t:.3f}\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n" for t in times)
    path = write("positions-1.txt", HEAD + rows)

    assert np.unique(read(path, "cats").tracks.frame).tolist() == [0, 1, 2, 3, 4, 5, 6]


def _xml(points):
    return (
        '<?xml version="1.0"?>\n<opencv_storage>\n<polygon>\n  '
        + "\n  ".join(points)
        + "</polygon>\n</opencv_storage>\n"
    )


def test_an_xml_trajectory_is_one_fish_played_at_the_rate(write, read):
    """Pairs may break over lines; a repeated pair is a guess, as CATS2 fills gaps."""
    path = write("fish.xml", _xml(["1.0e-01 2.0e-01 1.5e-01", "2.0e-01 1.5e-01 2.0e-01"]))

    imported = read(path, "cats", fps=10.0)

    assert imported.tracks.x_m.tolist() == [0.1, 0.15, 0.15]
    assert imported.tracks.y_m.tolist() == [0.2, 0.2, 0.2]
    assert imported.tracks.time_s.tolist() == [0.0, 0.1, 0.2]
    assert imported.tracks.confidence.tolist() == [1.0, 1.0, 0.0]
    assert any(note.startswith("1 positions repeat the one before") for note in imported.notes)


WRONG_TEXT = {
    "commas": (HEAD.replace("\t", ","), "expected columns separated by tabs, got commas"),
    "other columns": ("timeStep\tx\ty\n0\t1\t2\n", "expected tab-separated columns timeStep"),
    "half an agent": (
        "timeStep\tfish0X\tfish0Y\n0\t1\t2\n",
        "fish0Direction is missing",
    ),
    "backwards": (
        HEAD + "1.0\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n0.9\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n",
        "line 3, column timeStep: expected a later time in each row, got 0.9 after 1",
    ),
    "no time": (
        HEAD + "NaN\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n",
        "line 2, column timeStep: expected a later time in each row, got nan",
    ),
    "cut": (
        HEAD + "1.0\t0.1\t0.2\t1\t0.3\t0.4\t1\t\n1.067\t0.1\t0.",
        "line 3: expected 8 cells, got 3",
    ),
    "header only": (HEAD, "there is a header but no row below it"),
}


@pytest.mark.parametrize("case", WRONG_TEXT)
def test_a_wrong_text_file_is_one_clear_line(case, write, refused):
    """With the line and the column."""
    text, expected = WRONG_TEXT[case]

    assert expected in refused(write("positions-1.txt", text), "cats")


WRONG_XML = {
    "cut": (_xml(["1 2"])[:-20], "expected a whole XML file"),
    "other root": ("<svg/>", "expected <opencv_storage> with a <polygon> of x y pairs, got <svg>"),
    "odd": (_xml(["1 2 3"]), "expected pairs x y in <polygon>, got 3 numbers"),
    "empty": (_xml([""]), "expected pairs x y in <polygon>, got 0 numbers"),
    "words": (_xml(["1 two"]), "expected numbers in <polygon>"),
    "map": (
        _xml(["1 2"]).replace("</polygon>", "</polygon><excludedPolygons/>"),
        "expected a trajectory, got the map of a set-up",
    ),
}


@pytest.mark.parametrize("case", WRONG_XML)
def test_a_wrong_xml_file_is_one_clear_line(case, write, refused):
    """Maps of a set-up look alike: they are told apart."""
    text, expected = WRONG_XML[case]

    assert expected in refused(write("fish.xml", text), "cats")


def test_xml_that_grows_is_refused(write, refused):
    """Entities in entities: the parser stops them, or there are no numbers in them."""
    entities = "".join(
        f'<!ENTITY e{i} "{f"&e{i - 1};" * 10 if i else "1 " * 10}">' for i in range(9)
    )
    path = write(
        "fish.xml",
        f"<!DOCTYPE x [{entities}]><opencv_storage><polygon>&e8;</polygon></opencv_storage>",
    )

    assert "expected" in refused(path, "cats")
