"""The picture and the tables of `bench_rounds.py`."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.shared.measuring import table
from zfcal.report.figures.theme import BAND, FISH, GROUP, MODEL, MUTED, new_figure, save_png, style
from zfcal.report.views import PUBLISHED_S

NOTHING = "–"


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Mean and sample standard deviation over trials, by the end of the window.

    Parameters
    ----------
    end_s, mean, sd : ndarray, shape (window,)
        In order of time; ``sd`` is NaN where there is one trial.
    n : ndarray of int, shape (window,)
        How many trials have a value.
    """

    end_s: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    n: np.ndarray

    def at(self, end_s: int) -> str:
        """Return mean and sd of a window as text."""
        found = np.flatnonzero(self.end_s == end_s)
        if not len(found):
            return NOTHING
        mean, sd = self.mean[found[0]], self.sd[found[0]]
        return f"{mean:.3f}" if np.isnan(sd) else f"{mean:.3f} ± {sd:.3f}"

    def value(self, end_s: int) -> float:
        """Return the mean of a window; NaN where there is none."""
        found = self.mean[self.end_s == end_s]
        return float(found[0]) if len(found) else float("nan")


def curve(trials: Sequence[dict[str, Any]], who: str, key: str) -> Curve:
    """Return the curve of one number of the rounds of several trials.

    Parameters
    ----------
    trials
        As `bench_rounds` keeps them.
    who
        ``guided``, ``alone``, ``likelihood`` or ``truth``.
    key
        The number, such as ``S``; where it is null the trial does not count.
    """
    found: dict[int, list[float]] = {}
    for row in (row for trial in trials for row in trial[who]):
        if row[key] is not None:
            found.setdefault(row["end_s"], []).append(row[key])
    ends = sorted(found)
    nan = float("nan")
    return Curve(
        end_s=np.array(ends),
        mean=np.array([np.mean(found[end]) for end in ends]),
        sd=np.array([np.std(found[end], ddof=1) if len(found[end]) > 1 else nan for end in ends]),
        n=np.array([len(found[end]) for end in ends]),
    )


def of_trials(trials: Sequence[dict[str, Any]], who: str, key: str) -> np.ndarray:
    """Return the mean over the rounds of each trial, shape (trial,); NaN without a round."""
    rows = ([row[key] for row in trial[who] if row[key] is not None] for trial in trials)
    return np.array([np.mean(values) if values else np.nan for values in rows])


def difference(
    trials: Sequence[dict[str, Any]], key: str, end_s: int | None = None
) -> tuple[float, float]:
    """Return with less without the estimate, in one window or over all: mean, standard error."""
    if end_s is not None:
        trials = [
            {
                who: [row for row in trial[who] if row["end_s"] == end_s]
                for who in ("guided", "alone")
            }
            for trial in trials
        ]
    gains = of_trials(trials, "guided", key) - of_trials(trials, "alone", key)
    gains = gains[~np.isnan(gains)]
    if not len(gains):
        return float("nan"), float("nan")
    error = np.std(gains, ddof=1) / len(gains) ** 0.5 if len(gains) > 1 else float("nan")
    return float(np.mean(gains)), float(error)


def overall(trials: Sequence[dict[str, Any]], who: str, key: str) -> str:
    """Return the mean over all rounds as text, with its sd over trials."""
    means = of_trials(trials, who, key)
    return f"{np.nanmean(means):.3f} ± {np.nanstd(means, ddof=1):.3f}"


def draw(found: dict[str, Any], path: Path) -> None:
    """Draw S over the rounds: on the window itself, and on fish that no round has seen."""
    path.parent.mkdir(parents=True, exist_ok=True)
    trials = found["simulated"]
    with style():
        figure = new_figure(8.4, 3.9)
        own, late = figure.subplots(1, 2, sharey=True)
        _draw_lines(own, trials, "S", "own")
        _draw_ceiling(own, trials)
        seconds, published = zip(*PUBLISHED_S, strict=True)
        own.plot(seconds, published, "s", color=GROUP, label="paper (other fish)", zorder=4)
        last_s = max(row["end_s"] for trial in trials for row in trial["guided"])
        own.plot((seconds[-1], last_s), (published[-1],) * 2, color=GROUP, linestyle=":")
        _draw_lines(late, trials, "late", "late")
        own.set(title="On the window itself", ylabel="S")
        late.set(title="On ten minutes that no round has seen")
        for axes in (own, late):
            axes.set_xlabel("window ends at (s)")
            axes.set_xticks(curve(trials, "guided", "S").end_s)
        _key(figure, own)
        save_png(figure, path)


def _draw_lines(axes: Axes, trials: list[dict[str, Any]], scored: str, judged: str) -> None:
    # A little apart, that the bars can be told from each other.
    for shift_s, who, key, colour, mark, label in (
        (-4, "alone", scored, MODEL, "^-", "calibrated, the paper's way"),
        (4, "guided", scored, FISH, "o-", "calibrated, with the likelihood estimate"),
        (0, "likelihood", judged, MUTED, "x--", "the likelihood estimate by itself"),
        (0, "truth", judged, MUTED, ":", "the true model"),
    ):
        line = curve(trials, who, key)
        axes.plot(line.end_s + shift_s, line.mean, mark, color=colour, label=label)
        if who in {"alone", "guided"}:
            axes.errorbar(
                line.end_s + shift_s, line.mean, line.sd, fmt="none", ecolor=colour, elinewidth=0.9
            )


def _draw_ceiling(axes: Axes, trials: list[dict[str, Any]]) -> None:
    line = curve(trials, "guided", "ceiling")
    axes.fill_between(
        line.end_s,
        line.mean - line.sd,
        line.mean + line.sd,
        color=BAND,
        alpha=0.3,
        linewidth=0,
        label="ceiling, mean ± sd over trials",
    )


def _key(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)


def _prose(text: str) -> str:
    return textwrap.fill(" ".join(text.split()), 120) + "\n"


def markdown(found: dict[str, Any]) -> str:
    """Return the tables of what was measured, and what they say."""
    parts = [*_head(found), *_own(found), *_held_out(found), *_times(found)]
    parts += _recorded(found) if found.get("recorded") else []
    return "\n".join(parts)


def _head(found: dict[str, Any]) -> list[str]:
    return [
        "# S over the rounds\n",
        _prose(
            f"""Made by `benchmarks/calibration/bench_rounds.py`; numbers in
            `benchmarks/results/rounds.json`. Machine: {found["machine"]}; {found["took_s"]:.0f} s,
            {found["processor_s"]:.0f} s of processor time. With `--write` or `--full` all
            six trials are measured, which is what is committed; by default the first two, in a
            third of the time."""
        ),
        _prose(
            f"""{found["n_trials"]} simulated trials of four fish and a robot in `two-rooms`, the
            robot swimming as a fish does. Their true models differ: each gene of the natural
            model times a lognormal factor (sd of the logarithm 0.3). Windows of 120 s end every
            60 s; each round does {found["generations"]} generations of 60, the paper's effort, and
            starts from the last population of the round before it. S is the reported one: the
            champion's, by long simulations with new seeds. Mean ± sd over trials."""
        ),
        _prose(
            """The paper's figures are of other fish, which nobody but its authors has, and of
            another implementation: they stand here as landmarks. What can be compared is how soon
            a curve reaches its own plateau, and how near that is to the ceiling."""
        ),
        "![S over the rounds, with and without the likelihood estimate](pictures/rounds.png)\n",
        "Bars: sd over trials. Dotted grey: what the true model itself scores.\n",
    ]


def _paper(end_s: int) -> str:
    last_s, plateau = PUBLISHED_S[-1]
    known = dict(PUBLISHED_S)
    if end_s in known:
        return f"{known[end_s]:.3f}"
    return f"about {plateau:.3f}" if end_s > last_s else NOTHING


def _own(found: dict[str, Any]) -> list[str]:
    trials = found["simulated"]
    guided, alone = curve(trials, "guided", "S"), curve(trials, "alone", "S")
    ceiling, truth = curve(trials, "guided", "ceiling"), curve(trials, "truth", "own")
    likely = curve(trials, "likelihood", "own")
    rows = [
        [
            int(end),
            guided.at(end),
            alone.at(end),
            "{:+.3f} ± {:.3f}".format(*difference(trials, "S", end)),
            likely.at(end),
            truth.at(end),
            ceiling.at(end),
            _paper(end),
        ]
        for end in guided.end_s
    ]
    shown = (("guided", "S"), ("alone", "S"), ("likelihood", "own"), ("truth", "own"))
    means = [overall(trials, who, key) for who, key in shown]
    gain = "{:+.3f} ± {:.3f}".format(*difference(trials, "S"))
    last = overall(trials, "guided", "ceiling")
    rows.append(["all", *means[:2], gain, *means[2:], last, ""])
    first, fourth_s = int(guided.end_s[0]), PUBLISHED_S[-1][0]
    return [
        "## On the window itself\n",
        table(
            (
                "window ends at (s)",
                "with the estimate",
                "without (the paper's way)",
                "gain ± standard error",
                "the estimate by itself",
                "the true model",
                "ceiling",
                "paper",
            ),
            rows,
        ),
        _prose(
            f"""The first scored window ({first} s) stands at {guided.value(first):.3f} with the
            estimate and at {alone.value(first):.3f} without, of a ceiling of
            {ceiling.value(first):.3f}; the paper stood at {PUBLISHED_S[0][1]:.3f} at
            {PUBLISHED_S[0][0]} s and at {PUBLISHED_S[-1][1]:.3f} from {fourth_s} s on. A champion
            is chosen on the window on which it is scored: it may score above the true model
            there, and that is no merit."""
        ),
    ]


def _held_out(found: dict[str, Any]) -> list[str]:
    trials = found["simulated"]
    head: list[str] = ["window ends at (s)"]
    columns: list[Curve] = []
    for key, where in (("next", "next 120 s"), ("late", "late ten minutes")):
        for who, label in (
            ("guided", "with"),
            ("alone", "without"),
            ("likelihood", "estimate"),
            ("truth", "true model"),
        ):
            head.append(f"{where}: {label}")
            columns.append(curve(trials, who, key))
    rows = [[int(end), *(line.at(end) for line in columns)] for end in columns[0].end_s]
    whos = ("guided", "alone", "likelihood", "truth")
    rows.append(["all", *(overall(trials, who, key) for key in ("next", "late") for who in whos)])
    gains = {key: "{:+.3f} ± {:.3f}".format(*difference(trials, key)) for key in ("next", "late")}
    return [
        "## On fish that no round has seen\n",
        _prose(
            """Each round's model against the next 120 s, and against the last ten minutes of the
            trial, on which nothing is calibrated. S on ten minutes is higher than on two for any
            model, since the fish themselves vary less."""
        ),
        table(head, rows),
        _prose(
            f"""With less without the estimate, over all rounds, with its standard error:
            {gains["next"]} on the next 120 s, {gains["late"]} on the late ten minutes."""
        ),
        _prose(
            f"""A model that scores best on two minutes is not therefore the best model. On the late
            ten minutes the champions score {overall(trials, "guided", "late")} with the estimate
            and {overall(trials, "alone", "late")} without, the estimate by itself
            {overall(trials, "likelihood", "late")}, the true model
            {overall(trials, "truth", "late")}. On the window itself it is
            {overall(trials, "guided", "S")}, {overall(trials, "alone", "S")},
            {overall(trials, "likelihood", "own")} and {overall(trials, "truth", "own")}."""
        ),
    ]


def _times(found: dict[str, Any]) -> list[str]:
    times = found["likelihood_times"]
    names = (
        ("cold_median_s", "in a new process, imports and all, kernels compiled before: median"),
        ("warm_median_s", "in a process that has done one: median"),
        ("warm_largest_s", "the slowest of these"),
    )
    return [
        "## The estimate takes\n",
        _prose(
            f"""The load of the {found["machine"].split(", ")[1]} was {times["load"][0]:.1f} then:
            with a load beyond the cores the wall clock includes the work of others, the
            processor time does not."""
        ),
        table(
            ("a window of 120 s, four fish at 5 Hz", "wall clock (s)", "processor (s)"),
            [[said, *times[name]] for name, said in names],
        ),
    ]


def _recorded(found: dict[str, Any]) -> list[str]:
    parts = [
        "## Real recordings\n",
        _prose(
            """With the same effort, on recordings described in
            [real-recordings.md](real-recordings.md); one calibration each, so no sd. The late
            stretch is 600 to 1200 s."""
        ),
    ]
    for trial in found["recorded"]:
        lines = [
            curve([trial], who, key)
            for who, key in (
                ("guided", "S"), ("alone", "S"), ("guided", "ceiling"), ("guided", "next"),
                ("alone", "next"), ("guided", "late"), ("alone", "late"),
            )
        ]  # fmt: skip
        parts += [
            f"### {trial['title'][:1].upper()}{trial['title'][1:]}\n",
            table(
                (
                    "window ends at (s)", "with", "without", "ceiling", "next 120 s: with",
                    "without", "late: with", "without",
                ),
                [[int(end), *(line.at(end) for line in lines)] for end in lines[0].end_s],
            ),
        ]  # fmt: skip
    return parts
