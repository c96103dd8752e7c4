"""What several trials are called beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def labels_of(roots: Sequence[Path]) -> list[str]:
    """Return what trials are called: the end of each path that tells all of them apart.

    >>> labels_of([Path("a/trial"), Path("b/trial")])
    ['a/trial', 'b/trial']
    """
    parts = [root.resolve().parts for root in roots]
    for n in range(1, max(map(len, parts)) + 1):
        labels = ["/".join(each[-n:]) for each in parts]
        if len(set(labels)) == len(labels):
            break
    return labels
