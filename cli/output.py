"""What a command says, and where: paths or one JSON document out, all talk to stderr.

The only place that writes to the two streams. What happened comes as the
events of `zfcal.stages.events`.
"""

from __future__ import annotations

import json
import logging
import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, final

import click

from .progress import Bars

if TYPE_CHECKING:
    from zfcal.errors import ZfcalError
    from zfcal.stages.events import Event, LeftOut

EXIT_DAMAGED = 3
EXIT_INTERRUPTED = 130
EXIT_DISAGREES = 4
HAS_VOICE = f"{__name__}.has_voice"
"""Key in what click keeps of a run, once a command writes its JSON document itself."""

_STEERING = {
    code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"
}

_SEVERITY = (0, EXIT_DISAGREES, EXIT_DAMAGED, 75, 1)
"""Exit codes from the best to the worst: of several trials the worst one counts."""


def complain(message: str, *, hint: str = "") -> None:
    """Write an error, and what to do about it, to standard error."""
    _say(f"{_paint('zfcal: error:', 'red')} {_printable(message)}")
    if hint:
        _say(f"{_paint('hint:', 'cyan')} {_printable(hint)}")


def usage_text(error: click.UsageError) -> tuple[str, str]:
    """Return what is said of wrong usage, and where help is."""
    context = error.ctx or click.get_current_context(silent=True)
    path = context.command_path if context is not None else "zfcal"
    return error.format_message(), f"See: {path} --help"


def _say(text: str) -> None:
    """Write a line to standard error."""
    click.echo(text, err=True)


def _printable(text: str) -> str:
    """Return a text without signs that steer a terminal, which names of files may hold."""
    return text.translate(_STEERING)


def _paint(text: str, colour: str) -> str:
    """Return the text in a colour where standard error is a terminal that wants it."""
    wanted = sys.stderr.isatty() and not os.environ.get("NO_COLOR")
    return click.style(text, fg=colour, bold=True) if wanted else text


class ReaderGoneError(BaseException):
    """Nobody reads standard output any more.

    A name of its own, since click turns a `BrokenPipeError` into exit code 1.
    """


@final
class Output:
    """The voice of one run of a command, and its exit code.

    Parameters
    ----------
    command
        Its name.
    as_json
        Whether standard output gets one JSON document instead of paths.
    verbose
        0, or 1 for the reason of each artifact.
    quiet
        Whether only errors and left-out files are told.

    Attributes
    ----------
    bare
        Whether a single result is the JSON document, as it stands in its file.
    in_lines
        Whether the command writes JSON lines itself, in place of the document.
    """

    def __init__(self, command: str, *, as_json: bool, verbose: int, quiet: bool) -> None:
        self.command = command
        self.as_json = as_json
        self.verbose = verbose
        self.quiet = quiet
        self.exit_code = 0
        self.bare = False
        self.in_lines = False
        self._bars = Bars(shown=sys.stderr.isatty() and not quiet, name=command)
        self._artifacts: dict[Path, dict[str, str]] = {}
        self._left_out: dict[tuple[str, str], dict[str, str]] = {}
        self._messages: list[dict[str, str]] = []
        self._errors: list[dict[str, str]] = []
        self._results: list[Any] = []

    def __enter__(self) -> Self:
        self._handler = logging.Handler()
        self._handler.emit = self._announce  # type: ignore[method-assign]
        logger = logging.getLogger("zfcal")
        logger.setLevel(logging.INFO)
        logger.addHandler(self._handler)
        self._bars.watch()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        logging.getLogger("zfcal").removeHandler(self._handler)
        self._bars.close()
        if isinstance(error, BrokenPipeError):
            raise ReaderGoneError from error
        if error is not None:
            self.record(error)
        if self.as_json and not self.in_lines:
            self.print_document()
        if error is None and not self.quiet:
            self._summarise()

    def tell(self, event: Event) -> None:
        """Take one event of a stage."""
        from zfcal.stages import events as of

        match event:
            case of.Made():
                self._artifact(event.path, "made", event.reason)
            case of.UpToDate():
                self._artifact(event.path, "up to date", "")
            case of.Planned():
                self._plan(event.path, event.reason)
            case of.LeftOut():
                self._leave_out(event)
            case of.Note():
                self._talk("warning" if event.warning else "note", event.text)
            case of.Progress():
                self._bars.show(event.stage, event.done, event.total)
            case of.Result():
                self._results.append(event.value)

    def has_own_line(self) -> None:
        """Leave the last line of the terminal to the command's own status line."""
        self._bars.close()

    def attempt(self, work: Callable[[], object]) -> None:
        """Do a part of the work; an error that a person can mend ends that part alone.

        Options that cannot be are wrong usage of the command, whatever it was to work on.
        """
        from zfcal.errors import OptionError, ZfcalError

        try:
            work()
        except OptionError:
            raise
        except ZfcalError as error:
            self._fail(error)

    def result(self, value: Any, *, text: str | None = None) -> None:
        """Give a result that is no file: into the document, or as text to standard output."""
        self._results.append(value)
        if text is not None and not self.as_json:
            self._bars.clear()
            click.echo(text)

    def note(self, text: str) -> None:
        """Tell something worth knowing."""
        self._talk("note", text)

    def warn(self, text: str) -> None:
        """Tell something that a person may have to mend."""
        self._talk("warning", text)

    def _announce(self, record: logging.LogRecord) -> None:
        """Show what the library logs: of this start, not of the result, hence not in JSON."""
        if not self.quiet:
            self._bars.clear()
            _say(record.getMessage())

    def record(self, error: BaseException) -> None:
        """Put into the document what `main` will say to the person."""
        message, hint = str(error) or type(error).__name__, getattr(error, "hint", "")
        if isinstance(error, click.UsageError):
            message, hint = usage_text(error)
        elif isinstance(error, KeyboardInterrupt):
            message = "Interrupted."
        self._errors.append({"message": message, "hint": hint})
        self.exit_code = EXIT_INTERRUPTED if isinstance(error, KeyboardInterrupt) else 1
        self.exit_code = getattr(error, "exit_code", self.exit_code)

    def left_out(self, path: Path, problem: str) -> None:
        """Tell of a file that is damaged."""
        from zfcal.stages.events import LeftOut

        self._leave_out(LeftOut(path=path, problem=problem))

    def worsen(self, code: int = EXIT_DAMAGED) -> None:
        """Take an exit code, unless there is a worse one."""
        self.exit_code = max(self.exit_code, code, key=_SEVERITY.index)

    def _fail(self, error: ZfcalError) -> None:
        self.worsen(error.exit_code)
        text = {"message": str(error), "hint": error.hint}
        if text in self._errors:
            # A pipe meets the same obstacle with every line.
            return
        self._errors.append(text)
        self._bars.clear()
        complain(str(error), hint=error.hint)

    def _plan(self, path: Path, reason: str) -> None:
        self._artifacts[path] = {"path": str(path), "state": "planned", "reason": reason}
        self._bars.clear()
        _say(_printable(f"would make {path}: {reason}"))

    def _leave_out(self, event: LeftOut) -> None:
        key = (str(event.path), event.problem)
        if event.damaged:
            self.worsen(EXIT_DAMAGED)
        if key in self._left_out:
            return
        self._left_out[key] = {"path": key[0], "problem": key[1]}
        self._bars.clear()
        _say(f"{_paint('zfcal: left out:', 'yellow')} {_printable(event.problem)}")
        if event.hint:
            _say(f"{_paint('hint:', 'cyan')} {_printable(event.hint)}")

    def _talk(self, level: str, text: str) -> None:
        if {"level": level, "text": text} in self._messages:
            return
        self._messages.append({"level": level, "text": text})
        if not self.quiet:
            self._bars.clear()
            shown = _printable(text)
            _say(f"{_paint('warning:', 'yellow')} {shown}" if level == "warning" else shown)

    def _artifact(self, path: Path, state: str, reason: str) -> None:
        known = self._artifacts.get(path)
        self._artifacts[path] = {"path": str(path), "state": state, "reason": reason}
        if known is not None and (state == "up to date" or known["state"] == "made"):
            # Met again on a later line of standard input: it stays what it was.
            self._artifacts[path] = known
            return
        self._bars.clear()
        if self.verbose:
            _say(f"{path}: {state}" + (f" ({reason})" if reason else ""))
        if not self.as_json:
            click.echo(str(path))
            sys.stdout.flush()

    def _summarise(self) -> None:
        states = [artifact["state"] for artifact in self._artifacts.values()]
        made, fresh, planned = (states.count(s) for s in ("made", "up to date", "planned"))
        if planned:
            _say(f"{self.command}: {planned} to make, {fresh} up to date; nothing was written.")
        elif made:
            _say(f"{self.command}: {made} made, {fresh} up to date.")
        elif fresh and not self._errors:
            _say(f"{self.command}: nothing to do, {fresh} up to date.")

    def print_document(self) -> None:
        """Write the JSON document to standard output, as one line where others are lines."""
        document: Any = {
            "command": self.command,
            "exit_code": self.exit_code,
            "artifacts": list(self._artifacts.values()),
            "left_out": list(self._left_out.values()),
            "messages": self._messages,
            "errors": self._errors,
            "results": self._results,
        }
        if self.bare and len(self._results) == 1 and not self._errors:
            (document,) = self._results
        text = json.dumps(document, indent=None if self.in_lines else 2, ensure_ascii=False)
        # A path that is no UTF-8 would make it no JSON.
        click.echo(text.encode(errors="surrogateescape").decode(errors="replace"))
        sys.stdout.flush()
