"""What the search of each round has reached: the hypervolume of its population."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.arrays import Floats
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.views import Round


def search_picture(rounds: Sequence[Round]) -> Picture | None:
    """Return the hypervolume at the beginning and the end of each round's search.

    Parameters
    ----------
    rounds
        Of one trial; those whose files do not say are left out.

    Returns
    -------
    Picture or None
        None where no file says.
    """
    known = [each for each in rounds if each.hypervolume]
    if not known:
        return None
    minute = np.array([each.second for each in known]) / 60.0
    first, last = (np.array([each.hypervolume[at] for each in known]) for at in (0, -1))

    def draw(axes: Axes) -> None:
        _draw(axes, minute, first, last)

    return Picture(
        name="search",
        title="What the search has reached",
        short="Search",
        panels=(
            Panel(
                title="Hypervolume of the population",
                alt=f"Hypervolume in {len(known)} rounds: from {first[-1]:.2f} to {last[-1]:.2f} "
                f"in the last one, and {last.mean():.2f} on average at the end of a search.",
                draw=draw,
            ),
        ),
        key=(
            Entry(label="first generation", colour=theme.MODEL, mark="hollow", marker="o"),
            Entry(label="last generation", colour=theme.MODEL, mark="line", marker="o"),
        ),
        note="The share of all possible similarities of the window (D, W, O and T, or of those "
        "that were named) that some genome of the population matches or exceeds in all of them: "
        "1 if one were perfect in all. A round begins with the population of the one before. "
        "Where it no longer rises within a round, more generations bring little. It is no S and "
        "has no ceiling: windows differ in what can be reached.",
    )


def _draw(axes: Axes, minute: Floats, first: Floats, last: Floats) -> None:
    axes.vlines(minute, first, last, color=theme.MODEL, lw=1, alpha=0.5)
    axes.plot(minute, last, color=theme.MODEL, marker="o")
    axes.plot(minute, first, color=theme.MODEL, marker="o", ls="none", mfc=theme.GROUND)
    axes.set(xlabel="end of the window (min)", ylabel="hypervolume", ylim=(0.0, 1.02))
    axes.set_xlim(minute[0] - 0.7, max(minute[-1], minute[0] + 1) + 0.7)
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))
