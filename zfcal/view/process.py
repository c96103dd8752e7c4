"""The page of a trial, seen from the command that shows it: an address, and a process apart.

Nothing here waits for the page: a watch that tells it something goes on at once.
"""

from __future__ import annotations

import contextlib
import errno
import multiprocessing
import os
import signal
import socket
import threading
from collections import deque
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Self, final

from zfcal.errors import InputError
from zfcal.view.token import token_of

PORT = 8642
HOST = "127.0.0.1"

_NICENESS = 10
_GRACE_S = 0.4
"""A server that is told to end has nothing to lose: a page finds out without a word as well."""
_MOST_WAITING = 200
"""Messages that the page may be behind; the oldest are dropped."""


@final
class Page:
    """A server of a trial's page, for as long as a ``with`` block lasts.

    Parameters
    ----------
    root
        The trial's directory.
    port
        Where on loopback; 0 for any that is free.

    Attributes
    ----------
    url
        The address, with its secret.

    Raises
    ------
    InputError
        The port is in use, or may not be opened.
    """

    def __init__(self, root: Path, port: int = PORT) -> None:
        listener = _listen(port)
        token = token_of(root)
        self.url = f"http://{HOST}:{listener.getsockname()[1]}/{token}/"
        context = multiprocessing.get_context("spawn")
        theirs, self._pipe = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_run, args=(root, token, listener, theirs), name="zfcal-view", daemon=True
        )
        self._process.start()
        theirs.close()
        listener.close()
        self._waiting: deque[dict[str, Any]] = deque(maxlen=_MOST_WAITING)
        self._news = threading.Event()
        self._is_closed = False
        threading.Thread(target=self._send, daemon=True).start()

    @property
    def is_alive(self) -> bool:
        """Whether the page is served."""
        return self._process.is_alive()

    def tell(self, message: dict[str, Any]) -> None:
        """Hand on what the page is to show: a ``status`` or an ``event`` of a watch, for JSON."""
        self._waiting.append(message)
        self._news.set()

    def wait(self) -> None:
        """Wait until nobody serves the page any more."""
        self._process.join()

    def close(self) -> None:
        """End the server; open pages say so, and wait for the next one."""
        self._is_closed = True
        self._news.set()
        self._process.terminate()
        self._process.join(_GRACE_S)
        self._process.kill()
        self._process.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _send(self) -> None:
        """Send what waits, in a thread of its own: a page that hangs keeps only this one."""
        with contextlib.suppress(OSError):
            while not self._is_closed:
                self._news.wait()
                self._news.clear()
                while self._waiting:
                    self._pipe.send(self._waiting.popleft())
        self._pipe.close()


def _listen(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if os.name == "posix":
        # A port that a watch has just left is free at once; on Windows it would mean any port.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        # At once: who comes later finds it in use, and who looks before the server is up waits.
        listener.listen()
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"--view-port: port {port} of {HOST} is in use.",
                hint="Another page may be open there. Choose another port, or 0 for any.",
            ) from error
        raise InputError(
            f"--view-port: port {port} of {HOST} cannot be opened ({error.strerror or error}).",
            hint="Choose one from 1024 on, or 0 for any.",
        ) from error
    return listener


def _run(root: Path, token: str, listener: socket.socket, orders: Connection) -> None:
    """Serve the page, in the process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
    from zfcal.view.serving import serve  # what it imports takes a second

    serve(root, token, listener, orders)
