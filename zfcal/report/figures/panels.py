"""Pictures made of panels: together as one PNG, or one by one on the page.

A panel knows how to draw itself on axes of its size; a picture is a list of
panels with one key to their marks. On the page the panels flow, three beside
each other on a desk and one below the other on a phone, at the size for which
they were drawn; the PNG puts them on a grid.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from zfcal.report.figures import theme

Mark = Literal["line", "dash", "dot", "reference", "points", "hollow", "bar", "band", "steps"]

_HOLLOW = frozenset({"reference", "hollow"})

PANEL_IN = (3.75, 2.6)
"""Width and height of a panel: 360 pixels wide, what a phone shows."""

_NARROWEST_IN = 1.6
"""Of a panel on paper: a column of 85 mm has two beside each other."""

_LOWEST_IN = 1.5
_KEY_LINE_IN = 0.22
_PAPER_SCALE = 0.83
"""Letters on paper over those on the screen."""

_MARGIN_IN = 0.35
_TITLE_LETTER_IN = 0.068
"""What a letter of a title takes on paper, and what is left of a panel beside its axes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One line of the key to a picture.

    Parameters
    ----------
    label
        What it stands for.
    colour
        One of the theme's colours.
    mark
        How it is drawn.
    marker
        The marker of a line or of points; none for an empty string.
    """

    label: str
    colour: str
    mark: Mark
    marker: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """A diagram with its title.

    Parameters
    ----------
    title
        What it shows, in a few words.
    alt
        What is to be seen, in a sentence, for those who cannot see it.
    draw
        Draws on empty axes.
    size_in
        Width and height, in inches.
    colour
        Colour of the title; the zone's where the panel is about one.
    """

    title: str
    alt: str
    draw: Callable[[Axes], None]
    size_in: tuple[float, float] = PANEL_IN
    colour: str = theme.INK


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """Panels that belong together.

    Parameters
    ----------
    name
        Its file name without the ending.
    title
        Its heading.
    panels
        At least one, all of a height.
    key
        What the marks mean.
    short
        What it is called where there is little room; the title if empty.
    columns
        Panels beside each other in the PNG.
    note
        How to read it, in plain words.
    """

    name: str
    title: str
    panels: Sequence[Panel]
    key: Sequence[Entry] = ()
    short: str = ""
    columns: int = 3
    note: str = ""


def write_picture(picture: Picture, path: Path) -> None:
    """Write all panels of a picture, its title and its key as one PNG."""
    path.write_bytes(png_of(picture))


def png_of(picture: Picture) -> bytes:
    """Return all panels of a picture, its title and its key as one PNG."""
    made = BytesIO()
    with theme.style():
        theme.save_png(compose(picture), made)
    return made.getvalue()


def compose(picture: Picture, *, width_in: float | None = None) -> Figure:
    """Return all panels of a picture on one figure, its key below.

    Parameters
    ----------
    picture
        With at least one panel.
    width_in
        Width on paper, in inches: as many panels beside each other as have room, each with a
        letter. None for the screen: panels have the size for which they were drawn, and
        their title stands above.
    """
    on_paper = width_in is not None
    columns = min(picture.columns, len(picture.panels))
    if width_in is not None:
        columns = max(1, min(columns, int(width_in / _NARROWEST_IN)))
    rows = math.ceil(len(picture.panels) / columns)
    width, height = _size(picture, columns, width_in)
    key_columns = _key_columns(picture.key, width, on_paper=on_paper)
    line_in = _KEY_LINE_IN * (_PAPER_SCALE if on_paper else 1.0)
    extra_in = line_in * math.ceil(len(picture.key) / key_columns) + (0.05 if on_paper else 0.3)
    figure = theme.new_figure(width, rows * height + extra_in)
    if not on_paper:
        figure.suptitle(picture.title, x=0.01, ha="left", fontsize=11, fontweight="bold")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    several = len(picture.panels) > 1
    for index, (axes, panel) in enumerate(zip(grid, picture.panels, strict=False)):
        _fill(axes, panel)
        if on_paper:
            title = f"{_letter(index)}  {panel.title}" if several else panel.title
            axes.set_title(_broken(title, width / columns), color=panel.colour, loc="left")
    for axes in grid[len(picture.panels) :]:
        axes.remove()
    if picture.key:
        figure.legend(
            handles=[handle(entry) for entry in picture.key],
            loc="outside lower left",
            ncols=key_columns,
        )
    return figure


def _size(picture: Picture, columns: int, width_in: float | None) -> tuple[float, float]:
    """Return the width of a figure and the height of its rows, in inches."""
    widths = [max(p.size_in[0] for p in picture.panels[i::columns]) for i in range(columns)]
    height = max(panel.size_in[1] for panel in picture.panels)
    if width_in is None:
        return sum(widths), height
    # Letters take their room however small the panel is.
    shape = max(p.size_in[1] / p.size_in[0] for p in picture.panels)
    return width_in, max(_LOWEST_IN, shape * width_in / columns)


def _letter(index: int) -> str:
    return chr(ord("a") + index) if index < 26 else str(index + 1)


def _broken(title: str, width_in: float) -> str:
    """Return a title on as many lines as a panel of a width needs."""
    letters = max(int((width_in - _MARGIN_IN) / _TITLE_LETTER_IN), 12)
    # A number keeps its unit.
    held = re.sub(r"(\d) (?=[a-z]{1,3}\b)", "\\1\u00a0", title)
    lines = textwrap.wrap(held, letters, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines)


def _key_columns(key: Sequence[Entry], width_in: float, *, on_paper: bool = False) -> int:
    """Return how many entries stand beside each other without leaving the figure."""
    scale = _PAPER_SCALE if on_paper else 1.0
    longest_in = scale * (0.6 + 0.078 * max((len(entry.label) for entry in key), default=0))
    return max(1, min(len(key), int(width_in / longest_in)))


def panel_svg(panel: Panel, prefix: str) -> str:
    """Return one panel as an element of a page; ``prefix`` begins its ids."""
    with theme.style():
        figure = theme.new_figure(*panel.size_in)
        _fill(figure.subplots(), panel)
        return theme.to_svg(figure, prefix=prefix, alt=panel.alt)


def entry_svg(entry: Entry) -> str:
    """Return the mark of a key entry as a small element of a page."""
    colour = f"var(--{theme.THEME[entry.colour][0]})"
    shapes = {
        "band": f'<rect x="1" y="2" width="26" height="10" fill="{colour}" opacity=".3"/>',
        "bar": f'<rect x="5" y="2" width="18" height="11" fill="{colour}" opacity=".45"/>',
        "steps": f'<path d="M1 12V5H14V2H27V12" fill="{colour}" fill-opacity=".2" '
        f'stroke="{colour}" stroke-width="1.5"/>',
    }
    body = shapes.get(entry.mark) or _line_svg(entry, colour)
    return f'<svg class="key" viewBox="0 0 28 14" aria-hidden="true">{body}</svg>'


def _line_svg(entry: Entry, colour: str) -> str:
    dashes = {"dash": "5 3", "dot": "1.5 2.5", "reference": "1.5 2.5"}.get(entry.mark, "none")
    line = (
        f'<path d="M1 7H27" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>'
        if entry.mark not in {"points", "hollow"}
        else ""
    )
    fill = "var(--ground)" if entry.mark in _HOLLOW else colour
    outlines = {
        "o": '<circle cx="14" cy="7" r="3.6" {0}/>',
        "s": '<rect x="10.6" y="3.6" width="6.8" height="6.8" {0}/>',
        "D": '<path d="M14 2.4L18.6 7L14 11.6L9.4 7Z" {0}/>',
        "^": '<path d="M14 2.8L18.4 10.6H9.6Z" {0}/>',
        "v": '<path d="M14 11.2L9.6 3.4H18.4Z" {0}/>',
        "P": '<path d="M14 2.5V11.5M9.5 7H18.5" stroke-width="3.4" {0}/>',
    }
    marker = outlines.get(entry.marker, "").format(f'fill="{fill}" stroke="{colour}"')
    return line + marker


def handle(entry: Entry) -> Line2D | Patch:
    """Return the mark of a key entry for a figure's legend."""
    if entry.mark in {"band", "bar", "steps"}:
        edge = entry.colour if entry.mark == "steps" else "none"
        alpha = {"band": 0.3, "bar": 0.45, "steps": 0.35}[entry.mark]
        return Patch(facecolor=entry.colour, edgecolor=edge, alpha=alpha, label=entry.label)
    styles: dict[str, Any] = {"line": "-", "dash": "--", "dot": ":", "reference": ":"}
    return Line2D(
        [],
        [],
        color=entry.colour,
        linestyle=styles.get(entry.mark, "none"),
        marker=entry.marker or None,
        markerfacecolor=theme.GROUND if entry.mark in _HOLLOW else entry.colour,
        label=entry.label,
    )


def _fill(axes: Axes, panel: Panel) -> None:
    axes.set_title(panel.title, color=panel.colour, loc="left")
    panel.draw(axes)
