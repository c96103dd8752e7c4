"""Rows of tracks and samples: one length, one order, chosen rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zfcal.errors import InputError
from zfcal.tracks import FISH, KINDS, ROBOT, Samples, Tracks, concatenate, joined


def tracks_of(frames, agents):
    """Return rows of these frames and agents; x is the row's number, so that it can be followed."""
    n = len(frames)
    return Tracks(
        time_s=np.asarray(frames) / 15.0,
        frame=np.asarray(frames, dtype=np.int64),
        agent=np.asarray(agents, dtype=np.int32),
        kind=np.zeros(n, dtype=np.int8),
        x_m=np.arange(n, dtype=np.float64),
        y_m=np.zeros(n),
        heading_rad=np.full(n, np.nan, dtype=np.float32),
        confidence=np.ones(n, dtype=np.float32),
    )


def samples_of(n_samples, kinds):
    """Return samples whose x is the agent's place, and whose y is the sample's."""
    n = len(kinds)
    xy = np.stack(np.meshgrid(np.arange(n), np.arange(n_samples)), axis=-1).astype(float)
    return Samples(
        dt_s=0.2,
        k=np.arange(5, 5 + n_samples),
        agent=np.arange(10, 10 + n, dtype=np.int32),
        kind=np.asarray(kinds, dtype=np.int8),
        xy_m=xy,
        confidence=np.ones((n_samples, n), dtype=np.float32),
    )


def test_the_kinds_are_fish_and_robot_by_their_codes():
    """The codes are what files and samples hold."""
    assert KINDS[FISH] == "fish"
    assert KINDS[ROBOT] == "robot"
    assert len(KINDS) == 2


def test_the_length_is_the_number_of_rows():
    """Three rows; none at all is a length as well."""
    assert len(tracks_of([0, 0, 1], [1, 2, 1])) == 3
    assert len(tracks_of([], [])) == 0


def test_rows_are_taken_by_mask_by_number_and_by_slice():
    """All columns alike, in the order asked for."""
    tracks = tracks_of([0, 0, 1, 1], [1, 2, 1, 2])

    by_mask = tracks.take(tracks.agent == 2)
    by_number = tracks.take(np.array([3, 0]))

    assert by_mask.x_m.tolist() == [1.0, 3.0]
    assert by_mask.frame.tolist() == [0, 1]
    assert by_number.x_m.tolist() == [3.0, 0.0]
    assert by_number.agent.tolist() == [2, 1]
    assert tracks.take(slice(1, 3)).x_m.tolist() == [1.0, 2.0]
    assert by_mask.confidence.dtype == np.float32


def test_parts_are_joined_by_frame_then_agent():
    """Two cameras' rows interleave, whichever part comes first."""
    first, second = tracks_of([0, 2], [1, 1]), tracks_of([0, 1, 2], [7, 7, 0])

    joined = concatenate([first, second])

    assert joined.frame.tolist() == [0, 0, 1, 2, 2]
    assert joined.agent.tolist() == [1, 7, 7, 0, 1]
    assert joined.x_m.tolist() == [0.0, 0.0, 1.0, 2.0, 1.0]
    assert joined.agent.dtype == np.int32


@given(
    rows=st.lists(st.tuples(st.integers(0, 20), st.integers(0, 5)), unique=True, max_size=30),
    cut=st.integers(0, 30),
)
def test_a_cut_is_healed_wherever_it_was(rows, cut):
    """Joining the two parts of sorted rows gives them back, in either order."""
    rows = sorted(rows)
    tracks = tracks_of([frame for frame, _ in rows], [agent for _, agent in rows])
    parts = [tracks.take(slice(None, cut)), tracks.take(slice(cut, None))]

    for order in (parts, parts[::-1]):
        joined = concatenate(order)
        assert joined.frame.tolist() == tracks.frame.tolist()
        assert joined.x_m.tolist() == tracks.x_m.tolist()


def test_columns_of_unequal_length_are_refused():
    """The message gives each column's shape."""
    whole = tracks_of([0, 1], [1, 1])

    with pytest.raises(InputError, match=r"one length.*'x_m': \(1,\)"):
        Tracks(**{name: getattr(whole, name) for name in whole.__slots__} | {"x_m": np.zeros(1)})


def test_columns_that_are_tables_are_refused():
    """A column has one axis: a table of positions would pass for rows."""
    whole = tracks_of([0, 1], [1, 1])
    tables = {name: np.stack([getattr(whole, name)] * 2) for name in whole.__slots__}

    with pytest.raises(InputError, match="one length"):
        Tracks(**tables)


def test_samples_of_one_kind_leave_out_the_other():
    """Fish are agents 10 and 12, the robot is 11; samples stay as they are."""
    samples = samples_of(4, [FISH, ROBOT, FISH])

    fish, robots = samples.of_kind(FISH), samples.of_kind(ROBOT)

    assert fish.agent.tolist() == [10, 12]
    assert fish.xy_m.shape == (4, 2, 2)
    assert fish.xy_m[:, :, 0].tolist() == [[0.0, 2.0]] * 4
    assert robots.agent.tolist() == [11]
    assert robots.k.tolist() == fish.k.tolist() == [5, 6, 7, 8]
    assert robots.dt_s == 0.2
    assert fish.confidence.shape == (4, 2)


def test_agents_are_taken_in_the_order_asked_for():
    """By number, with their kind."""
    taken = samples_of(2, [FISH, ROBOT, FISH]).take_agents(np.array([1, 0]))

    assert taken.agent.tolist() == [11, 10]
    assert taken.kind.tolist() == [ROBOT, FISH]
    assert taken.xy_m[0, :, 0].tolist() == [1.0, 0.0]


def test_a_kind_that_is_not_there_leaves_no_agents():
    """No robots: samples without agents, not an error."""
    none = samples_of(3, [FISH]).of_kind(ROBOT)

    assert none.xy_m.shape == (3, 0, 2)
    assert len(none.agent) == 0


def test_samples_are_joined_with_what_is_missing_between_them():
    """Samples 5 and 6 of agents 10 and 11, 9 and 10 of agents 11 and 12; 4 to 9 are asked for."""
    one = samples_of(2, [FISH, ROBOT])
    two = replace(samples_of(2, [ROBOT, FISH]), k=np.array([9, 10]), agent=np.array([11, 12]))

    both = joined([one, two], first=4, stop=10)

    assert both.k.tolist() == [4, 5, 6, 7, 8, 9]
    assert both.agent.tolist() == [10, 11, 12]
    assert both.kind.tolist() == [FISH, ROBOT, FISH]
    seen = ~np.isnan(both.xy_m[..., 0])
    assert seen.tolist() == [[k in (5, 6), k in (5, 6, 9), k == 9] for k in range(4, 10)]
    assert both.xy_m[5].tolist()[1:] == [[0.0, 0.0], [1.0, 0.0]]
    assert (np.isnan(both.confidence) == ~seen).all()


def test_agents_of_no_sample_that_is_asked_for_are_left_out():
    """Two agents, of whom the second is seen in the last sample alone."""
    samples = samples_of(3, [FISH, FISH])
    samples.xy_m[:2, 1] = np.nan

    assert joined([samples], first=5, stop=7).agent.tolist() == [10]
    assert joined([samples], first=5, stop=8).agent.tolist() == [10, 11]
    assert joined([samples], first=5, stop=5).xy_m.shape == (0, 0, 2)


def test_an_agent_of_two_kinds_is_refused_where_samples_are_joined():
    """A fish in one segment, the robot in the next."""
    one = samples_of(2, [FISH])
    two = replace(one, k=one.k + 2, kind=np.array([ROBOT], dtype=np.int8))

    with pytest.raises(InputError, match="agent 10 is of two kinds"):
        joined([one, two], first=5, stop=9)


@pytest.mark.parametrize("steps", [[], [0.2, 0.25]])
def test_samples_of_no_step_or_of_two_are_not_joined(steps):
    """There is no clock that holds them."""
    parts = [replace(samples_of(2, [FISH]), dt_s=step) for step in steps]

    with pytest.raises(InputError, match="one step dt_s"):
        joined(parts, first=5, stop=9)
