"""A stage in a process of its own, so that it keeps nobody waiting and dies alone.

It takes orders through a pipe, one at a time, and tells its events through it. All
else that stages have to tell one another stands in files.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any, NoReturn, TypeAlias, final

from zfcal.errors import DamagedError, LockedError, ZfcalError
from zfcal.stages.events import Event, Note, Tell

Job: TypeAlias = Callable[[Any, Tell], Any]
"""What a stage does with an order; it must be known by its name to another process."""

_GRACE_S = 10.0
"""A stage that is told to end closes its files within that time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """An order was carried out.

    Parameters
    ----------
    result
        What the job returned.
    """

    result: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """An order could not be carried out.

    Parameters
    ----------
    message, hint
        What is wrong, and what to do about it.
    exit_code
        As of the error; None for a process that is gone.
    """

    message: str
    hint: str = ""
    exit_code: int | None = None

    @property
    def error(self) -> ZfcalError:
        """What was raised in the process, or its death, to be raised in this one."""
        kinds: dict[int | None, type[ZfcalError]] = {
            kind.exit_code: kind for kind in (DamagedError, LockedError)
        }
        return kinds.get(self.exit_code, ZfcalError)(self.message, hint=self.hint)


@final
class Worker:
    """The stage, seen from outside.

    Parameters
    ----------
    name
        Of the stage.
    job
        What it does with an order.
    niceness
        How far the processor prefers others, as of nice(1).
    """

    def __init__(self, name: str, job: Job, *, niceness: int = 0) -> None:
        self.name = name
        self.is_busy = False
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(theirs, job, niceness), name=f"zfcal-{name}", daemon=True
        )
        self._process.start()
        theirs.close()

    @property
    def process(self) -> int | None:
        """The process id, for tools such as top(1)."""
        return self._process.pid

    def order(self, what: object) -> None:
        """Give it something to do; it must be idle."""
        self.is_busy = True
        # Whether it is still there shows when its answer is read.
        with contextlib.suppress(OSError):
            self.pipe.send(what)

    def take(self) -> list[Event | Done | Failure]:
        """Return what it has told since; a process that died tells `Failure` without a code."""
        told: list[Event | Done | Failure] = []
        try:
            while self.pipe.poll():
                each = self.pipe.recv()
                self.is_busy &= not isinstance(each, Done | Failure)
                told.append(each)
        except (EOFError, OSError):
            self._process.join()
            self.is_busy = False
            code = self._process.exitcode
            told.append(Failure(message=f"The process of {self.name} ended with code {code}."))
        return told

    def answer(self, tell: Tell) -> Any:
        """Wait until it has nothing more to do.

        Parameters
        ----------
        tell
            Hears of what it has told since.

        Returns
        -------
        Any
            What came of its last order; None if it had none.

        Raises
        ------
        ZfcalError
            The order could not be carried out, or the process has died.
        """
        result = None
        while self.is_busy:
            connection.wait([self.pipe])
            for each in self.take():
                if isinstance(each, Failure):
                    raise each.error
                if isinstance(each, Done):
                    result = each.result
                else:
                    tell(each)
        return result

    def stop(self) -> None:
        """End it; what it was writing is whole or not there."""
        if self._process.is_alive():
            self._process.terminate()
            self._process.join(_GRACE_S)
            self._process.kill()
        self._process.join()
        self.pipe.close()


class _TerminatedError(BaseException):
    """SIGTERM came: every file is closed on the way out."""


def _serve(pipe: Connection, job: Job, niceness: int) -> None:
    """Carry out orders until nobody gives any."""
    # SIGTERM may come at any moment, while the process still prepares itself too.
    with contextlib.suppress(_TerminatedError):
        signal.signal(signal.SIGTERM, _terminate)
        # Ctrl-C goes to all processes of the terminal; whoever gives the orders ends this one.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_die_with_parent, daemon=True).start()
        if hasattr(os, "nice"):
            os.nice(niceness)
        _hand_on_logs(pipe.send)
        with contextlib.suppress(EOFError, OSError):
            while True:
                pipe.send(_answer(job, pipe.recv(), pipe.send))


def _answer(job: Job, order: object, tell: Tell) -> Done | Failure:
    try:
        return Done(result=job(order, tell))
    except ZfcalError as error:
        return Failure(message=str(error), hint=error.hint, exit_code=error.exit_code)


def _terminate(number: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG001 - the signal's signature
    # A second one, to the whole group say, must not disturb the closing.
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise _TerminatedError


def _die_with_parent() -> None:
    """Go when the process that gave the orders was killed: the one after it needs the locks."""
    parent = multiprocessing.parent_process()
    assert parent is not None  # noqa: S101 - for the type checker
    connection.wait([parent.sentinel])
    os._exit(1)


def _hand_on_logs(tell: Tell) -> None:
    handler = logging.Handler()
    handler.emit = lambda record: tell(Note(text=record.getMessage()))  # type: ignore[method-assign]
    logger = logging.getLogger("zfcal")
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
