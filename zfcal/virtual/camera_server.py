"""A virtual camera: images over HTTP as they are taken, which OpenCV opens like any camera."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self, final

_BOUNDARY = "frame"
_WAIT_S = 1.0


@final
class CameraServer:
    """Serves the newest image to everybody who looks, as motion JPEG on the loopback device.

    Attributes
    ----------
    url
        Its address.
    """

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._image, self._number = b"", 0
        self._is_open = True
        self._visitors = 0
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self._server.server_port}/camera.mjpg"

    def show(self, jpeg: bytes) -> None:
        """Take an image, a JPEG file; who is still busy with the last one misses none after it."""
        with self._news:
            self._image, self._number = jpeg, self._number + 1
            self._news.notify_all()

    def wait_for_visitor(self, timeout_s: float) -> bool:
        """Return whether somebody looks, after waiting for so long."""
        with self._news:
            return self._news.wait_for(lambda: self._visitors > 0, timeout_s)

    def close(self) -> None:
        """Send all visitors away."""
        with self._news:
            self._is_open = False
            self._news.notify_all()
        self._server.shutdown()
        self._server.server_close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def log_message(self, *words: Any) -> None:
                pass

            def do_GET(self) -> None:
                self.send_response(200)
                kind = f"multipart/x-mixed-replace; boundary={_BOUNDARY}"
                self.send_header("Content-Type", kind)
                self.end_headers()
                camera.serve(self.wfile)

        return Handler

    def serve(self, out: Any) -> None:
        """Write each image to a visitor as it is shown, until one of the two leaves."""
        with self._news:
            self._visitors += 1
            seen = self._number
            self._news.notify_all()
        try:
            while True:
                with self._news:
                    self._news.wait_for(lambda: self._number > seen or not self._is_open, _WAIT_S)  # noqa: B023
                    if not self._is_open:
                        return
                    if self._number == seen:
                        continue
                    image, seen = self._image, self._number
                head = f"Content-Type: image/jpeg\r\nContent-Length: {len(image)}\r\n\r\n"
                out.write(f"--{_BOUNDARY}\r\n{head}".encode() + image + b"\r\n")
                out.flush()
        except OSError:
            return
        finally:
            with self._news:
                self._visitors -= 1
