"""The figures of `bench_diagnosis.py`: who is taken for whom, and power."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap

from benchmarks.diagnosis.answers import NAMELESS, NOTHING
from benchmarks.diagnosis.document import MODES
from zfcal.report.figures.theme import FISH, GROUND, INK, MODEL, MUTED, new_figure, save_png, style

_SHADES = LinearSegmentedColormap.from_list("shades", (GROUND, FISH))
_MARKS = ("o", "^", "s", "D")


def draw(found: Mapping[str, Any], folder: Path) -> None:
    """Draw the figures of each mode that has trials for them."""
    folder.mkdir(parents=True, exist_ok=True)
    for mode, told in found["modes"].items():
        if told["confusion"]:
            _confusion(told["confusion"], folder / f"diagnosis-confusion-{mode}.png", mode)
        if any(each["right"]["n"] for each in told["power"]):
            _power(told["power"], folder / f"diagnosis-power-{mode}.png", mode)


def _columns(matrix: Mapping[str, Mapping[str, int]]) -> tuple[list[str], list[str]]:
    """Return what was hidden and what was said, in one order; nothing and verdicts last."""
    said = {answer for answers in matrix.values() for answer in answers}
    hidden = [true for true in matrix if true != NOTHING]
    names = sorted({*hidden, *said} - {*NAMELESS, NOTHING})
    rows = [name for name in names if name in matrix]
    last = [each for each in NAMELESS if each in said]
    return [*rows, *([NOTHING] if NOTHING in matrix else [])], [*names, *last]


def _confusion(matrix: Mapping[str, Mapping[str, int]], path: Path, mode: str) -> None:
    rows, columns = _columns(matrix)
    counts = np.array([[matrix[row].get(column, 0) for column in columns] for row in rows])
    of_row = counts / counts.sum(axis=1, keepdims=True)
    with style():
        figure = new_figure(8.4, 1.6 + 0.26 * len(rows))
        axes = figure.subplots()
        axes.imshow(of_row, cmap=_SHADES, vmin=0, vmax=1, aspect="auto")
        for (y, x), n in np.ndenumerate(counts):
            if n:
                ink = GROUND if of_row[y, x] > 0.5 else INK
                axes.text(x, y, str(n), ha="center", va="center", color=ink, fontsize=7.5)
        totals = [f"{row} ({counts[y].sum()})" for y, row in enumerate(rows)]
        axes.set_xticks(
            range(len(columns)), columns, rotation=60, ha="right", rotation_mode="anchor"
        )
        axes.set_yticks(range(len(rows)), totals)
        axes.grid(visible=False)
        axes.set(xlabel="said", ylabel="hidden (trials)", title=f"Hidden and said: {_named(mode)}")
        save_png(figure, path)


def _named(mode: str) -> str:
    return MODES[mode].replace("`", "")


def _power(power: Sequence[Mapping[str, Any]], path: Path, mode: str) -> None:
    with style():
        figure = new_figure(8.4, 3.4)
        left, right = figure.subplots(1, 2, sharey=True)
        whole = [each for each in power if each["minutes"] is None and each["right"]["n"]]
        _line(left, whole, "right", (f"named rightly, {_named(mode)}", FISH, "o"))
        _line(left, whole, "wrong", ("a wrong name", MODEL, "^"))
        _decorate(left, "All lengths")
        lengths = sorted({each["minutes"] for each in power if each["minutes"] is not None})
        shades = (MUTED, MODEL, FISH, INK)
        for number, minutes in enumerate(lengths):
            part = [e for e in power if e["minutes"] == minutes and e["right"]["n"]]
            mark = (f"{minutes:g} min", shades[number % 4], _MARKS[number % 4])
            _line(right, part, "right", mark)
        _decorate(right, "Named rightly, by length")
        left.set_ylabel("share of trials (%)")
        save_png(figure, path)


def _line(
    axes: Axes, part: Sequence[Mapping[str, Any]], key: str, mark: tuple[str, str, str]
) -> None:
    """Draw a rate over the median nats of each bin, with its interval."""
    if not part:
        return
    label, colour, marker = mark
    # A little aside, so that the intervals of two curves do not hide each other.
    aside = 1.0 + 0.06 * _MARKS.index(marker)
    x = aside * np.maximum([each["median_nats"] for each in part], 1.0)
    y = 100 * np.array([each[key]["share"] for each in part])
    low, high = (100 * np.array([each[key][end] for each in part]) for end in ("low", "high"))
    # Rounding can put the share a hair outside its own interval.
    spread = np.maximum([y - low, high - y], 0)
    axes.errorbar(x, y, yerr=spread, color=colour, marker=marker, label=label, capsize=2)


def _decorate(axes: Axes, title: str) -> None:
    axes.set_xscale("log")
    ticks = (1, 10, 20, 50, 100, 200, 500, 1000, 5000)
    axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks], rotation=30)
    axes.xaxis.minorticks_off()
    axes.set_ylim(-4, 104)
    axes.set(title=title, xlabel="oracle nats (median of the bin)")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.28), ncols=4)
