"""Ids are kept where the number of animals is known: lost, crossed, and told by looks."""

import math

import numpy as np
import pytest

from zfcal.tracking.blobs import Blob, Shape
from zfcal.tracking.identity import Identities
from zfcal.tracking.trail import Detection, Trail

FPS = 15.0
LARGE, SMALL = (44.0, 0.35), (36.0, 0.30)


def sighting(look, at=(50.0, 50.0), *, shared=1):
    """Return an animal of an area and darkness somewhere."""
    area, darkness = look
    blob = Blob(
        pixels=np.array([at]),
        weights=np.ones(1),
        shares=np.full(1, darkness),
        darkness=darkness,
        contour=np.zeros((4, 2), np.int32),
        corners=np.empty((0, 2)),
        box=(int(at[0]), int(at[1]), 1, 1),
    )
    shape = Shape(
        x_px=at[0], y_px=at[1], axis_rad=0.0, head=1.0, length_px=16.0, width_px=3.0, area_px=area
    )
    return Detection(shape=shape, blob=blob, shared=shared)


class Film:
    """Two tracks whose looks are told frame by frame."""

    def __init__(self, n=2):
        self.rng = np.random.default_rng(1)
        self.names = Identities(n)
        self.frame = 0
        self.trails = {}

    def show(self, looks, frames, *, mixed=None, spread=(0.04, 0.03)):
        """Show tracks, by key, for some frames; return their last ids by key."""
        for _ in range(frames):
            self.frame += 1
            time_s = self.frame / FPS
            for key, (area, darkness) in looks.items():
                wide = np.exp(np.array(spread) * self.rng.standard_normal(2))
                seen = sighting((area * wide[0], darkness * wide[1]), at=(50.0 + 30 * key, 50.0))
                if key not in self.trails:
                    self.trails[key] = Trail(key, seen, time_s)
                else:
                    self.trails[key].update(seen, time_s)
            told = [self.trails[key] for key in looks]
            ids = self.names.step(told, mixed or {}, time_s)
        return ids


def test_ids_are_those_of_the_opening_and_stay():
    """As many as there are animals, from nought."""
    assert Film().show({7: LARGE, 9: SMALL}, 60) == {7: 0, 9: 1}


def test_a_new_track_takes_the_id_of_the_one_that_ended():
    """Never a third id for two animals."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 30)

    assert film.show({0: LARGE, 5: SMALL}, 30) == {0: 0, 5: 1}
    assert film.show({6: LARGE, 5: SMALL}, 30) == {6: 0, 5: 1}


def test_of_two_that_ended_the_nearer_is_gone_on_with():
    """Both end, both begin elsewhere: by place, since they look the same."""
    film = Film()
    film.show({0: LARGE, 3: LARGE}, 30)

    ids = film.show({13: LARGE, 10: LARGE}, 6)

    assert sorted(ids.values()) == [0, 1]


def test_places_changed_unseen_are_mended_by_looks():
    """After a crossing that may have been either, a second of looks settles it."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.5})

    assert film.show({0: SMALL, 1: LARGE}, 30) == {0: 1, 1: 0}


def test_a_crossing_that_changed_nothing_changes_no_id():
    """The same doubt, and the looks of before."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.5})

    assert film.show({0: LARGE, 1: SMALL}, 120) == {0: 0, 1: 1}


def test_animals_that_look_the_same_keep_their_ids():
    """Where looks tell nothing ids do not flicker, whatever is doubted."""
    film = Film()
    film.show({0: LARGE, 1: LARGE}, 60)
    changes = 0
    for _ in range(20):
        film.show({0: LARGE, 1: LARGE}, 1, mixed={(0, 1): 0.5})
        changes += film.show({0: LARGE, 1: LARGE}, 15) != {0: 0, 1: 1}

    assert changes <= 10


def test_chances_sum_to_one_over_tracks_and_over_ids():
    """Whatever was seen and mixed, each track is somebody and each id is somewhere."""
    film = Film(3)
    looks = {0: LARGE, 1: SMALL, 2: (60.0, 0.5)}
    film.show(looks, 40)
    film.show(looks, 20, mixed={(0, 1): 0.3, (1, 2): 0.2})

    chance = film.names._chance
    assert chance.sum(axis=0) == pytest.approx(np.ones(3), abs=0.02)
    assert chance.sum(axis=1) == pytest.approx(np.ones(3), abs=0.02)


def test_a_look_is_learnt_from_one_that_is_alone():
    """Its area, length and darkness to two hundredths, after four seconds."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)

    look = film.names.look(1)

    assert look.area_px == pytest.approx(SMALL[0], rel=0.02)
    assert look.darkness == pytest.approx(SMALL[1], rel=0.02)
    assert look.length_px == pytest.approx(16.0)


def test_a_crowd_teaches_nothing():
    """One that shares its blob from the start has no look of its own."""
    names = Identities(2)
    trail = Trail(0, sighting(LARGE, shared=2), 0.0)
    for k in range(1, 40):
        trail.update(sighting(LARGE, shared=2), k / FPS)
        names.step([trail], {}, k / FPS)

    assert names.look(0) is None
    assert math.isnan(trail.darkness)


def exchanges(film):
    """Return what was exchanged when, in frames, and forget it."""
    return [
        ({told.one, told.other}, round(told.since_s * FPS)) for told in film.names.take_exchanges()
    ]


def test_an_exchange_says_when_the_two_crossed():
    """Looks tell in 20 frames or so; the crossing was before, and is told once."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.5})
    film.show({0: SMALL, 1: LARGE}, 30)

    assert exchanges(film) == [({0, 1}, 61)]
    assert exchanges(film) == []


def test_the_likely_moment_of_an_encounter_counts():
    """Not the last one of it, nor a likely one of long before."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.5})
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 5, mixed={(0, 1): 0.06})
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.4})
    film.show({0: SMALL, 1: LARGE}, 3, mixed={(0, 1): 0.06})
    film.show({0: SMALL, 1: LARGE}, 60)

    assert exchanges(film) == [({0, 1}, 127)]

    film.show({0: SMALL, 1: LARGE}, 60, mixed={(0, 1): 0.02})
    film.show({0: SMALL, 1: LARGE}, 1, mixed={(0, 1): 0.06})
    film.show({0: LARGE, 1: SMALL}, 90)

    assert exchanges(film) == [({0, 1}, 251)]


def test_three_that_changed_places_are_put_right_by_two_crossings():
    """The first with the second, the one there with the third: replayed, all told ids are right."""
    looks = {"a": LARGE, "b": SMALL, "c": (60.0, 0.5)}
    film = Film(3)
    told = {}

    def show(order, frames, **known):
        for _ in range(frames):
            ids = film.show({key: looks[who] for key, who in enumerate(order)}, 1, **known)
            told[film.frame] = (order, [ids[key] for key in range(3)])
            for each in film.names.take_exchanges():
                swap = {each.one: each.other, each.other: each.one}
                for frame, (_, names) in told.items():
                    if each.since_s * FPS - 0.5 < frame < film.frame:
                        names[:] = [swap.get(name, name) for name in names]

    show("abc", 60)
    show("bac", 1, mixed={(0, 1): 0.5})
    show("bac", 2)
    show("bca", 1, mixed={(1, 2): 0.5})
    show("bca", 90)

    for order, names in told.values():
        assert names == ["abc".index(who) for who in order]


def test_an_encounter_of_long_ago_explains_nothing():
    """Both were surely themselves in between: what was told then stays."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.5})
    film.show({0: LARGE, 1: SMALL}, 150)
    film.show({0: SMALL, 1: LARGE}, 200, mixed={(0, 1): 0.04})

    assert exchanges(film) == []


def test_an_exchange_uses_its_encounter_up():
    """Before it the two had other names, so nothing is put right from there once more."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60)
    film.show({0: LARGE, 1: SMALL}, 1, mixed={(0, 1): 0.5})
    while not (found := exchanges(film)):
        film.show({0: SMALL, 1: LARGE}, 1)
    assert found == [({0, 1}, 61)]

    film.show({0: LARGE, 1: SMALL}, 200, mixed={(0, 1): 0.04})

    assert exchanges(film) == []


def test_an_exchange_of_which_nobody_knows_the_moment_is_not_told():
    """Two that never were near each other look like each other from now on."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 60, mixed={(0, 1): 0.04})
    assert film.show({0: SMALL, 1: LARGE}, 200, mixed={(0, 1): 0.04}) == {0: 1, 1: 0}
    assert exchanges(film) == []


def test_two_that_share_a_blob_from_the_start_are_learnt_when_they_part():
    """Nothing is known of either, so there is no doubt: their looks become theirs."""
    film = Film()
    film.show({0: LARGE, 1: SMALL}, 5, mixed={(0, 1): 0.5})

    ids = film.show({0: LARGE, 1: SMALL}, 60)

    looks = [film.names.look(ids[key]) for key in (0, 1)]
    assert [look.area_px for look in looks] == pytest.approx([LARGE[0], SMALL[0]], rel=0.05)


def test_who_is_known_is_not_settled_by_who_is_not():
    """A doubt between an animal that was seen and a new one stays until looks tell."""
    film = Film()
    film.show({0: LARGE}, 60)

    film.show({0: LARGE, 1: LARGE}, 1, mixed={(0, 1): 0.5})

    assert film.names._chance[0, 0] < 0.9


def test_of_two_between_whom_nothing_tells_each_keeps_the_id(monkeypatch):
    """Two others exchange theirs; the chances of these two are even but for rounding."""
    monkeypatch.setattr("zfcal.tracking.identity._MEND", 2.0)
    for rounding in (-1e-15, 0.0, 1e-15):
        names = Identities(4)
        chance = np.full((4, 4), 1e-6)
        chance[:2, :2] = 0.5
        chance[0, 0] += rounding
        chance[2, 3] = chance[3, 2] = 0.99
        names._chance = chance

        names._rename()

        assert names._name.tolist() == [0, 1, 3, 2]
