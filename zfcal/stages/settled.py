"""Work on files that others may change meanwhile: done again once, and then left alone.

Nothing is published that was made from something else than what lies there, see
`zfcal.artifacts.reading.contents`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar, final

from zfcal.artifacts.reading.contents import one_content
from zfcal.errors import ChangedError
from zfcal.stages.events import LeftOut, Note, Tell

R = TypeVar("R")
T = TypeVar("T")


def settled(work: Callable[[], T], tell: Tell) -> T:
    """Do a piece of work from one content of its inputs, and once more if one has changed.

    Parameters
    ----------
    work
        Reads its inputs and publishes what it makes.
    tell
        Hears that it is done again.

    Raises
    ------
    ChangedError
        An input has changed both times; nothing was published the second time.
    """
    try:
        with one_content():
            return work()
    except ChangedError as error:
        tell(_again(error))
    with one_content():
        return work()


@final
class Items(Generic[R]):
    """The items of a stage, each made from one content of all that it stands on.

    Parameters
    ----------
    open_run
        Reads what the items share, such as the settings, the arena and the model.
    tell
        Hears what is made again, and what is left out.
    """

    def __init__(self, open_run: Callable[[], R], tell: Tell) -> None:
        self._open_run = open_run
        self._tell = tell
        self.run = self._opened()

    def make(self, path: Path, work: Callable[[R], T]) -> T | None:
        """Make an item, and once more if an input has changed.

        Parameters
        ----------
        path
            What is made, for the message.
        work
            Makes it, from what the items share.

        Returns
        -------
        T or None
            What the work returned; None where an input has changed both times. Then the item is
            told as left out, and it is up to the next run.
        """
        try:
            with one_content(self._shared):
                return work(self.run)
        except ChangedError as error:
            self._tell(_again(error))
        try:
            self.run = self._opened()
            with one_content(self._shared):
                return work(self.run)
        except ChangedError as error:
            problem = f"{path}: not made, {error}"
            self._tell(LeftOut(path=path, problem=problem, hint=error.hint))
            return None

    def _opened(self) -> R:
        with one_content() as self._shared:
            return settled(self._open_run, self._tell)


def _again(error: ChangedError) -> Note:
    return Note(text=f"{error} What depends on it is made again.", warning=True)
