"""Panels on a grid or one by one, and the key to their marks."""

from xml.etree import ElementTree as ET

import pytest

from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture, compose, entry_svg, handle, panel_svg

MARKS = ("line", "dash", "dot", "reference", "points", "hollow", "bar", "band", "steps")


def panel(number=0, size_in=(3.0, 2.0)):
    """Return a panel with one line."""
    return Panel(
        title=f"panel {number}",
        alt="a line",
        draw=lambda axes: axes.plot([0, 1], [0, number]) and None,
        size_in=size_in,
    )


@pytest.mark.parametrize(("n", "shape"), [(1, (1, 1)), (3, (1, 3)), (5, (2, 3)), (7, (3, 3))])
def test_panels_stand_on_a_grid(n, shape):
    """Three beside each other, and no empty axes where the last row is not full."""
    figure = compose(Picture(name="a", title="A", panels=[panel(i) for i in range(n)]))

    assert [axes.get_title(loc="left") for axes in figure.axes] == [f"panel {i}" for i in range(n)]
    assert figure.axes[0].get_gridspec().get_geometry() == shape


def test_a_picture_is_as_large_as_its_panels():
    """Widths of the columns add up, and the key adds its lines below."""
    wide = [panel(0, (3.0, 2.0)), panel(1, (4.0, 2.0))]
    entries = [Entry(label="a" * 70, colour=theme.FISH, mark="line") for _ in range(2)]
    bare = compose(Picture(name="a", title="A", panels=wide))
    keyed = compose(Picture(name="a", title="A", panels=wide, key=entries))

    assert bare.get_size_inches() == pytest.approx([7.0, 2.0 + 0.3])
    assert keyed.get_size_inches()[1] - bare.get_size_inches()[1] == pytest.approx(2 * 0.22)


@pytest.mark.parametrize("mark", MARKS)
def test_every_mark_has_a_sign_on_page_and_picture(mark):
    """The page's sign is sound XML in the colour of the entry; the picture's has its label."""
    entry = Entry(label="x", colour=theme.ROBOT, mark=mark, marker="s")

    root = ET.fromstring(entry_svg(entry))  # noqa: S314 - made here

    assert len(root) >= 1
    assert "var(--robot)" in entry_svg(entry)
    assert handle(entry).get_label() == "x"


def test_hollow_marks_are_open_and_others_are_not():
    """What is not identified differs from what is by more than its colour."""
    full, hollow = (
        Entry(label="x", colour=theme.ROBOT, mark=mark, marker="o") for mark in ("points", "hollow")
    )

    assert 'fill="var(--ground)"' in entry_svg(hollow)
    assert 'fill="var(--robot)"' in entry_svg(full)
    assert handle(hollow).get_markerfacecolor() == theme.GROUND


def test_a_panel_is_sound_xml_at_its_own_size():
    """Three inches are 216 points, shown a little larger than letters of 12 points."""
    root = ET.fromstring(panel_svg(panel(), "p"))  # noqa: S314 - made here

    assert root.get("viewBox") == "0 0 216 144"
    assert root.get("style") == "width: 18.62rem"
    assert root.get("role") == "img"
    assert root.get("aria-label") == "a line"
