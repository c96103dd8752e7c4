"""The page of `zfcal watch --view`, and the table of --table."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import adds
from .output import Output

if TYPE_CHECKING:
    from zfcal.view.process import Page

_PORT = 8642

view_options = adds(
    click.option(
        "--view", is_flag=True, help="Show it on a page, for browsers on this computer alone."
    ),
    click.option(
        "--view-port",
        type=click.IntRange(0, 65535),
        default=_PORT,
        show_default=True,
        help="Port of the page; 0 for any that is free.",
    ),
    click.option("--table", is_flag=True, help="A table on the terminal, not one line."),
)


@contextlib.contextmanager
def open_page(trial: Path, options: Mapping[str, Any]) -> Iterator[Page | None]:
    """Serve the page while a watch runs, where it is asked for.

    Raises
    ------
    click.UsageError
        A table is asked for where there is no terminal.
    InputError
        It is no trial, or the port is in use.
    """
    if options["table"] and not sys.stderr.isatty():
        raise click.UsageError("--table is drawn on a terminal, and standard error is not one.")
    if not options["view"]:
        yield None
        return
    from zfcal.stages.trial_context import open_trial
    from zfcal.view.process import Page

    open_trial(trial)
    with Page(trial, options["view_port"]) as page:
        yield page


def page_plan(options: Mapping[str, Any]) -> str:
    """Return what a dry run says of the page."""
    port = options["view_port"]
    where = f"port {port}" if port else "a free port"
    return f"watch would show the trial on a page, at {where} of this computer."


def stay(page: Page, out: Output) -> None:
    """Go on serving the page of a trial that has ended, until Ctrl-C.

    Raises
    ------
    ZfcalError
        The page's process has ended by itself.
    """
    from zfcal.errors import ZfcalError

    out.note("The page stays until Ctrl-C.")
    with contextlib.suppress(KeyboardInterrupt):
        page.wait()
        raise ZfcalError("The page is gone: its process has ended.", hint="Start it again.")
