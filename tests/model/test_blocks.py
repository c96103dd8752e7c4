"""Steps in blocks, side by side."""

import numpy as np
import pytest

from zfcal.model import blocks
from zfcal.model.blocks import in_blocks


@pytest.mark.parametrize(("n", "n_workers", "expected"), [(0, 2, 1), (9, 2, 1), (99, 3, 3)])
def test_each_step_is_in_one_block(monkeypatch, n, n_workers, expected):
    """As many blocks as there are threads, fewer where they would be small."""
    monkeypatch.setattr(blocks, "_LEAST", 10)
    asked = []
    in_blocks(n, n_workers, asked.append)
    assert len(asked) == expected
    steps = np.concatenate([np.arange(n)[own] for own in sorted(asked, key=lambda s: s.start)])
    np.testing.assert_array_equal(steps, np.arange(n))


def test_what_fails_in_a_block_is_heard(monkeypatch):
    """Nothing is left unwritten in silence."""
    monkeypatch.setattr(blocks, "_LEAST", 1)

    def fail(own):
        if own.start > 0:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        in_blocks(10, 2, fail)
