"""A search as bytes and back."""

from dataclasses import fields, replace

import numpy as np
import pytest

from zfcal.calibrate.checkpoint import from_bytes, to_bytes
from zfcal.calibrate.search import search
from zfcal.errors import DamagedError


@pytest.fixture(params=["zfcal", "deap"])
def settings(request, small):
    """Return settings of three generations with either optimiser."""
    return replace(small, generations=3, optimiser=request.param)


@pytest.fixture
def progress(task, settings):
    """Return a search that is over."""
    return search(task, settings)


def test_a_search_comes_back_bit_by_bit(progress):
    """Arrays with their types, history, random numbers."""
    again = from_bytes(to_bytes(progress, key="k"), key="k")
    for field in fields(progress.state):
        expected, found = (getattr(p.state, field.name) for p in (progress, again))
        np.testing.assert_equal(found, expected)
        assert getattr(found, "dtype", None) == getattr(expected, "dtype", None)
    np.testing.assert_array_equal(again.genes, progress.genes)
    np.testing.assert_array_equal(again.features, progress.features)
    assert again.history == progress.history
    assert (again.world_changed, again.n_renewed) == (False, 0)


def test_a_null_feature_and_an_infinite_crowding_survive(progress):
    """NaN and inf are values here."""
    features = progress.features.copy()
    features[0, 0] = np.nan
    found = from_bytes(to_bytes(replace(progress, features=features), key="k"), key="k")
    assert np.isnan(found.features[0, 0])
    assert np.isinf(found.state.crowding).any()


def test_the_same_search_gives_the_same_bytes(task, settings, progress):
    """Also from a second run of it."""
    assert to_bytes(progress, key="k") == to_bytes(search(task, settings), key="k")


def test_a_search_that_went_through_bytes_ends_in_the_same_bytes(task, settings, progress):
    """Saved after every generation, resumed from each."""
    saved = []
    search(task, settings, watch=lambda p: saved.append(to_bytes(p, key="k")))
    assert saved[-1] == to_bytes(progress, key="k")
    for data in saved:
        found = search(task, settings, resume=from_bytes(data, key="k"))
        assert to_bytes(found, key="k") == saved[-1]


def test_the_checkpoint_of_another_round_is_not_taken(progress):
    """The key says of which one it is."""
    assert from_bytes(to_bytes(progress, key="seed 1"), key="seed 2") is None


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_checkpoint_that_was_cut_is_named_as_damaged(progress, share):
    """At any place."""
    data = to_bytes(progress, key="k")
    with pytest.raises(DamagedError, match="cannot be read"):
        from_bytes(data[: int(share * len(data))], key="k")


def test_a_checkpoint_with_a_changed_byte_is_named_as_damaged(progress):
    """In the midst of the genes."""
    data = bytearray(to_bytes(progress, key="k"))
    data[len(data) // 2] ^= 0xFF
    with pytest.raises(DamagedError, match="cannot be read"):
        from_bytes(bytes(data), key="k")


def test_foreign_bytes_are_named_as_damaged():
    """No pickle is ever opened."""
    with pytest.raises(DamagedError):
        from_bytes(b"\x80\x04K\x01.", key="k")
