"""What the options of `zfcal watch` come to, and how it speaks."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

import click
from click.core import ParameterSource

from .output import Output
from .status_line import StatusLine, describe
from .tracking import track_options
from .watch_table import WatchTable

if TYPE_CHECKING:
    from zfcal.online.watch_events import Happened, Status
    from zfcal.online.watch_stages import WatchOptions
    from zfcal.stages.calibrate.searching import CalibrateOptions
    from zfcal.view.process import Page

_DEFAULT_BUDGET_S = 50.0

_NONE = "none"
_OWN = {
    "trial", "stages", "poll", "once", "until_idle_s", "view", "view_port", "table", "dry_run",
}  # fmt: skip
_OF_CALIBRATE = {
    "generations", "budget", "population", "runs", "steps", "optimiser", "seed_likelihood",
    "champion", "publish", "model", "baselines", "seed", "workers", "as_published", "confirm",
    "diversity", "renewal", "sampler",
}  # fmt: skip


def watch_options(trial: Path, options: Mapping[str, Any]) -> WatchOptions:
    """Return what the options ask for.

    Raises
    ------
    click.UsageError
        One belongs to a stage that does not run, or two contradict each other.
    """
    from zfcal.online.watch_stages import WatchOptions
    from zfcal.stages.analyse.analyse import AnalyseOptions

    stages = _stages(trial, options)
    _check_together(options, stages)
    return WatchOptions(
        track=track_options(dict(options)) if "track" in stages else None,
        analyse=AnalyseOptions(control=options["control"]) if "analyse" in stages else None,
        calibrate=_round(options) if "calibrate" in stages else None,
        poll=options["poll"],
        once=options["once"],
        until_idle_s=options["until_idle_s"],
    )


def _round(options: Mapping[str, Any]) -> CalibrateOptions:
    from zfcal.api.rounds import round_options

    asked = dict(options)
    if asked["generations"] is None and asked["budget"] is None:
        asked["budget"] = _DEFAULT_BUDGET_S
    return round_options(asked)


def _stages(trial: Path, options: Mapping[str, Any]) -> tuple[str, ...]:
    from zfcal.artifacts.settings import read_trial
    from zfcal.online.watch_stages import ANALYSE, CALIBRATE, STAGES

    if options["stages"] is None:
        cameras = read_trial(trial).cameras or {}
        has_source = options["overhead"] or "source" in cameras.get("overhead", {})
        return STAGES if has_source else (ANALYSE, CALIBRATE)
    asked = {word.strip() for word in options["stages"].split(",")}
    if asked == {_NONE}:
        if not options["view"]:
            raise click.UsageError("--stages none does nothing but show the page: add --view.")
        return ()
    if unknown := asked - set(STAGES):
        named = ", ".join(sorted(repr(word) for word in unknown))
        raise click.UsageError(f"--stages: {named} is none of {', '.join(STAGES)}.")
    return tuple(name for name in STAGES if name in asked)


def _check_together(options: Mapping[str, Any], stages: tuple[str, ...]) -> None:
    """Refuse options that could not take effect."""
    context = click.get_current_context()
    if options["once"] and options["until_idle_s"] is not None:
        raise click.UsageError("--once leaves at once, --until-idle later: give one.")
    for name in ("once", "until_idle_s", "poll", "table"):
        if not stages and options[name]:
            flag = f"--{name.removesuffix('_s').replace('_', '-')}"
            raise click.UsageError(f"{flag} is about stages, and --stages none runs none.")
    has_port = context.get_parameter_source("view_port") is ParameterSource.COMMANDLINE
    if has_port and not options["view"]:
        raise click.UsageError("--view-port belongs to --view.")
    for parameter in context.command.params:
        name = parameter.name or ""
        if name in _OWN or name not in options:
            continue
        stage = "calibrate" if name in _OF_CALIBRATE else "track"
        stage = "analyse" if name == "control" else stage
        given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if given and stage not in stages:
            raise click.UsageError(
                f"{parameter.opts[0]} belongs to {stage}, which is none of the stages "
                f"{', '.join(stages) or 'that run here'}."
            )


@final
class Voice:
    """Tells what a watch does: as lines, as JSON lines, on the status line and on the page.

    Parameters
    ----------
    out
        The command's own voice.
    page
        Shows it to a browser as well; None for no page.
    table
        Whether a table stands in the place of the status line.
    """

    def __init__(self, out: Output, page: Page | None = None, *, table: bool = False) -> None:
        self._out = out
        self._page = page
        self._table = WatchTable() if table else None
        self._shown: Status | None = None
        out.has_own_line()
        self._line = StatusLine(shown=sys.stderr.isatty() and not out.quiet)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._line.clear()

    def announce(self) -> None:
        """Say where the page is, if there is one."""
        from zfcal.online.watch_events import Happened

        if self._page is not None:
            self.hear(Happened(at_s=0.0, kind="page", values={"url": self._page.url}))

    def hear(self, told: Happened | Status) -> None:
        """Take what the watch tells."""
        from zfcal.online.watch_events import Status

        if isinstance(told, Status):
            self._show(told)
            return
        if self._page is not None:
            self._page.tell({"event": told.as_dict()})
        if self._table is not None:
            self._table.take(told)
        if self._out.as_json:
            self._line.clear()
            click.echo(json.dumps(told.as_dict(), ensure_ascii=False))
            sys.stdout.flush()
        self._say(told)

    def _show(self, status: Status) -> None:
        self._line.show(describe(status) if self._table is None else self._table.draw(status))
        if self._page is None or status == self._shown:
            return
        self._shown = status
        self._page.tell({"status": dataclasses.asdict(status)})
        if not self._page.is_alive:
            self._page = None
            self._line.clear()
            self._out.warn("The page is gone: its process has ended. The stages go on.")

    def _say(self, told: Happened) -> None:
        from zfcal.stages import events as of

        event = told.event
        if isinstance(event, of.LeftOut):
            # It may be mended yet: what still is left out at the end counts.
            event = dataclasses.replace(event, damaged=False)
        text = _WORDS.get(told.kind, "").format_map(_Words(told))
        if text and (told.kind not in _DETAILS or self._out.verbose):
            event = of.Note(text=text, warning=told.kind in _WARNINGS)
        if event is not None:
            self._line.clear()
            self._out.tell(event)


_WORDS = {
    "page": "watch: a page for browsers on this computer is at {url}",
    "began": "watch: {stages} of {trial}{polling}.",
    "started": "{stage}: process {process}.",
    "arrived": "{path}: arrived.",
    "unfinished": "{problem} It is skipped until it is.",
    "skipped": "calibrate: the window to {window_end_s} s is skipped, {went_on_with_s} s is "
    "next. {because}",
    "finished": "{stage}: window to {window_end_s} s in {took_s:.1f} s, {lag_s:.1f} s after its "
    "tracks.",
    "failed": "{stage}: {problem} {hint} Tries again.",
    "gone": "{path}: the trial is gone ({problem}); waits for it.",
    "back": "{path}: is back.",
    "ended": "watch: ends, {because}.",
}
_DETAILS = {"started", "arrived"}
_WARNINGS = {"unfinished", "skipped", "failed", "gone"}


class _Words(dict[str, Any]):
    """The values of an event, as its text needs them."""

    def __init__(self, told: Happened) -> None:
        super().__init__(told.values, stage=told.stage)
        if told.kind == "began":
            polls = self["polls"]
            self["stages"] = ", ".join(self["stages"])
            self["polling"] = f"; polls: {polls}" if polls else ""
