"""Steps of a scene in blocks, one for each thread."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

_LEAST = 1024
"""Steps that are worth a thread of their own."""


def in_blocks(n: int, n_workers: int, ask: Callable[[slice], None]) -> None:
    """Do what is done step by step in as many blocks as there are threads, side by side.

    Parameters
    ----------
    n
        Number of steps.
    n_workers
        Threads; what is written for a step does not depend on them.
    ask
        Is given the steps of a block, and writes what is said of them.
    """
    n_blocks = max(1, min(n_workers, n // _LEAST))
    if n_blocks == 1:
        ask(slice(0, n))
        return
    edges = [n * number // n_blocks for number in range(n_blocks + 1)]
    with ThreadPoolExecutor(n_blocks) as pool:
        list(pool.map(lambda low, high: ask(slice(low, high)), edges[:-1], edges[1:]))
