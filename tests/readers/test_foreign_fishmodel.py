"""The text of FishModel: steps of no known length, y as the rows of an image, no header."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from zfcal.readers import guess_format

PRINTED = Path(__file__).parent / "golden" / "fishmodel-printed.txt"
"""40 steps of 3 fish, printed by a program in C++ that has FishModel's output statements."""

TWO = "0.000000\t0.1 0.2 0\t0.3 0.4 1.5\n0.066667\t0.11 0.2 0\t0.3 0.41 1.5\n"


def test_what_the_simulator_prints_is_read_step_by_step(read):
    """The first and last numbers of the file by eye; 0.00002 is printed as 2e-05."""
    tracks = read(PRINTED, "fishmodel", fps=3.0).tracks

    assert guess_format(PRINTED) == "fishmodel"
    assert len(tracks) == 40 * 3
    assert tracks.x_m[:3] == pytest.approx([2e-05, 0.5, 0.71], abs=1e-15)
    assert tracks.heading_rad[:3] == pytest.approx([1.25, -0.4, 6.1 - 2 * np.pi], abs=1e-6)
    x_m, y_m, direction_rad = PRINTED.read_text().splitlines()[-1].split("\t")[3].split(" ")
    assert (tracks.x_m[-1], tracks.y_m[-1]) == (float(x_m), float(y_m))
    assert np.cos(tracks.heading_rad[-1] - float(direction_rad)) == pytest.approx(1)


@pytest.mark.parametrize("fps", [3.0, 5.0, 15.0])
def test_a_step_is_as_long_as_the_rate_says(fps, write, read):
    """The file says 1/15 s whatever it was; what is taken is told."""
    found = read(write("aa", TWO), "fishmodel", fps=fps)

    assert found.tracks.frame.tolist() == [0, 0, 1, 1]
    assert found.tracks.time_s == pytest.approx([0, 0, 1 / fps, 1 / fps])
    assert f"{fps:g} steps a second are taken" in found.notes[0]


def test_steps_that_are_not_there_stay_away(write, read):
    """Every third line of a run: frames 0, 3, 6."""
    lines = PRINTED.read_text().splitlines()[:7:3]

    tracks = read(write("aa", "\n".join(lines)), "fishmodel", fps=3.0).tracks

    assert tracks.frame[::3].tolist() == [0, 3, 6]
    assert tracks.time_s[::3] == pytest.approx([0, 1, 2])


def test_y_counts_down_as_in_the_image_of_the_arena(write, read):
    """It is told, and turned about the upper edge of the square of 1 m when asked for."""
    path = write("aa", TWO)
    down = read(path, "fishmodel")
    up = read(path, "fishmodel", flip_y=True, origin=(0.0, 1.0))

    assert any("y counts downwards" in note for note in down.notes)
    assert not any("y counts downwards" in note for note in up.notes)
    assert up.tracks.y_m == pytest.approx([0.8, 0.6, 0.8, 0.59])
    assert up.tracks.heading_rad == pytest.approx([0, -1.5, 0, -1.5])


def test_an_agent_whose_trajectory_is_over_is_missing(write, read):
    """The simulator writes 0 0 0 for it; a fish at the left edge is where it is."""
    path = write("aa", "0.000000\t0 0 0\t0 0.4 0\n0.066667\t0.1 0.1 0\t0 0 0\n")

    found = read(path, "fishmodel")

    assert found.tracks.agent.tolist() == [1, 0]
    assert "2 positions at exactly 0 0 0 are taken as missing." in found.notes


def test_older_output_with_six_digits_of_time_is_read(write, read):
    """Without fixed decimals 1000 s and a step is written as 1000.07."""
    text = "1000\t0.1 0.2 0\n1000.07\t0.1 0.2 0\n1000.13\t0.1 0.2 0\n"

    assert read(write("aa", text), "fishmodel").tracks.frame.tolist() == [15000, 15001, 15002]


def test_a_packed_file_is_unpacked(tmp_path, read):
    """The same tracks as from the file itself."""
    path = tmp_path / "aa.gz"
    path.write_bytes(gzip.compress(PRINTED.read_bytes()))

    assert guess_format(path) == "fishmodel"
    assert np.array_equal(read(path, "fishmodel").tracks.x_m, read(PRINTED, "fishmodel").tracks.x_m)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time\tx y direction\n", "line 1: expected a time and x, y and direction of 1 agents"),
        ("0.000000 0.1 0.2 0.3\n", "line 1: expected a time and x, y and direction of some agents"),
        (TWO + "0.133333\t0.1 0.2 0\n", "line 3: expected a time and x, y and direction of 2"),
        (TWO + "0.133333\t0.1 0.2 0\t0.3 0.4\n", "line 3: expected a time"),
        (TWO + "0.133333\t0.1 0.2 0\t0.3 abc 1\n", "line 3: expected a time"),
        (TWO + "0.133333\t0.1 0.2 0\t0.3 inf 1\n", "line 3: expected a time"),
        (TWO + "0.066667\t0.1 0.2 0\t0.3 0.4 1\n", "line 3: expected a later step than 1, got 1"),
        (TWO + TWO, "line 3: expected a later step than 1, got 0. Two runs in one file"),
        ("0.000000\t0.1 0.2 0\n0.333333\t0.1 0.2 0\n0.500000\t0.1 0.2 0\n", "line 3: expected a"),
        ("nan\t0.1 0.2 0\n", "line 1: expected a time that is a whole number of 1/15 s"),
        ("1e30\t0.1 0.2 0\n", "line 1: expected a time of at most 143165576 s, got 1e30"),
        (TWO + "1e19\t0.1 0.2 0\t0.3 0.4 0\n", "line 3: expected a time of at most"),
        ("-1.000000\t0.1 0.2 0\n", "line 1: expected a time that is a whole number of 1/15 s"),
        ("0.000000\tnan nan nan\n0.066667\t-nan -nan -nan\n", "expected positions, got none"),
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("0.000000\t0.1 0.2\0 0\n", "expected a text file, got binary data"),
    ],
)
def test_a_damaged_file_is_told_with_its_line(text, message, write, refused):
    """What was expected and what is there; nothing is skipped."""
    assert message in refused(write("aa", text), "fishmodel")
