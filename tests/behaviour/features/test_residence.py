"""How long animals stay in a zone."""

import numpy as np
import pytest

from zfcal.behaviour.statistics import measure, measure_robot

L, R, GONE = (0.1, 0.1), (0.3, 0.1), None
VOID = (0.9, 0.9)


@pytest.fixture
def stays(tank, samples_of):
    """Return what counts the stays of one animal, left and right, by bin."""

    def count(path, **how):
        samples = samples_of([[place] for place in path], **how)
        left, right = measure(samples, tank, further=["residence"]).of("residence")
        return tuple(
            {int(b): int(n) for b, n in enumerate(counts) if n} for counts in (left, right)
        )

    return count


def test_stays_by_hand(stays):
    """3 s left, 5 s right, 1 s left: bins from 1.875, 3.75 and 0.9375 s on."""
    assert stays([L] * 3 + [R] * 5 + [L]) == ({2: 1, 3: 1}, {4: 1})


def test_the_bins_double_up_to_the_window(tank, samples_of):
    """Nine of them: below 0.47 s, then up to 60 s and from there to 120 s."""
    counts = measure(samples_of([[L]] * 600, dt_s=0.2), tank, further=["residence"])
    assert counts.of("residence").shape == (2, 9)
    assert counts.of("residence").tolist() == [[0] * 8 + [1], [0] * 9]


def test_a_time_on_an_edge_belongs_to_the_bin_above(stays):
    """75 samples of 0.2 s are 15 s."""
    assert stays([L] * 75, dt_s=0.2) == ({6: 1}, {})
    assert stays([L] * 74, dt_s=0.2) == ({5: 1}, {})


def test_a_short_loss_ends_no_stay(stays):
    """Four samples of 0.25 s are a second; a fifth is too long, and so is none in another zone."""
    assert stays([L] * 4 + [GONE] * 4 + [L] * 4, dt_s=0.25) == ({3: 1}, {})
    assert stays([L] * 4 + [GONE] * 5 + [L] * 4, dt_s=0.25) == ({2: 2}, {})
    assert stays([L] * 4 + [GONE] + [R] * 4, dt_s=0.25) == ({2: 1}, {2: 1})


def test_a_position_outside_is_a_loss(stays):
    """An animal in the void is in no zone."""
    assert stays([L, VOID, L]) == stays([L, GONE, L]) == ({3: 1}, {})


def test_a_window_s_end_cuts_a_stay(stays):
    """240 s left are twice 120 s; the clock starts with the first sample."""
    assert stays([L] * 240) == ({8: 2}, {})
    assert stays([L] * 120, first_k=60) == ({8: 1}, {})


def test_what_remains_after_whole_windows_is_left_out(stays):
    """10 s more would be a short stay only because the recording ends; 10 s alone count."""
    assert stays([L] * 130) == ({8: 1}, {})
    assert stays([L] * 10) == ({5: 1}, {})


def test_two_animals_stay_each_for_itself(tank, samples_of):
    """One is left for 4 s, another right: their samples follow each other, their stays do not."""
    counts = measure(samples_of([[L, R]] * 4), tank, further=["residence"]).of("residence")
    assert counts.sum(axis=1).tolist() == [1, 1]
    assert counts[:, 4].tolist() == [1, 1]


def test_a_robot_s_stays_are_its_own(tank, samples_of):
    """The fish beside it do not count."""
    samples = samples_of([[L, R]] * 4, kind=[0, 1])
    assert measure_robot(samples, tank, further=["residence"]).of("residence").sum(
        axis=1
    ).tolist() == [0, 1]


def test_nobody_stays_nowhere(tank, samples_of):
    """An empty window has no stay."""
    counts = measure(samples_of(np.full((3, 1, 2), np.nan)), tank, further=["residence"])
    assert counts.of("residence").sum() == 0
