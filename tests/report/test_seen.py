"""What the report keeps of the tracks is what the whole of them would tell."""

from itertools import pairwise

import numpy as np
import pytest

from zfcal.behaviour.ceilings import halves_ceiling
from zfcal.behaviour.located import join, locate
from zfcal.report import seen as module
from zfcal.report.seen import see, visits_of
from zfcal.tracks import FISH, ROBOT


def cut(located, *edges):
    """Cut points at some samples."""
    limits = [-1, *edges, 10**9]
    return [located.take((located.k >= a) & (located.k < b)) for a, b in pairwise(limits)]


@pytest.mark.parametrize("together", [1, 2_000, 10**6])
@pytest.mark.parametrize("edges", [(), (300, 600), (3, 299, 301, 3000)])
def test_parts_are_seen_as_the_whole(two_rooms, wander, monkeypatch, together, edges):
    """However the tracks are cut, and however many parts are counted at once."""
    monkeypatch.setattr(module, "_TOGETHER", together)
    located = locate(wander(two_rooms, n_samples=3300), two_rooms)

    seen = see(iter(cut(located, *edges)))

    assert (seen.n_points, seen.first_k, seen.last_k) == (len(located), 0, 3299)
    assert np.array_equal(seen.last.k, located.between(seen.end_s - 120, seen.end_s).k)
    for kind in (FISH, ROBOT):
        whole = visits_of(located.of_kind(kind))
        assert np.array_equal(seen.visits[kind].cells, whole.cells)
        assert np.array_equal(seen.visits[kind].zones, whole.zones)
    expected = halves_ceiling(located.of_kind(FISH), two_rooms)
    assert seen.halves.scores().values == expected.values


def test_halves_are_counted_from_the_first_fish(two_rooms, wander):
    """Blocks of a minute begin where the first fish was seen, not where a file begins."""
    whole = locate(wander(two_rooms, n_samples=2000), two_rooms)
    late = whole.take((whole.k >= 123) | (whole.kind == ROBOT))

    seen = see(cut(late, 300, 600, 900))

    assert seen.first_k == 0
    expected = halves_ceiling(late.of_kind(FISH), two_rooms)
    assert seen.halves.scores().values == expected.values


def test_a_minute_has_no_halves(two_rooms, wander):
    """There is no other minute to hold it against."""
    seen = see([locate(wander(two_rooms, n_samples=300), two_rooms)])
    assert seen.halves.scores() is None


def test_no_part_is_nothing_seen_and_empty_parts_are_nobody_seen(two_rooms, wander):
    """A trial without tracks, and one in whose tracks nobody is."""
    nobody = locate(wander(two_rooms, n_samples=10), two_rooms).take(slice(0, 0))

    assert see([]) is None
    seen = see([nobody, nobody])
    assert (seen.n_points, seen.end_s, seen.visits) == (0, 0.0, {})


def test_parts_are_let_go(two_rooms, wander, monkeypatch):
    """Of ten minutes no more than the last window and what is counted at once are kept."""
    monkeypatch.setattr(module, "_TOGETHER", 1)
    parts = cut(locate(wander(two_rooms, n_samples=3000), two_rooms), *range(300, 3000, 300))
    longest = len(join(parts[:3]))
    kept = []
    take_on = module._Watcher.add

    def watch(self, part):
        take_on(self, part)
        kept.append(len(self._last))

    monkeypatch.setattr(module._Watcher, "add", watch)
    see(parts)
    assert len(kept) == 10
    assert max(kept) < longest
