"""Forward scores of the rules by which models are published, over the windows of a trial."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from zfcal.arrays import Floats
from zfcal.report.figures import theme
from zfcal.report.figures.panels import Entry, Panel, Picture
from zfcal.report.views import RuleScore

_MARKS = dict(
    zip(
        ("score", "likelihood", "compromise", "memory", "nearest", "keep"),
        zip(theme.ZONES, ("o", "s", "D", "^", "v", "P"), strict=True),
        strict=True,
    )
)
_OTHER = (theme.MUTED, "o")
_S_PER_MIN = 60.0
_SIZE_IN = (5.6, 2.8)
"""Six lines over each other need some room."""


def rules_picture(scores: Sequence[RuleScore]) -> Picture | None:
    """Return the picture of what the rules' models scored; None where none was judged.

    Parameters
    ----------
    scores
        Of one trial.
    """
    known = [each for each in scores if not math.isnan(each.score.value)]
    rules = list(dict.fromkeys(each.rule for each in known))
    if not rules:
        return None
    lines = {rule: _line([each for each in known if each.rule == rule]) for rule in rules}
    said = ", ".join(f"{rule} {line[1].mean():.2f}" for rule, line in lines.items())

    def draw(axes: Axes) -> None:
        _draw(axes, lines)

    return Picture(
        name="rules",
        title="Forward score of each rule",
        short="Rules",
        panels=(
            Panel(
                title="Forward score, on the first window after",
                alt=f"Forward score of each rule on the windows that followed; means: {said}.",
                draw=draw,
                size_in=_SIZE_IN,
            ),
        ),
        key=tuple(
            Entry(
                label=rule,
                colour=_MARKS.get(rule, _OTHER)[0],
                mark="line",
                marker=_MARKS.get(rule, _OTHER)[1],
            )
            for rule in rules
        ),
        note="Each rule has a model at the end of a window, and is judged by what that scores on "
        "the first window of 120 s that follows. One rule is in charge, and another takes "
        "over where it leads by more than chance.",
    )


def _line(scores: Sequence[RuleScore]) -> tuple[Floats, Floats]:
    ordered = sorted(scores, key=lambda each: each.end_s)
    minute = np.array([each.end_s for each in ordered]) / _S_PER_MIN
    return minute, np.array([each.score.value for each in ordered])


def _draw(axes: Axes, lines: dict[str, tuple[Floats, Floats]]) -> None:
    for rule, (minute, value) in lines.items():
        colour, marker = _MARKS.get(rule, _OTHER)
        axes.plot(minute, value, color=colour, marker=marker, ms=4.5, lw=1.2, alpha=0.9)
    axes.set(xlabel="end of the window (min)", ylabel="forward score")
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))
