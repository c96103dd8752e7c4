"""Threads of a command take memory from one heap."""

import ctypes
import platform
import re
import subprocess
import sys

import pytest

from zfcal_cli.heaps import share_one_heap

_COUNTED = """
import ctypes, threading
from zfcal_cli.heaps import share_one_heap

if {shared}:
    share_one_heap()
c = ctypes.CDLL(None)
c.malloc.restype = ctypes.c_void_p
together = threading.Barrier(4)

def take():
    together.wait()
    c.malloc(1000)
    together.wait()

threads = [threading.Thread(target=take) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
c.malloc_info(0, ctypes.c_void_p.in_dll(c, "stdout"))
c.fflush(None)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
@pytest.mark.parametrize("shared", [True, False])
def test_threads_share_a_heap_once_they_are_told(shared):
    """As the C library counts its heaps; by itself it has one for each thread."""
    asked = [sys.executable, "-c", _COUNTED.format(shared=shared)]
    said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    heaps = re.findall(r"<heap nr=", said)
    assert (len(heaps) == 1) is shared


def test_another_c_library_is_left_alone(monkeypatch):
    """It has no such setting: nothing of it is opened."""
    opened = []
    monkeypatch.setattr(ctypes, "CDLL", opened.append)
    monkeypatch.setattr(platform, "libc_ver", lambda: ("", ""))
    share_one_heap()
    assert not opened


@pytest.mark.parametrize("command", ["diagnose", "extend"])
def test_the_commands_that_hold_most_are_told(command, monkeypatch, zfcal, tmp_path):
    """Before they open a trial."""
    told = []
    monkeypatch.setattr("zfcal_cli.heaps.share_one_heap", lambda: told.append(command))
    zfcal(command, tmp_path / "none")
    assert told == [command]
