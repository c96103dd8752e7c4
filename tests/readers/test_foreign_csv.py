"""CSV tracks: what is read, and each wrong file with its line, column, expected and got."""

import numpy as np
import pytest

HEADER = "time_s,agent,kind,x_m,y_m,heading_rad,confidence\n"
SURE = "0.0666667,0,0.1,0.2,0.9\n"


def test_all_columns_by_hand(write, read):
    """Optional columns are taken; an empty heading is unknown, an empty confidence certain."""
    path = write(
        "tracks.csv",
        HEADER + "0.0,3,fish,0.1,0.2,1.5,0.25\n0.0,7,robot,0.3,0.4,,\n"
        "0.0666667,3,fish,0.11,0.2,-3.2,1\n",
    )

    tracks = read(path, "csv").tracks

    assert tracks.agent.tolist() == [3, 7, 3]
    assert tracks.kind.tolist() == [0, 1, 0]
    assert tracks.frame.tolist() == [0, 0, 1]
    assert tracks.time_s.tolist() == [0.0, 0.0, 0.0666667]
    assert tracks.x_m.tolist() == [0.1, 0.3, 0.11]
    # -3.2 rad and 2 pi - 3.2 are the same direction.
    assert tracks.heading_rad == pytest.approx([1.5, np.nan, 2 * np.pi - 3.2], nan_ok=True)
    assert tracks.confidence.tolist() == [0.25, 1.0, 1.0]


def test_pixels_are_scaled_and_turned_up_by_hand(write, read):
    """(60, 80) px about (10, 100) px at 2 mm per px is (0.10, 0.04) m; the heading is mirrored."""
    path = write("tracks.csv", "time_s,agent,x_px,y_px,heading_rad\n0,0,60,80,0.5\n")

    tracks = read(path, "csv", m_per_px=0.002, origin=(10.0, 100.0), flip_y=True).tracks

    assert tracks.x_m[0] == pytest.approx(0.10)
    assert tracks.y_m[0] == pytest.approx(0.04)
    assert tracks.heading_rad[0] == pytest.approx(-0.5)


def test_turning_up_twice_is_the_file_again(write, read):
    """A mirror is its own inverse, for positions about its origin and for headings."""
    text = "time_s,agent,x_m,y_m,heading_rad\n0,0,0.25,0.5,2.0\n"
    once = read(write("a.csv", text), "csv", origin=(0.0, 0.0), flip_y=True).tracks

    again = (
        f"time_s,agent,x_m,y_m,heading_rad\n0,0,{once.x_m[0]},{once.y_m[0]},{once.heading_rad[0]}\n"
    )
    twice = read(write("b.csv", again), "csv", origin=(0.0, 0.0), flip_y=True).tracks

    assert once.y_m[0] == -0.5
    assert (twice.x_m[0], twice.y_m[0]) == (0.25, 0.5)
    assert twice.heading_rad[0] == pytest.approx(2.0)


def test_metres_are_taken_beside_pixels_unless_a_scale_is_given(write, read):
    """The scale says which columns are meant; the others are passed over."""
    path = write("tracks.csv", "time_s,agent,x_px,y_px,x_m,y_m\n0,0,100,200,0.5,0.6\n")

    metres = read(path, "csv")
    pixels = read(path, "csv", m_per_px=0.001)

    assert (metres.tracks.x_m[0], pixels.tracks.x_m[0]) == (0.5, 0.1)
    assert "Columns that are not used: x_px, y_px." in metres.notes
    assert "Columns that are not used: x_m, y_m." in pixels.notes


def test_a_frame_column_does_without_times(write, read):
    """time_s = (frame - first_frame) / fps."""
    path = write("tracks.csv", "frame,agent,x_m,y_m\n1,0,0.1,0.2\n4,0,0.1,0.2\n")

    tracks = read(path, "csv", first_frame=1).tracks

    assert tracks.frame.tolist() == [0, 3]
    assert tracks.time_s == pytest.approx([0.0, 0.2])


@pytest.mark.parametrize("first_frame", [0, 1])
def test_a_first_frame_in_a_file_without_frames_is_refused(write, refused, first_frame):
    """What it could have no effect on is named, with the columns that there are."""
    path = write("tracks.csv", "time_s,agent,x_m,y_m\n0,0,0.1,0.2\n")

    message = refused(path, "csv", first_frame=first_frame)

    assert f"{path}, line 1: first_frame = {first_frame} cannot take effect" in message
    assert "expected a column 'frame', got time_s, agent, x_m, y_m." in message
    assert "--columns frame=NAME" in message


@pytest.mark.parametrize("columns", ["x_m,y_m", "x_m,y_m,confidence"])
def test_a_least_confidence_in_a_file_without_any_is_refused(write, refused, read, columns):
    """Without the column, and with one that says nothing; one word in it is enough."""
    end = "," if columns.endswith("confidence") else ""
    rows = f"0,0,0.1,0.2{end}\n0.0666667,0,0.1,0.2{end}\n"
    path = write("tracks.csv", f"time_s,agent,{columns}\n{rows}")
    sure = write("sure.csv", f"time_s,agent,x_m,y_m,confidence\n0,0,0.1,0.2,\n{SURE}")

    message = refused(path, "csv", min_confidence=0.5)

    assert f"{path}: min_confidence = 0.5 cannot take effect: expected a confidence" in message
    assert "Leave --min-confidence out" in message
    assert len(read(path, "csv", min_confidence=0.0).tracks) == 2
    assert len(read(sure, "csv", min_confidence=0.5).tracks) == 2


def test_a_frame_column_beside_times_is_kept(write, read):
    """A clock that wavers by milliseconds keeps the frame numbers of the camera."""
    path = write(
        "tracks.csv",
        "time_s,frame,agent,x_m,y_m\n0.002,0,0,0.1,0.1\n0.065,1,0,0.1,0.1\n0.135,2,0,0.1,0.1\n",
    )

    tracks = read(path, "csv").tracks

    assert tracks.frame.tolist() == [0, 1, 2]
    assert tracks.time_s.tolist() == [0.002, 0.065, 0.135]


def test_columns_can_be_renamed_and_agents_can_have_names(write, read):
    """Names that are no numbers are numbered in their order, and a note says how."""
    path = write("tracks.csv", "frame,id,pos_x,pos_y\n0,B,10,20\n0,A,30,40\n")
    columns = (("agent", "id"), ("x_px", "pos_x"), ("y_px", "pos_y"))

    imported = read(path, "csv", m_per_px=0.01, columns=columns, robots=("B",))

    assert imported.tracks.agent.tolist() == [0, 1]
    assert imported.tracks.x_m == pytest.approx([0.3, 0.1])
    assert imported.tracks.kind.tolist() == [0, 1]
    assert "Agents are numbered: A = 0, B = 1." in imported.notes


def test_named_agents_are_numbered_in_alphabetical_order(write, read):
    """Whatever their order in the file, so that a second import numbers them alike."""
    rows = "".join(f"0,{name},0.{k + 1},0.1\n" for k, name in enumerate("HGFEDCBA"))
    path = write("tracks.csv", "time_s,agent,x_m,y_m\n" + rows)

    assert read(path, "csv").tracks.x_m == pytest.approx(np.arange(8, 0, -1) / 10)


def test_extra_columns_are_passed_over_and_reported(write, read):
    """Nothing is dropped without a word."""
    path = write("tracks.csv", "time_s,agent,x_m,y_m,speed,mood\n0,0,0.1,0.2,9,calm\n")

    assert "Columns that are not used: speed, mood." in read(path, "csv").notes


def test_rows_may_be_grouped_by_agent_and_spread_over_lines(write, read):
    """Order in the file is free between agents; empty lines, CRLF and a byte order mark pass."""
    path = write(
        "tracks.csv",
        "\ufefftime_s,agent,x_m,y_m\r\n0,1,0.1,0.2\r\n\r\n0.0667,1,0.1,0.2\r\n0,0,0.3,0.4\r\n\r\n",
    )

    tracks = read(path, "csv").tracks

    assert tracks.frame.tolist() == [0, 0, 1]
    assert tracks.agent.tolist() == [0, 1, 1]


def test_a_compressed_file_reads_the_same(write, read):
    """.csv.gz is unpacked on the way."""
    text = "time_s,agent,x_m,y_m\n0,0,0.1,0.2\n"

    plain, packed = read(write("a.csv", text), "csv"), read(write("a.csv.gz", text), "csv")

    assert packed.tracks.x_m.tolist() == plain.tracks.x_m.tolist() == [0.1]


def test_missing_positions_are_counted_and_leave_no_row(write, read):
    """NaN, empty, or one coordinate without the other."""
    path = write(
        "tracks.csv",
        "time_s,agent,x_m,y_m\n0,0,NaN,NaN\n0,1,,\n0,2,0.1,\n0,3,0.1,0.2\n",
    )

    imported = read(path, "csv")

    assert imported.tracks.agent.tolist() == [3]
    assert "3 of 4 positions are missing." in imported.notes


def test_numbers_that_turn_into_fractions_late_are_read(write, read):
    """The type of a column is not settled by its first thousand rows."""
    rows = "".join(f"{k / 15!r},0,{1 if k < 60_000 else 0.5},0\n" for k in range(60_010))
    path = write("tracks.csv", "time_s,agent,x_m,y_m\n" + rows)

    assert read(path, "csv").tracks.x_m[-1] == 0.5


def test_an_hour_of_six_agents_is_read_whole(tmp_path, read):
    """Every row, which takes about half a second on one core."""
    n = 3600 * 15 * 6
    frame, agent = np.divmod(np.arange(n), 6)
    columns = np.column_stack([frame / 15, agent, 0.3 + agent * 0.01, 0.5 + frame * 1e-6])
    path = tmp_path / "hour.csv"
    np.savetxt(path, columns, fmt="%.9g", delimiter=",", header="time_s,agent,x_m,y_m", comments="")

    assert len(read(path, "csv").tracks) == n


HEAD = "time_s,agent,x_m,y_m\n"

WRONG = {
    "empty": ("", "the file is empty, expected a header line and rows"),
    "blank": ("\n\n", "the file is empty"),
    "header only": (HEAD, "there is a header but no row below it"),
    "semicolons": (
        "time_s;agent;x_m;y_m\n0;0;0,1;0,2\n",
        "line 1: expected columns separated by commas, got semicolons: 'time_s;agent;x_m;y_m'",
    ),
    "tabs": ("time_s\tagent\tx_m\ty_m\n0\t0\t0.1\t0.2\n", "separated by commas, got tabs"),
    "no agent": (
        "time_s,x_m,y_m\n0,0.1,0.2\n",
        (
            "line 1: expected columns time_s (or frame), agent, and x_m, y_m (or x_px, y_px), got "
            "time_s, x_m, y_m. Rename them in the file, or here: --columns agent=id"
        ),
    ),
    "no y": ("time_s,agent,x_m\n0,0,0.1\n", "expected columns time_s (or frame), agent"),
    "no clock": ("agent,x_m,y_m\n0,0.1,0.2\n", "expected columns time_s (or frame), agent"),
    "twice": (
        "time_s,agent,x_m,x_m,y_m\n0,0,1,2,3\n",
        "line 1: column 'x_m' is there twice",
    ),
    "short row": (
        HEAD + "0,0,0.1,0.2\n0.0667,0,0.1\n",
        "line 3: expected 4 cells, got 3: '0.0667,0,0.1'. The file may have been cut short",
    ),
    "long row": (HEAD + "0,0,0.1,0.2,0.3\n", "line 2: expected 4 cells, got 5"),
    "word": (
        HEAD + "0,0,0.1,0.2\n\n0.0667,0,abc,0.2\n",
        "line 4, column x_m: expected a number, got 'abc'",
    ),
    "decimal comma": (
        'time_s,agent,x_m,y_m\n0,0,"0,1",0.2\n',
        "line 2, column x_m: expected a number, got '0,1'",
    ),
    "inf": (
        HEAD + "0,0,0.1,0.2\n0.0667,0,inf,0.2\n",
        (
            "line 3, column x_m: expected a finite number, or nothing where the agent is missing, "
            "got inf"
        ),
    ),
    "all missing": (HEAD + "0,0,,\n", "expected positions, got none: all 1 are missing"),
    "no time": (HEAD + ",0,0.1,0.2\n", "line 2, column time_s: expected seconds since"),
    "negative time": (
        HEAD + "-1,0,0.1,0.2\n",
        "line 2, column time_s: expected seconds since the start of the trial, got -1",
    ),
    "unix time": (HEAD + "1700000000,0,0.1,0.2\n", "since the start of the trial, got 1700000000"),
    "backwards": (
        HEAD + "0,0,0.1,0.2\n0.1333,0,0.1,0.2\n0.0667,0,0.1,0.2\n",
        (
            "line 4, column time_s: expected times of agent 0 that never run backwards, got 0.0667 "
            "after 0.1333"
        ),
    ),
    "same time": (
        HEAD + "0,0,0.1,0.2\n0,1,0.1,0.2\n0,0,0.1,0.2\n",
        "line 4, column time_s: expected agent 0 once in frame 0 (at fps = 15), got 0 s and 0 s",
    ),
    "no agent number": (
        HEAD + "0,0,0.1,0.2\n0.0667,,0.1,0.2\n",
        "line 3, column agent: expected an agent, got nothing",
    ),
    "kind": (
        "time_s,agent,kind,x_m,y_m\n0,0,shark,0.1,0.2\n",
        "line 2, column kind: expected fish or robot, got 'shark'",
    ),
    "no kind": ("time_s,agent,kind,x_m,y_m\n0,0,,0.1,0.2\n", "expected fish or robot, got nothing"),
    "two kinds": (
        "time_s,agent,kind,x_m,y_m\n0,0,fish,0.1,0.2\n0.0667,0,robot,0.1,0.2\n",
        "line 3, column kind: expected agent 0 to stay what it is, got robot",
    ),
    "pixels as metres": (
        HEAD + "0,0,100,200\n0.0667,0,110,210\n0.1333,0,900,210\n",
        (
            "column x_m: expected metres within a tank of 20 m, got 900: the column spans 800. "
            "That looks like pixels or millimetres: call the columns x_px, y_px and give "
        ),
    ),
    "degrees": (
        "time_s,agent,x_m,y_m,heading_rad\n0,0,0.1,0.2,359\n",
        "line 2, column heading_rad: expected radians within -2 pi to 2 pi, got 359 (degrees?)",
    ),
    "percent": (
        "time_s,agent,x_m,y_m,confidence\n0,0,0.1,0.2,99\n",
        "line 2, column confidence: expected 0 to 1, got 99",
    ),
    "fraction of a frame": (
        "frame,agent,x_m,y_m\n0.5,0,0.1,0.2\n",
        "line 2, column frame: expected a whole number, got 0.5",
    ),
    "frame backwards": (
        "frame,agent,x_m,y_m\n5,0,0.1,0.2\n4,0,0.1,0.2\n",
        "line 3, column frame: expected times of agent 0 that never run backwards, got 4 after 5",
    ),
    "negative frame": (
        "frame,agent,x_m,y_m\n-1,0,0.1,0.2\n",
        "line 2, column frame: expected a frame number of 0 or more, got -1",
    ),
    "frame with two times": (
        "time_s,frame,agent,x_m,y_m\n0,0,0,0.1,0.2\n0.05,0,1,0.1,0.2\n",
        "line 3, column time_s: expected one time for frame 0, got another: 0.05",
    ),
    "time stands still": (
        "time_s,frame,agent,x_m,y_m\n0.1,0,0,0.1,0.2\n0.05,1,1,0.1,0.2\n",
        "line 3, column time_s: expected a later time in frame 1 than in the one before, got 0.05",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_line_with_the_place_expected_and_got(case, write, refused):
    """One clear line: file, line, column, expected, got, and what to do."""
    text, expected = WRONG[case]
    path = write("tracks.csv", text)

    message = refused(path, "csv")

    assert str(path) in message
    assert expected in message


def test_bytes_that_are_no_text_are_named(tmp_path, refused):
    """A picture under the name of a table."""
    path = tmp_path / "tracks.csv"
    path.write_bytes(b"\x89PNG\r\n\x1a\n\x00\xff\xfe")

    assert "expected a text file in UTF-8, got other bytes" in refused(path, "csv")


def test_a_broken_archive_is_named(tmp_path, refused):
    """Something else under the name of a compressed file."""
    path = tmp_path / "tracks.csv.gz"
    path.write_bytes(b"time_s,agent,x_m,y_m\n")

    assert "cannot be read" in refused(path, "csv")


def test_two_rows_in_one_frame_are_told_with_their_times(write, refused):
    """An extra row between two frames of an agent: not another rate, but no frame of its own."""
    times = np.sort(np.append(np.arange(100) / 15, 2.02))
    path = write("tracks.csv", HEAD + "".join(f"{t:.4f},0,0.1,0.2\n" for t in times))

    message = refused(path, "csv")

    assert (
        "line 33, column time_s: expected agent 0 once in frame 30 (at fps = 15), got 2 s and "
        "2.02 s"
    ) in message


def test_two_rates_in_one_file_are_both_told(write, refused):
    """A minute at 15 Hz, then a minute at 30 Hz."""
    times = np.concatenate([np.arange(900) / 15, 60 + np.arange(1800) / 30])
    path = write("tracks.csv", HEAD + "".join(f"{t:.5f},0,0.1,0.2\n" for t in times))

    message = refused(path, "csv", fps=15.0)

    assert "two frame rates, 15 Hz at first and 30 Hz from about" in message


def test_another_rate_than_asked_for_is_told_with_both(write, refused):
    """25 Hz in the file, 15 Hz in the trial."""
    path = write("tracks.csv", HEAD + "".join(f"{k / 25},0,0.1,0.2\n" for k in range(100)))

    message = refused(path, "csv", fps=15.0)

    assert "the times advance at 25 Hz, expected fps = 15 Hz. Give --fps 25" in message


def test_frames_that_advance_at_another_rate_than_times_are_refused(write, refused):
    """Every second frame of a camera at 30 Hz is not 15 frames a second numbered by one."""
    rows = "".join(f"{k / 15},{2 * k},0,0.1,0.2\n" for k in range(50))
    path = write("tracks.csv", "time_s,frame,agent,x_m,y_m\n" + rows)

    assert "the times advance at 30 Hz, expected fps = 15 Hz" in refused(path, "csv")


def test_a_column_to_rename_must_be_there_and_be_ours(write, refused):
    """Both ends of --columns are checked."""
    path = write("tracks.csv", "time_s,agent,x_m,y_m\n0,0,0.1,0.2\n")

    assert "expected a column 'pos_x' (for x_px)" in refused(
        path, "csv", columns=(("x_px", "pos_x"),)
    )
    assert "'speed' is no column of tracks" in refused(path, "csv", columns=(("speed", "x_m"),))
