"""Fish, model and robot over each other."""

import numpy as np
import pytest

from zfcal.behaviour.features.registry import further
from zfcal.behaviour.features.registry import statistics as statistics_known
from zfcal.behaviour.histograms import bin_edges
from zfcal.behaviour.statistics import Statistics, measure, measure_robot
from zfcal.report.figures import theme
from zfcal.report.figures.panels import compose
from zfcal.report.figures.statistics import histogram_mean, statistics_picture


def statistics(names, **counts):
    """Return statistics without a count but for the given ones."""
    n = len(names)
    shapes = {
        "distance": (n, 10),
        "wall": (n, 10),
        "occupation": (n,),
        "transition": (n, n),
        "speed": (n, 10),
    }
    arrays = {name: np.zeros(shape, dtype=np.int64) for name, shape in shapes.items()}
    return Statistics(zone_names=names, **(arrays | counts))


def panel_of(figure, title):
    """Return the axes with a title."""
    (axes,) = (a for a in figure.axes if a.get_title(loc="left") == title)
    return axes


def texts_of(axes):
    """Return the texts written into a panel."""
    return [text.get_text() for text in axes.texts]


def test_the_mean_of_a_histogram_by_hand():
    """Three at 0.01 and one at 0.19 on bins of 0.02: (3 x 0.01 + 0.19) / 4."""
    counts = np.array([3, 0, 0, 0, 0, 0, 0, 0, 0, 1])

    assert histogram_mean(counts, bin_edges((0.0, 0.2))) == pytest.approx(0.055)


def test_an_empty_histogram_has_no_mean():
    """Nothing observed is unknown, not zero."""
    assert np.isnan(histogram_mean(np.zeros(10, dtype=np.int64), bin_edges((0.0, 0.2))))


def test_transition_tables_have_their_numbers(arenas):
    """8 of 10 steps stay: 0.800; a zone that nobody left has none."""
    arena = arenas["circular"]
    fish = statistics(arena.zone_names, transition=np.array([[8, 2], [0, 0]]))
    figure = compose(statistics_picture({"fish": fish}, arena, title="x"))

    axes = panel_of(figure, "Transitions in one step, fish")

    assert texts_of(axes) == ["0.800", "0.200", "none", "none"]
    assert axes.yaxis_inverted()


def test_shares_of_time_have_their_numbers(arenas):
    """One in four near the wall."""
    arena = arenas["circular"]
    fish = statistics(arena.zone_names, occupation=np.array([1, 3]))
    figure = compose(statistics_picture({"fish": fish}, arena, title="x"))

    axes = panel_of(figure, "Share of time in each zone")

    assert texts_of(axes)[:2] == ["25", "75"]
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([25, 75])


def test_a_panel_says_how_alike_fish_and_model_are(arenas):
    """The same histogram has similarity 1; of another none is seen at all."""
    arena = arenas["circular"]
    wall = np.zeros((2, 10), dtype=np.int64)
    wall[0, 2] = 5
    same = statistics(arena.zone_names, wall=wall)
    cases = {"fish": same, "model": same}
    figure = compose(statistics_picture(cases, arena, title="x"))

    assert texts_of(panel_of(figure, "To the wall, walls")) == ["similarity 1.00\nfew: n = 5"]
    assert texts_of(panel_of(figure, "To the wall, centre")) == ["none seen"]


def test_who_was_not_seen_is_named(arenas):
    """A zone that only the model visits says that no fish was there."""
    arena = arenas["circular"]
    wall = np.zeros((2, 10), dtype=np.int64)
    wall[0, 2] = 5
    cases = {
        "fish": statistics(arena.zone_names),
        "model": statistics(arena.zone_names, wall=wall),
    }
    figure = compose(statistics_picture(cases, arena, title="x"))

    assert texts_of(panel_of(figure, "To the wall, walls")) == ["none seen: fish"]


def test_bars_are_shares_of_each_zone(make_view):
    """Each histogram of the fish sums to one, whatever the other zones hold."""
    view = make_view()
    fish = view.statistics[540, "control"]
    figure = compose(statistics_picture({"fish": fish}, view.arena, title="x"))

    for zone in view.arena.zone_names:
        axes = panel_of(figure, f"To the wall, {zone}")
        assert sum(bar.get_height() for bar in axes.patches) == pytest.approx(1.0)
        assert axes.get_xlim()[0] == view.arena.bins.wall_distance_m[0]
        colour = theme.zone_colours(view.arena.zone_names)[zone]
        assert axes.title.get_color() == theme.INK or axes._left_title.get_color() == colour


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "circular", "ring", "own"])
def test_no_text_covers_another(arenas, wander, covered_texts, name):
    """Long zone names are wrapped or slanted, and numbers have their room."""
    arena = arenas[name]
    samples, every = wander(arena), further(statistics_known())
    cases = {
        "fish": measure(samples.of_kind(0), arena, further=every),
        "model": measure(samples, arena, further=every),
        "robot": measure_robot(samples, arena, further=every),
    }

    assert covered_texts(statistics_picture(cases, arena, title="Fish and model")) == []


def test_what_lies_beyond_the_bins_stands_apart(make_view):
    """The last of ten bins is moved away, hatched and has a ≥; no line of the model leads to it."""
    view = make_view()
    fish = view.statistics[540, "control"]
    cases = {"fish": fish, "model": view.model_statistics}
    figure = compose(statistics_picture(cases, view.arena, title="x"))
    axes = panel_of(figure, "Between two fish, walls")
    lefts = np.array([bar.get_x() for bar in axes.patches])

    assert np.diff(lefts)[:-1] == pytest.approx(0.022)
    assert np.diff(lefts)[-1] > 1.5 * 0.022
    assert [bool(bar.get_hatch()) for bar in axes.patches] == [False] * 9 + [True]
    assert axes.get_xticklabels()[-1].get_text() == "≥ 0.198"
    assert max(axes.get_xticks()[:-1]) < 0.198
    points = [len(line.get_xdata()) for line in axes.get_lines() if line.get_marker() == "^"]
    assert points == [9, 1]


def test_bins_beyond_which_nothing_lies_stand_together(arenas, wander):
    """A polarisation is at most 1: its last bin is one like the others."""
    arena = arenas["two-rooms"]
    fish = measure(wander(arena), arena, further=["polarisation"])
    figure = compose(statistics_picture({"fish": fish}, arena, title="x"))
    axes = panel_of(figure, "Polarisation of the group")

    assert axes.get_xlim() == (0.0, 1.0)
    assert not [text for text in axes.get_xticklabels() if "≥" in text.get_text()]
    assert np.diff([bar.get_x() for bar in axes.patches]) == pytest.approx(0.1)


@pytest.mark.parametrize(("n", "said"), [(99, "few: n = 99"), (100, "n = 100")])
def test_few_observations_are_named(arenas, n, said):
    """Fewer than a hundred, ten for each bin, are said to be few, in the colour of warnings."""
    arena = arenas["circular"]
    wall = np.zeros((2, 10), dtype=np.int64)
    wall[0, 2] = n
    fish = statistics(arena.zone_names, wall=wall)
    picture = statistics_picture({"fish": fish}, arena, title="x")
    axes = panel_of(compose(picture), "To the wall, walls")

    assert texts_of(axes) == [said]
    assert axes.texts[0].get_color() == (theme.WARN if n < 100 else theme.MUTED)
    (panel,) = (p for p in picture.panels if p.title == "To the wall, walls")
    assert f"{n} observations of fish" in panel.alt


def test_no_axis_shows_a_share_above_one(arenas):
    """The words above the bars have room, and the numbers of the axis end at 1 and 100 %."""
    arena = arenas["circular"]
    wall = np.zeros((2, 10), dtype=np.int64)
    wall[0, 2] = 500
    fish = statistics(arena.zone_names, wall=wall, occupation=np.array([9, 1]))
    figure = compose(statistics_picture({"fish": fish}, arena, title="x"))

    assert panel_of(figure, "To the wall, walls").get_yticks().max() <= 1.0
    assert panel_of(figure, "Share of time in each zone").get_yticks().max() <= 100.0
    assert panel_of(figure, "To the wall, walls").get_ylim()[1] > 1.2
