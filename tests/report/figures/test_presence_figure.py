"""Where the fish were beside where the model is."""

from dataclasses import replace

import numpy as np
import pytest

from zfcal.behaviour.located import locate
from zfcal.report.figures.panels import compose
from zfcal.report.figures.presence import presence_picture
from zfcal.report.seen import visits_of


@pytest.fixture
def visits(wander, two_rooms):
    """Return where agents that wander from a seed were."""
    return lambda seed: visits_of(locate(wander(two_rooms, seed=seed, robot=False), two_rooms))


def test_both_maps_have_one_scale(visits, two_rooms):
    """A fish that stays in one square does not make the model look evenly spread."""
    fish, model = visits(1), visits(2)
    rest = np.zeros_like(fish.cells)
    rest[10, 50] = 1000.0
    figure = compose(
        presence_picture(replace(fish, cells=fish.cells + rest), model, two_rooms, end_s=120)
    )
    norms = [axes.images[0].norm for axes in figure.axes[:2]]

    assert norms[0].vmax == norms[1].vmax
    assert norms[0].vmin == norms[1].vmin == 0


def test_shares_of_zones_by_hand(visits, two_rooms):
    """10, 60 and 30 % beside 20, 50 and 30 %; what lies outside the tank is not counted."""
    fish = replace(visits(1), zones=np.array([50, 10, 60, 30]))
    model = replace(visits(2), zones=np.array([0, 40, 100, 60]))
    picture = presence_picture(fish, model, two_rooms, end_s=120)
    bars = compose(picture).axes[2].patches

    assert [bar.get_height() for bar in bars] == pytest.approx([10, 60, 30, 20, 50, 30])
    assert "corridor 10% of the fish's and 20% of the model's" in picture.panels[2].alt


def test_without_a_side_there_is_no_picture(visits, two_rooms):
    """Neither without a model nor of fish that were never in a zone."""
    fish = visits(1)
    nowhere = replace(fish, zones=np.zeros_like(fish.zones))

    assert presence_picture(fish, None, two_rooms, end_s=120) is None
    assert presence_picture(None, fish, two_rooms, end_s=120) is None
    assert presence_picture(nowhere, fish, two_rooms, end_s=120) is None


@pytest.mark.parametrize("name", ["two-rooms", "ring", "own", "narrow"])
def test_no_text_covers_another(arenas, wander, covered_texts, name):
    """Whatever the tank."""
    arena = arenas[name]
    seen = visits_of(locate(wander(arena), arena))

    assert covered_texts(presence_picture(seen, seen, arena, end_s=120)) == []
