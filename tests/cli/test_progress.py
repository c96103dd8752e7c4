"""On a terminal long work shows what, how far and how long; elsewhere nothing."""

import os
import pty
import re
import subprocess
import sys

import pytest

PROGRAM = """
import time
from zfcal_cli import progress
progress._SILENT_S = progress._LOOK_S = 0.1
bars = progress.Bars(shown={shown}, name="report")
bars.watch()
{work}
bars.close()
print("END")
"""
SILENT = "time.sleep(1.5)"
FAR = """
for k in range(6):
    bars.show("rounds", k, 10)
    time.sleep(0.2)
bars.clear()
print("a line")
time.sleep(1.0)
"""


def screen_of(work, *, shown=True):
    """Return what a program writes to a terminal, without the signs that move the cursor."""
    ours, theirs = pty.openpty()
    program = PROGRAM.format(shown=shown, work=work)
    env = os.environ | {"TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=theirs, stderr=theirs, env=env, close_fds=True
    )
    os.close(theirs)
    data = b""
    while b"END" not in data:
        try:
            data += os.read(ours, 65536)
        except OSError:
            break
    assert process.wait(30) == 0
    os.close(ours)
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", data.decode())


@pytest.mark.slow
def test_silent_work_says_what_works_and_for_how_long():
    """A bar without a length comes by itself; a stderr that is no terminal stays as it was."""
    screen = screen_of(SILENT)
    assert re.search(r"report\s.*\b1 s", screen)
    assert "left" not in screen
    assert screen_of(SILENT, shown=False).split() == ["END"]


@pytest.mark.slow
def test_a_bar_says_how_far_and_comes_back_after_a_line():
    """With the time that is left as soon as it is known; the whole time counts on."""
    screen = screen_of(FAR)
    before, after = screen.split("a line")
    assert re.search(r"rounds\s.*\b5/10\s+1 s, about \d s left", before)
    assert re.search(r"rounds\s.*\b5/10\s+2 s", after)
    assert "report" not in screen


@pytest.mark.parametrize(
    ("seconds", "says"),
    [(0.0, "0 s"), (59.6, "1 min 0 s"), (75.0, "1 min 15 s"), (3725.0, "1 h 2 min")],
)
def test_times_are_read_by_people(seconds, says):
    """Seconds, minutes, hours."""
    from zfcal_cli.progress import _time

    assert _time(seconds) == says
