"""How `zfcal drive` speaks: as lines, as lines of JSON, and on the status line."""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias, final

import click

from .output import Output
from .status_line import StatusLine, describe_drive

if TYPE_CHECKING:
    from zfcal.drive.events import DriveStatus
    from zfcal.stages.events import Event

    Told: TypeAlias = Event | DriveStatus

_WHY = {"KeyboardInterrupt": "Ctrl-C", "Terminated": "SIGTERM"}


@final
class DriveVoice:
    """Tells what a driver does, from a thread of its own.

    A terminal that is scrolled, or a reader that does not read, holds up whoever writes to it;
    it must not hold up who steers a robot.

    Parameters
    ----------
    out
        The command's own voice.
    events
        Whether standard output gets a line of JSON for each event, in place of all else.

    Attributes
    ----------
    because
        Why the drive ended, once it has.
    """

    def __init__(self, out: Output, *, events: bool) -> None:
        self._out = out
        if events:
            out.as_json = out.in_lines = True
        out.has_own_line()
        self._line = StatusLine(shown=sys.stderr.isatty() and not out.quiet)
        self._told: queue.SimpleQueue[tuple[float, Told] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._speak, daemon=True)
        self._problem: BaseException | None = None
        self._began_s = time.monotonic()
        self.because = ""

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        from zfcal.stages.events import Note

        if error is not None:
            self.because = _WHY.get(type(error).__name__) or str(error) or type(error).__name__
        text = f"drive: ends, {self.because.rstrip('.')}."
        self._put(Note(text=text, kind="ended", values={"because": self.because}))
        self._told.put(None)
        self._thread.join()
        self._line.clear()
        if self._problem is not None and error is None:
            raise self._problem

    def hear(self, told: Told) -> None:
        """Take what the driver tells; what went wrong with telling it is raised here."""
        if self._problem is not None:
            raise self._problem
        self._put(told)

    def say(self, told: Told) -> None:
        """Tell it at once: where no robot is steered."""
        self._say(0.0, told)

    def _put(self, told: Told) -> None:
        self._told.put((time.monotonic() - self._began_s, told))

    def _speak(self) -> None:
        while (found := self._told.get()) is not None:
            if self._problem is not None:
                continue
            try:
                self._say(*found)
            except Exception as error:  # noqa: BLE001 - it is the driver's to raise
                self._problem = error

    def _say(self, at_s: float, told: Told) -> None:
        from zfcal.drive.events import DriveStatus, line_of

        if isinstance(told, DriveStatus):
            self._line.show(describe_drive(told))
            return
        self._line.clear()
        if self._out.in_lines and (line := line_of(told, at_s)):
            click.echo(json.dumps(line, ensure_ascii=False))
            sys.stdout.flush()
        self._out.tell(told)
