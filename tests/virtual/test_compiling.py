"""What is compiled before it is needed, in a folder of the user's."""

import os
import subprocess
import sys

import pytest

from zfcal.errors import InputError
from zfcal.virtual import compiling

IMAGES = """
from zfcal.virtual import compiling
compiling.FIRST, compiling.BESIDE = ("images",), ()
from zfcal_cli.main import run
raise SystemExit(run(["--compile"]))
"""

AGAIN = """
from zfcal.virtual import compiling
compiling.images()
from zfcal.tracking.fitting import _fit
print(len(_fit.stats.cache_hits), len(_fit.stats.cache_misses))
"""


def python(code, **variables):
    """Run Python code in a process of its own; return its words."""
    words = [sys.executable, "-c", code]
    environment = {**os.environ, **variables}
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_the_parts_are_those_that_are_started():
    """Each part of the second process exists; with the simulator they are all but the crowd."""
    assert {*compiling.BESIDE, "simulator", "crowd"} == compiling.PARTS.keys()


def test_without_a_place_compiling_ends_with_one_line(monkeypatch):
    """What cannot be kept is not compiled; the hint names the variable."""
    monkeypatch.setattr(compiling, "KEPT", False)
    with pytest.raises(InputError, match="not writable") as caught:
        compiling.compile_all()
    assert "NUMBA_CACHE_DIR" in caught.value.hint


def test_a_part_that_fails_is_an_error_with_its_last_line(monkeypatch):
    """The exit code of a process is looked at."""
    monkeypatch.setattr(compiling, "KEPT", True)
    monkeypatch.setattr(compiling, "BESIDE", ("no such part",))
    monkeypatch.setattr(compiling, "FIRST", ("neither",))
    with pytest.raises(InputError, match="Compiling failed: KeyError: 'neither'"):
        compiling.compile_all()


def test_where_kernels_are_kept_no_process_is_started(monkeypatch):
    """A second demonstration pays nothing."""
    monkeypatch.setattr(compiling, "is_warm", lambda: True)
    monkeypatch.setattr(compiling, "_start", None)
    with compiling.compiled_beside():
        pass


def test_the_second_process_ends_with_the_demonstration(monkeypatch):
    """Whatever happens in it."""
    started = []
    start = compiling._start
    monkeypatch.setattr(compiling, "is_warm", lambda: False)
    monkeypatch.setattr(compiling, "KEPT", True)
    monkeypatch.setattr(
        compiling, "_start", lambda *a, **k: started.append(start(*a, **k)) or started[-1]
    )
    with pytest.raises(ZeroDivisionError), compiling.compiled_beside():
        raise ZeroDivisionError
    assert started[0].returncode is not None


@pytest.mark.slow
def test_what_was_compiled_is_found_by_the_next_process(tmp_path):
    """`zfcal --compile` in an empty folder; afterwards a tracker compiles nothing."""
    (folder,) = python(IMAGES, NUMBA_CACHE_DIR=str(tmp_path))
    assert folder.startswith(str(tmp_path))
    assert python(AGAIN, NUMBA_CACHE_DIR=str(tmp_path)) == ["1", "0"]
