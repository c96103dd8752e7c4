"""A camera with an address, for tests: JPEG images one after the other over HTTP, in real time."""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class Camera:
    """Serves JPEG files as a stream that OpenCV opens.

    Each visitor gets the images from where the camera is; `gone` sends visitors away and
    lets none in.

    Parameters
    ----------
    images : list of bytes
        JPEG files.
    fps
        How many a second.
    waits
        Whether the first image waits for the first visitor.
    """

    def __init__(self, images, *, fps=15.0, waits=True):
        self.images, self.fps = images, fps
        self.gone = threading.Event()
        self._zero_s = None if waits else time.monotonic()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self._server.server_port}/camera.mjpg"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.gone.set()
        self._server.shutdown()
        self._server.server_close()

    def _handler(camera):  # noqa: N805 - the handler has a self of its own
        class Handler(BaseHTTPRequestHandler):
            def log_message(self, *_):
                pass

            def do_GET(self):
                if camera.gone.is_set():
                    self.send_error(503)
                    return
                self.send_response(200)
                kind = "multipart/x-mixed-replace; boundary=frame"
                self.send_header("Content-Type", kind)
                self.end_headers()
                camera.send(self.wfile)

        return Handler

    def send(self, out):
        """Send what comes until the end, or until the camera is gone."""
        self._zero_s = self._zero_s or time.monotonic()
        first = round((time.monotonic() - self._zero_s) * self.fps)
        for number in range(first, len(self.images)):
            time.sleep(max(0.0, self._zero_s + number / self.fps - time.monotonic()))
            data = self.images[number]
            head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
            if self.gone.is_set():
                return
            try:
                out.write(head.encode() + data + b"\r\n")
                out.flush()
            except OSError:
                return
