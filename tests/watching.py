"""A watch as a process of its own, whose lines a test reads as they come."""

import json
import queue
import signal
import subprocess
import threading
import time

QUICK = ("--generations", "1", "--population", "4", "--steps", "20", "--seed", "1")
QUICK += ("--no-seed-likelihood",)
"""A round of a moment."""


class Watching:
    """Runs ``zfcal watch TRIAL --json`` and reads what it says.

    Parameters
    ----------
    command
        The words that start zfcal.
    words
        What follows ``watch``.
    """

    def __init__(self, command, *words, cwd=None, prefix=()):
        self.events = []
        self._lines = queue.Queue()
        self.process = subprocess.Popen(
            [*prefix, *command, "watch", *map(str, words), "--json"],
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._threads = [
            threading.Thread(target=self._read, daemon=True),
            threading.Thread(target=self._listen, daemon=True),
        ]
        self.said = ""
        for thread in self._threads:
            thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()

    def kill(self):
        """Kill it, as kill -9 does, if it still runs."""
        self.process.kill()
        self.process.wait()
        for thread in self._threads:
            thread.join()
        self.process.stdout.close()
        self.process.stderr.close()

    def _read(self):
        for line in self.process.stdout:
            self._lines.put(json.loads(line))
        self._lines.put(None)

    def _listen(self):
        for line in self.process.stderr:
            self.said += line

    def until(self, event, timeout_s=150, **values):
        """Return the next event of a kind with these values; fail when it does not come."""
        ends_s = time.monotonic() + timeout_s
        while True:
            try:
                found = self._lines.get(timeout=max(0.0, ends_s - time.monotonic()))
            except queue.Empty:
                found = None
            assert found is not None, f"no {event} {values} in {self.events[-5:]}; {self.said}"
            self.events.append(found)
            if found["event"] == event and all(found.get(k) == v for k, v in values.items()):
                return found

    def process_of(self, stage):
        """Return the id of the process in which a stage runs, as far as was told by now."""
        self._take_all()
        found = [
            e["process"] for e in self.events if (e["event"], e.get("stage")) == ("started", stage)
        ]
        return found[-1] if found else None

    def _take_all(self):
        while not self._lines.empty():
            if (found := self._lines.get()) is not None:
                self.events.append(found)

    def end(self, number=signal.SIGTERM, timeout_s=60):
        """Send a signal, and return the exit code."""
        self.process.send_signal(number)
        return self.wait(timeout_s)

    def wait(self, timeout_s=150):
        """Return the exit code, with all events read."""
        code = self.process.wait(timeout_s)
        for thread in self._threads:
            thread.join(timeout_s)
        while (found := self._lines.get(timeout=1)) is not None:
            self.events.append(found)
        return code


def contents(root):
    """Return every artifact's bytes; dot-files are nobody's artifacts."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_file() and not path.name.startswith(".")
    }
