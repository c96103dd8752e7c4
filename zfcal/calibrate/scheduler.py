"""A cluster of dask.distributed: how it is reached, and how work is put through it.

What the work is stands in ``cluster``. The package ``distributed`` is optional and is
imported where a cluster is asked for.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import logging
import pickle
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar, final
from urllib.parse import urlsplit

from zfcal.calibrate.fingerprint import (
    Fingerprint,
    fingerprint,
    refuse_other_bits,
    refuse_unlike,
    trace,
    warm_up,
)
from zfcal.errors import InputError, ZfcalError

if TYPE_CHECKING:
    from distributed import Client, Future

_PATIENCE_S = 10.0
"""So long a cluster may take to answer, and may be without any worker."""

_LOOK_S = 1.0
_RETRIES = 2
_ATTEMPTS = 6
_SCHEMES = ("tcp", "tls")
_START = "Start one with: dask scheduler, and on each computer: dask worker tcp://HOST:8786"

T = TypeVar("T")


class _UnknownMachineError(Exception):
    """A worker came late whose processor has not been compared yet; never leaves `Cluster`."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cluster:
    """A scheduler and workers, each of which computes as this process does.

    Several threads may use it at the same time. Made by `connect`.

    Parameters
    ----------
    address
        Of the scheduler, such as ``tcp://host:8786``.
    client
        The open connection.
    patience_s
        So long it may be without any worker.
    """

    address: str
    client: Client
    patience_s: float = _PATIENCE_S
    _machines: set[str] = field(default_factory=set, init=False, repr=False)

    @property
    def n_workers(self) -> int:
        """Worker processes there are now."""
        return len(self._workers())

    @property
    def n_threads(self) -> int:
        """Pieces of work that run at the same time: the threads of all workers there are now."""
        return sum(self._workers().values())

    def check(self) -> bool:
        """Compare all workers with this process.

        Returns
        -------
        bool
            Whether all of them answered; one that is dying does not.

        Raises
        ------
        InputError
            One has no zfcal, another version, or a processor that makes other numbers.
        """
        from distributed.comm.core import CommClosedError

        here = fingerprint()
        answers = self._ask(fingerprint, on_error="return")
        found = {
            worker: there
            for worker, there in answers.items()
            if not isinstance(there, CommClosedError)
        }
        for worker, there in found.items():
            refuse_unlike(here, there, worker)
        known = {here.machine} | self._machines
        others = [worker for worker, there in found.items() if there.machine not in known]
        for worker, there in self._ask(trace, workers=others).items() if others else ():
            refuse_other_bits(there, worker)
        self._machines.update(there.machine for there in found.values())
        return len(found) == len(answers)

    def _ask(self, function: Callable[[], T], **how: Any) -> dict[str, Any]:
        """Return what each worker answers, or say that the scheduler has gone."""
        try:
            return dict(self.client.run(function, **how))
        except OSError as error:
            raise self._gone() from error

    def warm_up(self) -> None:
        """Have every worker compile now what it will need, or load it."""
        self.client.run(warm_up, on_error="ignore")

    def work(self, function: Callable[..., T], pieces: Sequence[tuple[Any, ...]]) -> list[T]:
        """Return the function of each piece, in the order given.

        Parameters
        ----------
        function
            Gives the same for the same piece, wherever and however often it runs.
        pieces
            Its arguments, whatever pickle takes.

        Raises
        ------
        ZfcalError
            The scheduler has gone, no worker is left, they die of the work, or one
            joined late that differs from this process.
        """
        futures = [self._submit(function, piece) for piece in pieces]
        failures = [0] * len(pieces)
        while max(failures, default=0) < _ATTEMPTS:
            done, answers = self._gather(futures)
            if done:
                return answers
            for number, piece in enumerate(pieces):
                if futures[number].status == "error":
                    failures[number] += 1
                    futures[number] = self._submit(function, piece)
        raise ZfcalError(
            f"Cluster {self.address}: its workers keep dying of the work.",
            hint="Look at their logs; often a worker has too little memory.",
        )

    def _submit(self, function: Callable[..., T], piece: tuple[Any, ...]) -> Future:
        call = _Call(fingerprint(), frozenset(self._machines), function, *piece)
        return self.client.submit(pickle.loads, pickle.dumps(call), pure=False, retries=_RETRIES)

    def _gather(self, futures: Sequence[Future]) -> tuple[bool, list[Any]]:
        """Return whether all pieces came to an end, and what came of them."""
        from distributed import KilledWorker

        coming = asyncio.run_coroutine_threadsafe(
            self.client.gather(futures, asynchronous=True), self.client.loop.asyncio_loop
        )
        alone_since_s = None
        try:
            while not concurrent.futures.wait([coming], timeout=_LOOK_S).done:
                alone_since_s = self._look_for_workers(alone_since_s)
            return True, coming.result()
        except KilledWorker:
            # Dask gives up on what was under way when a worker died for the fourth time.
            return False, []
        except _UnknownMachineError:
            self.check()
            return False, []
        except ZfcalError:
            raise
        except (concurrent.futures.CancelledError, OSError) as error:
            raise self._gone() from error
        except Exception:
            # Such as a worker that joined late and has no zfcal: this says so. A worker
            # that is dying takes results with it: they are made again.
            if self.check():
                raise
            return False, []
        finally:
            coming.cancel()

    def _look_for_workers(self, alone_since_s: float | None) -> float | None:
        """Return since when there has been no worker; None while there are some."""
        if self._workers():
            return None
        now_s = time.monotonic()
        since_s = now_s if alone_since_s is None else alone_since_s
        if now_s - since_s > self.patience_s:
            raise ZfcalError(
                f"Cluster {self.address}: no worker is left.",
                hint="Start workers and run the command again: it goes on where it was.",
            )
        return since_s

    def _workers(self) -> dict[str, int]:
        if self.client.status != "running":
            raise self._gone()
        try:
            return dict(self.client.nthreads())
        except (OSError, RuntimeError) as error:
            raise self._gone() from error

    def _gone(self) -> ZfcalError:
        return ZfcalError(
            f"Cluster {self.address}: the scheduler has gone, or has dropped the work.",
            hint="Start it and run the command again: it goes on where it was.",
        )


@final
class _Call:
    """A piece of work that is done by unpickling it.

    So a worker without zfcal fails in that one task. Where it cannot unpickle the
    function of a task, it loses the connection on which all of them come.
    """

    def __init__(self, *arguments: Any) -> None:
        self._arguments = arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return what unpickling calls, and with what."""
        return _on_worker, self._arguments


def _on_worker(
    here: Fingerprint, machines: frozenset[str], function: Callable[..., T], *piece: Any
) -> T:
    """Do a piece of work, on a worker that computes as whoever asks does.

    Parameters
    ----------
    here
        Of whoever asks.
    machines
        Those that are known to agree with it.
    function, *piece
        What to do.
    """
    from distributed import get_worker

    there = fingerprint()
    refuse_unlike(here, there, get_worker().address)
    if there.machine not in machines:
        raise _UnknownMachineError(there.machine)
    return function(*piece)


@contextmanager
def connect(address: str, *, patience_s: float = _PATIENCE_S) -> Iterator[Cluster]:
    """Connect to a cluster for the length of a block.

    Parameters
    ----------
    address
        Of the scheduler, such as ``tcp://host:8786``.
    patience_s
        Nothing is waited for longer, save for workers that compile.

    Raises
    ------
    InputError
        The package ``distributed`` is missing, no scheduler answers at the address,
        it has no worker, or a worker would count otherwise than this process.
    """
    _check_address(address)
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError(
            f"A cluster needs the package distributed, which cannot be loaded ({error}).",
            hint="Install it with: pip install 'zfcal[cluster]'",
        ) from error
    _hush()
    _greet(address, patience_s)
    try:
        client = Client(address, timeout=patience_s, set_as_default=False, name="zfcal")
    except OSError as error:
        raise _silent(address, error) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=patience_s)
        except TimeoutError as error:
            raise InputError(f"Cluster {address}: it has no worker.", hint=_START) from error
        cluster = Cluster(address=address, client=client, patience_s=patience_s)
        cluster.check()
        cluster.warm_up()
        yield cluster


def _hush() -> None:
    """Silence what dask and its loop log: what matters is said in one line, by the errors here."""
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] in {"distributed", "tornado", "asyncio"}:
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _check_address(address: str) -> None:
    try:
        parts = urlsplit(address)
        fits = parts.scheme in _SCHEMES and bool(parts.hostname) and bool(parts.port)
    except ValueError:
        fits = False
    if not fits:
        raise InputError(
            f"A cluster's address is tcp://HOST:PORT, got {address!r}.",
            hint="It is what dask scheduler prints when it starts, such as tcp://host:8786",
        )


def _greet(address: str, patience_s: float) -> None:
    """Make sure that a scheduler answers: a client waits for ever for a port that is silent."""
    from distributed.core import rpc

    async def ask() -> str:
        async with rpc(address) as server:
            return str((await server.identity())["type"])

    try:
        kind = asyncio.run(asyncio.wait_for(ask(), patience_s))
    except Exception as error:  # whatever listens there may answer anything
        raise _silent(address, error) from error
    if kind != "Scheduler":
        raise InputError(
            f"Cluster {address}: a {kind.lower()} answers there, expected the scheduler."
        )


def _silent(address: str, error: Exception) -> InputError:
    reason = str(error) or "it took too long"
    return InputError(f"Cluster {address}: no scheduler answers there: {reason}.", hint=_START)
