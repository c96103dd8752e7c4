"""Points of the tank as CSV."""

from __future__ import annotations

import numpy as np
import pytest

from zfcal.artifacts.point_files import read_points
from zfcal.errors import DamagedError, InputError

GOOD = "# my tank\nx_px,y_px,x_m,y_m,name\n10,20.5,0,0,corner\n\n 30 , 40 , 0.5 , -0.25 ,mark\n"


def test_points_are_read_by_the_names_of_their_columns(tmp_path):
    """In any order; comments, empty lines, blanks and other columns do no harm."""
    path = tmp_path / "points.csv"
    path.write_text(GOOD)
    found = read_points(path)
    np.testing.assert_array_equal(found.px, [[10, 20.5], [30, 40]])
    np.testing.assert_array_equal(found.m, [[0, 0], [0.5, -0.25]])
    assert found.lines == (3, 5)


@pytest.mark.parametrize(("unit", "scale"), [("cm", 0.01), ("mm", 0.001)])
def test_other_units_are_named_by_the_columns(tmp_path, unit, scale):
    """And become metres."""
    path = tmp_path / "points.csv"
    path.write_text(f"\ufeffx_{unit},y_{unit},y_px,x_px\n5,6,2,1\n", encoding="utf-8")
    found = read_points(path)
    np.testing.assert_allclose(found.m, [[5 * scale, 6 * scale]])
    np.testing.assert_array_equal(found.px, [[1, 2]])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x,y,X,Y\n1,2,3,4\n", "expected the columns x_px, y_px, x_m, y_m, got x, y, X, Y"),
        ("x_px,y_px,x_m,y_cm\n", "expected the columns"),
        ("x_px,y_px,x_m,y_m,x_mm,y_mm\n", "expected the columns"),
        (GOOD.replace("20.5", "abc"), "line 3, column y_px: expected a number, got 'abc'"),
        (GOOD.replace("-0.25", "nan"), "line 5, column y_m: expected a number, got 'nan'"),
        (GOOD.replace("10,20.5,0,0,corner", "10,20.5"), "line 3, column x_m: .* got ''"),
        ("", "holds no points"),
        ("# nothing\n", "holds no points"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path, text, says):
    """The line as an editor counts."""
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        read_points(path)


def test_what_is_no_text_is_damaged(tmp_path):
    """Such as a picture."""
    path = tmp_path / "points.csv"
    path.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(DamagedError, match="is no UTF-8 text"):
        read_points(path)
    with pytest.raises(InputError, match="no such file"):
        read_points(tmp_path / "none.csv")
