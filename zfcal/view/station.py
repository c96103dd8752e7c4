"""What all open pages are told, as server-sent events. Nobody looks while no page is open."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any, final

from zfcal.arena import Arena
from zfcal.errors import ZfcalError
from zfcal.trial import Trial
from zfcal.view.live import Live
from zfcal.view.minutes import stamps_of
from zfcal.view.state import TrialState
from zfcal.view.tank import tank_of

TICK_S = 0.1
"""Positions are looked for so often."""

LOOK_S = 1.0
"""The other files so often; each page hears at least one word in that time."""

FRESH_S = 5.0
"""Positions that came within this time are those of now."""

MOST_PAGES = 16

_MOST_EVENTS = 40
_BYE = "bye"


@final
class Station:
    """Looks at one trial for all pages.

    Parameters
    ----------
    trial, arena
        The trial.
    """

    def __init__(self, trial: Trial, arena: Arena) -> None:
        self._root = trial.root
        self._live = Live(trial.root)
        self._state = TrialState(trial, arena)
        self._pages: set[_Page] = set()
        self._last: dict[str, Any] = {"trial": _head(trial, arena)}
        self._events: deque[dict[str, Any]] = deque(maxlen=_MOST_EVENTS)
        self._open = asyncio.Event()
        self._seen_s = -FRESH_S
        self._has_looked = False
        self._is_closed = False

    @property
    def is_full(self) -> bool:
        """Whether so many pages are open that there is no room for another."""
        return len(self._pages) >= MOST_PAGES

    async def run(self) -> None:
        """Look, and tell all pages, until `close`: positions do not wait for the other files."""
        await asyncio.gather(
            self._every(TICK_S, self._follow),
            self._every(LOOK_S, self._look),
            self._every(LOOK_S, self._beat),
        )

    def hear(self, message: dict[str, Any]) -> None:
        """Take what the watch tells: its ``status``, or an ``event``."""
        message = _finite(message)
        if "event" in message:
            self._events.append(message["event"])
            self._note("events", list(self._events))
        else:
            self._note("watch", message["status"])

    async def stream(self) -> AsyncIterator[str]:
        """Yield what one page is told, from what is known on, until it or the server closes."""
        page = _Page()
        for kind, value in self._last.items():
            page.put(kind, _message(kind, value))
        self._pages.add(page)
        self._open.set()
        try:
            while not page.is_over:
                yield await page.take()
        finally:
            self._pages.discard(page)
            if not self._pages:
                self._open.clear()

    def close(self) -> None:
        """Tell all pages that this is the end."""
        self._is_closed = True
        self._open.set()
        for page in self._pages:
            page.put(_BYE, _message(_BYE, {}))

    async def _every(self, interval_s: float, step: Callable[[], Awaitable[None]]) -> None:
        while not self._is_closed:
            await self._open.wait()
            next_s = time.monotonic() + interval_s
            await step()
            await asyncio.sleep(max(0.0, next_s - time.monotonic()))

    async def _follow(self) -> None:
        pose = await asyncio.to_thread(self._live.poll)
        if pose is not None:
            # What the first look finds may lie there for years.
            self._seen_s = time.monotonic() if self._has_looked else self._seen_s
            self._publish("pose", pose)
        self._has_looked = True

    async def _look(self) -> None:
        self._note("stamps", await asyncio.to_thread(self._stamps))
        self._note("state", await asyncio.to_thread(self._state.look))
        self._note("faults", self._live.faults)

    async def _beat(self) -> None:
        # By itself: the first look at a long trial takes many beats.
        self._publish("beat", {"fresh": time.monotonic() - self._seen_s < FRESH_S})

    def _stamps(self) -> dict[str, int]:
        try:
            return {str(start): stamp for start, stamp in stamps_of(self._root).items()}
        except ZfcalError:
            return {}

    def _note(self, kind: str, value: Any) -> None:
        """Tell what has changed."""
        if self._last.get(kind) != value:
            self._publish(kind, value)

    def _publish(self, kind: str, value: Any) -> None:
        if kind != "beat":
            self._last[kind] = value
        text = _message(kind, value)
        for page in self._pages:
            page.put(kind, text)


@final
class _Page:
    """What waits for one page: of each kind the newest, since each tells all that counts."""

    def __init__(self) -> None:
        self._waiting: dict[str, str] = {}
        self._news = asyncio.Event()
        self.is_over = False

    def put(self, kind: str, text: str) -> None:
        self._waiting.pop(kind, None)
        self._waiting[kind] = text
        self._news.set()

    async def take(self) -> str:
        """Return the message that has waited longest; the end comes last."""
        await self._news.wait()
        kind = next(iter(self._waiting))
        text = self._waiting.pop(kind)
        if not self._waiting:
            self._news.clear()
        self.is_over = kind == _BYE
        return text


def _finite(value: Any) -> Any:
    """Return a value for JSON, with null for numbers that are none."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _message(kind: str, value: Any) -> str:
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return f"event: {kind}\ndata: {text}\n\n"


def _head(trial: Trial, arena: Arena) -> dict[str, Any]:
    return {
        "name": trial.root.resolve().name,
        "fish": trial.n_fish,
        "robots": trial.n_robots,
        "fps": trial.fps,
        "source": trial.source,
        "tank": tank_of(arena),
    }
