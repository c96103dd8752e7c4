"""The server of the page: GET alone, on loopback, in a process of its own."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import socket
import threading
from collections.abc import Callable
from importlib.resources import files
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.settings import read_trial
from zfcal.errors import ZfcalError
from zfcal.report.figures import theme
from zfcal.trial import Trial
from zfcal.view.guard import Guard
from zfcal.view.minutes import minute_of, minute_starts
from zfcal.view.station import Station

_PAGE = files("zfcal.view") / "page"
_KINDS = {
    ".html": "text/html",
    ".css": "text/css",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
}
_CLOSING_S = 0.15
"""Open pages hear of the end within this time."""


def make_app(trial: Trial, station: Station, token: str) -> Guard:
    """Return what answers the page.

    Parameters
    ----------
    trial
        The trial that is shown.
    station
        Tells what is new in it; whoever serves lets it run.
    token
        The secret that each address begins with.
    """

    async def events(_: Request) -> Response:
        if station.is_full:
            return PlainTextResponse("Too many pages are open.\n", 503)
        return StreamingResponse(station.stream(), media_type="text/event-stream")

    async def minute(request: Request) -> Response:
        try:
            found = await asyncio.to_thread(_minute, trial, request.path_params["start_s"])
        except ZfcalError as error:
            text = str(error).replace(f"{trial.root}/", "")
            return JSONResponse({"problem": text}, 404)
        if found is None:
            return JSONResponse({"problem": "There is no such minute."}, 404)
        return JSONResponse(found)

    async def page(request: Request) -> Response:
        return _file(request.path_params.get("name", "index.html"))

    async def colours(_: Request) -> Response:
        return Response(colours_css(), media_type=_KINDS[".css"])

    routes = [
        Route("/", page),
        Route("/events", events),
        Route("/minute/{start_s}", minute),
        Route("/colours.css", colours),
        Route("/{name}", page),
    ]
    app = Starlette(routes=routes)
    app.router.redirect_slashes = False
    return Guard(app, token)


def serve(root: Path, token: str, listener: socket.socket, orders: Connection) -> None:
    """Serve the page of a trial until the other end of ``orders`` closes, or SIGTERM comes.

    Parameters
    ----------
    root
        The trial's directory.
    token
        The secret of its address.
    listener
        Listens on loopback.
    orders
        Brings what the watch tells.
    """
    # A page that is closed is no news: what is written to it then is lost.
    logging.getLogger("asyncio").setLevel(logging.ERROR)
    trial = read_trial(root)
    station = Station(trial, load_arena(trial.arena, root))
    config = uvicorn.Config(
        make_app(trial, station, token),
        loop="asyncio",
        http="h11",
        ws="none",
        lifespan="off",
        log_config=None,
        access_log=False,
        server_header=False,
        date_header=False,
    )
    asyncio.run(_serve(uvicorn.Server(config), station, listener, orders))


async def _serve(
    server: uvicorn.Server, station: Station, listener: socket.socket, orders: Connection
) -> None:
    loop = asyncio.get_running_loop()

    def end() -> None:
        station.close()
        server.should_exit = True
        # It has nothing to lose, and the watch waits for it.
        loop.call_later(_CLOSING_S, os._exit, 0)

    async def look() -> None:
        with contextlib.suppress(NotImplementedError):
            # After those of the server: Ctrl-C is the business of the watch, which ends this one.
            loop.add_signal_handler(signal.SIGINT, lambda: None)
            loop.add_signal_handler(signal.SIGTERM, end)
        ear = threading.Thread(target=_listen, args=(orders, loop, station.hear, end), daemon=True)
        ear.start()
        await station.run()

    serving = asyncio.create_task(server.serve(sockets=[listener]))
    # The server takes the signals in its first step, and tasks begin in their order.
    looking = asyncio.create_task(look())
    await asyncio.wait({serving, looking}, return_when=asyncio.FIRST_COMPLETED)
    end()
    await asyncio.gather(serving, looking)


def _listen(
    orders: Connection,
    loop: asyncio.AbstractEventLoop,
    hear: Callable[[dict[str, Any]], None],
    end: Callable[[], None],
) -> None:
    """Hand on what the watch tells; when it is gone, that is the end."""
    with contextlib.suppress(RuntimeError):
        try:
            while True:
                loop.call_soon_threadsafe(hear, orders.recv())
        except (EOFError, OSError):
            loop.call_soon_threadsafe(end)


def colours_css() -> str:
    """Return the colours of the report as variables of a style sheet, for light and dark."""
    light, dark = (
        "".join(f"--{row[0]}:{row[column]};" for row in theme.THEME.values()) for column in (1, 2)
    )
    return f":root{{{light}}}@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"


def _minute(trial: Trial, said: str) -> dict[str, Any] | None:
    """Return a minute by what an address says; None where the trial has none of that start."""
    start_s = {str(start): start for start in minute_starts(trial.root)}.get(said)
    return None if start_s is None else minute_of(trial, start_s)


def _file(name: str) -> Response:
    if name not in {each.name for each in _PAGE.iterdir()}:
        return PlainTextResponse("There is no such part of the page.\n", 404)
    kind = _KINDS.get(Path(name).suffix, "text/plain")
    return Response((_PAGE / name).read_bytes(), media_type=kind)
