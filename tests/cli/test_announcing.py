"""Compiling takes long, so whoever waits is told why."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

_COMPILE = """
import sys
import numpy as np
from zfcal_cli.output import Output
with Output("simulate", as_json=True, verbose=0, quiet=sys.argv[1] == "quiet"):
    from zfcal.model.kernels.random import seeded, vonmises_r
    seeded(np.uint64(1))
    vonmises_r.py_func(1.0)
"""


def start(cache, loudness="loud"):
    """Run a command that needs a compiled kernel; return what it says on both streams."""
    done = subprocess.run(
        [sys.executable, "-c", _COMPILE, loudness],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache), "NUMBA_DISABLE_JIT": "0"},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout, done.stderr


@pytest.mark.slow
def test_the_first_start_says_once_that_it_compiles_and_the_next_one_nothing(tmp_path):
    """On standard error, beside a document that does not depend on it."""
    (document, told), (again, silence) = start(tmp_path), start(tmp_path)

    assert told.count("Compiling the simulator") == 1
    assert "The next start finds it ready." in told
    assert silence == ""
    assert document == again


@pytest.mark.slow
def test_where_nothing_is_kept_every_start_says_so(tmp_path):
    """The cache folder's place is a file."""
    (tmp_path / "file").write_text("")

    for _ in range(2):
        assert "Every start will" in start(tmp_path / "file")[1]


@pytest.mark.parametrize("loudness", ["quiet", "loud"])
def test_quiet_is_quiet(loudness, tmp_path):
    """--quiet keeps it to itself."""
    assert (start(tmp_path, loudness)[1] == "") == (loudness == "quiet")
