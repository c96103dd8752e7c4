"""The published figure: means, spreads, ceilings and the published values."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_hex

from zfcal.report.figures import theme
from zfcal.report.figures.panels import compose
from zfcal.report.figures.scores import pool, scores_picture
from zfcal.report.views import FEATURE_NAMES, MODEL, ROBOT, SOCIAL


def picture_of(views, compared=MODEL):
    """Return the figure of a comparison."""
    return scores_picture(views, compared, name="scores", title="Scores", short="Scores")


def lines_of(figure, title):
    """Return the lines of the panel of one feature."""
    (axes,) = (a for a in figure.axes if a.get_title(loc="left") == title)
    return axes, axes.get_lines()


def test_mean_and_spread_over_trials_by_hand(course):
    """0.7 and 0.9: mean 0.8, sample standard deviation sqrt(0.02)."""
    line = pool([course([0.7, 0.5]), course([0.9])])

    assert line.value == pytest.approx([0.8, 0.5])
    assert line.sd[0] == pytest.approx(np.sqrt(0.02))
    assert np.isnan(line.sd[1])
    assert line.n_trials.tolist() == [2, 1]


def test_the_range_of_the_ceiling_over_trials_is_a_mean(course):
    """0.7 to 0.9 and 0.5 to 0.7: 0.6 to 0.8, whatever the scores are."""
    line = pool([course([0.1], ceiling=0.8), course([0.9], ceiling=0.6)])

    assert (line.low[0], line.ceiling[0], line.high[0]) == pytest.approx((0.6, 0.7, 0.8))


def test_a_single_trial_keeps_its_values_and_its_ceiling(course):
    """Nothing is averaged, and the band is that of the ceiling."""
    only = course([0.7, np.nan], ceiling=0.85)
    line = pool([only])

    assert line.value == pytest.approx(only.value, nan_ok=True)
    assert line.low == pytest.approx(only.low)
    assert line.n_trials.tolist() == [1, 0]


def test_the_order_of_trials_does_not_matter(course):
    """Every permutation gives the same mean and spread."""
    courses = [course([0.7, 0.5]), course([0.9]), course([np.nan, 0.4, 0.3])]
    first = pool(courses)

    for order in itertools.permutations(courses):
        line = pool(order)
        for part in ("value", "sd", "ceiling"):
            assert getattr(line, part) == pytest.approx(getattr(first, part), nan_ok=True)


def test_windows_of_different_trials_meet_by_their_end(course):
    """A trial that starts a minute later is compared at the same second."""
    line = pool([course([0.6, 0.8]), course([0.4], first_s=180)])

    assert line.end_s.tolist() == [120, 180]
    assert line.value == pytest.approx([0.6, 0.6])


def test_nothing_to_show_is_no_picture(make_view, course):
    """Neither no scores nor scores that are all null make an empty figure."""
    empty = {(MODEL, feature, None): course([np.nan]) for feature in FEATURE_NAMES}

    assert picture_of([make_view(courses={})]) is None
    assert picture_of([make_view(courses=empty)]) is None


def test_published_values_stand_beside_s_alone_and_where_asked_for(make_view):
    """0.610 at 3 min, 0.827 at 5 min and 0.850 from 6 min on, in the panel of S only."""
    figure = compose(picture_of([make_view(n_windows=10, published=True)]))

    for title in FEATURE_NAMES.values():
        axes, lines = lines_of(figure, title)
        marks = [line for line in lines if line.get_marker() == "D"]
        if title != FEATURE_NAMES["S"]:
            assert marks == []
            continue
        (published,) = marks
        assert published.get_xdata() == pytest.approx([3, 5, 6])
        assert published.get_ydata() == pytest.approx([0.610, 0.827, 0.850])
        (flat,) = (line for line in lines if line.get_linestyle() == ":")
        assert flat.get_xdata() == pytest.approx([6, 11])
        assert axes.get_xlim()[1] > 11


def test_published_values_of_other_fish_are_not_drawn_unasked(make_view):
    """Neither on the axes nor in the key."""
    picture = picture_of([make_view()])

    _, lines = lines_of(compose(picture), FEATURE_NAMES["S"])
    assert not [line for line in lines if line.get_marker() == "D"]
    assert not [entry for entry in picture.key if "published" in entry.label]


def test_the_robot_has_no_published_value(make_view):
    """The published numbers are of the model; the robot's panels do without."""
    for compared, colour in ((ROBOT, theme.ROBOT), (SOCIAL, theme.GROUP)):
        figure = compose(picture_of([make_view(published=True)], compared))
        _, lines = lines_of(figure, FEATURE_NAMES["S"])

        assert not [line for line in lines if line.get_linestyle() == ":"]
        assert {line.get_color() for line in lines if line.get_marker() != "None"} == {colour}


def test_scores_have_the_whole_axis(make_view):
    """From 0 to 1 in every panel: no difference looks larger than it is."""
    figure = compose(picture_of([make_view()]))

    assert {axes.get_ylim() for axes in figure.axes} == {(0.0, 1.02)}
    assert all(axes.get_yticks()[0] == 0 and axes.get_yticks()[-1] == 1 for axes in figure.axes)


def bands_of(axes):
    """Return the colour, lower and upper end of each band that is to be seen."""
    shown = [band for band in axes.collections if band.get_paths()]
    boxes = [band.get_paths()[0].get_extents() for band in shown]
    colours = [to_hex(band.get_facecolor()[0]) for band in shown]
    return {colour: (box.y0, box.y1) for colour, box in zip(colours, boxes, strict=True)}


def test_grey_is_the_ceiling_and_the_spread_has_the_colour_of_the_score(make_view):
    """One trial has the range of the ceiling alone; two have that and their spread."""
    (one, _), (two, _) = (
        lines_of(compose(picture_of(views)), FEATURE_NAMES["S"])
        for views in ([make_view()], [make_view("a"), make_view("b")])
    )

    assert bands_of(one) == {theme.BAND: pytest.approx((0.75, 0.95))}
    assert bands_of(two).keys() == {theme.BAND, theme.MODEL}
    assert bands_of(two)[theme.BAND] == pytest.approx((0.75, 0.95))


def test_every_mark_of_the_key_means_one_thing(make_view):
    """No two entries look alike, of whatever comparison and number of trials."""
    for views in ([make_view()], [make_view("a"), make_view("b")]):
        for compared in (MODEL, SOCIAL, ROBOT):
            key = picture_of(views, compared).key
            assert len({(e.colour, e.mark, e.marker) for e in key}) == len(key)
            assert len({e.label for e in key}) == len(key)


def test_a_window_above_the_range_is_hollow(make_view, course):
    """0.99 where the range ends at 0.95: marked as chance, and so in the key."""
    courses = dict(make_view().courses) | {(MODEL, "S", None): course([0.8, 0.99], ceiling=0.85)}
    picture = picture_of([make_view(courses=courses)])
    _, lines = lines_of(compose(picture), FEATURE_NAMES["S"])
    (hollow,) = (line for line in lines if line.get_markerfacecolor() == theme.GROUND)

    assert hollow.get_xdata() == pytest.approx([3])
    assert "above that range: fits chance" in [entry.label for entry in picture.key]


def test_a_single_window_has_a_band_that_is_seen(make_view):
    """The ceiling of one window is drawn a minute wide."""
    axes, lines = lines_of(compose(picture_of([make_view(n_windows=1)])), FEATURE_NAMES["S"])
    (ceiling,) = (line for line in lines if line.get_linestyle() == "--")
    band = axes.collections[0].get_paths()[0].get_extents()

    assert ceiling.get_xdata() == pytest.approx([1.5, 2.5])
    assert band.width == pytest.approx(1.0)
    assert band.height == pytest.approx(0.2)


@pytest.mark.slow
@pytest.mark.parametrize("n_trials", [1, 3])
@pytest.mark.parametrize("n_windows", [1, 2, 29])
def test_no_text_covers_another(make_view, covered_texts, n_trials, n_windows):
    """Titles, ticks and key have room, for any number of trials and windows."""
    views = [make_view(f"t{i}", n_windows=n_windows) for i in range(n_trials)]

    for compared in (MODEL, SOCIAL, ROBOT):
        assert covered_texts(picture_of(views, compared)) == []


def test_several_trials_say_so(make_view):
    """The title counts them, and a band is the standard deviation."""
    picture = picture_of([make_view("a"), make_view("b")])

    assert picture.title == "Scores, 2 trials"
    assert "± standard deviation over trials" in [entry.label for entry in picture.key]
