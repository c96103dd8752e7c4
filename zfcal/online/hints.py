"""Notifications that something changed in a trial: hints, which may be late, double or missing."""

from __future__ import annotations

import contextlib
import importlib
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, final

from zfcal.artifacts.machine import file_system, is_network
from zfcal.online.arrivals import FOLDERS

RESCAN_S = 2.0
"""With notifications, all is looked at again after so long without one."""

POLL_S = 1.0
"""Without them, so often."""

_CHECK_MS = 1000


def reason_to_poll(root: Path, *, asked: bool) -> str | None:
    """Return why a trial is looked at again and again without notifications; None to use them."""
    if asked:
        return "--poll was given"
    kind = file_system(root)
    if is_network(kind):
        return f"the file system is {kind}, where changes made elsewhere are not announced"
    if _library() is None:
        return "watchfiles is not installed"
    return None


@final
class Hints:
    """Waits in a thread for the file system's notifications.

    Parameters
    ----------
    root
        The trial's directory.
    polls
        Whether to do without.

    Attributes
    ----------
    pipe
        Becomes readable when there is a hint: to wait for it among others.
    """

    def __init__(self, root: Path, *, polls: bool) -> None:
        self.rescan_s = POLL_S if polls else RESCAN_S
        self.pipe, self._write = os.pipe()
        os.set_blocking(self.pipe, False)
        os.set_blocking(self._write, False)
        self._root = root
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        if not polls:
            self._thread.start()

    def clear(self) -> bool:
        """Take the hints that came, and return whether there were any."""
        found = False
        with contextlib.suppress(BlockingIOError):
            while os.read(self.pipe, 4096):
                found = True
        return found

    def close(self) -> None:
        """End the thread."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()
        os.close(self.pipe)
        os.close(self._write)

    def _run(self) -> None:
        while not self._stop.is_set():
            places = _places(self._root)
            # Of what came before the watching, too.
            self._give()
            try:
                for _ in self._changes(places):
                    self._give()
            except (OSError, RuntimeError):
                # A folder has just gone, or there are too many watches: the rescans are enough.
                pass
            self._stop.wait(0.0 if places and places != _places(self._root) else RESCAN_S)

    def _changes(self, places: dict[str, tuple[int, int]]) -> Iterator[None]:
        """Yield whenever something changes, until the folders themselves do."""
        library = _library()
        if library is None or not places:
            return
        for changes in library.watch(
            *places,
            watch_filter=None,
            recursive=False,
            debounce=50,
            step=20,
            rust_timeout=_CHECK_MS,
            yield_on_timeout=True,
            stop_event=self._stop,
            raise_interrupt=False,
            force_polling=False,
            ignore_permission_denied=True,
        ):
            if any(not Path(path).name.startswith(".") for _, path in changes):
                yield
            if _places(self._root) != places:
                return

    def _give(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.write(self._write, b".")


def _places(root: Path) -> dict[str, tuple[int, int]]:
    """Return the folders to watch that are there, with what tells them from later ones."""
    found = {}
    for folder in (root, *(root / name for name in FOLDERS)):
        try:
            status = folder.stat()
        except OSError:
            continue
        found[str(folder)] = (status.st_dev, status.st_ino)
    return found


def _library() -> Any | None:
    """Return watchfiles; None where it is not installed: then rescans do its work."""
    try:
        return importlib.import_module("watchfiles")
    except ImportError:
        return None
