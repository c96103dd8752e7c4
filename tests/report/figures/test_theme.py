"""Colours that stay apart for every reader, and SVG that the page can colour."""

import itertools
import re
from io import BytesIO

import numpy as np
import pytest
from matplotlib.lines import Line2D

from zfcal.report.figures import theme

# Viénot-style simulation of dichromats in linear RGB (Machado et al. 2009, severity 1).
DICHROMATS = {
    "none": np.eye(3),
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
               [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
               [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
               [0.004733, 0.691367, 0.303900]],
}  # fmt: skip
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
     [0.0193339, 0.1191920, 0.9503041]]
)  # fmt: skip
CASES = (theme.FISH, theme.MODEL, theme.ROBOT, theme.GROUP)


def linear(colour):
    """Return a colour in linear RGB."""
    value = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """Return linear RGB as CIE Lab."""
    xyz = TO_XYZ @ np.clip(rgb, 0, 1) / np.array([0.95047, 1.0, 1.08883])
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def least_distance(colours):
    """Return the least distance of two colours for the eye that sees it least."""
    return min(
        np.linalg.norm(lab(np.asarray(eye) @ linear(a)) - lab(np.asarray(eye) @ linear(b)))
        for eye in DICHROMATS.values()
        for a, b in itertools.combinations(colours, 2)
    )


def contrast(a, b):
    """Return the contrast of two colours as WCAG defines it."""
    light, dark = sorted((TO_XYZ[1] @ linear(a), TO_XYZ[1] @ linear(b)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def shown(colours, mode):
    """Return colours as they are on light (1) or dark (2) ground."""
    return [theme.THEME[colour][mode] for colour in colours]


@pytest.mark.parametrize("mode", [1, 2], ids=["light", "dark"])
@pytest.mark.parametrize(
    ("colours", "least"),
    [(CASES, 28), (theme.ZONES[:3], 45), (theme.ZONES, 15)],
    ids=["cases", "zones of a tank", "six zones"],
)
def test_colours_stay_apart_for_colour_blind_readers(colours, least, mode):
    """Distances in Lab under simulated dichromacy; 10 is a difference seen at a glance."""
    assert least_distance(shown(colours, mode)) > least


@pytest.mark.parametrize("mode", [1, 2], ids=["light", "dark"])
def test_every_colour_stands_out_from_its_ground(mode):
    """Lines and marks have a contrast of 3, text of 4.5 (WCAG 2.1)."""
    (ground,) = shown([theme.GROUND], mode)

    assert min(contrast(c, ground) for c in shown((*CASES, *theme.ZONES), mode)) > 3
    assert min(contrast(c, ground) for c in shown((theme.INK, theme.MUTED, theme.WARN), mode)) > 4.5


def test_a_contrast_by_hand():
    """Black on white has 21: (1 + 0.05) / (0 + 0.05)."""
    assert contrast("#000000", "#ffffff") == pytest.approx(21)


def test_a_zone_has_one_colour_in_every_arena():
    """Walls and centre look alike in a disc and in two rooms."""
    rooms, disc = (
        theme.zone_colours(z) for z in (("corridor", "walls", "centre"), ("walls", "centre"))
    )

    assert {name: rooms[name] for name in disc} == disc
    assert len(set(rooms.values())) == 3


def test_zones_of_ones_own_take_what_colours_are_left():
    """No zone shares the colour of another until six are used up, whatever the order."""
    names = ("a", "walls", "b", "centre", "c", "d")

    assert len(set(theme.zone_colours(names).values())) == 6
    assert len(theme.zone_colours((*names, "e", "f"))) == 8


def test_two_shipped_names_of_one_colour_in_one_arena_are_told_apart():
    """`walls` and `middle` share a colour in different arenas, never in the same one."""
    assert len(set(theme.zone_colours(("walls", "middle", "inner")).values())) == 3


class Counting(Line2D):
    """A line that counts how often it is drawn."""

    times = 0

    def draw(self, renderer):
        """Draw it, and count."""
        self.times += 1
        super().draw(renderer)


def test_a_figure_is_laid_out_and_drawn_once():
    """What stands beside the axes has room within the figure."""
    line = Counting([0, 1], [0, 1])
    with theme.style():
        figure = theme.new_figure(2, 1)
        axes = figure.subplots()
        axes.add_line(line)
        axes.set(xlabel="time", ylabel="speed")
        theme.save(figure, BytesIO(), "png", said={})
        names = [axis.label.get_window_extent() for axis in (axes.xaxis, axes.yaxis)]
    assert line.times == 1
    assert all(min(name.x0, name.y0) >= 0 for name in names)


def draw(text="a"):
    """Return the SVG of a line and a text in theme colours."""
    with theme.style():
        figure = theme.new_figure(2, 1)
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], color=theme.MODEL, marker="o")
        axes.set_title(text, color=theme.ZONES[0])
        return theme.to_svg(figure, prefix="p7", alt='a < b & "c"')


def test_svg_takes_its_colours_from_the_page():
    """Every theme colour is a variable with the light colour as its fallback."""
    svg = draw()

    assert f"var(--model, {theme.MODEL})" in svg
    bare = re.sub(r"var\([^)]*\)", "", svg).lower()
    assert not [colour for colour in theme.THEME if colour in bare]


def test_svg_ids_are_its_own_and_all_found():
    """Ids begin with the prefix, so that two figures on a page do not meet."""
    svg = draw()
    ids = set(re.findall(r'\bid="([^"]*)"', svg))
    used = set(re.findall(r'url\(#([^)]*)\)|href="#([^"]*)"', svg))

    assert ids
    assert all(name.startswith("p7-") for name in ids)
    assert {a or b for a, b in used} <= ids


def test_svg_is_the_same_every_time_and_says_nothing_of_the_day():
    """No date, no program, the same bytes."""
    svg = draw()

    assert svg == draw()
    assert "dc:date" not in svg
    assert "Matplotlib" not in svg


def test_what_people_name_cannot_break_the_page():
    """Markup in names is text, and a dollar is a dollar."""
    svg = draw("<script>$x_1$ & </svg>")

    assert "<script" not in svg
    assert svg.count("</svg>") == 1
    assert "$x_1$" in svg
    assert 'aria-label="a &lt; b &amp; &quot;c&quot;"' in svg


def test_long_names_are_wrapped_between_words():
    """Names break where a person would break them, and never vanish."""
    assert theme.wrapped("feeding place") == "feeding\nplace"
    assert theme.wrapped("Schwimmbeckenrand") == "Schwimmbeckenrand"
    assert theme.wrapped("_") == "_"
