"""The last step of every import: scale, missing, kinds, and checks on the whole."""

from pathlib import Path

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers.assemble import assemble
from zfcal.readers.options import ImportOptions
from zfcal.readers.raw import Grid, Rows

HERE = Path("tracks.h5")


def _rows(**columns):
    given = {
        "time_s": np.array([0.0, 0.0, 0.1]),
        "frame": np.array([0, 0, 1]),
        "agent": np.array([4, 2, 4]),
        "x": np.array([10.0, 20.0, 30.0]),
        "y": np.array([1.0, 2.0, 3.0]),
        "unit": "px",
    }
    return Rows(**{**given, **columns})


def _options(**given):
    return ImportOptions(**{"fps": 10.0, "m_per_px": 0.01, **given})


def test_rows_come_sorted_by_frame_then_agent():
    """Whatever their order in the file."""
    tracks = assemble(HERE, _rows(), _options()).tracks

    assert tracks.frame.tolist() == [0, 0, 1]
    assert tracks.agent.tolist() == [2, 4, 4]
    assert tracks.x_m == pytest.approx([0.2, 0.1, 0.3])


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001)])
def test_units_of_length_are_known(unit, metres):
    """Ten of them, in metres."""
    tracks = assemble(HERE, _rows(unit=unit), _options(m_per_px=None)).tracks

    assert tracks.x_m[1] == pytest.approx(10 * metres)


def test_positions_that_are_not_trusted_are_taken_as_missing():
    """Below min_confidence; a confidence that is not known counts as certain."""
    rows = _rows(confidence=np.array([0.9, 0.3, np.nan]))

    imported = assemble(HERE, rows, _options(min_confidence=0.5))

    assert imported.tracks.agent.tolist() == [4, 4]
    assert imported.tracks.confidence.tolist() == pytest.approx([0.9, 1.0])
    assert "1 of 3 positions have a confidence below 0.5 and are taken as missing." in (
        imported.notes
    )


def test_all_positions_not_trusted_is_an_error():
    """Nothing is left to analyse."""
    rows = _rows(confidence=np.zeros(3))

    with pytest.raises(InputError, match="got none: all 3 are missing or not trusted"):
        assemble(HERE, rows, _options(min_confidence=0.5))


def test_a_robot_is_not_named_by_what_two_agents_are_called():
    """One of them may be a fish; without --robots both are read."""
    rows = _rows(agent=np.array([0, 1, 2]), names={0: "a", 1: "a", 2: "b"})

    with pytest.raises(InputError, match="2 agents are called 'a', expected the name of one robot"):
        assemble(HERE, rows, _options(robots=("a",)))
    assert assemble(HERE, rows, _options(robots=("b", "0"))).tracks.kind.tolist() == [1, 0, 1]
    assert len(assemble(HERE, rows, _options()).tracks) == 3


def test_robots_are_named_by_name_or_by_number():
    """Both ways name the same agent."""
    rows = _rows(names={4: "lure"})

    by_name = assemble(HERE, rows, _options(robots=("lure",))).tracks
    by_number = assemble(HERE, rows, _options(robots=("4",))).tracks

    assert by_name.kind.tolist() == by_number.kind.tolist() == [0, 1, 1]


def test_a_robot_that_is_not_there_lists_who_is():
    """A misspelt name must not pass as no robot."""
    with pytest.raises(InputError, match="no agent is called 'lire', expected one of 2, lure"):
        assemble(HERE, _rows(names={4: "lure"}), _options(robots=("lire",)))


def test_a_name_goes_before_a_number():
    """An agent that is called 2 is meant, not the one that has number 2."""
    tracks = assemble(HERE, _rows(names={4: "2"}), _options(robots=("2",))).tracks

    assert tracks.kind.tolist() == [0, 1, 1]


def test_more_robots_at_once_than_the_trial_has_are_refused():
    """Two robots in frame 0."""
    with pytest.raises(InputError, match="frame 0 has 2 robots at once, expected at most 0"):
        assemble(HERE, _rows(), _options(robots=("2", "4"), n_robots=0))


def test_fewer_agents_than_the_trial_has_pass():
    """Some may be hidden or lost."""
    assert len(assemble(HERE, _rows(), _options(n_fish=9, n_robots=3)).tracks) == 3


def test_an_agent_twice_in_a_frame_is_refused_with_both_places():
    """Frame, agent and the two positions are told."""
    rows = _rows(agent=np.array([4, 4, 4]))

    with pytest.raises(
        InputError, match=r"agent 4 is twice in frame 0, at \(0\.1, 0\.01\) m and \(0\.2, 0\.02\) m"
    ):
        assemble(HERE, rows, _options())


def test_a_span_that_no_tank_has_points_to_the_scale():
    """Metres per pixel given as millimetres: 1 px = 1 m."""
    with pytest.raises(InputError, match=r"span 200 m \(at 10 m per px\), expected a tank"):
        assemble(HERE, _rows(), _options(m_per_px=10.0))


def test_infinite_positions_are_refused():
    """A format that knows no infinity has been misread."""
    with pytest.raises(InputError, match=r"agent 2 in frame 0: expected a finite position"):
        assemble(HERE, _rows(x=np.array([1.0, np.inf, 1.0])), _options())


@pytest.mark.parametrize("number", [2**40, -3])
def test_agent_numbers_beyond_31_bits_are_refused(number):
    """They would wrap round without a word, or fail only when the artifact is written."""
    with pytest.raises(InputError, match=f"{HERE}: agent numbers must be 0 to 2147483647"):
        assemble(HERE, _rows(agent=np.array([number, 2, 5])), _options())


def test_mirrored_tracks_are_noted_once_y_is_left_down():
    """Only in formats whose y counts downwards."""
    down, up = _rows(), _rows(y_down=False)
    turned = _options(flip_y=True, origin=(0.0, 100.0))

    assert any("mirrored" in note for note in assemble(HERE, down, _options()).notes)
    assert not assemble(HERE, up, _options()).notes
    assert not assemble(HERE, down, turned).notes


def test_a_grid_numbers_its_agents_by_their_names_if_these_are_numbers():
    """Agent 7 of the file stays agent 7; other names are numbered from 0."""
    grid = {
        "xy": np.zeros((1, 2, 2)),
        "frame": np.array([0]),
        "time_s": np.array([0.0]),
        "unit": "px",
    }

    assert Grid(**grid, names=("7", "3")).rows().agent.tolist() == [7, 3]
    assert Grid(**grid, names=("red", "3")).rows().agent.tolist() == [0, 1]
    assert Grid(**grid, names=("3", "3")).rows().agent.tolist() == [0, 1]
    assert Grid(**grid).rows().agent.tolist() == [0, 1]
