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
    features = progress.features
    features[0, 0] = np.nan
    changed = replace(progress, parts=((progress.genes, features),))
    found = from_bytes(to_bytes(changed, key="k"), key="k")
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


@pytest.fixture
def blocks(task, settings):
    """Return a search in blocks, the first whole and one for each generation."""
    seen = []
    search(task, settings, watch=seen.append)
    befores = [None, *seen[:-1]]
    return [to_bytes(p, key="k", since=old) for p, old in zip(seen, befores, strict=True)]


def test_blocks_say_what_the_whole_says(blocks, progress):
    """The initial population and a block for each of three generations."""
    assert len(blocks) == 4
    again = from_bytes(b"".join(blocks), key="k")
    assert to_bytes(again, key="k") == to_bytes(progress, key="k")


def test_a_block_holds_one_generation_however_long_the_search(blocks):
    """The last one is no longer than the second."""
    assert len(blocks[3]) < 1.02 * len(blocks[1])


@pytest.mark.parametrize("n_whole", [1, 2, 3])
@pytest.mark.parametrize("share", [0.001, 0.5, 0.999])
def test_a_search_goes_on_from_the_last_block_that_is_whole(
    task, settings, progress, blocks, n_whole, share
):
    """What a killed process left half-written is left out, and the end is the same."""
    torn = blocks[n_whole][: int(share * len(blocks[n_whole]))]
    found = from_bytes(b"".join(blocks[:n_whole]) + torn, key="k")
    assert found.state.generation == n_whole - 1
    ended = search(task, settings, resume=found)
    assert to_bytes(ended, key="k") == to_bytes(progress, key="k")


def test_what_follows_a_changed_block_is_left_out(blocks):
    """A generation cannot be skipped."""
    changed = bytearray(blocks[2])
    changed[len(changed) // 2] ^= 0xFF
    data = blocks[0] + blocks[1] + bytes(changed) + blocks[3]
    assert from_bytes(data, key="k").state.generation == 1


def test_a_block_that_misses_its_forerunner_is_damage(blocks):
    """As where the beginning of the file was lost."""
    with pytest.raises(DamagedError, match="follows generation"):
        from_bytes(blocks[0] + blocks[2], key="k")
    with pytest.raises(DamagedError, match="follows generation 0"):
        from_bytes(blocks[1], key="k")


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
