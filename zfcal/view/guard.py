"""Who may look, and how: the door in front of every answer of the page's server."""

from __future__ import annotations

import hmac
from typing import final

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_NAMES = {"127.0.0.1", "localhost", "[::1]"}
"""By which a browser reaches this computer itself; another name may lead here by deceit."""

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""With every answer: the page loads nothing from elsewhere, and nobody else may show it."""


@final
class Guard:
    """Lets through what asks by GET, under a name of this computer, with the secret.

    Parameters
    ----------
    app
        What answers; it sees paths without the secret.
    token
        The secret.
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one question."""
        if scope["type"] != "http":
            return
        refused = self._refused(scope)
        answer: ASGIApp = refused or self._app
        if refused is None:
            rest = scope["path"].removeprefix(f"/{self._token}")
            scope = {**scope, "path": rest, "raw_path": rest.encode()}

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        await answer(scope, receive, send_guarded)

    def _refused(self, scope: Scope) -> Response | None:
        if not _is_of_here(Headers(scope=scope).getlist("host")):
            return PlainTextResponse("This is not a name of this computer.\n", 403)
        if scope["method"] != "GET":
            return PlainTextResponse("Only GET is answered.\n", 405, {"Allow": "GET"})
        # A path need not begin with a slash, nor hold one.
        before, _, rest = scope["path"].partition("/")
        given = b"" if before else rest.partition("/")[0].encode()
        if not hmac.compare_digest(given, self._token.encode()):
            text = "The address of the page is the one that zfcal watch printed, to its end.\n"
            return PlainTextResponse(text, 403)
        if scope["path"] == f"/{self._token}":
            return RedirectResponse(f"/{self._token}/")
        return None


def _is_of_here(hosts: list[str]) -> bool:
    if len(hosts) != 1:
        return False
    name, colon, port = hosts[0].rpartition(":")
    if not colon or hosts[0].endswith("]"):
        name, port = hosts[0], "0"
    return name.lower() in _NAMES and port.isascii() and port.isdigit()
