"""Two things at the same time."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def together(first: Callable[[], A], second: Callable[[], B], *, n_workers: int) -> tuple[A, B]:
    """Return what two functions return; one after the other where there is one worker.

    Parameters
    ----------
    first, second
        Neither needs the other, or what it writes.
    n_workers
        Threads.
    """
    if n_workers < 2:
        return first(), second()
    with ThreadPoolExecutor(1) as pool:
        behind = pool.submit(second)
        return first(), behind.result()
