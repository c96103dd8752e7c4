"""The table of `zfcal watch --table`: stages, the last rounds and what is amiss, on a terminal."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from rich.table import Table

    from zfcal.online.watch_events import Happened, StageStatus, Status

_MOST_ROUNDS = 5
_BAR = 16
_AMISS = {"failed", "unfinished", "left-out", "skipped", "gone"}


@final
class WatchTable:
    """Draws the state of a watch, and remembers its last rounds and its last problem."""

    def __init__(self) -> None:
        self._rounds: deque[tuple[int, float, float | None, str]] = deque(maxlen=_MOST_ROUNDS)
        self._problem = ""

    def take(self, told: Happened) -> None:
        """Remember what happened, as far as the table shows it."""
        if told.kind == "result" and told.stage == "calibrate":
            value = told.values["value"]
            if value.get("S") is not None and "window_end_s" in value:
                row = (value["window_end_s"], value["S"], value.get("ceiling"))
                self._rounds.append((*row, value.get("rule", "")))
        elif told.kind in _AMISS:
            said = told.values.get("problem") or told.values.get("because") or told.kind
            self._problem = f"{told.stage or 'watch'}: {said}"
        elif told.kind in {"finished", "back"}:
            self._problem = ""

    def draw(self, status: Status) -> Table:
        """Return the table."""
        from rich import box
        from rich.table import Table
        from rich.text import Text

        table = Table(box=box.SIMPLE_HEAD, expand=False, pad_edge=False, show_edge=False)
        for head in ("stage", "at", "", "done to"):
            table.add_column(head, justify="right" if head == "done to" else "left")
        for name, stage in status.stages.items():
            last = "–" if stage.last_s is None else _clock(stage.last_s)
            table.add_row(name, *_at(stage), last)
        if self._rounds:
            table.add_section()
        for end_s, score, ceiling, rule in self._rounds:
            of = "" if ceiling is None else f" of {ceiling:.3f}"
            bar = Text("█" * round(_BAR * min(1.0, max(0.0, score))), style="dark_orange")
            table.add_row(f"S to {_clock(end_s)}", f"{score:.3f}{of}", bar, rule)
        notes = [] if status.lag_s is None else [f"lag {status.lag_s:.0f} s"]
        notes += [f"skipped {status.n_skipped}"] if status.n_skipped else []
        notes += ["the trial is gone; waits"] if status.is_gone else []
        notes += [self._problem] if self._problem else []
        if notes:
            table.caption = Text(" · ".join(notes))
            table.caption_justify = "left"
        return table


def _at(stage: StageStatus) -> tuple[str, str]:
    if stage.problem:
        return "fails, tries again", ""
    if stage.now_s is None and not stage.done:
        return "waits", ""
    words = "works" if stage.now_s is None else f"window to {_clock(stage.now_s)}"
    if not stage.total:
        return words, ""
    full = round(_BAR * min(1.0, stage.done / stage.total))
    return words, f"{'━' * full}{'╌' * (_BAR - full)} {stage.done}/{stage.total}"


def _clock(second: int) -> str:
    return f"{second // 60}:{second % 60:02d}"
