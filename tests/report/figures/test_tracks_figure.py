"""Paths and maps of where the animals were."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.behaviour.located import locate
from zfcal.report.figures.panels import compose
from zfcal.report.figures.tracks import density, path_pieces, tracks_picture
from zfcal.report.seen import grid_of, see, visits_of
from zfcal.tracks import FISH


def test_a_path_breaks_where_the_animal_was_lost(arenas, wander):
    """Ten samples without the sixth: pieces of five and four points."""
    samples = wander(arenas["open-square"], n=1, n_samples=10, robot=False)
    samples.xy_m[5] = np.nan

    pieces = path_pieces(locate(samples, arenas["open-square"]))

    assert [len(piece) for piece in pieces] == [5, 4]
    assert pieces[1][0] == pytest.approx(samples.xy_m[6, 0])


def test_paths_of_two_animals_are_not_joined(arenas, wander):
    """One piece per animal, each with all its samples."""
    located = locate(wander(arenas["open-square"], n=2, n_samples=7), arenas["open-square"])

    assert [len(piece) for piece in path_pieces(located)] == [7, 7]


def test_a_single_point_is_no_path(arenas, wander):
    """A point between two gaps has no line."""
    samples = wander(arenas["open-square"], n=1, n_samples=1, robot=False)

    assert path_pieces(locate(samples, arenas["open-square"])) == []


def test_density_by_hand(arenas, wander):
    """Three of four points in one square of a tank of 1 m, which has 60 x 60 squares."""
    arena = arenas["open-square"]
    samples = wander(arena, n=1, n_samples=4, robot=False)
    samples.xy_m[:, 0] = [(0.501, 0.251)] * 3 + [(0.99, 0.99)]

    share = density(visits_of(locate(samples, arena)))
    _, extent = grid_of(arena)

    assert share.shape == (60, 60)
    assert extent == pytest.approx((0, 1, 0, 1))
    assert share[15, 30] == pytest.approx(0.75)
    assert share[59, 59] == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["two-rooms", "ring", "own", "narrow"])
def test_all_time_is_on_the_map(arenas, wander, name):
    """The shares sum to one, for every shape of tank."""
    share = density(visits_of(locate(wander(arenas[name]), arenas[name])))

    assert share.sum() == pytest.approx(1.0)
    assert (share >= 0).all()


def test_nobody_seen_is_no_picture(arenas, wander):
    """Tracks in which everybody is lost have nothing to show."""
    samples = wander(arenas["open-square"], n_samples=3)
    samples.xy_m[:] = np.nan

    assert tracks_picture(see([locate(samples, arenas["open-square"])])) is None


def test_fish_and_robot_have_a_map_each(arenas, wander):
    """Without a robot there is no empty map of one."""
    arena = arenas["two-rooms"]
    both, fish = (see([locate(wander(arena, robot=robot), arena)]) for robot in (True, False))

    assert [panel.title for panel in tracks_picture(both).panels] == [
        "Paths, 0 to 120 s",
        "Fish, all 120 s",
        "Robot, all 120 s",
    ]
    assert len(tracks_picture(fish).panels) == 2


def test_paths_are_those_of_the_last_window(arenas, wander):
    """Half an hour of paths would be a blot: the last two minutes are shown."""
    arena = arenas["open-square"]
    located = locate(wander(arena, n_samples=900), arena)

    picture = tracks_picture(see([located]))

    assert picture.panels[0].title == "Paths, 60 to 180 s"
    assert picture.panels[1].title == "Fish, all 180 s"


def test_an_animal_that_stays_in_one_place_can_be_drawn(arenas, wander):
    """All the time in one square is no division by zero, and no empty scale."""
    arena = arenas["ring"]
    samples = wander(arena, n=1, n_samples=5, robot=False)
    samples = replace(samples, xy_m=np.repeat(samples.xy_m[:1], 5, axis=0))
    figure = compose(tracks_picture(see([locate(samples, arena)])))

    figure.canvas.draw()

    assert len(locate(samples, arena).of_kind(FISH)) == 5


@pytest.mark.parametrize("name", ["two-rooms", "ring", "own", "narrow"])
def test_no_text_covers_another(arenas, wander, covered_texts, name):
    """Titles, axes and colour bars have room in wide and in narrow tanks."""
    assert covered_texts(tracks_picture(see([locate(wander(arenas[name]), arenas[name])]))) == []
