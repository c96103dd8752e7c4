"""Who draws a diagnosis: processes that load what drawing needs while it is computed."""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process, resource_tracker
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType
from typing import Self

from zfcal.diagnose.document import Sheet
from zfcal.report.diagnosis import page as diagnosis_page
from zfcal.report.options import Printing

_HANDS = 2
"""One for the PNGs, one for the page."""

_NICE = 10
"""By so much these processes stand back where there are more of them than cores."""


class RenderPool:
    """Draws pages of findings; a context, at whose end its processes are gone.

    Parameters
    ----------
    ahead
        Whether processes get ready when they are told that there will be something to draw.
    printing
        In which form pictures are files; None for that of the page that is there.
    """

    def __init__(self, *, ahead: bool = True, printing: Printing | None = None) -> None:
        self._ahead = ahead
        self._printing = printing
        self._pool: ProcessPoolExecutor | None = None
        self._hands: set[BaseProcess] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._let_go(at_once=kind is not None)

    def prepare(self) -> None:
        """Start the processes, unless they are there: a page will be drawn in a while."""
        if self._ahead and self._pool is None:
            # Where none can be had, the page is drawn without.
            self._ahead = self._begin()

    def reason(self, folder: Path, findings_sha256: str) -> str | None:
        """Return why a page must be drawn, as `page.reason`."""
        return diagnosis_page.reason(folder, findings_sha256, self._printing)

    def files(self, folder: Path) -> list[Path]:
        """Return the page that is there and its pictures."""
        return diagnosis_page.files(folder)

    def write(self, folder: Path, sheet: Sheet) -> list[Path]:
        """Draw pictures and page as `page.write` does."""
        if self._pool is not None:
            try:
                return diagnosis_page.write(folder, sheet, self._pool, printing=self._printing)
            except BrokenExecutor:
                # One was killed, for want of memory, say: it can be done here as well.
                self._let_go(at_once=True)
        return diagnosis_page.write(folder, sheet, printing=self._printing)

    def _begin(self) -> bool:
        """Start the processes; whether they could be."""
        others = set(active_children())
        try:
            with _interrupts_held_back():
                spawn = get_context("spawn")
                self._pool = ProcessPoolExecutor(_HANDS, mp_context=spawn, initializer=_get_ready)
                # Each starts when there is something to do and nobody at leisure.
                for _ in range(_HANDS):
                    self._pool.submit(int)
        except OSError:
            begun = False
        else:
            begun = True
        finally:
            self._hands = set(active_children()) - others
        if not begun:
            self._let_go(at_once=True)
        return begun

    def _let_go(self, *, at_once: bool) -> None:
        if self._pool is None:
            return
        if at_once:
            # Nobody waits until they have loaded what will not be needed.
            for hand in self._hands:
                hand.terminate()
        self._pool.shutdown(cancel_futures=True)
        self._pool = None


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Begin processes that say nothing of an interrupt from the keyboard, which goes to all.

    Whoever began them does; they are born with it held back, where the system can do that.
    """
    if sys.platform == "win32" or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Python 3.11 begins one more with the first one that is spawned, and lets interrupts through.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _get_ready() -> None:
    """Load what drawing needs, and end with the process that one draws for."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):  # What is computed meanwhile takes as long as all this, and longer.
        os.nice(_NICE)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    importlib.import_module("zfcal.report.diagnosis.drawing")


def _end_with_parent() -> None:
    # Without that one who waits for work would wait for good.
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
