"""Progress on standard error, when it is a terminal: what, how far, how long."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_SILENT_S = 2.0
"""After so long without a word it is shown that the work goes on."""

_LOOK_S = 0.25


@final
class Bars:
    """One bar per stage; they vanish when they are done.

    Where nothing was shown for two seconds, the bars that were wiped come back; where there are
    none, a bar without a length says what works and for how long.

    Parameters
    ----------
    shown
        False for a stderr that is no terminal, or a quiet run: all does nothing.
    name
        What works, as it is called where no stage has told how far it is.
    """

    def __init__(self, *, shown: bool, name: str = "") -> None:
        self._shown = shown
        self._name = name
        self._progress: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._far: dict[str, tuple[int, int]] = {}
        self._began_s: dict[str, float] = {name: time.monotonic()}
        self._said_s = time.monotonic()
        self._lock = threading.RLock()
        self._ended = threading.Event()
        self._watcher: threading.Thread | None = None

    def watch(self) -> None:
        """Begin to look whether nothing is shown for long."""
        if self._shown and self._watcher is None:
            self._watcher = threading.Thread(target=self._watch, daemon=True)
            self._watcher.start()

    def show(self, stage: str, done: int, total: int) -> None:
        """Move a stage's bar to ``done`` of ``total``; a whole one goes."""
        if not self._shown or (done >= total and stage not in self._far):
            return
        with self._lock:
            self._began_s.setdefault(stage, time.monotonic())
            if done >= total:
                self._drop(stage)
            else:
                self._far[stage] = (done, total)
                self._draw(stage)

    def clear(self) -> None:
        """Wipe the bars from the terminal before a line is written; the next step shows them."""
        with self._lock:
            self._said_s = time.monotonic()
            if self._progress is not None:
                self._progress.stop()
                self._progress = None
                self._tasks.clear()

    def close(self) -> None:
        """Wipe the bars for good."""
        self._ended.set()
        if self._watcher is not None:
            self._watcher.join()
        self.clear()

    def _watch(self) -> None:
        while not self._ended.wait(_LOOK_S):
            with self._lock:
                if self._progress is None and time.monotonic() - self._said_s > _SILENT_S:
                    for stage in tuple(self._far) or (self._name,):
                        self._draw(stage)

    def _drop(self, stage: str) -> None:
        """Take a whole bar away, and with the last one the whole display."""
        del self._far[stage]
        if stage != self._name:
            del self._began_s[stage]
        task = self._tasks.pop(stage, None)
        if self._progress is not None and task is not None:
            self._progress.remove_task(task)
        if not self._far:
            self.clear()

    def _draw(self, stage: str) -> None:
        """Draw the bar of a stage; of one that has not told how far it is, one without a length."""
        progress = self._progress or self._start()
        done, total = self._far.get(stage, (0, None))
        if stage in self._far and self._name not in self._far:
            self._retire(progress)
        if stage not in self._tasks:
            self._tasks[stage] = progress.add_task(stage, total=total)
            progress.tasks[-1].start_time = self._began_s[stage]
        progress.update(self._tasks[stage], completed=done, total=total)

    def _retire(self, progress: Progress) -> None:
        """Take the bar without a length away: one with a length comes."""
        if (task := self._tasks.pop(self._name, None)) is not None:
            progress.remove_task(task)

    def _start(self) -> Progress:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
        from rich.text import Text

        class Count(ProgressColumn):
            """How far, where that is known."""

            def render(self, task: Task) -> Text:
                return Text("" if task.total is None else f"{task.completed:.0f}/{task.total:.0f}")

        class Times(ProgressColumn):
            """How long it has taken, and about how long it will."""

            def render(self, task: Task) -> Text:
                left = task.time_remaining if task.total else None
                rest = "" if left is None else f", about {_time(left)} left"
                return Text(f"{_time(task.elapsed or 0.0)}{rest}")

        columns = (TextColumn("{task.description}"), BarColumn(), Count(), Times())
        self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._progress.start()
        return self._progress


def _time(seconds: float) -> str:
    """Return a duration as people read it.

    >>> _time(42.4), _time(75), _time(3720)
    ('42 s', '1 min 15 s', '1 h 2 min')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
