"""Progress bars on standard error, when it is a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


@final
class Bars:
    """One bar per stage; they vanish when they are done.

    Parameters
    ----------
    shown
        False for a stderr that is no terminal, or a quiet run: all does nothing.
    """

    def __init__(self, *, shown: bool) -> None:
        self._shown = shown
        self._progress: Progress | None = None
        self._tasks: dict[str, TaskID] = {}

    def show(self, stage: str, done: int, total: int) -> None:
        """Move a stage's bar to ``done`` of ``total``; a whole one goes."""
        if not self._shown or (done >= total and stage not in self._tasks):
            return
        progress = self._progress or self._start()
        if stage not in self._tasks:
            self._tasks[stage] = progress.add_task(stage, total=total)
        progress.update(self._tasks[stage], completed=done, total=total)
        if done >= total:
            progress.remove_task(self._tasks.pop(stage))
            if not self._tasks:
                self.clear()

    def clear(self) -> None:
        """Wipe the bars from the terminal before a line is written; the next step shows them."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None
            self._tasks.clear()

    def _start(self) -> Progress:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._progress.start()
        return self._progress
