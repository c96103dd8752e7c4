"""MOT csv: boxes by their corner, points by their centre."""

import pytest

PX = 0.001
HEAD = "frame,id,x,y,width,height,confidence\n"


def test_a_box_is_taken_at_its_centre_by_hand(write, read):
    """Corner (100, 200), 40 x 10 px: centre (120, 205) px; frame 1 is the first."""
    path = write("gt.txt", "1,3,100,200,40,10,1,-1,-1,-1\n")

    tracks = read(path, "mot", m_per_px=PX).tracks

    assert (tracks.x_m[0], tracks.y_m[0]) == pytest.approx((0.120, 0.205))
    assert (tracks.frame[0], tracks.time_s[0], tracks.agent[0]) == (0, 0.0, 3)


def test_x_and_y_can_be_the_centre_of_a_box(write, read):
    """Some programs write centres."""
    path = write("gt.txt", "1,3,100,200,40,10,1\n")

    assert read(path, "mot", m_per_px=PX, box="centre").tracks.x_m[0] == pytest.approx(0.1)


def test_without_a_box_x_and_y_are_the_animal(write, read):
    """Width and height of -1: a point; x = y = -1: missing."""
    path = write("gt.csv", HEAD + "1,1,100,200,-1,-1,0.1\n1,2,-1,-1,-1,-1,-1\n2,1,NaN,5,-1,-1,1\n")

    tracks = read(path, "mot", m_per_px=PX).tracks

    assert tracks.x_m == pytest.approx([0.1])
    assert tracks.confidence == pytest.approx([0.1])


def test_a_box_at_minus_one_is_a_box(write, read):
    """Half out of the picture, but there."""
    path = write("gt.csv", HEAD + "1,1,-1,-1,40,10,1\n")

    assert read(path, "mot", m_per_px=PX).tracks.x_m[0] == pytest.approx(0.019)


def test_a_confidence_of_minus_one_says_nothing_and_scores_are_cut(write, read):
    """-1 is certain here; detectors' scores beyond [0, 1] are cut, with a note."""
    path = write("det.csv", HEAD + "1,1,5,5,-1,-1,-1\n1,2,6,6,-1,-1,2.5\n1,3,7,7,-1,-1,-0.2\n")

    imported = read(path, "mot", m_per_px=PX)

    assert imported.tracks.confidence.tolist() == [1.0, 1.0, 0.0]
    assert "2 confidences lie outside 0 to 1 and are cut to it." in imported.notes


def test_frames_can_be_counted_from_zero(write, read, refused):
    """Frame 0 under the standard's count is refused, with the way out."""
    path = write("gt.csv", HEAD + "0,1,5,5,-1,-1,1\n1,1,5,5,-1,-1,1\n")

    message = refused(path, "mot", m_per_px=PX)

    assert "line 2, column frame: expected a frame number of 1 or more, got 0" in message
    assert "--first-frame 0" in message
    assert read(path, "mot", m_per_px=PX, first_frame=0).tracks.frame.tolist() == [0, 1]


@pytest.mark.parametrize("head", ["frame,id,bb_left,bb_top,bb_width,bb_height,conf\n", ""])
def test_headers_of_the_usual_tools_are_known(head, write, read):
    """And none at all."""
    path = write("gt.csv", head + "1,1,5,5,-1,-1,1\n")

    assert len(read(path, "mot", m_per_px=PX).tracks) == 1


WRONG = {
    "other columns": ("frame,id,keypoint,y,x,confidence\n1,1,0,5,5,1\n", "expected columns frame"),
    "too few": ("1,1,5,5\n", "line 1: expected 7 to 10 columns"),
    "word": (HEAD + "1,1,five,5,-1,-1,1\n", "line 2, column x: expected a number, got 'five'"),
    "word without header": ("1,1,5,5,-1,-1,1\n2,1,b,5,-1,-1,1\n", "line 2, column x: expected"),
    "half an id": (HEAD + "1,1.5,5,5,-1,-1,1\n", "line 2, column id: expected a whole number"),
    "infinite": (HEAD + "1,1,inf,5,-1,-1,1\n", "expected a finite position, got (inf, 5.0)"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_clear_line(case, write, refused):
    """With line and column, header or not."""
    text, expected = WRONG[case]

    assert expected in refused(write("gt.csv", text), "mot", m_per_px=PX)


def test_a_choice_of_corner_or_centre_needs_boxes(write, refused):
    """An option that cannot take effect is an error."""
    path = write("gt.csv", HEAD + "1,1,5,5,-1,-1,1\n")

    assert "no row has a box" in refused(path, "mot", m_per_px=PX, box="corner")
