"""Outputs whose place is taken by a folder: each is told and left out, the others are made."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from zfcal.errors import TakenError
from zfcal.stages.events import LeftOut, Tell


@contextmanager
def unless_taken(path: Path, tell: Tell) -> Iterator[None]:
    """Leave out, and tell, what is done within where a folder stands in the way.

    Parameters
    ----------
    path
        The file that is written or removed within.
    tell
        Hears that it is left out.
    """
    try:
        yield
    except TakenError as error:
        tell(LeftOut(path=path, problem=str(error), hint=error.hint))
