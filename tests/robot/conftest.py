"""Virtual robots as processes, and lines in memory."""

import time

import pytest

from zfcal.robot.virtual_process import VirtualProcess


class MemoryLine:
    """A line that keeps what is sent and says what it is told to."""

    def __init__(self):
        self.is_open = True
        self.is_guarded = True
        self.n_opened = 1
        self.sent = []
        self.incoming = b""

    def write(self, data):
        """Keep bytes, unless the line has gone."""
        if self.is_open:
            self.sent.append(data)
        return self.is_open

    def read(self):
        """Return what was put into `incoming`."""
        said, self.incoming = self.incoming, b""
        return said

    def beat(self, until_s):
        """Hear until when the robot may move."""

    def close(self):
        """Close it."""
        self.is_open = False


@pytest.fixture
def line():
    """Return a line in memory."""
    return MemoryLine()


@pytest.fixture
def start_virtual():
    """Return what starts virtual robots, which end with the test."""
    started = []

    def start(*words):
        started.append(VirtualProcess(words))
        return started[-1]

    yield start
    for process in started:
        process.control.close()
        process.close()


@pytest.fixture
def until():
    """Return what waits until something holds, for some seconds at most."""

    def wait(holds, *, patience_s=5.0):
        end_s = time.monotonic() + patience_s
        while time.monotonic() < end_s:
            if found := holds():
                return found
            time.sleep(0.005)
        return holds()

    return wait
