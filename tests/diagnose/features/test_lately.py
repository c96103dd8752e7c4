"""How fast the others were over two seconds: each by its own steps alone."""

import numpy as np
import pytest

from zfcal.diagnose.features.draws import _lately
from zfcal.model.kernels.state import SPEED, ZONE


def test_who_comes_into_a_column_has_no_speed_of_who_was_there():
    """Two tracks share a column, with a sample between them at which nobody is there."""
    states = np.zeros((12, max(SPEED, ZONE) + 1, 1))
    states[:, ZONE] = 1.0
    states[:6, SPEED], states[6:, SPEED] = 0.1, 0.3
    states[6, ZONE] = 0.0
    found = _lately(states, 0.5)[:, 0]
    assert found[:6] == pytest.approx(np.full(6, 0.1))
    assert found[6] == 0.0
    assert found[7:] == pytest.approx(np.full(5, 0.3))


def test_it_is_the_mean_of_two_seconds():
    """Four steps of half a second; fewer where there were no more."""
    states = np.ones((6, max(SPEED, ZONE) + 1, 1))
    states[:, SPEED, 0] = [1.0, 2.0, 3.0, 4.0, 5.0, np.nan]
    found = _lately(states, 0.5)[:, 0]
    assert found == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.5, 4.0])
