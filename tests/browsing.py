"""A headless Chromium that a test drives: addresses, keys, sizes, colour schemes, pictures."""

import base64
import itertools
import json
import os
import subprocess
import sys
import time

OPTIONS = ("--hide-scrollbars", "--remote-debugging-pipe")

# Chromium reads the descriptor 3 and writes to 4.
_RUN = """
import fcntl, os, sys
ours = [fcntl.fcntl(int(word), fcntl.F_DUPFD, 10) for word in sys.argv[1:3]]
for descriptor, place in zip(ours, (3, 4)):
    os.dup2(descriptor, place)
os.execv(sys.argv[3], sys.argv[3:])
"""


class Browser:
    """One page of Chromium, spoken to by its DevTools protocol over two pipes.

    Parameters
    ----------
    command
        Path of Chromium, and options that show nothing.
    profile
        A folder for what it keeps.
    """

    def __init__(self, command, profile):
        theirs_in, self._to = os.pipe()
        self._from, theirs_out = os.pipe()
        words = [*command, *OPTIONS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(
            [sys.executable, "-c", _RUN, str(theirs_in), str(theirs_out), *words],
            pass_fds=(theirs_in, theirs_out),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self._numbers = itertools.count(1)
        self._left = b""
        self.said = []
        (page,) = (t for t in self._send("Target.getTargets")["targetInfos"] if t["type"] == "page")
        told = self._send("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self._session = told["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        os.close(self._to)
        os.close(self._from)

    def ask(self, method, **parameters):
        """Return what the page answers to a command of the protocol."""
        return self._send(method, self._session, **parameters)

    def _send(self, method, session=None, **parameters):
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            found = self._read()
            if found.get("id") == number:
                assert "error" not in found, found
                return found["result"]
            self.said.append(found)

    def _read(self):
        while b"\0" not in self._left:
            more = os.read(self._from, 1 << 20)
            assert more, "Chromium has ended"
            self._left += more
        text, self._left = self._left.split(b"\0", 1)
        return json.loads(text)

    def go(self, address):
        """Open an address, and wait until all that belongs to it has been read."""
        self.ask("Page.navigate", url=address)
        self.until(f"location.href === {address!r} && document.readyState === 'complete'")

    def value(self, expression):
        """Return what an expression of JavaScript comes to."""
        found = self.ask("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def until(self, expression, timeout_s=30):
        """Return what an expression comes to as soon as that is true; fail when it never is."""
        ends_s = time.monotonic() + timeout_s
        while True:
            found = self.value(expression)
            if found:
                return found
            assert time.monotonic() < ends_s, f"never: {expression}; {self.problems()}"
            time.sleep(0.05)

    def press(self, key):
        """Press a key and let it go."""
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, **text)

    def show(self, width=1280, height=900, *, scheme="light", motion="no-preference"):
        """Choose the size of the window, and what a person prefers."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        features = {"prefers-color-scheme": scheme, "prefers-reduced-motion": motion}
        said = [{"name": name, "value": value} for name, value in features.items()]
        self.ask("Emulation.setEmulatedMedia", features=said)

    def picture(self, path, *, whole=False):
        """Write what is seen as a PNG; the whole page rather than the window where asked."""
        found = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))

    def problems(self):
        """Return what the page complained of: errors in it, and what it was not let to do."""
        self.value("1")
        kinds = {"Runtime.exceptionThrown", "Log.entryAdded", "Network.loadingFailed"}
        return [each["params"] for each in self.said if each.get("method") in kinds]

    def asked_for(self):
        """Return the addresses that the page has asked for."""
        return [
            each["params"]["request"]["url"]
            for each in self.said
            if each.get("method") == "Network.requestWillBeSent"
        ]
