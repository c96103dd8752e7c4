"""Colours and lettering that all figures share, on light and on dark ground.

One colour per zone and one per case in every figure. A colour is never the only
mark: cases also differ by dash and marker, zones by marker and by name. Apart
for red-, green- and blue-blind readers as well (the tests measure how far).
"""

from __future__ import annotations

import re
import textwrap
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from zfcal.arrays import Ints

INK = "#1b1f24"
MUTED = "#59636e"
_GRID = "#dde2e8"
GROUND = "#ffffff"
WARN = "#8a4b00"
"""Of what is too little to be read."""

BAND = "#8b95a1"
"""The ceiling and its range, and nothing else."""

FISH = "#16497a"
MODEL = "#d55e00"
ROBOT = "#bd5bdb"
GROUP = "#00a078"
"""Fish and robot together."""

ZONES = ("#bd7a00", "#2a8c8c", "#5a1f99", "#7d2a35", "#f0308a", "#2f5bea")

THEME: Mapping[str, tuple[str, str, str]] = MappingProxyType(
    {
        INK: ("ink", INK, "#e8ebef"),
        MUTED: ("muted", MUTED, "#a3adb8"),
        _GRID: ("grid", _GRID, "#343b43"),
        GROUND: ("ground", GROUND, "#16191d"),
        WARN: ("warn", WARN, "#ffc069"),
        BAND: ("band", BAND, "#7d8793"),
        FISH: ("fish", FISH, "#a9cdec"),
        MODEL: ("model", MODEL, "#e8701a"),
        ROBOT: ("robot", ROBOT, "#cf52f2"),
        GROUP: ("group", GROUP, "#4fe39a"),
        ZONES[0]: ("zone-0", ZONES[0], "#db8f1c"),
        ZONES[1]: ("zone-1", ZONES[1], "#74dede"),
        ZONES[2]: ("zone-2", ZONES[2], "#9d6bf2"),
        ZONES[3]: ("zone-3", ZONES[3], "#ffe375"),
        ZONES[4]: ("zone-4", ZONES[4], "#f04769"),
        ZONES[5]: ("zone-5", ZONES[5], "#2a93bb"),
    }
)
"""For each colour of a figure: its name on the page, light and dark."""

_ZONE_MARKERS = ("o", "s", "D", "^", "v", "P")
MARKER_OF = MappingProxyType({FISH: "o", MODEL: "^", ROBOT: "s", GROUP: "D"})

_KNOWN_ZONES = {"corridor": 0, "walls": 1, "centre": 2, "inner": 0, "middle": 1, "outer": 2}

FONT = "DejaVu Sans"

_STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": [FONT],
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.linewidth": 0.8,
    "grid.color": _GRID,
    "grid.linewidth": 0.7,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": GROUND,
    "lines.linewidth": 1.6,
    "lines.markersize": 4,
    # A zone may be named with a dollar sign.
    "text.parse_math": False,
    # Text stays text: it can be searched, read aloud and takes the page's colour.
    "svg.fonttype": "none",
    "svg.hashsalt": "zfcal",
    "pdf.fonttype": 42,
}

_ON_PAPER: dict[str, Any] = {
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "axes.titlepad": 4,
    "axes.labelsize": 7.5,
    "axes.labelpad": 2,
    "axes.linewidth": 0.6,
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.fontsize": 7,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.2,
    "lines.linewidth": 1.1,
    "lines.markersize": 3,
    "hatch.linewidth": 0.6,
}
"""What a journal asks for: letters of 7 to 8 points at the width of print."""

PNG_DPI = 150
PAPER_DPI = 300

_LETTER = 0.6
"""Width of a letter, in sizes of the font."""

_REM_PER_PT = 1 / 11.6
"""A letter of 12 points is a little larger than one of 16 pixels."""


def _zone_numbers(names: Sequence[str]) -> dict[str, int]:
    """Return for each zone the number of its colour and marker.

    Zones of the arenas that come with zfcal keep theirs in every arena; others
    take what is left, in the arena's order, and begin again after six.
    """
    numbers: dict[str, int] = {}
    for name in names:
        if (number := _KNOWN_ZONES.get(name, -1)) >= 0 and number not in numbers.values():
            numbers[name] = number
    free = [number for number in range(len(ZONES)) if number not in numbers.values()]
    others = [name for name in names if name not in numbers]
    for index, name in enumerate(others):
        numbers[name] = free[index] if index < len(free) else index % len(ZONES)
    return {name: numbers[name] for name in names}


def zone_colours(names: Sequence[str]) -> dict[str, str]:
    """Return the colour of each zone, in the order given."""
    return {name: ZONES[number] for name, number in _zone_numbers(names).items()}


def zone_markers(names: Sequence[str]) -> dict[str, str]:
    """Return the marker of each zone, in the order given."""
    return {name: _ZONE_MARKERS[number] for name, number in _zone_numbers(names).items()}


@contextmanager
def style(*, on_paper: bool = False) -> Iterator[None]:
    """Draw and save in the report's style, whatever a person's own settings are.

    Parameters
    ----------
    on_paper
        Whether the letters are those of print.
    """
    with mpl.rc_context(), warnings.catch_warnings():
        # A zone may be named in letters that the font lacks; on the page they are shown.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE | (_ON_PAPER if on_paper else {}))  # type: ignore[arg-type]
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure that no window manager knows of; `save` lays it out.

    Parameters
    ----------
    width_in, height_in
        Size in inches.
    """
    figure = Figure(figsize=(width_in, height_in))
    FigureCanvasAgg(figure)
    return figure


def save(
    figure: Figure,
    made: Path | BytesIO,
    kind: str,
    *,
    dpi: float = PNG_DPI,
    said: Mapping[str, Any],
) -> None:
    """Lay a figure out, and write it.

    Parameters
    ----------
    figure
        Made by `new_figure`.
    made
        Where it goes.
    kind
        ``png``, ``svg`` or ``pdf``.
    dpi
        Dots per inch, of what has dots.
    said
        What the file says of itself; a name whose value is None leaves out what Matplotlib
        would say.
    """
    # As wide as the letters that are written.
    figure.set_dpi(dpi)
    lay_out(figure)
    figure.savefig(made, format=kind, dpi=dpi, metadata=dict(said))


def lay_out(figure: Figure) -> None:
    """Give all that stands beside the axes its room.

    A figure that has an engine for its layout would be drawn once more, only to be laid out.
    """
    # In inches.
    ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.07).execute(figure)


def wrapped(name: str) -> str:
    """Return a name on lines of at most eleven letters, where it can be broken."""
    return "\n".join(textwrap.wrap(name.replace("_", " "), 11, break_long_words=False)) or name


def name_ticks(axes: Axes, at: Ints | NDArray[np.floating], names: Sequence[str]) -> None:
    """Put names below an x axis, slanted where they would run into each other."""
    labels = [wrapped(name) for name in names]
    longest = max(len(line) for label in labels for line in label.split("\n"))
    if longest * len(names) > letters_across(axes):
        axes.set_xticks(at, labels, rotation=30, ha="right", rotation_mode="anchor")
    else:
        axes.set_xticks(at, labels)


def small_pt() -> float:
    """Return the size of the smallest letters, in points."""
    return float(FontProperties(size=mpl.rcParams["xtick.labelsize"]).get_size_in_points())


def width_in_of(axes: Axes) -> float:
    """Return about how wide axes will be, in inches."""
    return float(axes.get_window_extent().width / axes.figure.dpi)


def height_in_of(axes: Axes) -> float:
    """Return about how high axes will be below their title, in inches."""
    return float(0.8 * axes.get_window_extent().height / axes.figure.dpi)


def letters_across(axes: Axes) -> int:
    """Return how many letters of tick labels stand beside each other below axes."""
    return round(width_in_of(axes) * 72 / (_LETTER * small_pt()))


def save_png(figure: Figure, path: Path | BytesIO) -> None:
    """Write the figure as a PNG that holds nothing of the day or the machine."""
    save(figure, path, "png", said={"Software": None})


def to_svg(figure: Figure, *, prefix: str, alt: str) -> str:
    """Return the figure as an ``<svg>`` element for a page, coloured by the page.

    Parameters
    ----------
    figure
        Drawn with colours of `THEME`; these become ``var(--NAME, colour)``, so
        that the page sets them for light and dark.
    prefix
        Unique on the page; the element's ids begin with it.
    alt
        What the figure shows, for those who cannot see it.
    """
    buffer = BytesIO()
    unsaid = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with mpl.rc_context({"savefig.transparent": True}):
        save(figure, buffer, "svg", said=unsaid)
    text = buffer.getvalue().decode("utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}-", text)
    text = _label(text, alt)
    for colour, (name, light, _) in THEME.items():
        text = re.sub(colour, f"var(--{name}, {light})", text, flags=re.IGNORECASE)
    return text.strip()


def _label(svg: str, alt: str) -> str:
    """Let the element take the width it is given, and say what it shows."""
    head, body = svg.split(">", 1)
    width = re.search(r'\bwidth="([0-9.]+)pt"', head)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    # Little more than the size for which the letters were chosen; less where there is no room.
    size = "" if width is None else f' style="width: {float(width.group(1)) * _REM_PER_PT:.4g}rem"'
    quoted = alt.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return f'{head}{size} role="img" aria-label="{quoted}">{body}'
